//! `lamp target lines`: writes lines of mirrors for several times, and a table to fill in.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use lamp_grayscale::resin::ExposureTime;
use lamp_grayscale::target::lines;
use lamp_pipeline::documents::document;
use lamp_planning::ecpl::{LONGEST_MS, SettingError};
use lamp_planning::projector::{Projector, SpreadOf};
use lamp_stack::{Destination, Format, Length, write_stack};

use super::squares::Doses;
use super::{counted, pages, parse_gap, pitch_of, sorted};
use crate::args::options::Common;
use crate::exit::Exit;
use crate::streams::{new_folder, write_file, written_to};
use crate::terminal::progress::Progress;

/// Write lines of mirrors for several times, to calibrate the rates of a reaction
///
/// It writes a stack, lines.tif, whose pages a projector shows one after the other through the glass,
/// each for its exposure_ms and without a pause, and lines.csv, a table to fill in for lamp calibrate
/// kinetics. The k-th block from the top is lit for the k-th time in total. In a block, lines stand
/// side by side, narrow ones on the left. lamp plan simulate --model column reads the stack, too.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp target lines --projector jariwala -o lines/
  lamp target lines --projector mine.toml --widths 20,60 --times 2s,4s,8s,16s --length 600um -o lines/
  lamp calibrate kinetics lines/lines.csv --projector jariwala --material tmpta")]
pub(super) struct LinesArgs {
    /// Projector: a built-in projector's name (see lamp projector list) or a file
    #[arg(long, value_name = "PROJECTOR")]
    projector: PathBuf,

    /// Widths of the lines, in mirrors
    #[arg(long, value_name = "PIXELS,...", value_delimiter = ',', default_value = "10,60,90")]
    widths: Vec<u32>,

    /// Times for which blocks are lit, in ascending order
    #[arg(long, value_name = "TIME,...", value_delimiter = ',', default_value = "5s,10s,30s")]
    times: Vec<ExposureTime>,

    /// Length of the lines on the glass, to the nearest mirror
    #[arg(long, value_name = "LENGTH", default_value = "1mm", value_parser = parse_gap)]
    length: Length,

    /// Black between lines, to the nearest mirror
    #[arg(long, value_name = "LENGTH", default_value = "400um", value_parser = parse_gap)]
    gap: Length,

    /// Folder to write to; without --force it must be new or empty
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,

    /// Replace a folder that an earlier run wrote, once the new one is complete
    #[arg(long, alias = "overwrite")]
    force: bool,
}

pub(super) fn run(args: &LinesArgs, common: &Common) -> Result<(), Exit> {
    let projector: Projector = document(&args.projector)?;
    if matches!(projector.spread(), SpreadOf::Cone(_)) {
        let error = anyhow::Error::new(SettingError::Cone);
        return Err(Exit::Failed(error).at(args.projector.display().to_string()));
    }
    let light = projector.irradiance();
    let widths = sorted("--widths", &args.widths)?;
    let step_ms = projector.step.value.ms() * (1.0 - 1e-9);
    let shown = |time: &&ExposureTime| (step_ms..=LONGEST_MS).contains(&time.ms());
    if !(args.times.iter().all(|time| shown(&time)) && args.times.is_sorted_by(|a, b| a < b)) {
        return Err(Exit::usage(format!(
            "--times: write times in ascending order, from the display's step of {} to ten minutes",
            projector.step.value
        )));
    }
    let doses = Doses(args.times.iter().map(|&time| light * time).collect());
    let um = projector.pitch.value.um();
    let [length, gap] = [args.length, args.gap].map(|length| (length.um() / um).round() as u32);
    let exposures = lines(&widths, length, gap, &doses.0)?;
    let [columns, rows] = [projector.display.columns, projector.display.rows];
    if let Some(first) = exposures.first()
        && (first.image.width() > columns || first.image.height() > rows)
    {
        let name = &projector.name;
        return Err(Exit::usage(format!(
            "the lines take {} x {} mirrors, and the display of {name} has {columns} x {rows}: choose \
             fewer, or a smaller --length or --gap",
            first.image.width(),
            first.image.height()
        )));
    }
    let pitch = pitch_of(&projector)?;
    let mut table = TABLE_HEAD.to_owned();
    for time in &args.times {
        for width in &widths {
            writeln!(table, "{},{width},0,,", time.ms()).expect("a text takes all");
        }
    }
    let to = new_folder(&args.output, args.force)?;
    let command = args.command(&widths, &projector.name);
    let layers = pages("lines".to_owned(), command, &doses, exposures, (light, pitch), None);
    write_stack(layers, Destination::File(to.path().join("lines.tif")), Format::Big)?;
    write_file(&to.path().join("lines.csv"), |out| out.write_all(table.as_bytes()))?;
    let progress = Progress::new("target", common, true);
    written_to(&args.output, to.persist().map_err(Exit::from), &progress)?;
    progress.say(&format!(
        "{}: lines.tif of {}, and lines.csv to fill in",
        args.output.display(),
        counted(args.times.len(), "exposure")
    ));
    Ok(())
}

const TABLE_HEAD: &str = "\
# Write the height of each line at x_um from its middle into height_um, and its width on the glass
# into width_um; leave empty what was not measured. Add rows for other places, and for films under a
# wide white field with an empty line_px.
# Then: lamp calibrate kinetics lines.csv, with the --projector of the target
exposure_ms,line_px,x_um,height_um,width_um
";

impl LinesArgs {
    fn command(&self, widths: &[u32], projector: &str) -> String {
        let widths: Vec<String> = widths.iter().map(u32::to_string).collect();
        let times: Vec<String> = self.times.iter().map(|time| format!("{}ms", time.ms())).collect();
        let (widths, times) = (widths.join(","), times.join(","));
        let Self { length, gap, .. } = self;
        format!(
            "target lines --projector {projector} --widths {widths} --times {times} --length {length} \
             --gap {gap}"
        )
    }
}
