//! `lamp tile`: lays out copies on a build area.

mod check;
mod fields;
mod mesh;
mod placing;
mod plan;
mod recipe;
mod report;
mod stacks;
pub(crate) mod time;

use std::cell::RefCell;
use std::ops::Range;
use std::path::PathBuf;
use std::rc::Rc;

use clap::Args;
use lamp_build::{BuildFinding, BuildWanted, Layout, PartStack, Recipe};
use lamp_machine::Machine;
use lamp_pipeline::build_findings::{NoMesh, StrayTotals, describe_stray, within_height};
use lamp_pipeline::documents::document_and_word;
use lamp_pipeline::tile::TileSettings;
use lamp_stack::StackFormat;

use crate::args::options::{Common, Output, TimeArgs, format_parser, parse_layers};
use crate::args::parsed::Parsed;
use crate::args::tile::TileStageArgs;
use crate::commands::job::build_clock;
use crate::exit::Exit;
use crate::output::endings::parse_json;
use crate::output::json_report::ReportTo;
use crate::streams::Layers;
use crate::streams::{progress, unless_found, write_file};
use crate::terminal::progress::Progress;
use crate::terminal::stack_notes::doubts;
use fields::CutArgs;
use mesh::template;
use placing::read_layout;
use report::BuildTotals;
use stacks::{InputStack, StackArg};

/// Lay out copies of parts on a build area, in a mesh
///
/// Copies of one part are placed in rows from the top left, centered as a group; --pack outline
/// places copies by their outlines if more fit. The first page records their positions. Several
/// stacks are matched by the heights of their layers; shorter parts end first. Gray layers make a
/// gray build.
///
/// A mesh fills the rest of the area. A moat around each part stays free, even above the part, and
/// break lines cut through the mesh; the first layers are only mesh. Small or floating pieces of
/// mesh are left out. The default dimensions of the mesh are LAMP's own. --mesh none leaves the
/// area black.
#[derive(Args, Clone)]
#[command(after_help = "\
Examples:
  slice blade.stl | fix | dither | tile > build.tif
  tile blade.tif --machine beta --fit --gap 5mm -o build.tif
  tile blade.tif --mesh square --cell 4mm --clearance 500um --base-layers 10 -o build.tif
  tile blade.tif --area 200x200mm --copies 4 --mesh none -o build.tif
  tile blade.tif:120 core.tif:40 --machine beta --pack outline --layout-out layout.json -o build.tif
  tile blade.tif:3 core.tif:1 --shares --machine beta --pack outline -o build.tif
  tile blade.tif --machine beta --turns 15deg --layout-out layout.json -o build.tif > build.sh
  tile blade.tif core.tif --layout layout.json --fit --layout-picture layout.png -o build.tif
  tile blade.tif --machine beta --strips strips/ --mirrors 1920 --overlap 64
  tile blade.tif --area 90x50mm --fields 2560x1600 --overlap 4 -o fields/
  tile blade.tif --machine beta --recipe build.json
  tile blade.tif --machine mine.toml --report report.json -o build.tif
  tile blade.tif --machine mine.toml --time
  tile blade.tif --machine beta --time --expose 1.5s --recoat 9s")]
pub(crate) struct TileArgs {
    /// Stacks to read, each with its number of copies: TIFF or picture files, folders of pages, or
    /// - for standard input [default count: as many as fit for one stack, one each for several]
    #[arg(value_name = "STACK[:COPIES]", default_value = "-", value_parser = StackArg::parse)]
    stacks: Vec<StackArg>,

    /// Use only these layers: A..B is A to B - 1; A.. and ..B are open-ended
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    layers: Option<Range<u32>>,

    #[command(flatten)]
    pub(crate) settings: Parsed<TileStageArgs, TileSettings>,

    /// Write the copies' positions, for --layout
    #[arg(long, value_name = "FILE.json", value_parser = parse_json)]
    layout_out: Option<PathBuf>,

    /// Draw the numbered copies on the build area, as SVG or PNG
    #[arg(long, value_name = "FILE")]
    layout_picture: Option<PathBuf>,

    /// Write the recipe for the build's pages, without its parts' stacks; lamp compose makes any
    /// page from it. Without -o, the build itself is not written
    #[arg(long, value_name = "FILE.json", value_parser = parse_json)]
    recipe: Option<PathBuf>,

    #[command(flatten)]
    report: ReportTo,

    /// Print how long the build takes, from the machine's times, or from --expose and --recoat.
    /// Without -o, the build itself is not written
    #[arg(long)]
    time: bool,

    #[command(flatten)]
    times: TimeArgs,

    /// Stop with status 3 if a part's pages list stray rows, not all copies fit, or pages of a
    /// folder may be missing: no build is written
    #[arg(long)]
    strict: bool,

    #[command(flatten)]
    cut: CutArgs,

    /// Where to write the build: a file, a folder of pages (a name that ends in /, or an empty
    /// folder), or - for standard output. With --fields, the folder of the fields [default: -, or
    /// nowhere with --strips, --recipe, --time or --json]
    #[arg(short, long, value_name = "OUT")]
    output: Option<PathBuf>,

    /// Format of the file, if the ending of its name does not give it
    #[arg(long, value_name = "FORMAT", value_parser = format_parser(), conflicts_with = "fields")]
    format: Option<StackFormat>,

    /// Write classic TIFFs (at most 4 GiB) instead of BigTIFFs
    #[arg(long)]
    classic: bool,

    /// Compress gray pages with PackBits, for readers without Deflate; files are several times
    /// larger
    #[arg(long)]
    packbits: bool,

    /// Replace folders that an earlier run wrote, once the new ones are complete
    #[arg(long, alias = "overwrite")]
    force: bool,
}

pub(crate) fn run(args: &TileArgs, common: &Common) -> Result<(), Exit> {
    args.check()?;
    if let Some(turns) = args.settings.free_turns() {
        // Standard output takes a script, for which no stage waits.
        return args.plan(turns, &Progress::new("tile", common, true));
    }
    let output = args.output();
    let progress = match &output {
        Some(output) => progress("tile", common, output),
        None => Progress::new("tile", common, true),
    };
    let machine = args.settings.machine()?;
    let form = args.cut.form(machine.as_ref())?;
    let cut = args.cut.writer(form, args.output.as_ref(), args.classic, args.force)?;
    let built = args.build(machine.clone(), &progress)?;
    let Build { layers, layout, stray_rows, no_mesh, recipe, totals } = built;
    let finding = || {
        let found = stray_rows.borrow().text().or_else(doubts);
        found.filter(|_| args.strict).map(Exit::Findings)
    };
    fields::write(unless_found(layers, finding), cut, output.as_ref(), &progress)?;
    if let Some(text) = stray_rows.borrow().text() {
        progress.warn(&text);
    }
    if let Some(text) = no_mesh.borrow().text() {
        progress.warn(&text);
    }
    if let Some((path, recipe)) = args.recipe.as_ref().zip(recipe) {
        write_file(path, |out| out.write_all(recipe.borrow().to_json().as_bytes()))?;
    }
    args.tell(&layout)?;
    args.tell_totals(&layout, &totals.borrow(), machine.as_ref(), output.as_ref())
}

/// A build that is being made.
pub(crate) struct Build {
    pub(crate) layers: Layers<'static>,
    layout: Layout,
    pub(crate) stray_rows: Rc<RefCell<StrayTotals>>,
    pub(crate) no_mesh: Rc<RefCell<NoMesh>>,
    /// Its recipe, if that is wanted: complete after the last layer.
    recipe: Option<Rc<RefCell<Recipe>>>,
    /// The contents of its layers, if wanted: complete after the last layer.
    totals: Rc<RefCell<BuildTotals>>,
}

impl TileArgs {
    /// Checks, before there are stacks, what can be checked of the number of copies of each.
    pub(crate) fn check_for(&self, copies: &[Option<u32>]) -> Result<(), Exit> {
        self.settings.machine()?;
        if let Some(turns) = self.settings.free_turns() {
            return Err(Exit::usage(format!(
                "--turns {turns} takes stacks that are yet to be sliced: run lamp tile by hand for it"
            )));
        }
        self.of(copies.iter().map(|&copies| (PathBuf::from("stack"), copies))).check()
    }

    fn of(&self, stacks: impl Iterator<Item = (PathBuf, Option<u32>)>) -> Self {
        let stacks = stacks.map(|(path, copies)| StackArg { path, copies }).collect();
        Self { stacks, ..self.clone() }
    }

    /// Returns the build of other stacks, with the number of copies of each.
    pub(crate) fn build_of(
        &self,
        stacks: &[(PathBuf, Option<u32>)],
        progress: &Progress,
    ) -> Result<Build, Exit> {
        self.of(stacks.iter().cloned()).build(self.settings.machine()?, progress)
    }

    /// Lays the copies out, and returns the layers of the build.
    fn build(&self, machine: Option<Machine>, progress: &Progress) -> Result<Build, Exit> {
        let mesh = self.settings.mesh.options(template)?;
        let file = self.settings.layout.as_deref().map(read_layout).transpose()?;
        let from_bottom = self.settings.mesh.needs_layers_below();
        let mut stacks =
            InputStack::open_all(&self.stacks, &self.layers, from_bottom, machine.as_ref())?;
        let outlines = self.settings.needs_outlines();
        let parts = stacks.iter_mut().map(|stack| stack.part(outlines));
        let parts = parts.collect::<Result<Vec<PartStack>, _>>()?;
        let placed = self.placed(parts, file.as_ref(), machine.as_ref(), mesh.as_ref())?;
        let placed = match &self.settings.machine {
            Some(machine) => placed.for_machine(&document_and_word::<Machine>(machine)?.1),
            None => placed,
        };
        self.tell_places(&placed, progress)?;
        let heights = self.settings.heights();
        let recipe = self.recipe_of(&placed, heights, mesh.as_ref())?;
        let recipe = recipe.map(|recipe| Rc::new(RefCell::new(recipe)));
        let layout = placed.clone();
        let layout = match &mesh {
            Some(mesh) => layout
                .with_mesh(mesh)?
                .from_layer(self.layers.as_ref().map_or(0, |layers| layers.start)),
            None => layout,
        };
        let base_layers = mesh.map_or(0, |mesh| mesh.base_layers);
        stacks
            .iter()
            .filter_map(InputStack::layer_count)
            .max()
            .inspect(|&layers| progress.expect(u64::from(layers) + u64::from(base_layers)));
        let layers = stacks.into_iter().map(InputStack::layers).collect::<Result<Vec<_>, _>>()?;
        let stray_rows = Rc::new(RefCell::new(StrayTotals::default()));
        let no_mesh = Rc::new(RefCell::new(NoMesh::default()));
        let bare = Rc::clone(&no_mesh);
        let (found, progress) = (Rc::clone(&stray_rows), progress.clone());
        let told = recipe.clone();
        let is_timed = self.time || self.report.path().is_some();
        let clock = build_clock(
            self.settings.machine.as_deref().filter(|_| is_timed),
            machine.as_ref(),
            self.times,
        )?;
        let clock = match fields::of_steps(self.cut.form(machine.as_ref())?) {
            Some(form) => clock.with_fields(form),
            None => clock,
        };
        let needs_images = self.needs_images() || clock.needs_images();
        let totals = Rc::new(RefCell::new(BuildTotals::new(&layout, clock)));
        let added = Rc::clone(&totals);
        let wanted = BuildWanted { images: needs_images, areas: self.report.path().is_some() };
        let build = layout.build_telling(layers, heights, wanted, move |finding| match finding {
            BuildFinding::Stray(stray) => {
                found.borrow_mut().add(&stray);
                progress.detail(&describe_stray(&stray));
            }
            BuildFinding::Loose(loose) => {
                if let Some(recipe) = &told {
                    recipe.borrow_mut().add_loose(loose);
                }
            }
            BuildFinding::NoMesh(layer) => bare.borrow_mut().add(layer),
            BuildFinding::Areas(areas) => added.borrow_mut().add(areas),
        });
        let timed = Rc::clone(&totals);
        let size = [placed.pixels().width, placed.pixels().height];
        let print = machine.as_ref().and_then(Machine::print_record);
        let layers = Box::new(within_height(build, machine).map(move |layer| {
            let mut layer = layer?;
            timed.borrow_mut().time(&layer, size);
            if let Some((print, stack)) = print.as_ref().zip(layer.info.stack.as_mut()) {
                stack.set_print_record(print);
            }
            Ok(layer)
        }));
        Ok(Build { layers, layout: placed, stray_rows, no_mesh, recipe, totals })
    }

    /// Returns the folder of the strips or fields, if any are written.
    fn cut_folder(&self) -> Option<&PathBuf> {
        self.cut.folder(self.output.as_ref())
    }

    /// Returns the output of the whole build, if it is wanted.
    fn output(&self) -> Option<Output> {
        if self.cut.makes_fields() {
            return None;
        }
        let answers = self.time || self.report.is_printed();
        let is_alone = self.cut_folder().is_none() && self.recipe.is_none() && !answers;
        let output = self.output.clone().or_else(|| is_alone.then(|| PathBuf::from("-")))?;
        let &Self { format, classic, packbits, force, .. } = self;
        Some(Output { output, format, classic, packbits, force })
    }
}
