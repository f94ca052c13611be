//! `lamp fix`: corrects stray rows, and reports them.

use std::path::PathBuf;

use clap::Args;
use lamp_fix::{Band, BandOutcome, FixOptions, Fixed};
use lamp_pipeline::fix::{FixSettings, Fixing};
use lamp_pipeline::whereabouts;
use lamp_stack::PageInfo;

use crate::args::options::{Common, InputArgs, Output};
use crate::args::stages::FixStageArgs;
use crate::exit::Exit;
use crate::field_folder::{read_stack_or_fields, write_stack_or_fields};
use crate::output::band_pictures::BandPictures;
use crate::output::json_report::{JsonReport, ReportTo, schemas};
use crate::streams::{check_beside, progress, unless_found};
use crate::terminal::stack_notes::doubts;

/// Find and correct stray rows, where a gap in the mesh lets white run across the image
///
/// A row is stray if it ends white (the last column of every part is black) or if `slice` found
/// that it enters the part more or less often than it leaves it. Where `slice` found that contours
/// break off, a row is also stray if its neighbors above and below have crossings that it lacks, or
/// lack a run that it has. Missing crossings are added; existing crossings stay unless they
/// contradict the contours around them. A band of any width is corrected if the rows and layers
/// around it show how; otherwise it is left and reported. Pages record their changes, and two lines
/// sum them up; --verbose and --report list all changes. All other layers are passed on unchanged,
/// byte for byte. In gray layers, outlines are corrected.
///
/// The strips or fields of a folder are joined into their build, which is corrected and cut again.
#[derive(Args)]
#[command(after_help = "\
Examples:
  slice blade.stl | fix > blade.tif
  fix stack.tif --report fix.json --evidence pictures/ -o fixed.tif
  fix stack.tif --strict --min-confidence 0.8 -o fixed.tif
  fix pages/ --layers 100..200 --method nearest -o fixed/")]
pub(crate) struct FixArgs {
    #[command(flatten)]
    input: InputArgs,

    #[command(flatten)]
    settings: FixStageArgs,

    #[command(flatten)]
    report: ReportTo,

    /// Write a picture of each band to a new folder: before, after and the difference (new white in
    /// blue, new black in red), or just the band if it was not corrected
    #[arg(long, value_name = "DIR")]
    evidence: Option<PathBuf>,

    /// Stop with status 3 if a band was not corrected, or if pages of a folder may be missing: no
    /// stack is written, and the next stage of a pipe fails, too
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    output: Output,
}

schemas! { "lamp-fix-1": lamp_pipeline::FixHead, "bands": [lamp_pipeline::ReportedBand]; }

pub(crate) fn run(args: &FixArgs, common: &Common) -> Result<(), Exit> {
    args.report.check_output(&args.output.output)?;
    for beside in args.report.path().into_iter().chain(&args.evidence) {
        check_beside(beside, &args.output.output, [&args.input.stack])?;
    }
    let progress = progress("fix", common, &args.output);
    let settings = FixSettings::from(&args.settings);
    let options = settings.options();
    let fixing = Fixing::new(&settings);
    let evidence = args.evidence.as_deref();
    let mut evidence =
        evidence.map(|folder| BandPictures::new(folder, args.output.force)).transpose()?;
    let mut layer_count = 0;
    let layers = read_stack_or_fields(&args.input, &progress)?.inspect(|_| layer_count += 1);
    let fixed = fixing.layers(layers, 0..u32::MAX, |fixed| {
        for line in describe(fixed, &options) {
            progress.detail(&line);
        }
        if let Some(evidence) = &mut evidence {
            evidence.add(fixed);
        }
    });
    let finding = || {
        let left = fixing.report().text_of_left().or_else(doubts);
        left.filter(|_| args.strict).map(Exit::Findings)
    };
    let fixed = unless_found(fixed, finding);
    let written = write_stack_or_fields(fixed, &args.input, |form| form, &args.output, &progress);
    // After a finding, the report and the pictures still show it.
    if !matches!(written, Ok(()) | Err(Exit::Findings(_))) {
        return written;
    }
    let findings = fixing.report();
    if let Some(evidence) = evidence {
        evidence.finish()?;
    }
    if let Some(path) = args.report.path() {
        let report = JsonReport::of_schema("lamp-fix-1", &findings.head(layer_count));
        report.list("bands", findings.bands()).write(path)?;
    }
    if let Some(line) = findings.text_of_corrected() {
        progress.say(&line);
    }
    // With --strict, the error says it.
    if let Some(line) = findings.text_of_left().filter(|_| !args.strict) {
        progress.warn(&line);
    }
    written
}

/// Findings in a layer: a line for all that was corrected, and one for each band that was left.
fn describe(fixed: &Fixed<'_>, options: &FixOptions) -> Vec<String> {
    let info = &fixed.before.info;
    let corrected: Vec<&Band> =
        fixed.bands.iter().filter(|band| band.outcome == BandOutcome::Corrected).collect();
    let mut lines = Vec::new();
    if !corrected.is_empty() {
        lines.push(describe_corrected(info, &corrected));
    }
    for band in fixed.bands {
        let why = match band.outcome {
            BandOutcome::Corrected => continue,
            BandOutcome::TooWide => {
                let limit = options.max_width.unwrap_or(u32::MAX);
                format!("{} rows wide, limit {limit}", band.rows)
            }
            BandOutcome::Doubtful => {
                format!("confidence {:.2}, limit {:.2}", band.confidence, options.min_confidence)
            }
        };
        lines.push(format!(
            "{} {}: {why}; repair the CAD model near {}",
            info.name(),
            rows_of(band),
            whereabouts(fixed.before, band)
        ));
    }
    lines
}

/// `layer 812 (z 81.20 mm): rows 1034-1036, 1070 corrected, 214 pixels changed`.
fn describe_corrected(info: &PageInfo, bands: &[&Band]) -> String {
    let word = if bands.len() == 1 && bands[0].rows == 1 { "row" } else { "rows" };
    let rows: Vec<String> = bands.iter().map(|band| range_of(band)).collect();
    let pixels: u64 = bands.iter().map(|band| band.pixels).sum();
    format!("{}: {word} {} corrected, {pixels} pixels changed", info.name(), rows.join(", "))
}

/// `row 7` or `rows 1034-1071`.
fn rows_of(band: &Band) -> String {
    let word = if band.rows == 1 { "row" } else { "rows" };
    format!("{word} {}", range_of(band))
}

fn range_of(band: &Band) -> String {
    match band.rows {
        1 => band.first_row.to_string(),
        _ => format!("{}-{}", band.first_row, band.end() - 1),
    }
}

#[cfg(test)]
mod tests {
    use lamp_fix::BandKinds;
    use lamp_stack::{Layer, Mask, Pitch};

    use super::*;

    fn band(first_row: u32, rows: u32, outcome: BandOutcome) -> Band {
        Band {
            first_row,
            rows,
            kinds: BandKinds::NONE,
            columns: 100..400,
            gap: Some(120..130),
            pixels: 107,
            confidence: 0.312,
            outcome,
        }
    }

    fn described(bands: &[Band], info: PageInfo) -> Vec<String> {
        let layer =
            Layer { info, pitch: Pitch::of_dpi(254.0), image: Mask::black(500, 2000).into() };
        let fixed = Fixed { before: &layer, after: &layer, bands };
        describe(&fixed, &FixOptions::default())
    }

    #[test]
    fn what_was_corrected_is_said_in_one_line() {
        let info = PageInfo { index: 812, z_um: Some(81_200.0), ..PageInfo::default() };
        let bands = [band(1034, 3, BandOutcome::Corrected), band(1070, 1, BandOutcome::Corrected)];
        assert_eq!(
            described(&bands, info),
            ["layer 812 (z 81.20 mm): rows 1034-1036, 1070 corrected, 214 pixels changed"]
        );
        assert_eq!(
            described(&bands[1..], PageInfo::default()),
            ["layer 0: row 1070 corrected, 107 pixels changed"]
        );
    }

    #[test]
    fn what_was_left_is_said_with_its_place() {
        let origin_mm = Some([20.0, 120.0]);
        let info = PageInfo { index: 812, z_um: Some(81_200.0), origin_mm, ..PageInfo::default() };
        let bands = [band(1034, 38, BandOutcome::TooWide), band(1080, 1, BandOutcome::Doubtful)];
        let layer =
            Layer { info, pitch: Pitch::of_dpi(254.0), image: Mask::black(500, 2000).into() };
        let fixed = Fixed { before: &layer, after: &layer, bands: &bands };
        assert_eq!(
            describe(&fixed, &FixOptions { max_width: Some(15), ..FixOptions::default() }),
            [
                "layer 812 (z 81.20 mm) rows 1034-1071: 38 rows wide, limit 15; repair the CAD \
                 model near x 32.0-33.0 y 12.8-16.6 mm",
                "layer 812 (z 81.20 mm) row 1080: confidence 0.31, limit 0.35; repair the CAD \
                 model near x 32.0-33.0 y 11.9-12.0 mm",
            ]
        );
        assert_eq!(
            described(&bands[1..], PageInfo::default()),
            ["layer 0 row 1080: confidence 0.31, limit 0.35; repair the CAD model near \
                 columns 120-129"]
        );
    }
}
