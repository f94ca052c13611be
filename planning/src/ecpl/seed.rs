//! Plans one bitmap after the other, as in 003 section 5.

use lamp_grayscale::resin::ExposureTime;
use rayon::prelude::*;

use super::RingExposure;
use super::profile::{Profile, WantedProfile};
use super::reactor::Chamber;
use super::simulation::{RingSimulation, ShownLight};

/// The longest time in the database of single discs, in whole seconds (003 table 2).
const DATABASE_S: u32 = 30;

/// The radius of its largest disc, in pixels.
const DATABASE_PIXELS: u32 = 45;

/// The longest time of a later disc, in seconds.
const LONGEST_S: f64 = 10.0;

/// A disc that made the part worse for this many seconds is not shown any longer.
const WORSE_S: f64 = 1.0;

/// Plans a first disc from the database, and then one smaller disc after the other, until the cured
/// height is the wanted one, or no disc improves it, or `is_stopped` returns true.
pub(super) fn plan(
    simulation: &RingSimulation,
    wanted: &WantedProfile,
    is_stopped: &dyn Fn() -> bool,
) -> Vec<RingExposure> {
    let Some((pixels, seconds)) = first_disc(simulation, wanted) else { return Vec::new() };
    let mut plan =
        vec![RingExposure::disc(pixels, ExposureTime::from_ms(f64::from(seconds) * 1000.0))];
    let mut chamber = Chamber::new(simulation.reaction());
    let shown = [disc(simulation, pixels, f64::from(seconds))];
    simulation.expose(&mut chamber, &shown, 0, |_, _| ());
    let mut reach = pixels;
    while !is_stopped()
        && let Some(next) = next_disc(simulation, wanted, &chamber, reach)
    {
        plan.push(RingExposure::disc(next.pixels, next.time));
        (reach, chamber) = (next.pixels, next.chamber);
    }
    plan
}

fn disc(simulation: &RingSimulation, pixels: u32, until_s: f64) -> ShownLight {
    ShownLight { until_s, light: simulation.light(|ring| ring < pixels as usize) }
}

/// Returns the difference between a profile and the part up to the profile's own height, as a share
/// of that height (003 equation 15). Without the division, the thinnest films would be best.
fn misfit(wanted: &WantedProfile, profile: &Profile) -> f64 {
    let highest = profile.highest_um();
    if highest == 0.0 { f64::INFINITY } else { wanted.rms_below(profile, highest) / highest }
}

/// Returns the disc of the database that fits best, in pixels and seconds (003 section 5.1).
pub(super) fn first_disc(
    simulation: &RingSimulation,
    wanted: &WantedProfile,
) -> Option<(u32, u32)> {
    let most = DATABASE_PIXELS.min(simulation.rings() as u32);
    let best_time = |pixels: u32| {
        let mut chamber = Chamber::new(simulation.reaction());
        let shown = [disc(simulation, pixels, f64::from(DATABASE_S))];
        let every = (1.0 / simulation.reaction().seconds()).round() as usize;
        let mut best = (f64::INFINITY, pixels, 0);
        simulation.expose(&mut chamber, &shown, 0, |step, chamber| {
            if step > 0 && step % every == 0 {
                let fit = misfit(wanted, &Profile::of(chamber, simulation.reaction()));
                if fit < best.0 {
                    best = (fit, pixels, (step / every) as u32);
                }
            }
        });
        best
    };
    let all: Vec<_> = (1..=most).into_par_iter().map(best_time).collect();
    let best = all.into_iter().min_by(|a, b| a.0.total_cmp(&b.0))?;
    best.0.is_finite().then_some((best.1, best.2))
}

/// A disc to show after others.
struct NextDisc {
    pixels: u32,
    time: ExposureTime,
    misfit: f64,
    chamber: Chamber,
}

/// Returns the smaller disc that fits best (003 section 5.2, equations 16 and 17), if one improves
/// the part.
fn next_disc(
    simulation: &RingSimulation,
    wanted: &WantedProfile,
    chamber: &Chamber,
    reach: u32,
) -> Option<NextDisc> {
    let now = Profile::of(chamber, simulation.reaction());
    let rms_now = wanted.rms_um(&now);
    let tries = (1..reach).into_par_iter().filter_map(|pixels| {
        try_disc(simulation, wanted, chamber, pixels).filter(|next| {
            // The misfit is a share of the height: a higher film can lower it although its
            // difference from the part is larger.
            wanted.rms_um(&Profile::of(&next.chamber, simulation.reaction())) < rms_now
        })
    });
    let tries: Vec<_> = tries.collect();
    tries.into_iter().min_by(|a, b| a.misfit.total_cmp(&b.misfit))
}

/// Finds the time for which a disc fits best.
fn try_disc(
    simulation: &RingSimulation,
    wanted: &WantedProfile,
    chamber: &Chamber,
    pixels: u32,
) -> Option<NextDisc> {
    let step_s = simulation.setting().step.ms() / 1000.0;
    let mut chamber = chamber.clone();
    let mut best: Option<NextDisc> = None;
    let mut shown_s = 0.0;
    while shown_s < LONGEST_S {
        simulation.expose(&mut chamber, &[disc(simulation, pixels, step_s)], 0, |_, _| ());
        // The chamber continues from step to step, so that all times of a disc take one simulation.
        shown_s += step_s;
        let misfit = misfit(wanted, &Profile::of(&chamber, simulation.reaction()));
        let time = ExposureTime::from_ms((shown_s * 1e6).round() / 1e3);
        match &best {
            Some(best) if best.misfit <= misfit => {
                if shown_s > best.time.ms() / 1000.0 + WORSE_S {
                    break;
                }
            }
            _ => best = Some(NextDisc { pixels, time, misfit, chamber: chamber.clone() }),
        }
    }
    best
}
