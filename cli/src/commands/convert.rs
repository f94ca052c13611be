//! `lamp convert`: writes a stack in another form, a STEP part as STL, or a mesh as STEP.

use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use anyhow::anyhow;
use clap::Args;
use lamp_machine::Machine;
use lamp_pipeline::documents::document_and_word;
use lamp_pipeline::panel::on_panel;
use lamp_pipeline::solid::part_notes;
use lamp_pipeline::step::{ReaderSettings, bytes_of};
use lamp_slicing::topology::{CornerTable, StepSolids};
use lamp_slicing::{OpenOptions, Part, Placement, Units};
use lamp_stack::{
    FileFormat, Format, Layer, Length, PartFormat, StackError, StackFormat, png_of_layer,
    write_png_folder,
};

use crate::args::options::{Common, InputArgs, Output, one_of};
use crate::args::solid::{ReaderArgs, STEP, parse_tolerance};
use crate::exit::Exit;
use crate::output::endings::{PART, check_ending, is_model_name, is_step_name};
use crate::output::numbers::number_of;
use crate::streams::{
    Layers, check_beside, counting, for_tiffs, input_name, is_folder, is_stream, layers_of_input,
    new_folder, open_pages, progress, stack_format, unless_found, write_file, write_layers,
    written_to,
};
use crate::terminal::progress::{Progress, Severity};
use crate::terminal::stack_notes::doubts;

/// Convert a stack to pages, PNGs or contours, a STEP part to STL, or a mesh to STEP
///
/// Images and their metadata stay unchanged, and the command is not recorded: a stack converted
/// from file to folder and back has the same bytes. Only --machine changes them, and is recorded.
///
/// A mesh must be closed. In a STEP file, its facets become flat faces; facets in one plane become
/// a single face.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp convert build.tif -o pages/
  lamp convert pages/ --classic -o build.tif
  lamp convert build.tif --layers 100..200 --png -o pictures/
  lamp convert build.tif --layers 600 -o layer.png
  lamp convert plate.goo plate.uvj
  lamp convert build.tif --machine mars3 plate.goo
  lamp convert build.tif -o contours.cli
  lamp convert part.step part.stl --chord 5um
  lamp convert part.stl part.step")]
pub(crate) struct ConvertArgs {
    #[command(flatten)]
    input: InputArgs,
    /// Where to write, as -o says. From a part, in millimeters: a binary STL from a STEP part, or a
    /// STEP file from a mesh
    #[arg(value_name = "OUT", conflicts_with = "output")]
    out: Option<PathBuf>,

    #[command(flatten)]
    output: Output,

    /// How far the facets of a STEP part may lie from its surfaces
    #[arg(long, value_name = "LENGTH", default_value = "5um", value_parser = parse_tolerance)]
    #[arg(help_heading = STEP)]
    chord: Length,

    /// Unit of the coordinates of a mesh in an STL or OBJ file
    #[arg(long, value_parser = one_of::<Units>(), default_value_t)]
    units: Units,

    #[command(flatten)]
    reader: ReaderArgs,

    /// Printer with a panel, by its name or a file: its panel's size, exposures and moves
    ///
    /// Images of another size are centered on the panel. Layers with an exposure time of their own
    /// keep it
    #[arg(long, value_name = "MACHINE")]
    machine: Option<PathBuf>,

    /// Write a folder of PNGs instead of TIFFs; a single layer may be a file that ends in .png
    #[arg(long, conflicts_with_all = ["classic", "format"])]
    png: bool,

    /// Accept pages that another program has changed, and make new checks
    #[arg(long)]
    ignore_checks: bool,

    /// Stop with status 3 and no output if the stack may be incomplete, for example a folder with a
    /// missing number
    #[arg(long)]
    strict: bool,
}

pub(crate) fn run(args: &ConvertArgs, common: &Common) -> Result<(), Exit> {
    // Before stacks: a name that ends in .stl or .step means a part, whatever the input is.
    match args.part() {
        Some(part) if is_stl_name(part) => return args.write_stl(part, common),
        Some(part) => return args.write_step(part, common),
        // A DXF is a drawing of a layer here, and a model elsewhere.
        None if StackFormat::of_name(args.to()).is_some() => {}
        None if is_model_name(args.to()) => check_ending(args.to(), &PART)?,
        None => {}
    }
    let path = &args.input.stack;
    let mut to = Output { output: args.to().to_owned(), ..args.output.clone() };
    let output = args.to();
    let progress = progress("convert", common, &to);
    let shape = shape_of(&to, args.png)?;
    let mut pages = open_pages(path).map_err(|error| match error.cause() {
        Some(StackError::NotTiff { format: Some(FileFormat::Part(PartFormat::Step)), .. }) => {
            let name = input_name(path);
            Exit::usage(format!("{name} is a STEP part: name a .stl after it"))
        }
        _ => error,
    })?;
    if args.ignore_checks {
        pages = pages.without_checks();
    }
    // A packed stack gives the TIFF back that it was made of.
    to.classic |= pages.packed_format() == Some(Format::Classic);
    let layers = layers_of_input(pages, &args.input, &progress).map(|layer| {
        let mut layer = layer?;
        if let Some(stack) = layer.info.stack.as_mut().filter(|_| args.ignore_checks) {
            // Missing layers would be reported missing again.
            stack.layers = None;
        }
        Ok(layer)
    });
    let mut replaced = Rc::default();
    let layers: Layers = match &args.machine {
        Some(machine) => {
            let (machine, word) = document_and_word::<Machine>(machine)?;
            let (layers, own_moves) = on_panel(layers, machine, &word)?;
            replaced = own_moves;
            Box::new(layers)
        }
        None => Box::new(layers),
    };
    let layers = unless_found(layers, || doubts().filter(|_| args.strict).map(Exit::Findings));
    match shape {
        OutputKind::Stack => write_layers(layers, &to, &progress)?,
        OutputKind::Pngs => {
            let counted = layers.inspect(counting(&progress));
            let folder = new_folder(output, args.output.force)?;
            written_to(output, write_png_folder(counted, folder), &progress)?;
        }
        OutputKind::Png => {
            let png = png_of_layer(&only_layer(layers, &input_name(&args.input.stack))?)?;
            write_file(output, |out| out.write_all(&png))?;
            progress.wrote(output, &[]);
        }
    }
    if replaced.get() > 0 && !common.quiet {
        let layers = number_of(replaced.get(), "layer");
        let note =
            format!("convert: {layers} with other moves than the rest: all get the machine's");
        Severity::Note.say(&note);
    }
    Ok(())
}

enum OutputKind {
    /// A file, a folder or a stream, as every stage writes it.
    Stack,
    /// A folder of PNGs.
    Pngs,
    /// A PNG of the only layer.
    Png,
}

impl ConvertArgs {
    /// The part to write, if one is named.
    fn part(&self) -> Option<&Path> {
        Some(self.to()).filter(|output| is_stl_name(output) || is_step_name(output))
    }

    /// Where to write: a second name means the same as `-o`.
    fn to(&self) -> &Path {
        self.out.as_deref().unwrap_or(&self.output.output)
    }

    /// Refuses options of stacks.
    fn check_for_part(&self, output: &Path) -> Result<(), Exit> {
        let Output { format, classic, .. } = self.output;
        let of_stacks = [self.input.layers.is_some(), self.png, classic, format.is_some()];
        if of_stacks.contains(&true) || self.machine.is_some() {
            let why =
                "--layers, --png, --format, --classic and --machine are for stacks, not for parts";
            return Err(Exit::usage(why));
        }
        check_beside(output, Path::new("-"), [&self.input.stack])
    }

    /// Writes a mesh as solids with flat faces.
    fn write_step(&self, step: &Path, common: &Common) -> Result<(), Exit> {
        self.check_for_part(step)?;
        let path = &self.input.stack;
        let name = input_name(path);
        let options = OpenOptions::default();
        let part = match is_stream(path) {
            true => Part::from_stream("stdin", io::stdin().lock(), &options),
            false => Part::open(path, &options),
        };
        let part = part.map_err(|error| Exit::from(error).at(name.clone()))?;
        // Its surfaces would become flat facets.
        if part.prepared().next().is_some() {
            return Err(Exit::usage(format!("{name} is a STEP part already")));
        }
        let table = CornerTable::of_part(&part, &Placement::default(), self.units);
        let table = table.map_err(|error| Exit::from(error).at(name.clone()))?;
        let facets = table.facet_count();
        let solids = StepSolids::new(table).map_err(|error| Exit::from(error).at(name))?;
        if !common.quiet {
            part_notes(&part)
                .iter()
                .for_each(|note| Severity::Note.say(&format!("convert: {note}")));
        }
        let progress = Progress::new("convert", common, true);
        write_file(step, |out| solids.write(part.name(), out))?;
        let [solids, faces, facets] =
            [(solids.solids(), "solid"), (solids.faces(), "face"), (facets, "facet")]
                .map(|(count, one)| number_of(count as u64, one));
        progress.wrote(step, &[solids, format!("{faces} of {facets}")]);
        Ok(())
    }

    /// Writes a STEP part as facets.
    fn write_stl(&self, stl: &Path, common: &Common) -> Result<(), Exit> {
        self.check_for_part(stl)?;
        let path = &self.input.stack;
        let name = input_name(path);
        let options = ReaderSettings::from(&self.reader).for_opening(self.chord)?;
        let model = bytes_of(path).and_then(|bytes| Part::from_step(&name, bytes, &options));
        let model = model.map_err(|error| Exit::from(error).at(name))?;
        if !common.quiet {
            part_notes(&model)
                .iter()
                .for_each(|note| Severity::Note.say(&format!("convert: {note}")));
        }
        let progress = Progress::new("convert", common, true);
        write_file(stl, |out| model.write_stl(out))?;
        progress.wrote(stl, &[number_of(model.facet_count() as u64, "facet")]);
        Ok(())
    }
}

fn shape_of(to: &Output, pngs: bool) -> Result<OutputKind, Exit> {
    let Output { output, format, classic, packbits, .. } = to;
    let named_png = output.extension().is_some_and(|end| end.eq_ignore_ascii_case("png"));
    match (is_folder(output), pngs) {
        (true, true) => Ok(OutputKind::Pngs),
        (false, _) if named_png && *classic => Err(for_tiffs("--classic")),
        (false, _) if named_png && *packbits => Err(for_tiffs("--packbits")),
        (false, _) if named_png && format.is_none() => Ok(OutputKind::Png),
        (false, true) => Err(Exit::usage("PNGs go into a folder: name it, such as -o pictures/")),
        (_, false) => stack_format(to).map(|_| OutputKind::Stack),
    }
}

/// The layer of a stack of one; `name` is what people call the stack.
fn only_layer(
    mut layers: impl Iterator<Item = Result<Layer, Exit>>,
    name: &str,
) -> Result<Layer, Exit> {
    let layer = layers.next().ok_or(StackError::NoLayers);
    let layer = layer.map_err(|error| Exit::from(error).at(name.to_owned()))??;
    match layers.next().transpose()? {
        None => Ok(layer),
        Some(_) => Err(Exit::Failed(anyhow!(
            "{name}: a PNG holds one layer: choose it with --layers, or write a folder of them with --png"
        ))),
    }
}

pub(super) fn is_stl_name(path: &Path) -> bool {
    path.extension().is_some_and(|end| end.eq_ignore_ascii_case("stl"))
}
