//! `lamp material profile`: the cured profile of a line of light.

use std::path::PathBuf;

use anyhow::anyhow;
use clap::Args;
use lamp_grayscale::exposure::MeasuredDoses;
use lamp_grayscale::resin::{Dose, GaussianBeam, QuantityError, WorkingCurve, plausible};
use lamp_pipeline::documents::document;
use lamp_stack::{Length, format_significant};

use crate::args::lamp_option::LampOption;
use crate::args::options::{Common, parse_distance};
use crate::exit::Exit;
use crate::streams::print;
use crate::terminal::progress::Progress;

/// Print the profile that a line of light cures: its width at the surface, and its depth across the
/// width
///
/// Light falls off as exp(-2 y^2/Wo^2) with the distance y from the line, nearly as light from one
/// pixel does. Depth follows the resin's working curve (002 equations 41 to 45). Ceramic also
/// scatters light: give a width and a critical dose that were fitted to cured lines (equation 46).
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp material profile lamp-suspension --dose 500mJ/cm2 --beam 17um
  lamp material profile mine.toml --dose 500mJ/cm2 --beam 60um --critical-dose 90mJ/cm2")]
pub(super) struct ProfileArgs {
    /// Material: a built-in material's name, a file, or - for standard input
    #[arg(value_name = "MATERIAL")]
    material: PathBuf,

    #[command(flatten)]
    lamp: LampOption,

    /// Dose in the middle of the line, for example 500mJ/cm2
    #[arg(long, value_name = "DOSE", value_parser = parse_dose)]
    dose: Dose,

    /// Gaussian width Wo of the light [default: twice the sigma of the material's [spread]]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance)]
    beam: Option<Length>,

    /// Critical dose for the width, if it was fitted to lines [default: the working curve's]
    #[arg(long, value_name = "DOSE", value_parser = parse_dose)]
    critical_dose: Option<Dose>,
}

pub(super) fn run(args: &ProfileArgs, common: &Common) -> Result<(), Exit> {
    let (material, lamp_doubt) = args.lamp.material(document(&args.material)?)?;
    let failed = |error: anyhow::Error| Exit::Failed(error).at(material.name.clone());
    let curve = material.working_curve().map_err(|error| failed(error.into()))?;
    let curve = curve.ok_or_else(|| failed(anyhow!("it has no [working-curve]")))?;
    let beam = match args.beam {
        Some(width) => width,
        None => {
            let spread = material.spread().map_err(|error| failed(error.into()))?;
            let spread = spread.ok_or_else(|| {
                Exit::usage(format!("{} has no [spread]: give --beam", material.name))
            })?;
            let sigma = spread.sigma().ok_or_else(|| {
                Exit::usage(format!(
                    "light of {} spreads by {} across and {} along the scan: give --beam, twice \
                     the one across the line",
                    material.name,
                    spread.across(),
                    spread.along()
                ))
            })?;
            // exp(-2 y²/Wo²) is a Gaussian of the standard deviation Wo / 2.
            Length::from_um(2.0 * sigma.um())
        }
    };
    let beam = GaussianBeam::new(beam).map_err(|error| Exit::usage(format!("--beam: {error}")))?;
    let doses = MeasuredDoses::of_working_curve(&material);
    doses.see(args.dose);
    let progress = Progress::new("material", common, true);
    let doubts = lamp_doubt.into_iter().chain(doses.doubt("lines"));
    doubts.for_each(|doubt| progress.say(&doubt));
    let critical = args.critical_dose.unwrap_or_else(|| curve.critical_dose());
    print(&table(beam, args.dose, &curve, critical))
}

/// The number of distances from the middle to the edge of what is cured.
const STEPS: u32 = 10;

/// The width, and the depth at distances from the middle.
fn table(beam: GaussianBeam, peak: Dose, curve: &WorkingCurve, critical: Dose) -> String {
    let short = |number: f64| format_significant(number, 5);
    let width = beam.cured_width(peak, critical);
    let deepest = beam.cure_depth(peak, Length::default(), curve);
    let mut text = format!(
        "cured {} um wide at the surface, {} um deep in the middle\n{:>12}{:>18}{:>12}\n",
        short(width.um()),
        short(deepest.um()),
        "y (um)",
        "dose (mJ/cm2)",
        "depth (um)"
    );
    let half = beam.cured_width(peak, curve.critical_dose()).um() / 2.0;
    for step in 0..=STEPS {
        let y = Length::from_um(half * f64::from(step) / f64::from(STEPS));
        let dose = beam.dose(peak, y, Length::default(), curve);
        // The last is where the depth ends, except for rounding.
        let depth = if step == STEPS { 0.0 } else { beam.cure_depth(peak, y, curve).um() };
        let [y, dose, depth] = [y.um(), dose.mj_per_cm2(), depth].map(short);
        text += &format!("{y:>12}{dose:>18}{depth:>12}\n");
    }
    text
}

fn parse_dose(text: &str) -> Result<Dose, String> {
    match text.parse::<Dose>() {
        Ok(dose) if plausible::DOSE.contains(&dose) => Ok(dose),
        Ok(_) => Err("a dose is from 1e-6 to 1e9 mJ/cm2".to_owned()),
        Err(error) => Err(<QuantityError as ToString>::to_string(&error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_as_deep_and_wide_as_equations_44_and_45_say() {
        let um = Length::from_um;
        let mj = Dose::from_mj_per_cm2;
        let curve = WorkingCurve::new(mj(131.5), um(211.0)).unwrap();
        let text = table(GaussianBeam::new(um(17.0)).unwrap(), mj(600.0), &curve, mj(131.5));
        let rows: Vec<Vec<f64>> = text
            .lines()
            .skip(2)
            .map(|line| line.split_whitespace().map(|cell| cell.parse().unwrap()).collect())
            .collect();
        // 17 sqrt(2 ln(600/131.5)) and 211 ln(600/131.5), by Python.
        assert!(text.starts_with("cured 29.620 um wide at the surface, 320.28 um deep"), "{text}");
        assert_eq!((rows.len(), rows[10][2]), (11, 0.0));
        assert!((rows[10][0] - 14.810).abs() < 1e-3 && (rows[10][1] - 131.5).abs() < 1e-2);
        for row in &rows {
            let parabola = 320.2817 - 2.0 * 211.0 * (row[0] / 17.0).powi(2);
            assert!((row[2] - parabola).abs() < 0.02, "{row:?}");
        }
    }
}
