//! The solid to slice: its files, units, placement and fill rule.

use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use lamp_slicer::{
    Axis, Bodies, FacetIndex, Fill, Join, OpenOptions, Part, Placement, SliceError, Units,
};
use lamp_stack::Dpi;
use serde::{Deserialize, Serialize};

use crate::exit::Exit;
use crate::options::one_of;
use crate::part_arg::{PartArg, PartPlacement, paths};
use crate::part_doubts::PartSize;
use crate::placement::PlacementOptions;
use crate::recorded::{parts, text};
use crate::step_options::{BrepOptions, notes};
use crate::streams::is_stream;

/// Options that decide the solid to slice.
#[derive(Args, Clone, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub(crate) struct PartOptions {
    /// Unit of coordinates in STL and OBJ files; STEP and 3MF files state their own
    #[arg(long, value_parser = one_of::<Units>(), default_value_t)]
    #[serde(with = "text")]
    pub(crate) units: Units,

    /// Rule for what is inside: all that shells wind around, which unites shells, bodies and files
    /// that overlap; or between odd and even crossings, where they cut each other
    #[arg(long, value_parser = one_of::<Fill>(), default_value_t)]
    #[serde(with = "text")]
    pub(crate) fill: Fill,

    /// How the bodies of a STEP file, or the items of a 3MF, join where they overlap under --fill
    /// even-odd: as one part, or as files do, which cut each other
    #[arg(long, value_parser = one_of::<Bodies>(), default_value_t)]
    #[serde(with = "text")]
    pub(crate) bodies: Bodies,

    /// Cut this file out of the part, such as a core out of its mould; may be given several times
    #[arg(long, value_name = "FILE", value_parser = PartArg::parser())]
    #[serde(with = "parts", skip_serializing_if = "Vec::is_empty")]
    subtract: Vec<PartArg>,

    /// Keep of the part only what lies in this file, too; may be given several times
    #[arg(long, value_name = "FILE", value_parser = PartArg::parser())]
    #[serde(with = "parts", skip_serializing_if = "Vec::is_empty")]
    intersect: Vec<PartArg>,

    #[command(flatten)]
    #[serde(flatten)]
    placement: PlacementOptions,

    /// Take the part as large as it seems, also if single vertices lie far outside the rest, or
    /// there are more rows than any machine exposes
    #[arg(long)]
    trust_extent: bool,

    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) brep: BrepOptions,
}

impl PartOptions {
    pub(crate) fn placement(&self) -> Placement {
        self.placement.placement()
    }

    /// Turns the part once more, before it is moved.
    pub(crate) fn turn(&mut self, axis: Axis, degrees: f64) {
        self.placement.turn(axis, degrees);
    }

    /// Returns the part's rotations with others after them, as `--rotate` takes them.
    pub(crate) fn rotation_with(&self, turns: impl Iterator<Item = (Axis, f64)>) -> String {
        self.placement.rotation_with(turns)
    }

    /// Returns the size of a part in its place.
    pub(crate) fn size(&self, model: &Part, box_mm: [[f64; 3]; 2]) -> PartSize {
        PartSize::new(box_mm, (!model.states_unit()).then_some(self.units))
    }

    /// Returns all files of a part, as they are numbered, and how each joins the others.
    pub(crate) fn files(&self, parts: &[PartArg]) -> (Vec<PartArg>, Vec<Join>) {
        let of = |parts: &[PartArg], join: Join| {
            parts.iter().map(|part| (part.clone(), join)).collect::<Vec<_>>()
        };
        let all = [
            of(parts, Join::Unite),
            of(&self.subtract, Join::Subtract),
            of(&self.intersect, Join::Intersect),
        ];
        all.into_iter().flatten().unzip()
    }

    /// Returns the files that cut the part.
    pub(crate) fn cutters(&self) -> impl Iterator<Item = &PathBuf> {
        paths(&self.subtract).chain(paths(&self.intersect))
    }

    /// Returns the files that cut the part, to be changed.
    pub(crate) fn cutters_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        self.subtract.iter_mut().chain(&mut self.intersect).map(|part| &mut part.path)
    }

    /// Returns a doubt about files that overlap: `found` are the numbers of two whose boxes do.
    pub(crate) fn overlap_doubt(
        &self,
        parts: &[PartArg],
        found: Option<[usize; 2]>,
    ) -> Option<String> {
        let [a, b] = found.filter(|_| self.fill == Fill::EvenOdd)?.map(|file| parts[file].name());
        Some(format!(
            "the bounding boxes of {a} and {b} overlap: what lies in both cancels out, or unites \
             with --fill solid"
        ))
    }

    /// Returns an index of the part's facets by height.
    pub(crate) fn body(&self, model: Part) -> Result<FacetIndex, SliceError> {
        FacetIndex::new(model, &self.placement(), self.units)
    }

    /// Opens all files of a part.
    pub(crate) fn open(&self, parts: &[PartArg], reading: &Reading<'_>) -> Result<Part, Exit> {
        if self.bodies == Bodies::Xor && self.fill == Fill::Solid {
            return Err(Exit::usage(
                "--bodies xor is for --fill even-odd: solid fill unites all bodies",
            ));
        }
        let (files, joins) = self.files(parts);
        if files.iter().filter(|part| is_stream(&part.path)).count() > 1 {
            return Err(Exit::usage("standard input can be read only once: give - for one part"));
        }
        let open = |part: &PartArg| {
            let model =
                self.open_one(&part.path, reading).map_err(|error| error.at(part.name()))?;
            let placement = part.placement.map(PartPlacement::placement);
            Ok(model.placed(&placement.unwrap_or_default()))
        };
        let opened = files.iter().map(open).collect::<Result<Vec<_>, Exit>>()?;
        let joined = opened.into_iter().zip(joins).map(|(part, join)| part.with_join(join));
        let part = Part::joined(joined.collect());
        Ok(part.with_bodies(self.bodies))
    }

    fn open_one(&self, path: &Path, reading: &Reading<'_>) -> Result<Part, Exit> {
        let tolerance = self.brep.tolerance(reading.dpi);
        let options = OpenOptions {
            allow_gaps: reading.may_be_open,
            trust_extent: self.trust_extent,
            ..self.brep.reader.for_opening(tolerance)?
        };
        let model = match is_stream(path) {
            true => Part::from_stream("stdin", io::stdin().lock(), &options)?,
            false => Part::open(path, &options)?,
        };
        if self.units != Units::default() && model.states_unit() {
            let why = "a STEP or 3MF file states its own unit: leave out --units";
            return Err(Exit::usage(why));
        }
        if model.prepared().next().is_some() && tolerance.um() > reading.dpi.pitch().um() {
            (reading.say)(&format!(
                "--tolerance {tolerance} is more than a pixel: pixels may be wrong where faces \
                 meet or run along rows"
            ));
        }
        part_notes(&model).iter().for_each(|note| (reading.say)(note));
        Ok(model)
    }
}

/// Returns notes about how a part was read, for people. Every command that opens one prints them.
pub(crate) fn part_notes(part: &Part) -> Vec<String> {
    let of_file = part.notes().iter().map(ToString::to_string);
    of_file.chain(part.prepared().flat_map(notes)).collect()
}

/// The purpose that files are read for.
pub(crate) struct Reading<'a> {
    /// The resolution of the images.
    pub(crate) dpi: Dpi,
    /// Whether bodies of STEP files may have gaps.
    pub(crate) may_be_open: bool,
    /// Takes notes about STEP files.
    pub(crate) say: &'a dyn Fn(&str),
}

/// Puts the name of the faulty facet's file, or of all files, before a message. `parts` are all
/// files, as [`PartOptions::files`] numbers them.
pub(crate) fn at_part(error: Exit, parts: &[PartArg]) -> Exit {
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
pub(crate) fn name_of_all(parts: &[PartArg]) -> String {
    match parts {
        [part] => part.name(),
        parts => format!("{} and {} more", parts[0].name(), parts.len() - 1),
    }
}
