//! Bridges layers whose sections have gaps: cuts them again next to their planes, or takes them
//! from another file of the same part.

use std::ops::Range;
use std::path::Path;

use lamp_slicing::{GridRule, Part, SliceError, SliceOptions, Slices};
use lamp_stack::{Image, Layer, Length, PageInfo, SliceRecord};

use crate::documents::{check_word, input_name, without_digest, word_of};
use crate::error::Error;
use crate::ranges::ranges;
use crate::slice_settings::SliceSettings;
use crate::solid::part_notes;
use crate::watcher::{Remark, Watcher};

/// Distances by which planes are moved, in micrometers, the nearest first.
///
/// Moved by d, a plane shows the part's own section d higher. On a slope that is off by d times its
/// cotangent, which is d / t of the step that a layer of thickness t makes there anyway. A flat
/// face between both heights would show as other contours, which `has_same_contours` refuses. Gaps
/// higher than 20 um are not bridged so: the fallback replaces these layers.
const NUDGES_UM: [f64; 8] = [1.0, -1.0, 2.5, -2.5, 5.0, -5.0, 10.0, -10.0];
/// The greatest distance of two boxes of the same part, as a share of its size.
const SAME_BOX: f64 = 1e-3;
/// Where contours turn, fewer consecutive rows than this may have more or fewer
/// transitions in an STL than on the surfaces it was made of.
const TURNING_ROWS: usize = 4;

/// A part's layers, with gaps bridged if there is a fallback.
pub(crate) struct Bridged {
    pub(crate) slices: Slices,
    fallback: Option<Fallback>,
}

struct Fallback {
    name: String,
    /// The word that stacks record for it.
    word: String,
    slices: Slices,
    /// The layers cut next to their planes, and the layers taken from the fallback.
    nudged: Vec<u32>,
    borrowed: Vec<u32>,
}

impl Bridged {
    /// `fallback` is an STL of the same part, in millimeters.
    pub(crate) fn new(
        slices: Slices,
        fallback: Option<&Path>,
        options: &SliceSettings,
        layers: Option<Range<u32>>,
        watcher: &dyn Watcher,
    ) -> Result<Self, Error> {
        let open = |path: &Path| {
            let name = input_name(&without_digest(path).0);
            let opened = Fallback::open(path, &slices, options, layers, watcher);
            opened.map_err(|error| error.at(name.clone()))
        };
        let fallback = fallback.map(open).transpose()?;
        Ok(Self { slices, fallback })
    }

    /// Returns the word that stacks record for the fallback, if there is one.
    pub(crate) fn word(&self) -> Option<String> {
        self.fallback.as_ref().map(|fallback| fallback.word.clone())
    }

    /// Returns a line about the bridged layers, if there are any.
    pub(crate) fn text(&self) -> Option<String> {
        let Fallback { name, nudged, borrowed, .. } = self.fallback.as_ref()?;
        let counted = |layers: &[u32]| match layers.len() {
            1 => "1 layer with gaps".to_owned(),
            count => format!("{count} layers with gaps"),
        };
        let part = |what: &str, layers: &[u32]| {
            (!layers.is_empty()).then(|| format!("{} {what}: {}", counted(layers), ranges(layers)))
        };
        let parts = [
            part("cut up to 10um next to their planes", nudged),
            part(&format!("taken from {name}"), borrowed),
        ];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        (!parts.is_empty()).then(|| parts.join("; "))
    }
}

impl Iterator for Bridged {
    type Item = Result<Layer, SliceError>;

    fn next(&mut self) -> Option<Self::Item> {
        let layer = self.slices.next()?;
        match (layer, &mut self.fallback) {
            (Ok(layer), Some(fallback)) => Some(fallback.better(layer, &self.slices)),
            (layer, _) => Some(layer),
        }
    }
}

impl Fallback {
    fn open(
        path: &Path,
        slices: &Slices,
        options: &SliceSettings,
        layers: Option<Range<u32>>,
        watcher: &dyn Watcher,
    ) -> Result<Self, Error> {
        let grid = slices.grid();
        let step = &options.solid.step;
        let opening = step.reader.for_opening(step.tolerance(options.pitch))?;
        let options = SliceOptions {
            // Both must cut the same planes on the same pixels, so that a layer can replace the
            // other's.
            heights: Some(slices.layer_heights()),
            shading: slices.shading(),
            grid: GridRule::At { origin_mm: grid.origin_mm, pixels: [grid.width, grid.height] },
            layers,
            fill: options.solid.fill,
            ..options.for_slicing()
        };
        let other = |what: String| {
            Error::work(format!("it is not the same part as the STEP file: its box {what}"))
        };
        let (file, _) = without_digest(path);
        let part = Part::open(&file, &opening)?;
        let word = word_of(&file, part.digest());
        check_word(path, &word)?;
        let name = input_name(&file);
        let note = |note| watcher.remark(Remark::note(format!("{name}: {note}")));
        part_notes(&part).into_iter().for_each(note);
        let fallback = Slices::new(part, &options).map_err(|error| match error {
            // The frame is the STEP part's own, so a file that leaves it is another part.
            SliceError::OutsideFrame { .. } => other("is larger".to_owned()),
            error => Error::from(error),
        })?;
        let ([low, high], others) = (slices.box_mm(), fallback.box_mm());
        let size = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        let apart = |k: usize| (others[0][k] - low[k]).abs().max((others[1][k] - high[k]).abs());
        let apart_mm = (0..3).map(apart).fold(0.0, f64::max);
        if apart_mm > SAME_BOX * size {
            return Err(other(format!("is {apart_mm:.3} mm off")));
        }
        let (nudged, borrowed) = (Vec::new(), Vec::new());
        Ok(Self { name, word, slices: fallback, nudged, borrowed })
    }

    /// Returns the layer, or a replacement if it has gaps or lacks contours.
    fn better(&mut self, layer: Layer, slices: &Slices) -> Result<Layer, SliceError> {
        // In lockstep with the part's layers, also where nothing is wrong: slices come only in
        // order.
        let Some(other) = self.slices.next().transpose()? else { return Ok(layer) };
        let number = layer.info.index;
        let is_good = |layer: &Layer| is_whole(layer) && has_same_contours(layer, &other);
        if is_good(&layer) {
            return Ok(layer);
        }
        // The stack's record stays with the first page, whichever file its image is from.
        let stack = layer.info.stack.clone();
        // A face that is missing is also missing next to the plane: if all rows balance, only the
        // fallback helps.
        for by_um in NUDGES_UM.into_iter().filter(|_| !is_whole(&layer)) {
            let again = slices.cut_again(number, Length::from_um(by_um))?;
            if is_good(&again) {
                self.nudged.push(number);
                return Ok(Layer { info: PageInfo { stack, ..again.info }, ..again });
            }
        }
        self.borrowed.push(number);
        let mut layer = Layer { info: PageInfo { stack, ..other.info }, ..other };
        layer.info.set_slice_record(SliceRecord { is_fallback: true, ..SliceRecord::default() });
        Ok(layer)
    }
}

/// Returns whether all contours close, and all rows balance.
fn is_whole(layer: &Layer) -> bool {
    layer.info.closed == Some(true) && layer.info.stray_rows.is_empty()
}

/// Returns whether rows have as many transitions in both, except where contours turn. A missing
/// face leaves no gap in a section: its whole contour is missing.
fn has_same_contours(a: &Layer, b: &Layer) -> bool {
    let [a, b] = [a, b].map(|layer| transitions(&layer.image));
    let rows: Vec<bool> = a.iter().zip(&b).map(|(a, b)| a != b).collect();
    a.len() == b.len()
        && rows.chunk_by(|a, b| a == b).all(|run| !run[0] || run.len() < TURNING_ROWS)
}

/// Returns the number of turns of each row from black to some level, or back.
fn transitions(image: &Image) -> Vec<usize> {
    match image {
        Image::Mask(mask) => (0..mask.height()).map(|row| mask.row(row).len()).collect(),
        Image::Gray(gray) => {
            let of_row = |changes: &[lamp_stack::LevelChange]| {
                let mut was_black = true;
                let turns = changes.iter().filter(|change| {
                    let is_black = change.level == 0;
                    std::mem::replace(&mut was_black, is_black) != is_black
                });
                turns.count()
            };
            gray.rows().map(of_row).collect()
        }
    }
}
