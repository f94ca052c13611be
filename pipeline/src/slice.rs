//! The stage that makes layers: a part is sliced.

use std::cell::{Cell, RefCell};
use std::iter;
use std::ops::Range;
use std::path::{Path, PathBuf};

use lamp_grayscale::exposure::Exposure;
use lamp_grayscale::resin::ExposureTime;
use lamp_machine::{Machine, MachineGamma, MachineLimit};
use lamp_slicing::{
    Bodies, Fill, FillDoubt, LayerHeights, LayerLevels, Part, Polished, Shading, SliceError,
    SliceOptions, Slices,
};
use lamp_stack::{Image, Layer, LayerImage, Length, PageInfo, Size, SliceRecord};
use serde::Serialize;

use crate::documents::{document_and_word, is_file, recorded_name};
use crate::error::{Error, ErrorKind};
use crate::exposure::RecordedExposure;
use crate::fallback::Bridged;
use crate::heights;
use crate::memory::{available, in_words};
use crate::overlaps::overlap_text;
use crate::panel::PanelFrame;
use crate::part_file::{PartFile, paths};
use crate::size::short;
use crate::slice_settings::{GrayRule, SliceSettings, SlicingRecord, Thickness};
use crate::solid::{Reading, SolidSettings, at_part, name_of_all};
use crate::step::length;
use crate::watcher::{Importance, Remark, Watcher};
use crate::words::option;

/// Changes when the same settings and part give other bytes.
pub const CODE: u32 = 8;

/// A part, how it is sliced, and on what machine it is to be built.
#[derive(Clone, Debug)]
pub struct SliceStage {
    /// The part's files, which share one coordinate system.
    pub parts: Vec<PartFile>,
    /// The part's name in the stack; `None` is its file's.
    pub name: Option<String>,
    /// The settings.
    pub settings: SliceSettings,
    /// A machine whose limits hold: a built-in one's name, or a file.
    pub machine: Option<PathBuf>,
    /// The layers to make; all if `None`.
    pub layers: Option<Range<u32>>,
    /// The bytes that the table of crossings may take; `None` is a quarter of the free memory.
    pub memory: Option<u64>,
    /// An STL of the same STEP part, which stands in for layers with gaps.
    pub fallback: Option<PathBuf>,
}

/// Counts of layers and stray rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Counts {
    /// Layers.
    pub layers: usize,
    /// Layers whose contours do not all close.
    pub open_layers: usize,
    /// Layers with rows whose crossings do not balance.
    pub stray_layers: usize,
    /// Rows whose crossings do not balance.
    pub stray_rows: usize,
}

impl Counts {
    fn add(&mut self, info: &PageInfo) {
        self.layers += 1;
        self.open_layers += usize::from(info.closed == Some(false));
        self.stray_layers += usize::from(!info.stray_rows.is_empty());
        self.stray_rows += info.stray_rows.len();
    }
}

/// A part that is being sliced.
pub struct Slicing<'a> {
    stage: &'a SliceStage,
    /// The part.
    pub part: Part,
    bridged: RefCell<Bridged>,
    pages: PageWords,
    counts: Cell<Counts>,
    /// The layers with pixels that white does not cure down to the underside, and those pixels.
    short: Cell<[u64; 2]>,
    is_blank: Cell<bool>,
    panel: Option<PanelFrame>,
    /// The levels of gray edges by their shares, where the machine's light is not in proportion.
    edge_levels: Option<[u8; 256]>,
}

/// Text that slicing writes on pages besides their images.
pub struct PageWords {
    record: SlicingRecord,
    /// The name that stands for the part's while the stack is stored.
    stored_name: Option<String>,
    exposure: Option<Exposure>,
}

impl PageWords {
    /// Writes a page's exposure, and the stack's record on the first page.
    pub fn write(&self, layer: &mut Layer) {
        // All thicknesses were tried before the work.
        let time = |exposure: &Exposure| {
            exposure.time(Length::from_um(layer.info.thickness_um?)).ok().map(ExposureTime::ms)
        };
        layer.info.exposure_ms = self.exposure.as_ref().and_then(time);
        let Some(stack) = &mut layer.info.stack else { return };
        self.record.write(stack);
        if let Some(material) = self.exposure.as_ref().and_then(Exposure::material) {
            let numbers = serde_json::to_value(material).expect("a material is texts and numbers");
            stack.other.insert("material".to_owned(), numbers);
        }
        if let Some(name) = self.record.name.as_ref().or(self.stored_name.as_ref()) {
            stack.part.clone_from(name);
        }
    }
}

impl SliceSettings {
    /// Returns the layers of a part, and the text for their pages; `parts` are its files.
    ///
    /// # Errors
    /// Returns an error if settings contradict each other or the part, or if there is too little
    /// memory.
    pub fn slices(
        &self,
        model: Part,
        parts: Vec<PartFile>,
        layers: Option<Range<u32>>,
        memory: Option<u64>,
        exposure: Option<RecordedExposure>,
        watcher: &dyn Watcher,
    ) -> Result<(Slices, PageWords), Error> {
        let of_part = self.of_part(&model)?;
        let mut settings = of_part.clone();
        // Records name files without folders, and the kernel that made the images: bytes must not
        // depend on where files lie.
        settings.exposure.name(exposure.as_ref());
        settings.solid.name();
        settings.solid.step.reader.kernel = settings.solid.step.reader.kernel.of_images();
        let record = SlicingRecord { parts, name: None, settings, fallback: None, machine: None };
        let exposure = exposure.map(|recorded| recorded.exposure);
        let heights = of_part.layer_heights(&model, exposure.as_ref(), watcher)?;
        let uniform = of_part.uniform_thickness();
        let shading = of_part.shading(heights.as_ref(), exposure.as_ref())?;
        let memory = table_memory(memory);
        let options = SliceOptions { layers, heights, shading, memory, ..self.for_slicing() };
        let stated = options.heights.iter().filter(|_| of_part.thickness == (Thickness::OfPart {}));
        let stated = stated.flat_map(LayerHeights::thicknesses_um).map(Length::from_um);
        if let Some(exposure) = &exposure {
            let thicknesses: Vec<_> = uniform.into_iter().chain(stated).collect();
            thicknesses.iter().try_for_each(|thickness| exposure.check(*thickness))?;
            // The search for adaptive heights remarks on the doses of its layers.
            let is_found = matches!(self.thickness, Thickness::Adaptive { .. });
            let doubts = if is_found { vec![] } else { exposure.doubts(thicknesses.into_iter()) };
            doubts.into_iter().for_each(|doubt| watcher.remark(Remark::note(doubt)));
        }
        let slices = Slices::new(model, &options)?;
        // Before the first layer: systems may end a process that takes too much without a word.
        check_memory(&slices)?;
        Ok((slices, PageWords { record, stored_name: None, exposure }))
    }

    /// Returns the gray of layers at these heights, by the resin of an exposure.
    fn shading(
        &self,
        heights: Option<&LayerHeights>,
        exposure: Option<&Exposure>,
    ) -> Result<Shading, Error> {
        let known = || {
            let why = "gray layers need a material";
            exposure.ok_or_else(|| Error::settings(why))
        };
        // Layers are as thick as their heights say, or all the same.
        let thickness = self.uniform_thickness().unwrap_or_default();
        Ok(match self.gray {
            GrayRule::None => self.side.into(),
            GrayRule::ByDepth => {
                let levels = |um| known()?.levels(um).map_err(Error::from);
                Shading::ByDepth(match heights {
                    Some(heights) => LayerLevels::by_thickness(heights, levels)?,
                    None => levels(thickness)?.into(),
                })
            }
            GrayRule::PrintThrough => {
                let levels = |um| known()?.fading_levels(um).map_err(Error::from);
                Shading::PrintThrough(match heights {
                    Some(heights) => LayerLevels::by_thickness(heights, levels)?,
                    None => levels(thickness)?.into(),
                })
            }
        })
    }

    /// Finds adaptive layer heights, if requested, with notes on them, or returns the layers that
    /// the part's files state.
    fn layer_heights(
        &self,
        model: &Part,
        exposure: Option<&Exposure>,
        watcher: &dyn Watcher,
    ) -> Result<Option<LayerHeights>, Error> {
        let settings = match &self.thickness {
            Thickness::Adaptive { heights, .. } => heights,
            Thickness::Uniform { thickness } => {
                // Black layers below the part and above it count.
                let stated = model.stated_layers(&self.solid.placement())?;
                let nm = thickness.to_whole_nm().um();
                return Ok(stated.filter(|layers| layers.thicknesses_um().all(|um| um == nm)));
            }
            Thickness::OfPart {} => return Ok(model.stated_layers(&self.solid.placement())?),
        };
        let body = self.solid.body(model.clone())?;
        let part = settings.part(body, self.pitch, self.solid.fill)?.on_side(self.side);
        let found = settings.find(&part, exposure, watcher)?;
        let notes = heights::doubts(&found, exposure);
        notes.into_iter().for_each(|note| watcher.remark(Remark::note(note)));
        if settings.has_budget() {
            let layers = found.heights.layers.len();
            let bound = heights::bound(&found);
            watcher.remark(Remark::note(format!(
                "{layers} layers keep the budget, with errors up to {bound}"
            )));
        }
        Ok(Some(found.heights.layer_heights()?))
    }
}

impl SliceStage {
    /// Returns the files that are read.
    pub fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        paths(&self.parts).chain(self.settings.files()).chain(&self.fallback).chain(&self.machine)
    }

    /// Returns the files that settings name, without the part, to be changed.
    pub fn named_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let machine = self.machine.iter_mut().filter(|path| is_file::<Machine>(path));
        self.settings.files_mut().chain(&mut self.fallback).chain(machine)
    }

    /// Returns the settings as one text, equal for all settings of the same meaning. Files have
    /// only the names that stacks record.
    pub fn canonical(&self) -> String {
        let mut words = format!("slice{}", self.settings.canonical());
        if let Some(fallback) = &self.fallback {
            let name = fallback.file_name().unwrap_or_default().to_string_lossy();
            words.push_str(&option("fallback", &name));
        }
        // Without a panel and a curve of levels it changes no image, but refuses some.
        if let Some(machine) = &self.machine {
            let name = recorded_name::<Machine>(machine);
            words.push_str(&option("machine", &name.to_string_lossy()));
        }
        words
    }

    /// Opens the part, and prepares to slice it. Stacks record `name`, if given, as its file's
    /// name.
    ///
    /// # Errors
    /// Returns an error if settings contradict each other, or the part cannot be sliced.
    pub fn open(&self, name: Option<&str>, watcher: &dyn Watcher) -> Result<Slicing<'_>, Error> {
        let Self { parts, settings, .. } = self;
        // Before any file is opened: STEP parts can take minutes.
        if settings.gray == GrayRule::PrintThrough && self.fallback.is_some() {
            let why = "--print-through needs all layers above a layer, and --fallback repairs \
                       single layers: leave out one";
            return Err(Error::settings(why));
        }
        if settings.gray == GrayRule::PrintThrough && settings.antialias {
            let why = "--print-through chooses levels for summed doses, and --antialias would \
                       change them: leave out one";
            return Err(Error::settings(why));
        }
        let exposure = settings.exposure()?;
        let machine = self.machine.as_deref().map(document_and_word::<Machine>).transpose()?;
        let (machine, machine_word) = machine.unzip();
        if let Some(machine) = &machine {
            settings
                .check_machine(machine)
                .map_err(|limit| Error::new(ErrorKind::Settings, limit))?;
            settings.check_centered(machine)?;
            if machine.gamma.is_some() && settings.antialias && settings.gray != GrayRule::None {
                let why = format!(
                    "--gray chooses levels by the material, and the [gamma] of {} would change \
                     them: leave out --gray or --antialias",
                    machine.name
                );
                return Err(Error::settings(why));
            }
        }
        let reading = Reading {
            pitch: settings.pitch,
            may_be_open: self.fallback.is_some(),
            keep_marks: false,
            mask: settings.uniform_thickness(),
            watcher,
        };
        let part = settings.solid.open(parts, &reading)?;
        let settings = &settings.of_part(&part).map_err(|error| error.at(name_of_all(parts)))?;
        if let Some(machine) = &machine {
            let stated = part.stated_layers(&settings.solid.placement())?;
            let stated = stated.iter().flat_map(LayerHeights::thicknesses_um).map(Length::from_um);
            let uniform = settings.uniform_thickness();
            let is_of_part = settings.thickness == Thickness::OfPart {};
            // The settings alone were checked above.
            let mut thicknesses = uniform.into_iter().chain(stated.filter(|_| is_of_part));
            thicknesses
                .try_for_each(|thickness| machine.check_thickness(thickness, "a layer"))
                .map_err(|limit| Error::new(ErrorKind::Settings, limit))?;
        }
        if self.fallback.is_some() && part.prepared().next().is_none() {
            return Err(Error::settings("--fallback needs a STEP part"));
        }
        let files = match name {
            // Stored results name a part by its content, and a part of a night has no placement.
            Some(name) => vec![PartFile { path: name.into(), placement: None }],
            None => parts.iter().map(PartFile::named).collect(),
        };
        let (slices, mut pages) = settings
            .slices(part.clone(), files, self.layers.clone(), self.memory, exposure, watcher)
            .map_err(|error| at_part(error, &settings.solid.files(parts).0))?;
        // Only now, as the part's box is known once it is opened and placed.
        if let Some(machine) = &machine {
            check_part(machine, &slices)
                .map_err(|limit| Error::from(limit).at(name_of_all(parts)))?;
        }
        let gamma = machine.as_ref().and_then(|it| it.gamma.as_ref());
        let edge_levels = gamma.filter(|_| settings.antialias).map(MachineGamma::levels_of_light);
        let panel = machine.and_then(|it| PanelFrame::new(&it, &slices, &settings.frame));
        let fallback = self.fallback.as_deref();
        let bridged = Bridged::new(slices, fallback, settings, self.layers.clone(), watcher)?;
        pages.record.fallback = bridged.word();
        pages.record.machine = machine_word;
        pages.record.name.clone_from(&self.name);
        pages.stored_name = name.map(|name| stem(Path::new(name)));
        Ok(Slicing {
            stage: self,
            part,
            bridged: RefCell::new(bridged),
            pages,
            counts: Cell::default(),
            short: Cell::default(),
            is_blank: Cell::new(true),
            panel,
            edge_levels,
        })
    }
}

impl Slicing<'_> {
    /// Returns doubts about the part, before the work.
    pub fn doubts(&self) -> Vec<String> {
        let SliceStage { settings, parts, .. } = self.stage;
        let slices = &self.bridged.borrow().slices;
        let size = settings.solid.size(&self.part, slices.box_mm());
        let doubts = [
            size.doubt(settings.pitch, self.pages.record.settings.uniform_thickness()),
            settings.solid.overlap_doubt(parts, slices.overlap()),
        ];
        doubts.into_iter().flatten().collect()
    }

    /// Returns the number of layers.
    pub fn layer_count(&self) -> u32 {
        self.bridged.borrow().slices.layer_count() as u32
    }

    /// Returns the layers. Counts the layers of `counted`, and shows them to `see`.
    pub fn layers(
        &self,
        counted: Range<u32>,
        mut see: impl FnMut(&PageInfo),
    ) -> impl Iterator<Item = Result<Layer, Error>> {
        let next = || self.bridged.borrow_mut().next();
        iter::from_fn(next).map(move |layer| {
            let mut layer = layer.map_err(|error| self.at_part(error))?;
            self.pages.write(&mut layer);
            if counted.contains(&layer.info.index) {
                self.is_blank.set(self.is_blank.get() && layer.image.change_count() == 0);
                let mut counts = self.counts.get();
                counts.add(&layer.info);
                self.counts.set(counts);
                if let Some(pixels) = layer.info.slice_record().short_px {
                    let [layers, all] = self.short.get();
                    self.short.set([layers + 1, all + pixels]);
                }
                see(&layer.info);
            }
            let SliceSettings { antialias, gray, .. } = self.stage.settings;
            if let (true, GrayRule::None, Image::Gray(shares)) = (antialias, gray, &*layer.image) {
                if let Some(levels) = &self.edge_levels {
                    let image = shares.with_levels(levels);
                    // A page without gray pixels has one bit.
                    layer.image = image.to_mask().map_or_else(|| image.into(), LayerImage::from);
                } else {
                    let record = SliceRecord { levels_are_areas: true, ..SliceRecord::default() };
                    layer.info.set_slice_record(record);
                }
            }
            // Last: reports point into the images of the part alone.
            if let Some(panel) = &self.panel {
                panel.place(&mut layer);
            }
            Ok(layer)
        })
    }

    fn at_part(&self, error: SliceError) -> Error {
        let SliceStage { settings, parts, .. } = self.stage;
        at_part(error.into(), &settings.solid.files(parts).0)
    }

    /// Returns the counts so far.
    pub fn counts(&self) -> Counts {
        self.counts.get()
    }

    /// Returns whether no layer so far had a white pixel.
    pub fn is_blank(&self) -> bool {
        self.is_blank.get()
    }

    /// Returns a message about bodies that overlap in the layers so far.
    pub fn overlap(&self) -> Option<String> {
        let overlaps = self.bridged.borrow().slices.body_overlaps();
        let SliceStage { settings, parts, .. } = self.stage;
        let SolidSettings { fill, bodies, .. } = settings.solid;
        let cancels = fill == Fill::EvenOdd && bodies == Bodies::Xor;
        overlap_text(&overlaps, &self.part, &settings.solid.files(parts).0, cancels)
    }

    /// Returns doubts about the facets of each file, from the layers so far.
    pub fn fill_doubts(&self) -> Vec<String> {
        let SliceStage { settings, parts, .. } = self.stage;
        let files = settings.solid.files(parts).0;
        let doubts = self.bridged.borrow().slices.fill_doubts();
        doubts.iter().flat_map(|doubt| fill_doubt(doubt, &files[doubt.file].name())).collect()
    }

    /// Returns a doubt about each cutting file that has cut nothing so far.
    pub fn idle_cutters(&self) -> Vec<String> {
        let SliceStage { settings, parts, .. } = self.stage;
        let files = settings.solid.files(parts).0;
        let idle = self.bridged.borrow().slices.idle_cutters();
        let doubt = |file: usize| {
            let name = files[file].name();
            format!("{name} cuts nothing: it shares no pixel with the part, so check where it is")
        };
        idle.into_iter().map(doubt).collect()
    }

    /// Looks at the slices with `look`.
    pub fn with_slices<T>(
        &self,
        look: impl FnOnce(&Slices) -> Result<T, SliceError>,
    ) -> Result<T, Error> {
        look(&self.bridged.borrow().slices).map_err(|error| self.at_part(error))
    }

    /// Returns other messages about the layers so far.
    pub fn remarks(&self) -> Vec<String> {
        let bridged = self.bridged.borrow().text();
        let doubts = self.fill_doubts().into_iter().chain(self.idle_cutters());
        bridged.into_iter().chain(self.overlap()).chain(doubts).collect()
    }

    /// Returns the number of all layers of the part, including layers that are not wanted.
    pub fn part_layers(&self) -> u32 {
        self.bridged.borrow().slices.layer_heights().thicknesses_um().count() as u32
    }

    /// Returns lines about the work, once it is done. Stray rows are listed in the file `report`,
    /// or could be.
    pub fn summary(&self, report: Option<&Path>) -> Vec<Remark> {
        let bridged = self.bridged.borrow();
        let polished = bridged.slices.polished().filter(|it| it.moved + it.kept > 0);
        let detail =
            |polished| Remark { importance: Importance::Detail, text: polish_text(polished) };
        let overlap: fn(String) -> Remark = match self.stage.settings.solid.bodies {
            // Overlaps that unite are as designed; overlaps that cancel leave voids.
            Bodies::Xor => Remark::warning,
            _ => Remark::note,
        };
        let mut remarks: Vec<Remark> = polished.map(detail).into_iter().collect();
        remarks.extend(bridged.text().map(Remark::note));
        remarks.extend(self.overlap().map(overlap));
        let doubts = self.fill_doubts().into_iter().chain(self.idle_cutters());
        remarks.extend(doubts.map(Remark::warning));
        if let [layers, pixels] = self.short.get()
            && pixels > 0
        {
            remarks.push(Remark::note(format!(
                "{pixels} pixels in {layers} layers are not cured down to the underside, even \
                 with white; their pages state how many (short_px), and more --overcure cures them"
            )));
        }
        remarks.extend(stray_rows_text(self.counts(), report).map(Remark::note));
        remarks
    }
}

/// Returns sentences on facets that contradict each other.
fn fill_doubt(doubt: &FillDoubt, name: &str) -> Vec<String> {
    let FillDoubt { unsigned_rows, repeated_mm3, inward_mm3, .. } = *doubt;
    let turned = format!(
        "{name}: facets are turned over in {unsigned_rows} rows of pixels: there every crossing \
         toggles, as with --fill even-odd, and shells that overlap cut each other; lamp mesh \
         repair turns the facets back"
    );
    let repeated = format!(
        "{name}: {} mm³ lie in several shells whose facets face outwards: bodies that overlap, or \
         exist twice, are filled; --fill even-odd cuts out a void within another shell",
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

/// Returns the name of a part by its file.
pub(crate) fn stem(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Checks that a part fits within a machine's area and height.
fn check_part(machine: &Machine, slices: &Slices) -> Result<(), MachineLimit> {
    let [low, high] = slices.box_mm();
    // Differences of coordinates are off by rounding: a part as large as the area must fit.
    let side = |k: usize| Length::from_mm(high[k] - low[k]).to_whole_nm();
    let footprint = Size { width: side(0), height: side(1) };
    machine.check_footprint(footprint, "the part")?;
    machine.check_on_panel(footprint)?;
    let thicknesses = slices.layer_heights();
    let height = Length::from_um(thicknesses.thicknesses_um().sum()).to_whole_nm();
    machine.check_height(height, "the part")
}

/// Returns a line about the result of polishing.
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

fn stray_rows_text(counts: Counts, written: Option<&Path>) -> Option<String> {
    let Counts { stray_rows: rows, stray_layers: layers, .. } = counts;
    let names = match written {
        Some(path) => format!("and {} lists the facets", path.display()),
        None => "and --report FILE.json lists the facets".to_owned(),
    };
    (rows > 0).then(|| {
        format!(
            "{rows} rows in {layers} layers do not balance: the mesh has gaps; fix corrects them, \
             {names}"
        )
    })
}

/// Returns the share of the allowed memory for the table of crossings: its lists double as they
/// grow, and the rest is for images in progress. More than 64 MiB would not make it faster.
fn table_memory(allowed: Option<u64>) -> u64 {
    let there_is = available();
    let allowed = allowed.unwrap_or(there_is / 4).min(there_is);
    (allowed / 4).min(64 << 20)
}

/// Checks that there is memory for the largest layer alone.
fn check_memory(slices: &Slices) -> Result<(), Error> {
    let (least, there_is) = (slices.least_memory(), available());
    if least <= there_is {
        return Ok(());
    }
    let [least, there_is] = [least, there_is].map(in_words);
    Err(Error::work(format!(
        "a layer takes some {least} of memory, and there are {there_is}: check --units and --dpi"
    )))
}
