//! Layers whose sections have gaps, bridged: cut again beside their planes, or taken
//! from an STL of the same part.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use lamp_slicer::{Frame, Model, SliceError, SliceOptions, Slices};
use lamp_stack::Layer;

use crate::part::PartOptions;
use crate::stop::Stop;
use crate::streams::input_name;

/// How far planes are moved, in micrometres: no one sees it in a part.
const NUDGES_UM: [f64; 8] = [1.0, -1.0, 2.5, -2.5, 5.0, -5.0, 10.0, -10.0];
/// How far boxes of the same part may be apart, in parts of its size.
const SAME_BOX: f64 = 1e-3;

/// A part's layers, those with gaps bridged where there is a fallback.
pub(crate) struct Bridged {
    pub(crate) slices: Slices,
    fallback: Option<Fallback>,
}

struct Fallback {
    name: String,
    slices: Slices,
    /// The layers cut beside their planes, and those taken from here.
    nudged: Vec<u32>,
    borrowed: Vec<u32>,
}

impl Bridged {
    /// `fallback` is an STL of the same part, in millimetres.
    pub(crate) fn new(
        slices: Slices,
        fallback: Option<&PathBuf>,
        options: &PartOptions,
    ) -> Result<Self, Stop> {
        let open = |path: &PathBuf| {
            Fallback::open(path, &slices, options).map_err(|stop| stop.at(input_name(path)))
        };
        let fallback = fallback.map(open).transpose()?;
        Ok(Self { slices, fallback })
    }

    /// What was bridged, in a line, if anything was.
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
            part("cut up to 10um beside their planes", nudged),
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
            (Ok(layer), Some(fallback)) if !is_whole(&layer) => {
                Some(fallback.instead(layer, &self.slices))
            }
            (layer, _) => Some(layer),
        }
    }
}

impl Fallback {
    fn open(path: &Path, slices: &Slices, options: &PartOptions) -> Result<Self, Stop> {
        let grid = slices.grid();
        let options = SliceOptions {
            heights: Some(slices.layer_heights()),
            gray: slices.levels().cloned(),
            frame: Frame::At { origin_mm: grid.origin_mm, pixels: [grid.width, grid.height] },
            ..options.for_slicing()
        };
        let fallback = Slices::new(Model::open(path)?, &options)?;
        let ([low, high], others) = (slices.box_mm(), fallback.box_mm());
        let size = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        let apart = |k: usize| (others[0][k] - low[k]).abs().max((others[1][k] - high[k]).abs());
        let apart_mm = (0..3).map(apart).fold(0.0, f64::max);
        if apart_mm > SAME_BOX * size {
            return Err(Stop::Failed(anyhow!(
                "it is not the same part: its box is {apart_mm:.3} mm off that of the STEP file"
            )));
        }
        let (nudged, borrowed) = (Vec::new(), Vec::new());
        Ok(Self { name: input_name(path), slices: fallback, nudged, borrowed })
    }

    /// Another image for a layer with gaps.
    fn instead(&mut self, layer: Layer, slices: &Slices) -> Result<Layer, SliceError> {
        let number = layer.info.index;
        for by_um in NUDGES_UM {
            let again = slices.cut_again(number, by_um)?;
            if is_whole(&again) {
                self.nudged.push(number);
                return Ok(Layer {
                    info: lamp_stack::PageInfo { stack: layer.info.stack, ..again.info },
                    ..again
                });
            }
        }
        self.borrowed.push(number);
        let other = self.slices.cut_again(number, 0.0)?;
        Ok(Layer { info: lamp_stack::PageInfo { stack: layer.info.stack, ..other.info }, ..other })
    }
}

/// Whether all contours close, and all rows balance.
fn is_whole(layer: &Layer) -> bool {
    layer.info.closed == Some(true) && layer.info.stray_rows.is_empty()
}

/// Numbers in order, those that follow each other as ranges.
fn ranges(numbers: &[u32]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b);
    let text = |run: &[u32]| match run {
        [one] => one.to_string(),
        [first, .., last] => format!("{first} to {last}"),
        [] => String::new(),
    };
    runs.map(text).collect::<Vec<_>>().join(", ")
}
