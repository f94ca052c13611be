//! `lamp target scan`: writes lines along and across the scan, and a table to fill in.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::{ArgGroup, Args};
use lamp_grayscale::calibrate::{LineKind, ScanDirection};
use lamp_grayscale::resin::Intensity;
use lamp_grayscale::target::scan_lines;
use lamp_stack::{Destination, Dpi, Format, Length, write_stack};

use super::squares::{Doses, parse_doses};
use super::{counted, full_white, pages, parse_gap, sorted, whole_pixels};
use crate::args::options::{Common, parse_light};
use crate::exit::Exit;
use crate::streams::{new_folder, write_file, written_to};
use crate::terminal::progress::Progress;

/// Write lines and gaps along and across the scan, to calibrate the spread of light
///
/// It writes a stack, lines.tif, and lines.csv, a table to fill in for lamp calibrate scan. Expose
/// all pages onto one layer, each for its exposure_ms: the k-th block from the top gets the k-th
/// dose in total. On the left of a block, lines and then gaps run along the scan, from the left, and
/// their widths are measured across it. On the right they run across the scan, from the top.
#[derive(Args)]
#[command(group = ArgGroup::new("light").required(true))]
#[command(after_help = "\
Examples:
  lamp target scan --doses 150,300mJ/cm2 --material lamp-suspension -o lines/
  lamp target scan --doses 80mJ/cm2 --widths 2,3,5,10,30 --intensity 20mW/cm2 -o lines/
  lamp calibrate scan lines/lines.csv --material mine.toml -o mine.toml")]
pub(super) struct ScanArgs {
    /// Resolution in dots per inch
    #[arg(long, default_value = "1500")]
    dpi: Dpi,

    /// Widths of the lines and gaps, in pixels; some should be about as wide as light spreads
    #[arg(long, value_name = "PIXELS,...", value_delimiter = ',')]
    #[arg(default_value = "2,3,4,6,8,12,20,40")]
    widths: Vec<u32>,

    /// Doses: A..B for ten doses from A to B in equal steps, or a list in ascending order
    #[arg(long, value_name = "A..BmJ/cm2|A,B,...mJ/cm2", value_parser = parse_doses)]
    doses: Doses,

    /// Intensity of full white, which turns doses into times
    #[arg(long, value_name = "INTENSITY", value_parser = parse_light, group = "light")]
    intensity: Option<Intensity>,

    /// Take the intensity from this material: a file or a built-in material's name
    #[arg(long, value_name = "MATERIAL", group = "light")]
    material: Option<PathBuf>,

    /// Length of the lines
    #[arg(long, value_name = "LENGTH", default_value = "5mm", value_parser = parse_gap)]
    length: Length,

    /// Black between lines, and white around gaps
    #[arg(long, value_name = "LENGTH", default_value = "1mm", value_parser = parse_gap)]
    gap: Length,

    /// Folder to write to; without --force it must be new or empty
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// Replace a folder that an earlier run wrote, once the new one is complete
    #[arg(long, alias = "overwrite")]
    force: bool,
}

pub(super) fn run(args: &ScanArgs, common: &Common) -> Result<(), Exit> {
    let light = full_white(args.intensity, args.material.as_deref())?;
    let [length, gap] = [args.length, args.gap].map(|length| whole_pixels(length, args.dpi));
    let widths = sorted("--widths", &args.widths)?;
    let doses = &args.doses.0;
    let exposures = scan_lines(&widths, length, gap, doses)?;
    let mut table = TABLE_HEAD.to_owned();
    for dose in doses {
        for direction in ScanDirection::ALL {
            for kind in LineKind::ALL {
                for width in &widths {
                    let dose = dose.mj_per_cm2();
                    let written = writeln!(table, "{direction},{kind},{width},{dose},");
                    written.expect("a text takes all");
                }
            }
        }
    }
    let to = new_folder(&args.output, args.force)?;
    let path = to.path().join("lines.tif");
    let part = "lines along and across the scan".to_owned();
    let command = args.command(&widths, light);
    let layers = pages(part, command, &args.doses, exposures, (light, args.dpi.into()), None);
    write_stack(layers, Destination::File(path), Format::Big)?;
    write_file(&to.path().join("lines.csv"), |out| out.write_all(table.as_bytes()))?;
    let progress = Progress::new("target", common, true);
    written_to(&args.output, to.persist().map_err(Exit::from), &progress)?;
    progress.say(&format!(
        "{}: lines.tif of {}, and lines.csv to fill in",
        args.output.display(),
        counted(doses.len(), "exposure")
    ));
    Ok(())
}

const TABLE_HEAD: &str = "\
# Write the width of each line, and of the opening of each gap, after curing into cured_um: 0 if the
# line did not cure or the gap closed; leave it empty where none was measured.
# across: measured across the scan, along x. along: measured along the scan, along y.
# Then: lamp calibrate scan lines.csv, with the --dpi of the target
direction,kind,feature_px,dose_mj_per_cm2,cured_um
";

impl ScanArgs {
    fn command(&self, widths: &[u32], light: Intensity) -> String {
        let widths: Vec<String> = widths.iter().map(u32::to_string).collect();
        let doses: Vec<String> = self.doses.0.iter().map(|d| d.mj_per_cm2().to_string()).collect();
        let (widths, doses, light) = (widths.join(","), doses.join(","), light.mw_per_cm2());
        let Self { dpi, length, gap, .. } = self;
        format!(
            "target scan --dpi {dpi} --widths {widths} --doses {doses}mJ/cm2 --intensity \
             {light}mW/cm2 --length {length} --gap {gap}"
        )
    }
}
