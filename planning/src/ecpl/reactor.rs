//! The reaction in a chamber, step by step (003 equations 4, 5, 10, 11 and 13).

use lamp_grayscale::resin::{Intensity, Kinetics, Quantity};

use super::cells::Cells;
use super::diffusion::Diffusion;
use crate::wide::wide;

/// Cells whose radicals are computed together.
const LANES: usize = 8;

/// Relative error of radicals before the last step of Newton's method, which squares it.
const NEAR: f64 = 1e-6;

/// The greatest power for which [`faded`] is exact to 2e-11.
const SMALL: f64 = 0.1;

/// A Newton step from above covers at least a third of the way: enough steps for any number.
const MOST_STEPS: usize = 100;

/// How a chamber reacts within one step of time.
#[derive(Clone, Debug)]
pub struct Reaction {
    cells: Cells,
    /// The step, in seconds.
    seconds: f64,
    /// The share of the initiator that 1 W/m² splits in a step.
    split: f64,
    /// The exponent by which light fades in half a cell with 1 mol/m³ of initiator.
    fade: f64,
    /// `2 k_t dt`.
    ended: f64,
    /// `k_t,O2 dt`.
    stopped: f64,
    initiator: f64,
    oxygen: f64,
    propagation: f64,
    critical: f64,
    diffusion: Option<Diffusion>,
}

impl Reaction {
    /// Prepares steps of `seconds`.
    pub fn new(kinetics: &Kinetics, cells: Cells, seconds: f64) -> Self {
        // Constants of 003 table 1 are in W/m², mol/m³ and seconds; lengths of cells are in
        // micrometers.
        let watt_per_m2 = Intensity::from_mw_per_cm2(0.1);
        let um2_per_s = 1e12 * kinetics.oxygen_diffusion.number();
        Self {
            cells,
            seconds,
            split: kinetics.splitting(watt_per_m2) * seconds,
            fade: 0.5 * kinetics.fading() * cells.height_um,
            ended: 2.0 * kinetics.termination.number() * seconds,
            stopped: kinetics.termination_by_oxygen.number() * seconds,
            initiator: kinetics.photoinitiator.number(),
            oxygen: kinetics.oxygen.number(),
            propagation: kinetics.propagation.number(),
            critical: kinetics.critical_conversion,
            diffusion: Diffusion::new(&cells, um2_per_s * seconds),
        }
    }

    /// Returns the chamber's cells.
    pub const fn cells(&self) -> &Cells {
        &self.cells
    }

    /// Returns the length of a step, in seconds.
    pub const fn seconds(&self) -> f64 {
        self.seconds
    }

    /// Returns the difference between the conversion and the critical one.
    fn beyond_critical(&self, growth: f64) -> f64 {
        // 003 eq. 11 integrated: [DB] falls by exp(-k_p ∫ [R] dt), and conversion is one minus that
        // (eq. 14, whose sign is lost).
        -(-self.propagation * growth).exp_m1() - self.critical
    }
}

/// The contents of a chamber: concentrations in mol/m³, cell by cell.
#[derive(Clone, Debug)]
pub struct Chamber {
    initiator: Vec<f64>,
    radicals: Vec<f64>,
    oxygen: Vec<f64>,
    /// The time integral of the radicals.
    growth: Vec<f64>,
    /// Columns from this one on never had light.
    reach: usize,
}

impl Chamber {
    /// Fills a chamber with fresh resin.
    pub fn new(reaction: &Reaction) -> Self {
        let filled = |with| vec![with; reaction.cells.count()];
        Self {
            initiator: filled(reaction.initiator),
            radicals: filled(0.0),
            oxygen: filled(reaction.oxygen),
            growth: filled(0.0),
            reach: 0,
        }
    }

    /// Advances one step under light, in W/m² at the glass of each column: oxygen diffuses, then
    /// light splits initiator, then radicals react with each other and with oxygen, each
    /// implicitly.
    pub fn pass(&mut self, reaction: &Reaction, light: &[f64]) {
        let lit = light.iter().rposition(|&light| light > 0.0).map_or(0, |last| last + 1);
        // Columns that never had light have no radicals: only oxygen moves there.
        self.reach = self.reach.max(lit);
        wide(
            #[inline(always)]
            || {
                if let Some(diffusion) = &reaction.diffusion {
                    // Operator splitting: only oxygen diffuses in 003 eq. 12 and 13.
                    diffusion.spread(&mut self.oxygen);
                }
                self.react(reaction, light);
            },
        );
    }

    #[inline(always)]
    fn react(&mut self, reaction: &Reaction, light: &[f64]) {
        let mut left: Vec<f64> =
            light[..self.reach].iter().map(|light| light * reaction.split).collect();
        let mut made = vec![0.0; self.reach];
        let width = reaction.cells.across;
        for row in (0..reaction.cells.deep).map(|z| z * width..z * width + self.reach) {
            split(reaction, &mut left, &mut self.initiator[row.clone()], &mut made);
            made.iter_mut().zip(&self.radicals[row.clone()]).for_each(|(made, had)| *made += had);
            let radicals = &mut self.radicals[row.clone()];
            let oxygen = &mut self.oxygen[row.clone()];
            let growth = &mut self.growth[row];
            let groups = radicals.chunks_mut(LANES).zip(oxygen.chunks_mut(LANES));
            let groups = groups.zip(growth.chunks_mut(LANES)).zip(made.chunks(LANES));
            for (((radicals, oxygen), growth), made) in groups {
                settle(reaction, radicals, oxygen, growth, made);
            }
        }
    }

    /// Returns the height to which each column is solid from the glass, in micrometers: where the
    /// conversion first falls below the critical one, linearly between middles of cells.
    pub fn heights_um(&self, reaction: &Reaction) -> Vec<f64> {
        (0..reaction.cells.across).map(|x| self.height_um(reaction, x)).collect()
    }

    fn height_um(&self, reaction: &Reaction, x: usize) -> f64 {
        let Cells { across, deep, height_um, .. } = reaction.cells;
        let beyond = |z: usize| reaction.beyond_critical(self.growth[z * across + x]);
        let Some(liquid) = (0..deep).find(|&z| beyond(z) < 0.0) else {
            return deep as f64 * height_um;
        };
        // Solid resin above a liquid cell has no hold on the glass.
        let Some(solid) = liquid.checked_sub(1) else { return 0.0 };
        let share = beyond(solid) / (beyond(solid) - beyond(liquid));
        (solid as f64 + 0.5 + share) * height_um
    }

    /// Returns the radius to which resin is solid on the glass, in micrometers from the axis,
    /// linearly between middles of cells.
    pub fn base_um(&self, reaction: &Reaction) -> f64 {
        let Cells { across, width_um, .. } = reaction.cells;
        let beyond = |x: usize| reaction.beyond_critical(self.growth[x]);
        let Some(solid) = (0..across).rev().find(|&x| beyond(x) >= 0.0) else { return 0.0 };
        if solid + 1 == across {
            return across as f64 * width_um;
        }
        let share = beyond(solid) / (beyond(solid) - beyond(solid + 1));
        (solid as f64 + 0.5 + share) * width_um
    }
}

/// Passes light through a row of cells and splits their initiator. `left` is the share that the
/// light would split where it enters, and then where it leaves. `made` gets the new radicals.
#[inline(always)]
fn split(reaction: &Reaction, left: &mut [f64], initiator: &mut [f64], made: &mut [f64]) {
    // Initiator is never made.
    let is_small = reaction.fade * reaction.initiator <= SMALL;
    for ((left, initiator), made) in left.iter_mut().zip(initiator).zip(made) {
        let power = reaction.fade * *initiator;
        // Initiator reacts to the light at its cell's middle: half of the cell fades it before,
        // half after (003 eq. 4).
        let half = if is_small { faded(power) } else { (-power).exp() };
        let share = *left * half;
        *left = share * half;
        // 003 eq. 5, implicit: however long the step, initiator stays above zero.
        *initiator /= 1.0 + share;
        // 003 eq. 10: two radicals for each molecule that splits.
        *made = 2.0 * share * *initiator;
    }
}

/// Returns e to the minus `power`, by its series.
#[inline(always)]
fn faded(power: f64) -> f64 {
    let terms = [1.0 / 720.0, -1.0 / 120.0, 1.0 / 24.0, -1.0 / 6.0, 0.5, -1.0, 1.0];
    terms.into_iter().fold(0.0, |sum, term| sum * power + term)
}

/// Finds the radicals `R` of some cells, where `source` is the sum of the old radicals and the ones
/// that light made:
///
/// ```text
/// R + 2 k_t dt R² + k dt R O / (1 + k dt R) = source,   k = k_t,O2
/// ```
///
/// The left side grows with R, so there is one solution. Multiplied by 1 + k dt R, it is a cubic
/// that is convex above zero: from above, Newton's method never passes the solution.
#[inline(always)]
fn settle(
    reaction: &Reaction,
    radicals: &mut [f64],
    oxygen: &mut [f64],
    growth: &mut [f64],
    source: &[f64],
) {
    let (a, b) = (reaction.ended, reaction.stopped);
    let lanes = |cells: &[f64]| {
        let mut lanes = [0.0; LANES];
        lanes[..cells.len()].copy_from_slice(cells);
        lanes
    };
    let (s, o, mut r) = (lanes(source), lanes(oxygen), lanes(radicals));
    // The cubic a b R³ + (a + b) R² + (1 + b (O - s)) R - s.
    let linear: [f64; LANES] = std::array::from_fn(|k| 1.0 + b * (o[k] - s[k]));
    let slope = |k: usize, r: f64| (3.0 * a * b * r + 2.0 * (a + b)) * r + linear[k];
    for k in 0..LANES {
        // The solution is at most the source; where the cubic falls, start there.
        r[k] = if r[k] < s[k] && slope(k, r[k]) > 0.0 { r[k] } else { s[k] };
    }
    for _ in 0..MOST_STEPS {
        let mut far = false;
        for k in 0..LANES {
            let value = ((a * b * r[k] + (a + b)) * r[k] + linear[k]) * r[k] - s[k];
            let next = (r[k] - value / slope(k, r[k])).min(s[k]);
            far |= (next - r[k]).abs() > NEAR * next;
            r[k] = next;
        }
        if !far {
            break;
        }
    }
    for (k, (radicals, (oxygen, growth))) in
        radicals.iter_mut().zip(oxygen.iter_mut().zip(growth)).enumerate()
    {
        // The trapezoid of the radicals over the step.
        *growth += 0.5 * reaction.seconds * (*radicals + r[k]);
        // 003 eq. 12 without diffusion, implicit with the radicals that were just found.
        *oxygen /= 1.0 + b * r[k];
        *radicals = r[k];
    }
}

#[cfg(test)]
mod tests {
    use lamp_grayscale::material::Material;
    use lamp_stack::Catalogued;

    use super::super::cells::ChamberShape;
    use super::*;

    fn reaction(height_um: f64, seconds: f64) -> Reaction {
        let kinetics = Material::builtin("tmpta").unwrap().kinetics().unwrap().unwrap();
        let deep = (200.0 / height_um) as usize;
        let cells = Cells { shape: ChamberShape::Round, across: 3, deep, width_um: 4.0, height_um };
        Reaction::new(&kinetics, cells, seconds)
    }

    #[test]
    fn small_powers_fade_as_the_exponential() {
        for power in [0.0, 0.01, 0.05, SMALL] {
            assert!((faded(power) - (-power).exp()).abs() < 2e-11, "{power}");
        }
    }

    #[test]
    fn each_cell_solves_its_equation_for_weak_and_strong_light() {
        for (light, seconds) in [(1e-3, 0.1), (25.7, 0.025), (1e4, 0.1), (1e9, 1.0)] {
            let reaction = reaction(1.0, seconds);
            let mut chamber = Chamber::new(&reaction);
            for _ in 0..20 {
                let before = chamber.clone();
                let mut spread = before.oxygen.clone();
                reaction.diffusion.as_ref().unwrap().spread(&mut spread);
                chamber.pass(&reaction, &[light; 3]);
                for (cell, oxygen) in spread.iter().enumerate() {
                    let r = chamber.radicals[cell];
                    let split = before.initiator[cell] - chamber.initiator[cell];
                    let source = before.radicals[cell] + 2.0 * split;
                    let stopped = oxygen - chamber.oxygen[cell];
                    let left = r + reaction.ended * r * r + stopped - source;
                    assert!(left.abs() < 1e-9 * (1.0 + source), "{light} {cell}: {left}");
                    assert!(r >= 0.0 && chamber.oxygen[cell] >= 0.0);
                }
            }
        }
    }

    #[test]
    fn cells_of_any_height_let_the_same_light_through() {
        // 20 um fade too much for the series.
        let [thin, thick] = [1.0, 20.0].map(|height_um| {
            let reaction = reaction(height_um, 0.025);
            let mut chamber = Chamber::new(&reaction);
            (0..400).for_each(|_| chamber.pass(&reaction, &[25.7; 3]));
            chamber.heights_um(&reaction)[0]
        });
        assert!((thin - 102.7).abs() < 0.2 && (thick - thin).abs() < 4.0, "{thin} {thick}");
    }
}
