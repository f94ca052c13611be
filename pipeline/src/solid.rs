//! The solid to slice: its files, units, placement and fill rule.

use std::io;
use std::path::{Path, PathBuf};

use lamp_slicing::brep::vector::Vec3;
use lamp_slicing::{
    Bodies, FacetIndex, Fill, Join, OpenOptions, Part, Placement, SliceError, SurfaceError,
    SurfaceName, Units,
};
use lamp_stack::{Length, Pitch};
use serde::{Deserialize, Serialize};

use crate::documents::is_stream;
use crate::error::{Error, ErrorKind};
use crate::part_file::{PartFile, PartPlacement, paths};
use crate::placement::PlacementSettings;
use crate::size::PartSize;
use crate::slice_settings::USUAL_THICKNESS;
use crate::step::{StepSettings, notes};
use crate::watcher::{Remark, Watcher};
use crate::words::{parts, text};

/// Settings that decide the solid that a part's files enclose.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct SolidSettings {
    /// Unit of coordinates in STL and OBJ files; STEP and 3MF files state their own.
    #[serde(with = "text")]
    pub units: Units,
    /// Rule for the inside of the part.
    #[serde(with = "text")]
    pub fill: Fill,
    /// How the bodies of a STEP file, or the items of a 3MF, join under even-odd fill.
    #[serde(with = "text", skip_serializing_if = "is_default")]
    pub bodies: Bodies,
    /// Files cut out of the part.
    #[serde(with = "parts", skip_serializing_if = "Vec::is_empty")]
    pub subtract: Vec<PartFile>,
    /// Files that the part is cut down to.
    #[serde(with = "parts", skip_serializing_if = "Vec::is_empty")]
    pub intersect: Vec<PartFile>,
    /// Scale, turns and moves.
    #[serde(flatten)]
    pub placement: PlacementSettings,
    /// Trusts the part's apparent size.
    #[serde(skip_serializing_if = "is_default")]
    pub trust_extent: bool,
    /// How STEP files are read.
    #[serde(flatten)]
    pub step: StepSettings,
}

/// Returns whether a setting has its default value, so that records need not name it.
pub(crate) fn is_default<T: Default + PartialEq>(setting: &T) -> bool {
    *setting == T::default()
}

impl SolidSettings {
    /// Returns the placement of facets.
    pub fn placement(&self) -> Placement {
        self.placement.placement()
    }

    /// Returns the size of a part in its place.
    pub fn size(&self, model: &Part, box_mm: [[f64; 3]; 2]) -> PartSize {
        PartSize::new(box_mm, (!model.states_unit()).then_some(self.units))
    }

    /// Returns all files of a part, as they are numbered, and how each joins the others.
    pub fn files(&self, parts: &[PartFile]) -> (Vec<PartFile>, Vec<Join>) {
        let of = |parts: &[PartFile], join: Join| {
            parts.iter().map(|part| (part.clone(), join)).collect::<Vec<_>>()
        };
        let all = [
            // The order gives files their numbers, by which errors and overlaps name them.
            of(parts, Join::Unite),
            of(&self.subtract, Join::Subtract),
            of(&self.intersect, Join::Intersect),
        ];
        all.into_iter().flatten().unzip()
    }

    /// Returns the files that cut the part.
    pub fn cutters(&self) -> impl Iterator<Item = &PathBuf> {
        paths(&self.subtract).chain(paths(&self.intersect))
    }

    /// Returns the files that cut the part, to be changed.
    pub fn cutters_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        self.subtract.iter_mut().chain(&mut self.intersect).map(|part| &mut part.path)
    }

    /// Replaces the paths of files by the names that stacks record.
    pub(crate) fn name(&mut self) {
        for file in self.subtract.iter_mut().chain(&mut self.intersect) {
            *file = file.named();
        }
    }

    /// Returns a doubt about files that overlap: `found` are the numbers of two whose boxes do.
    pub fn overlap_doubt(&self, parts: &[PartFile], found: Option<[usize; 2]>) -> Option<String> {
        let [a, b] = found.filter(|_| self.fill == Fill::EvenOdd)?.map(|file| parts[file].name());
        Some(format!(
            "the bounding boxes of {a} and {b} overlap: their common volume cancels out, or unites \
             with --fill solid"
        ))
    }

    /// Returns an index of the part's facets by height.
    pub fn body(&self, model: Part) -> Result<FacetIndex, SliceError> {
        FacetIndex::new(model, &self.placement(), self.units)
    }

    /// Returns the facets of surfaces of the part in its place: corners in millimeters. Colors and
    /// painted regions are known if the part was read to [keep](Reading::keep_marks) them.
    ///
    /// # Errors
    /// Returns an error if the part has no such surface, or cannot be read.
    pub fn surface(&self, model: &Part, name: SurfaceName) -> Result<Vec<[Vec3; 3]>, Error> {
        let found = model.surface(name, &self.placement(), self.units);
        found.map_err(|error| match error {
            SurfaceError::Part(error) => error.into(),
            error => Error::new(ErrorKind::Settings, error),
        })
    }

    /// Opens all files of a part.
    pub fn open(&self, parts: &[PartFile], reading: &Reading<'_>) -> Result<Part, Error> {
        if self.bodies == Bodies::Xor && self.fill == Fill::Solid {
            return Err(Error::settings(
                "--bodies xor is for --fill even-odd: solid fill unites all bodies",
            ));
        }
        let (files, joins) = self.files(parts);
        if files.iter().filter(|part| is_stream(&part.path)).count() > 1 {
            return Err(Error::settings(
                "standard input can be read only once: give - for one part",
            ));
        }
        let open = |part: &PartFile| {
            let model =
                self.open_one(&part.path, reading).map_err(|error| error.at(part.name()))?;
            let placement = part.placement.map(PartPlacement::placement);
            Ok(model.placed(&placement.unwrap_or_default()))
        };
        let opened = files.iter().map(open).collect::<Result<Vec<_>, Error>>()?;
        let joined = opened.into_iter().zip(joins).map(|(part, join)| part.with_join(join));
        let part = Part::joined(joined.collect());
        Ok(part.with_bodies(self.bodies))
    }

    fn open_one(&self, path: &Path, reading: &Reading<'_>) -> Result<Part, Error> {
        let tolerance = self.step.tolerance(reading.pitch);
        let options = OpenOptions {
            allow_gaps: reading.may_be_open,
            trust_extent: self.trust_extent,
            keep_marks: reading.keep_marks,
            mask_thickness: reading.mask.unwrap_or(USUAL_THICKNESS),
            ..self.step.reader.for_opening(tolerance)?
        };
        let model = match is_stream(path) {
            true => Part::from_stream("stdin", io::stdin().lock(), &options)?,
            false => Part::open(path, &options)?,
        };
        // After opening: only the content shows whether a file states its unit.
        if self.units != Units::default() && model.states_unit() {
            let why = "the file states its own unit: leave out --units";
            return Err(Error::settings(why));
        }
        // Crossings move onto the surfaces, but where faces meet, facets decide.
        if model.prepared().next().is_some() && tolerance.um() > reading.pitch.short_side().um() {
            reading.watcher.remark(Remark::note(format!(
                "--tolerance {tolerance} is more than a pixel: pixels may be wrong where faces \
                 meet or run along rows"
            )));
        }
        part_notes(&model).into_iter().for_each(|note| reading.watcher.remark(Remark::note(note)));
        Ok(model)
    }
}

/// Returns notes about how a part was read, for people. Every command that opens one prints them.
pub fn part_notes(part: &Part) -> Vec<String> {
    let of_file = part.notes().iter().map(ToString::to_string);
    of_file.chain(part.prepared().flat_map(notes)).collect()
}

/// The purpose that files are read for.
pub struct Reading<'a> {
    /// The resolution of the images.
    pub pitch: Pitch,
    /// Whether bodies of STEP files may have gaps.
    pub may_be_open: bool,
    /// Whether colors and painted regions of facets are kept.
    pub keep_marks: bool,
    /// The thickness of each mask of a layout; `None` is the usual.
    pub mask: Option<Length>,
    /// Takes notes about the files.
    pub watcher: &'a dyn Watcher,
}

/// Puts the name of the faulty facet's file, or of all files, before a message. `parts` are all
/// files, as [`SolidSettings::files`] numbers them.
pub fn at_part(error: Error, parts: &[PartFile]) -> Error {
    let place = match error.cause() {
        Some(
            &(SliceError::NotFinite { file, .. }
            | SliceError::WildVertex { file, .. }
            | SliceError::Changed { file, .. }),
        ) => parts[file].name(),
        _ => name_of_all(parts),
    };
    error.at(place)
}

/// Returns one name for all files of a part, for messages.
pub fn name_of_all(parts: &[PartFile]) -> String {
    match parts {
        [part] => part.name(),
        parts => format!("{} and {} more", parts[0].name(), parts.len() - 1),
    }
}
