//! `lamp target squares`: writes squares at several doses, and a table to fill in.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::{ArgGroup, Args};
use lamp_grayscale::resin::{Dose, Intensity, plausible};
use lamp_grayscale::target::{TargetExposure, squares};
use lamp_stack::{Destination, Dpi, Format, Length, write_stack};

use super::{counted, full_white, pages, parse_gap, sorted, whole_pixels};
use crate::args::options::{Common, parse_light};
use crate::exit::Exit;
use crate::streams::{new_folder, write_file, written_to};
use crate::terminal::progress::Progress;

/// Write squares of several sizes, each at several doses, to calibrate the cure width
///
/// It writes a stack for each size, squares_00025px.tif and so on, and squares.csv, a table to fill
/// in for lamp calibrate width. Expose all pages of a stack onto one layer, each for its
/// exposure_ms. Each page has one white square fewer than the page before, so that the k-th square,
/// counted in rows from the top left, gets the k-th dose in total.
#[derive(Args)]
#[command(group = ArgGroup::new("light").required(true))]
#[command(after_help = "\
Examples:
  lamp target squares --doses 60..600mJ/cm2 --material lamp-suspension -o targets/
  lamp target squares --doses 50,70,100,150mJ/cm2 --sizes 25,450 --intensity 20mW/cm2 -o targets/
  lamp calibrate width targets/squares.csv")]
pub(super) struct SquaresArgs {
    /// Resolution in dots per inch
    #[arg(long, default_value = "1500")]
    dpi: Dpi,

    /// Sides of the squares, in pixels
    #[arg(long, value_name = "PIXELS,...", value_delimiter = ',')]
    #[arg(default_value = "25,50,75,100,200,300,450,600,750,900")]
    sizes: Vec<u32>,

    /// Doses: A..B for ten doses from A to B in equal steps, or a list in ascending order
    #[arg(long, value_name = "A..BmJ/cm2|A,B,...mJ/cm2", value_parser = parse_doses)]
    doses: Doses,

    /// Intensity of full white, which turns doses into times
    #[arg(long, value_name = "INTENSITY", value_parser = parse_light, group = "light")]
    intensity: Option<Intensity>,

    /// Take the intensity from this material: a file or a built-in material's name
    #[arg(long, value_name = "MATERIAL", group = "light")]
    material: Option<PathBuf>,

    /// Distance between squares
    #[arg(long, value_name = "LENGTH", default_value = "1mm", value_parser = parse_gap)]
    gap: Length,

    /// Folder to write to; without --force it must be new or empty
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// Replace a folder that an earlier run wrote, once the new one is complete
    #[arg(long, alias = "overwrite")]
    force: bool,
}

pub(super) fn run(args: &SquaresArgs, common: &Common) -> Result<(), Exit> {
    let light = full_white(args.intensity, args.material.as_deref())?;
    let gap = whole_pixels(args.gap, args.dpi);
    let sizes = sorted("--sizes", &args.sizes)?;
    // All of them, before there is a folder: a size may be impossible.
    let doses = &args.doses.0;
    let targets: Vec<(u32, Vec<TargetExposure>)> = sizes
        .into_iter()
        .map(|size| Ok((size, squares(size, gap, doses)?)))
        .collect::<Result<_, Exit>>()?;
    let to = new_folder(&args.output, args.force)?;
    let mut table = TABLE_HEAD.to_owned();
    let stacks = targets.len();
    for (size, exposures) in targets {
        for dose in doses {
            let written = writeln!(table, "{size},{},", dose.mj_per_cm2());
            written.expect("a text takes all");
        }
        let path = to.path().join(format!("squares_{size:05}px.tif"));
        let (part, command) = (format!("squares of {size} pixels"), args.command(size, light));
        let layers =
            pages(part, command, &args.doses, exposures, (light, args.dpi.into()), Some(size));
        write_stack(layers, Destination::File(path), Format::Big)?;
    }
    write_file(&to.path().join("squares.csv"), |out| out.write_all(table.as_bytes()))?;
    let progress = Progress::new("target", common, true);
    written_to(&args.output, to.persist().map_err(Exit::from), &progress)?;
    progress.say(&format!(
        "{}: {} of {}, and squares.csv to fill in",
        args.output.display(),
        counted(stacks, "stack"),
        counted(doses.len(), "exposure")
    ));
    Ok(())
}

const TABLE_HEAD: &str = "\
# Write each square's side after curing into cured_um, also where it did not grow; leave it empty
# where none was measured.
# Then: lamp calibrate width squares.csv, with the --dpi of the target
feature_px,dose_mj_per_cm2,cured_um
";

impl SquaresArgs {
    /// The command that makes a size's stack alone.
    fn command(&self, size: u32, light: Intensity) -> String {
        let doses: Vec<String> = self.doses.0.iter().map(|d| d.mj_per_cm2().to_string()).collect();
        let (doses, light) = (doses.join(","), light.mw_per_cm2());
        let Self { dpi, gap, .. } = self;
        format!(
            "target squares --dpi {dpi} --sizes {size} --doses {doses}mJ/cm2 \
             --intensity {light}mW/cm2 --gap {gap}"
        )
    }
}

/// The doses of the squares, from the least.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Doses(pub(super) Vec<Dose>);

/// How many doses a range has: as many tiles as figure 73 of 002 has.
const RANGE_STEPS: u32 = 10;

/// Parses `60..600mJ/cm2` or `60,90,140mJ/cm2`; the last unit serves all.
pub(super) fn parse_doses(text: &str) -> Result<Doses, String> {
    let unit_of = |text: &str| -> String {
        let number = |c: char| c.is_ascii_digit() || " .+-eE".contains(c);
        text.trim_start_matches(number).to_owned()
    };
    // A split at dots serves both `..` and decimals: the unit stands behind the last of them.
    let unit = unit_of(text.rsplit([',', '.']).next().unwrap_or_default());
    let dose = |text: &str| -> Result<Dose, String> {
        let unit = if unit_of(text).is_empty() { &unit[..] } else { "" };
        let dose: Dose = format!("{}{unit}", text.trim()).parse().map_err(|_| {
            format!("`{text}` is not a dose: write --doses 60..600mJ/cm2 or 60,90,140mJ/cm2")
        })?;
        if dose.mj_per_cm2() > 0.0 && !plausible::DOSE.contains(&dose) {
            return Err(format!("`{text}` is not a plausible dose: write 1e-6 to 1e9 mJ/cm2"));
        }
        Ok(dose)
    };
    let Some((from, to)) = text.split_once("..") else {
        return Ok(Doses(text.split(',').map(dose).collect::<Result<_, _>>()?));
    };
    let [from, to] = [dose(from)?, dose(to)?].map(Dose::mj_per_cm2);
    // Equal ends would give ten equal doses, and nothing to fit.
    if from >= to {
        return Err(format!("`{text}` contains no doses: the end must be above the start"));
    }
    let step = (to - from) / f64::from(RANGE_STEPS - 1);
    let dose = |i| Dose::from_mj_per_cm2(from + step * f64::from(i));
    Ok(Doses((0..RANGE_STEPS).map(dose).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn doses_as_people_write_them() {
        let mj = |text: &str| -> Vec<f64> {
            parse_doses(text).unwrap().0.iter().map(|dose| dose.mj_per_cm2()).collect()
        };
        let tens: Vec<f64> = (1..=10).map(|i| 60.0 * f64::from(i)).collect();
        assert_eq!(mj("60..600mJ/cm2"), tens);
        assert_eq!(mj("60 mJ/cm2..0.6 J/cm2"), tens);
        assert_eq!(mj("60,90, 1.4e2 mJ/cm2"), [60.0, 90.0, 140.0]);
        assert_eq!(mj("75mJ/cm2"), [75.0]);
        for text in
            ["", "60..600", "60,90", "a..b mJ/cm2", "600..60mJ/cm2", "60..60mJ/cm2", "1,,2J/cm2"]
                .into_iter()
                .chain(["1e-300..1e300mJ/cm2", "1,1e10mJ/cm2"])
        {
            assert!(parse_doses(text).is_err(), "{text}");
        }
    }
}
