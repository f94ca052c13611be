//! The stage that makes layers: a part is sliced.

use std::cell::{Cell, RefCell};
use std::iter;
use std::ops::Range;
use std::path::{Path, PathBuf};

use clap::Args;
use lamp_postprocess::machine::{Machine, MachineLimit};
use lamp_slicer::{Bodies, Fill, FillDoubt, Part, Polished, SHORT_PX, SliceError, Slices};
use lamp_stack::{Layer, Length, PageInfo, Size};

use crate::body_overlaps::overlap_text;
use crate::catalogue::{entry_and_word, is_file, recorded_name};
use crate::exit::Exit;
use crate::fallback::Bridged;
use crate::mesh_report::Counts;
use crate::options::{parse_layers, parse_memory};
use crate::part_arg::{PartArg, paths};
use crate::part_doubts::short;
use crate::part_options::{PartOptions, Reading, at_part, name_of_all};
use crate::progress::Progress;
use crate::recorded::option;
use crate::slicing_options::SlicingOptions;
use crate::step_options::{HEADING, length};

/// Changes when other bytes come from the same options and part.
pub(crate) const CODE: u32 = 6;

/// What is sliced, and how.
#[derive(Args, Clone)]
pub(crate) struct SliceSettings {
    /// The part: STL, STEP, 3MF or OBJ files, also packed by gzip, or - for standard input
    ///
    /// Several files share one coordinate system; FILE@X,Y,Z,DEGREES turns one about z and moves it
    /// first. Where they overlap they unite; --subtract and --intersect cut them
    #[arg(value_name = "PART", required = true, value_parser = PartArg::parser())]
    pub(crate) parts: Vec<PartArg>,

    #[command(flatten)]
    pub(crate) options: SlicingOptions,

    /// Machine to build on: alpha, beta or a file (see lamp machine)
    ///
    /// A part, a resolution or a layer thickness beyond its limits is refused before the work. Its
    /// defaults hold where no other resolution, thickness or margin is given
    #[arg(long, value_name = "M")]
    pub(crate) machine: Option<PathBuf>,

    /// Use only these layers: A..B is A to B - 1; A.. and ..B are open-ended
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    pub(crate) layers: Option<Range<u32>>,

    /// Memory for the table of crossings, at least 16MB; with less, fewer layers are cut at a time
    /// [default: a quarter of what there is, as far as it helps]. Facets in no order of height are
    /// first sorted in a temporary file, 36 bytes per facet. --adaptive also holds the mesh in
    /// memory, 49 bytes per facet
    #[arg(long, value_name = "BYTES", value_parser = parse_memory)]
    memory: Option<u64>,

    /// An STL of the same STEP part, in millimetres. Layers where the STEP part has gaps are cut up
    /// to 10 um off their plane, or else taken from this STL, as are layers that lack contours of
    /// it
    #[arg(long, value_name = "PART.stl", help_heading = HEADING)]
    pub(crate) fallback: Option<PathBuf>,
}

/// A part that is being sliced.
pub(crate) struct Slicing<'a> {
    settings: &'a SliceSettings,
    pub(crate) part: Part,
    bridged: RefCell<Bridged>,
    name_command: Box<dyn Fn(&mut Layer)>,
    counts: Cell<Counts>,
    /// The layers with pixels that white does not cure down to the underside, and those pixels.
    short: Cell<[u64; 2]>,
    is_blank: Cell<bool>,
}

impl SliceSettings {
    /// Returns the files that are read.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        paths(&self.parts).chain(self.options.files()).chain(&self.fallback).chain(&self.machine)
    }

    /// Returns the files that options name, without the part.
    pub(crate) fn named_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let machine = self.machine.iter_mut().filter(|path| is_file::<Machine>(path));
        self.options.files_mut().chain(&mut self.fallback).chain(machine)
    }

    /// Returns the options as one text, defaults filled in. Files have only the names that stacks
    /// record.
    pub(crate) fn canonical(&self) -> String {
        let mut words = format!("slice{}", self.options.canonical());
        if let Some(fallback) = &self.fallback {
            let name = fallback.file_name().unwrap_or_default().to_string_lossy();
            words.push_str(&option("fallback", &name));
        }
        // It changes no image, but refuses some.
        if let Some(machine) = &self.machine {
            words
                .push_str(&option("machine", &recorded_name::<Machine>(machine).to_string_lossy()));
        }
        words
    }

    /// Opens the part, and prepares to slice it. Stacks record `name` as that of its file, if it is
    /// given.
    pub(crate) fn open(
        &self,
        name: Option<&str>,
        progress: &Progress,
    ) -> Result<Slicing<'_>, Exit> {
        if self.options.print_through && self.fallback.is_some() {
            let why = "--print-through looks at all layers above one, and --fallback mends single \
                       ones: leave out one of them";
            return Err(Exit::usage(why));
        }
        let exposure = self.options.exposure()?;
        let machine = self.machine.as_deref().map(entry_and_word::<Machine>).transpose()?;
        let (machine, machine_word) = machine.unzip();
        if let Some(machine) = &machine {
            self.options.check_machine(machine).map_err(Exit::wrong_options)?;
        }
        let note = |line: &str| progress.say(line);
        let reading =
            Reading { dpi: self.options.dpi, may_be_open: self.fallback.is_some(), say: &note };
        let part = self.options.solid.open(&self.parts, &reading)?;
        if self.fallback.is_some() && part.prepared().next().is_none() {
            return Err(Exit::usage("--fallback needs a STEP part"));
        }
        let recorded = match name {
            Some(name) => vec![name.to_owned()],
            None => self.parts.iter().map(PartArg::recorded).collect(),
        };
        let (slices, name_command) = self
            .options
            .slices(part.clone(), &recorded, self.layers.clone(), self.memory, exposure, progress)
            .map_err(|error| at_part(error, &self.options.solid.files(&self.parts).0))?;
        if let Some(machine) = &machine {
            let name = name_of_all(&self.parts);
            check_part(machine, &slices).map_err(|limit| Exit::from(limit).at(name))?;
        }
        let layers = self.layers.clone();
        let fallback = self.fallback.as_deref();
        let bridged = Bridged::new(slices, fallback, &self.options, layers, &note)?;
        let part_name = name.map(|name| stem(Path::new(name)));
        let machine = machine_word.map(|word| option("machine", &word));
        let more: String = bridged.option().into_iter().chain(machine).collect();
        let name_command = move |layer: &mut Layer| {
            name_command(layer);
            let Some(stack) = &mut layer.info.stack else { return };
            if let Some(name) = &part_name {
                stack.part.clone_from(name);
            }
            if let Some(command) = stack.commands.last_mut() {
                command.push_str(&more);
            }
        };
        Ok(Slicing {
            settings: self,
            part,
            bridged: RefCell::new(bridged),
            name_command: Box::new(name_command),
            counts: Cell::default(),
            short: Cell::default(),
            is_blank: Cell::new(true),
        })
    }
}

impl Slicing<'_> {
    /// Returns doubts about the part, before the work.
    pub(crate) fn doubts(&self) -> Vec<String> {
        let SliceSettings { options, parts, .. } = self.settings;
        let slices = &self.bridged.borrow().slices;
        let size = options.solid.size(&self.part, slices.box_mm());
        let doubts = [
            size.doubt(options.dpi, options.uniform_thickness()),
            options.solid.overlap_doubt(parts, slices.overlap()),
        ];
        doubts.into_iter().flatten().collect()
    }

    /// Returns the number of layers.
    pub(crate) fn layer_count(&self) -> u32 {
        self.bridged.borrow().slices.layer_count() as u32
    }

    /// Returns the layers. Those of `counted` are counted, and shown to `see`.
    pub(crate) fn layers(
        &self,
        counted: Range<u32>,
        mut see: impl FnMut(&PageInfo),
    ) -> impl Iterator<Item = Result<Layer, Exit>> {
        let next = || self.bridged.borrow_mut().next();
        iter::from_fn(next).map(move |layer| {
            let mut layer = layer.map_err(|error| self.at_part(error))?;
            (self.name_command)(&mut layer);
            if counted.contains(&layer.info.index) {
                self.is_blank.set(self.is_blank.get() && layer.image.change_count() == 0);
                let mut counts = self.counts.get();
                counts.add(&layer.info);
                self.counts.set(counts);
                let short = layer.info.other.get(SHORT_PX).and_then(serde_json::Value::as_u64);
                if let Some(pixels) = short {
                    let [layers, all] = self.short.get();
                    self.short.set([layers + 1, all + pixels]);
                }
                see(&layer.info);
            }
            Ok(layer)
        })
    }

    fn at_part(&self, error: SliceError) -> Exit {
        let SliceSettings { options, parts, .. } = self.settings;
        at_part(error.into(), &options.solid.files(parts).0)
    }

    /// Returns what was counted so far.
    pub(crate) fn counts(&self) -> Counts {
        self.counts.get()
    }

    /// Returns whether no layer so far had a white pixel.
    pub(crate) fn is_blank(&self) -> bool {
        self.is_blank.get()
    }

    /// Returns what is said of bodies that overlap in the layers so far.
    pub(crate) fn overlap(&self) -> Option<String> {
        let overlaps = self.bridged.borrow().slices.body_overlaps();
        let SliceSettings { options, parts, .. } = self.settings;
        let PartOptions { fill, bodies, .. } = options.solid;
        let cancels = fill == Fill::EvenOdd && bodies == Bodies::Xor;
        overlap_text(&overlaps, &self.part, &options.solid.files(parts).0, cancels)
    }

    /// Returns doubts about the facets of each file, from the layers so far.
    pub(crate) fn fill_doubts(&self) -> Vec<String> {
        let SliceSettings { options, parts, .. } = self.settings;
        let files = options.solid.files(parts).0;
        let doubts = self.bridged.borrow().slices.fill_doubts();
        doubts.iter().flat_map(|doubt| fill_doubt(doubt, &files[doubt.file].name())).collect()
    }

    /// Returns a doubt about each file that is there to cut, and cut nothing so far.
    pub(crate) fn idle_cutters(&self) -> Vec<String> {
        let SliceSettings { options, parts, .. } = self.settings;
        let files = options.solid.files(parts).0;
        let idle = self.bridged.borrow().slices.idle_cutters();
        let doubt = |file: usize| {
            let name = files[file].name();
            format!(
                "{name} cuts nothing: it shares no pixel with the part, so check where it stands"
            )
        };
        idle.into_iter().map(doubt).collect()
    }

    /// Looks at the slices with `look`.
    pub(crate) fn with_slices<T>(
        &self,
        look: impl FnOnce(&Slices) -> Result<T, SliceError>,
    ) -> Result<T, Exit> {
        look(&self.bridged.borrow().slices).map_err(|error| self.at_part(error))
    }

    /// Returns what else is to be said of the layers so far.
    pub(crate) fn remarks(&self) -> Vec<String> {
        let bridged = self.bridged.borrow().text();
        let doubts = self.fill_doubts().into_iter().chain(self.idle_cutters());
        bridged.into_iter().chain(self.overlap()).chain(doubts).collect()
    }

    /// Returns the number of all layers of the part, also of those that are not wanted.
    pub(crate) fn part_layers(&self) -> u32 {
        self.bridged.borrow().slices.layer_heights().thicknesses_um().count() as u32
    }

    /// Tells what was found on the way; stray rows are listed in the file `report`, or could be.
    pub(crate) fn tell(&self, progress: &Progress, report: Option<&Path>) {
        let bridged = self.bridged.borrow();
        if let Some(polished) = bridged.slices.polished().filter(|it| it.moved + it.kept > 0) {
            progress.detail(&polish_text(polished));
        }
        if let Some(text) = bridged.text() {
            progress.say(&text);
        }
        match self.overlap() {
            Some(text) if self.settings.options.solid.bodies == Bodies::Xor => progress.warn(&text),
            Some(text) => progress.say(&text),
            None => {}
        }
        let doubts = self.fill_doubts().into_iter().chain(self.idle_cutters());
        doubts.for_each(|doubt| progress.warn(&doubt));
        if let [layers, pixels] = self.short.get()
            && pixels > 0
        {
            progress.say(&format!(
                "{pixels} pixels in {layers} layers are not cured down to the underside, even by \
                 white; their pages say how many (short_px), and more --overcure cures them"
            ));
        }
        say_stray_rows(progress, self.counts(), report);
    }
}

/// Returns sentences on facets that contradict each other.
fn fill_doubt(doubt: &FillDoubt, name: &str) -> Vec<String> {
    let FillDoubt { unsigned_rows, repeated_mm3, inward_mm3, .. } = *doubt;
    let turned = format!(
        "{name}: facets are turned over in {unsigned_rows} rows of pixels: there every crossing \
         toggles, as with --fill even-odd, and shells that overlap cut each other; lamp mesh \
         repair turns them back"
    );
    let repeated = format!(
        "{name}: {} mm³ lie in several shells whose facets face outwards: bodies that overlap, or \
         stand twice, are filled; a void within another shell is cut out by --fill even-odd",
        short(repeated_mm3)
    );
    let inward = format!(
        "{name}: the facets around {} mm³ face inwards, or voids overlap there: all of it is filled",
        short(inward_mm3)
    );
    let all =
        [(unsigned_rows > 0, turned), (repeated_mm3 > 0.0, repeated), (inward_mm3 > 0.0, inward)];
    all.into_iter().filter_map(|(holds, text)| holds.then_some(text)).collect()
}

/// Returns what a stack calls a part by its file.
pub(crate) fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Checks that a part lies within a machine's area and height.
fn check_part(machine: &Machine, slices: &Slices) -> Result<(), MachineLimit> {
    let [low, high] = slices.box_mm();
    let side = |k: usize| Length::from_mm(high[k] - low[k]).to_whole_nm();
    machine.check_footprint(Size { width: side(0), height: side(1) }, "the part")?;
    let thicknesses = slices.layer_heights();
    let height = Length::from_um(thicknesses.thicknesses_um().sum()).to_whole_nm();
    machine.check_height(height, "the part")
}

/// What polishing did, in a line.
fn polish_text(polished: Polished) -> String {
    let Polished { moved, kept, mended, mean_mm, most_mm } = polished;
    let mean = length(mean_mm);
    let most = length(most_mm);
    let kept = match kept {
        0 => String::new(),
        kept => format!(", {kept} stayed on their facets"),
    };
    format!(
        "{moved} crossings were moved from facets to exact surfaces, by {mean} on average and \
         {most} at most along their rows{kept}; {mended} were added or removed where contours \
         turn"
    )
}

fn say_stray_rows(progress: &Progress, counts: Counts, written: Option<&Path>) {
    let Counts { stray_rows: rows, stray_layers: layers, .. } = counts;
    if rows > 0 {
        let names = match written {
            Some(path) => format!("and {} lists the facets", path.display()),
            None => "and --report FILE.json lists the facets".to_owned(),
        };
        progress.say(&format!(
            "{rows} rows in {layers} layers do not balance: the mesh has gaps; fix corrects them, {names}"
        ));
    }
}
