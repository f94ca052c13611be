//! Options that hold islands that are left, tried before they are named.

use lamp_stack::Length;
use lamp_supports::{
    Findings, IslandPlan, Listed, Support, SupportFoot, SupportOptions, SupportPlan,
};

use crate::exit::Exit;

/// Options that hold more islands.
pub(super) struct Hint {
    pub(super) options: String,
    pub(super) islands: usize,
}

/// Tries options that may hold islands that are left, one at a time: `plan` plans supports.
pub(super) fn hints(
    supports: &SupportPlan,
    found: &Findings,
    options: &SupportOptions,
    mut plan: impl FnMut(&Findings, &SupportOptions) -> Result<SupportPlan, Exit>,
) -> Result<Vec<Hint>, Exit> {
    let left = supports.islands.iter().filter(|plan| plan.is_left());
    let left: Vec<_> = left.map(|plan| plan.island.clone()).collect();
    if left.is_empty() {
        return Ok(Vec::new());
    }
    let found = Findings { islands: Listed { list: left, ..Listed::default() }, ..found.clone() };
    let options = SupportOptions { overhangs: None, ..options.clone() };
    let mut hints = Vec::new();
    if options.to != SupportFoot::Both {
        let both = SupportOptions { to: SupportFoot::Both, ..options.clone() };
        let islands = plan(&found, &both)?.islands.iter().filter(|plan| plan.stands).count();
        hints.push(Hint { options: "--to both".to_owned(), islands });
    }
    let twice = Length::from_um(2.0 * options.max_length.um());
    let held = plan(&found, &SupportOptions { max_length: twice, ..options })?;
    let held = || held.islands.iter().filter(|plan| plan.stands);
    let longest = held().flat_map(IslandPlan::supports).map(reach_mm).fold(0.0, f64::max);
    let longer = format!("--max-length {}mm", longest.ceil());
    hints.push(Hint { options: longer, islands: held().count() });
    hints.retain(|hint| hint.islands > 0);
    Ok(hints)
}

/// Returns the length of a support that `--max-length` limits.
fn reach_mm(support: &Support) -> f64 {
    let [from, to] = [support.path_mm[0], support.path_mm[1]];
    let is_upright = support.is_pillar() && support.tilt == 0.0;
    let leg = (0..3).map(|k| (to[k] - from[k]).powi(2)).sum::<f64>().sqrt();
    if is_upright { 0.0 } else { leg }
}
