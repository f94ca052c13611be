//! Cures and plans what `ecpl.py` times.
//!
//! ```sh
//! cargo run --release -p lamp-benches --example ecpl "wide field" REPEATS
//! cargo run --release -p lamp-benches --example ecpl "figure 11" REPEATS
//! cargo run --release -p lamp-benches --example ecpl plan hemisphere
//! ```
//!
//! Cures so many times and prints the heights of columns; or plans a built-in target of
//! 003's projector, its lens with a blur of 8 um, and prints the root mean square of what is off
//! and the seconds that it took.

use std::error::Error;
use std::time::Instant;

use lamp_grayscale::material::Material;
use lamp_grayscale::resin::ExposureTime;
use lamp_planning::ecpl::{
    Cells, Chamber, ChamberShape, KineticSetting, Method, Reaction, RingExposure, RingSimulation,
    plan,
};
use lamp_planning::projector::Projector;
use lamp_planning::target::Target;
use lamp_stack::{Catalogued, Length};

/// Pixels and seconds of 003's figure 11.
const FIGURE_11: [(u32, f64); 8] =
    [(12, 7.9), (11, 0.8), (10, 1.3), (9, 1.2), (8, 1.8), (7, 1.2), (6, 1.7), (5, 1.8)];

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let setting = setting()?;
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["wide field", repeats] => print(&repeat(repeats, || wide_field(&setting))?),
        ["figure 11", repeats] => print(&repeat(repeats, || figure_11(&setting))?),
        ["plan", target] => print(&planned(setting, target)?),
        _ => return Err("name a case and repeats, or a plan".into()),
    }
    Ok(())
}

fn setting() -> Result<KineticSetting, Box<dyn Error>> {
    let material = Material::builtin("tmpta").ok_or("tmpta is built in")?;
    let projector = Projector::builtin("jariwala").ok_or("jariwala is built in")?;
    Ok(KineticSetting::of(&projector, material.kinetics()?.ok_or("tmpta has kinetics")?)?)
}

fn repeat(
    repeats: &str,
    cure: impl Fn() -> Result<Vec<f64>, Box<dyn Error>>,
) -> Result<Vec<f64>, Box<dyn Error>> {
    let mut heights = Vec::new();
    for _ in 0..repeats.parse::<usize>()? {
        heights = cure()?;
    }
    Ok(heights)
}

fn wide_field(setting: &KineticSetting) -> Result<Vec<f64>, Box<dyn Error>> {
    let cells =
        Cells { shape: ChamberShape::Round, across: 1, deep: 200, width_um: 4.0, height_um: 1.0 };
    let reaction = Reaction::new(&setting.kinetics, cells, 0.025);
    let mut chamber = Chamber::new(&reaction);
    let light = [10.0 * setting.light.mw_per_cm2()];
    (0..708).for_each(|_| chamber.pass(&reaction, &light));
    Ok(chamber.heights_um(&reaction))
}

fn figure_11(setting: &KineticSetting) -> Result<Vec<f64>, Box<dyn Error>> {
    let disc = |&(pixels, seconds): &(u32, f64)| {
        RingExposure::disc(pixels, ExposureTime::from_ms(1000.0 * seconds))
    };
    let plan: Vec<_> = FIGURE_11.iter().map(disc).collect();
    Ok(RingSimulation::of_plan(*setting, &plan, 100.0)?.cure(&plan).heights_um)
}

fn planned(mut setting: KineticSetting, name: &str) -> Result<Vec<f64>, Box<dyn Error>> {
    let target = Target::builtin(name).ok_or("no such target")?;
    let round = target.round(Length::from_um(1.0))?;
    if name == "lens" {
        setting.sigma_um = 8.0;
    }
    let start = Instant::now();
    let plan = plan(setting, round.radius_um(), |r| round.height_um(r), Method::Joint, || false)?;
    Ok(vec![plan.wanted.rms_um(&plan.cured), start.elapsed().as_secs_f64()])
}

fn print(numbers: &[f64]) {
    let numbers: Vec<String> = numbers.iter().map(f64::to_string).collect();
    println!("{}", numbers.join(" "));
}
