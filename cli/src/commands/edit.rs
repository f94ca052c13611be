//! `lamp edit`: changes a stack at image level.

use std::path::{Path, PathBuf};

use clap::Args;
use lamp_edit::EditError;
use lamp_pipeline::edit::{EditCount, EditSettings, Editing, variants};

use crate::args::options::{Common, InputArgs, Output};
use crate::args::stages::EditStageArgs;
use crate::exit::Exit;
use crate::output::json_report::{JsonReport, ReportTo, schemas};
use crate::output::numbers::number_of;
use crate::streams::{
    check_beside, check_not_input, extension, input_name, is_stream, progress, read_passing,
    unless_found, write_file, write_layers,
};
use crate::terminal::stack_notes::{doubts, noting};

/// Edit the images of a part, without slicing it again
///
/// It adds or subtracts boxes, cylinders, cones, spheres, lofts, film-cooling holes, lines, polygons,
/// labels, pictures and other stacks in a range of heights, and can repeat them along lines and
/// circles. It crops, pads, mirrors and rotates all layers. Lengths and positions are in part coordinates, even in a build,
/// where you can choose copies. Serial numbers of labels may come from a CSV file. A TOML file
/// lists the edits, which are applied in order; docs/edit.md describes every key. Pages that no
/// edit changes are copied with their compressed images and checks, and are not decoded.
#[derive(Args)]
#[command(override_usage = "\
lamp edit [OPTIONS] <STACK> <EDITS.toml>
       lamp edit [OPTIONS] <STACK> <--union|--intersect|--difference|--xor> <STACK>")]
#[command(after_help = "\
Examples:
  lamp edit blade.tif edits.toml -o variant.tif
  slice blade.stl | fix | lamp edit - edits.toml | tile > build.tif
  lamp edit shell.tif --difference core.tif -o hollow.tif
  lamp edit blade.tif edits.toml --variants holes.csv -o 'blade-{name}.tif'

An edits.toml:
  [[edit]]
  op = \"subtract\"
  label = { text = \"SN {n:04}\", start = 17, at = [[\"2mm\", \"1mm\"]], height = \"3mm\" }
  z = [\"0mm\", \"0.5mm\"]")]
pub(crate) struct EditArgs {
    #[command(flatten)]
    input: InputArgs,

    #[command(flatten)]
    settings: EditStageArgs,

    /// Make a variant for each row of this table: columns such as 1.cylinder.diameter replace values
    /// of the list, and {name} in the name of the output (and of the report) is the row's name or
    /// number. An output that ends in .toml is the variant's list
    #[arg(
        long,
        value_name = "TABLE.csv",
        conflicts_with_all = ["union", "intersect", "difference", "xor", "json"]
    )]
    variants: Option<PathBuf>,

    #[command(flatten)]
    report: ReportTo,

    /// Stop with status 3 if an edit applies to no layer or changes no pixel, or if pages of a
    /// folder may be missing: no stack is written, and the next stage of a pipe fails, too
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    output: Output,
}

schemas! { "lamp-edit-1": lamp_pipeline::edit::EditHead, "edits": [lamp_pipeline::edit::EditCount]; }

impl EditArgs {
    fn check_streams(&self, settings: &EditSettings) -> Result<(), Exit> {
        let all = [settings.named(), &self.input.stack].into_iter();
        match all.filter(|path| is_stream(path)).count() {
            0 | 1 => Ok(()),
            _ => Err(Exit::usage(
                "only one input can be standard input (STACK is, unless it is named)",
            )),
        }
    }
}

pub(crate) fn run(args: &EditArgs, common: &Common) -> Result<(), Exit> {
    let settings = EditSettings::from(&args.settings);
    args.check_streams(&settings)?;
    args.report.check_output(&args.output.output)?;
    match &args.variants {
        None => make(&Editing::new(&settings)?, args, &args.output, args.report.path(), common),
        Some(table) => make_variants(args, settings.named(), table, common),
    }
}

/// The name of a variant in the names of its files.
const NAME: &str = "{name}";

/// Makes a stack, or a list of edits, of each row of a table.
fn make_variants(args: &EditArgs, list: &Path, table: &Path, common: &Common) -> Result<(), Exit> {
    if is_stream(&args.input.stack) || is_stream(list) || is_stream(table) {
        return Err(Exit::usage("--variants reads its inputs again and again: name files"));
    }
    let template = |path: &Path, option: &str| match path.to_str() {
        Some(text) if text.contains(NAME) => Ok(text.to_owned()),
        _ => Err(Exit::usage(format!(
            "--variants writes several files: write {NAME} in the name of {option}"
        ))),
    };
    let output = template(&args.output.output, "-o")?;
    let report = args.report.path().map(|path| template(path, "--report")).transpose()?;
    let is_list = extension(&args.output.output) == "toml";
    if is_list && report.is_some() {
        return Err(Exit::usage("--report is of stacks: lists of edits change nothing yet"));
    }
    let variants = variants(list, table)?;
    let inputs = [&args.input.stack, &list.to_owned(), &table.to_owned()];
    for (k, name) in variants.names().enumerate() {
        let named = |template: &String| PathBuf::from(template.replace(NAME, name));
        let output = Output { output: named(&output), ..args.output.clone() };
        check_not_input(&output.output, inputs)?;
        let text = variants.list(k);
        if is_list {
            let progress = progress("edit", common, &output);
            write_file(&output.output, |out| out.write_all(text.as_bytes()))?;
            progress.wrote(&output.output, &[]);
            continue;
        }
        let editing = Editing::of_variant(list, &text)?;
        make(&editing, args, &output, report.as_ref().map(named).as_ref(), common)?;
    }
    Ok(())
}

/// Edits a stack, and reports what each edit changed.
fn make(
    editing: &Editing,
    args: &EditArgs,
    output: &Output,
    report: Option<&PathBuf>,
    common: &Common,
) -> Result<(), Exit> {
    if let Some(beside) = report {
        check_beside(beside, &output.output, editing.inputs().chain([&args.input.stack]))?;
    }
    check_not_input(&output.output, editing.inputs())?;
    let progress = progress("edit", common, output);
    // Layers that are not wanted are no loss.
    let is_whole = [args.input.layers.is_none(); 2];
    let mut layer_count = 0;
    let layers = read_passing(&args.input, &progress)?.inspect(|_| layer_count += 1);
    let edited = editing.layers(layers, 0..u32::MAX, is_whole, &noting)?;
    let warnings = || {
        let all: Vec<String> = editing.counts().iter().filter_map(EditCount::warning).collect();
        (!all.is_empty()).then(|| all.join("; "))
    };
    let finding = || warnings().or_else(doubts).filter(|_| args.strict).map(Exit::Findings);
    let edited = unless_found(edited, finding);
    let written = write_layers(edited, output, &progress).map_err(|error| match error {
        // A page that cannot be decoded names its stack.
        error if matches!(error.cause(), Some(EditError::Page(_))) => error,
        Exit::Failed(error) => match (error.downcast_ref::<EditError>(), editing.list()) {
            (Some(EditError::Edit { .. }), Some(list)) => Exit::Failed(error).at(input_name(list)),
            (Some(_), _) => Exit::Failed(error).at(input_name(&args.input.stack)),
            (None, _) => Exit::Failed(error),
        },
        error => error,
    });
    // After a finding, the report still shows it.
    if !matches!(written, Ok(()) | Err(Exit::Findings(_))) {
        return written;
    }
    let counts = editing.counts();
    for count in &counts {
        let pixels = number_of(count.pixels, "pixel");
        let layers = number_of(count.layers as u64, "layer");
        progress.detail(&format!("edit {}: {pixels} changed in {layers}", count.edit));
        // With --strict, the error says it.
        let warning = count.warning().filter(|_| !args.strict);
        warning.iter().for_each(|warning| progress.warn(warning));
    }
    if let Some(path) = report {
        JsonReport::of_schema("lamp-edit-1", &editing.head(layer_count))
            .list("edits", counts)
            .write(path)?;
    }
    written
}
