//! Chooses gray levels down columns of pixels, for doses that add up.
//!
//! Let `b` be the underside below a pixel of a layer. The light of the layers above leaves a share
//! of the critical dose at `b`; the layer gets the level that supplies the rest, at most white, and
//! at least the least level above black, so that outlines stay. From the top down, this removes the
//! least light from white layers that leaves the underside in place: light from low layers weighs
//! most there, so these are darkened first, and one layer of a column is in between. Every point of
//! the part above `b` has more than its dose at `b`, or is cured by its own white layer, so it
//! cures.
//!
//! Where the layers above are white up to the part's top, or as far up as light comes from, the
//! level follows from the depth alone. Depths are known within a layer; further down, the layers
//! below have them. The undersides below a row's pixels are carried up from layer to layer
//! ([`below`](super::below)), and the columns where all layers above are part are carried down
//! ([`solid`](super::solid)). Only elsewhere, near faces that look up, the layers above are
//! examined; for most pixels, they are the layers that the layer above saw
//! ([`above`](super::above)).

use std::collections::VecDeque;
use std::ops::Range;

use lamp_stack::Image;
use rayon::prelude::*;

use super::band::{Around, BandChooser};
use super::below::{Below, push_below};
use super::print_through::PrintThrough;
use super::row_lists::RowLists;
use super::rows::{DepthRows, finished};

/// Rows that one thread takes at a time, through all layers.
pub(super) const BAND_ROWS: u32 = 64;

/// A layer whose levels are chosen.
pub(crate) struct ChosenLayer {
    pub(crate) image: Image,
    /// The pixels that even white does not cure down to the underside within the layer.
    pub(crate) short_px: u64,
}

/// The depths of consecutive layers, and the layers that contain the undersides below their pixels.
#[derive(Debug)]
pub(crate) struct Columns {
    /// The number of the first layer.
    first: usize,
    depths: VecDeque<DepthRows>,
    /// The undersides of each layer, by bands of rows.
    below: Vec<VecDeque<RowLists<Below>>>,
}

impl Columns {
    /// Starts with the number of the lowest layer.
    pub(crate) fn new(first: usize) -> Self {
        Self { first, depths: VecDeque::new(), below: Vec::new() }
    }

    /// Returns the first layer whose depths are not known yet.
    pub(crate) fn end(&self) -> usize {
        self.first + self.depths.len()
    }

    /// Adds the depths of the next layers above.
    pub(crate) fn extend(&mut self, light: &PrintThrough, depths: Vec<DepthRows>) {
        let (first, known) = (self.first, self.depths.len());
        self.depths.extend(depths);
        let Some(lowest) = self.depths.front() else { return };
        self.below.resize_with(lowest.height().div_ceil(BAND_ROWS) as usize, VecDeque::new);
        let depths = &self.depths;
        // A layer needs the one below it, but no other band.
        self.below.par_iter_mut().enumerate().for_each(|(band, of_layers)| {
            for (k, rows) in depths.iter().enumerate().skip(known) {
                let layer_below = k.checked_sub(1).map(|below| &of_layers[below]);
                let mut lists = layer_below.map_or_else(RowLists::default, RowLists::like);
                for (in_band, row) in (0..).zip(band_rows(band, rows)) {
                    let row_below = layer_below.map(|lists| lists.row(in_band));
                    push_below(light, first + k, rows, row, row_below, lists.items_mut());
                    lists.end_row();
                }
                of_layers.push_back(lists);
            }
        });
    }

    /// Forgets the layers below one.
    pub(crate) fn forget_below(&mut self, layer: usize) {
        let done = layer - self.first;
        self.depths.drain(..done);
        self.below.iter_mut().for_each(|of_layers| drop(of_layers.drain(..done)));
        self.first = layer;
    }

    /// Chooses the levels of some layers, given all layers below and above that count.
    pub(crate) fn choose(&self, light: &PrintThrough, layers: Range<usize>) -> Vec<ChosenLayer> {
        // A layer that is cut again has none above it here.
        let around = |layer| Around::new(light, layer, light.end_above(layer).min(self.end()));
        let around: Vec<Around<'_>> = layers.clone().map(around).collect();
        let chooser = || BandChooser::new(self, light);
        let bands = (0..self.below.len()).into_par_iter();
        let bands: Vec<_> =
            // A chooser keeps the memory of its lists from band to band.
            bands.map_init(chooser, |chooser, band| chooser.choose(band, &around)).collect();
        let whole = |k: usize| {
            let of_bands = bands.iter().map(|band| &band[k]);
            let rows = RowLists::joined(of_bands.clone().map(|(rows, _)| rows));
            let short_px = of_bands.map(|(_, short_px)| short_px).sum();
            ChosenLayer { image: finished(self.rows(layers.start).width(), rows), short_px }
        };
        (0..layers.len()).into_par_iter().map(whole).collect()
    }

    /// Returns the depths of a layer.
    pub(super) fn rows(&self, layer: usize) -> &DepthRows {
        &self.depths[layer - self.first]
    }

    /// Returns the undersides below a row of a band.
    pub(super) fn below(&self, layer: usize, band: usize, in_band: u32) -> &[Below] {
        self.below[band][layer - self.first].row(in_band)
    }
}

/// Returns the rows of a band.
pub(super) fn band_rows(band: usize, rows: &DepthRows) -> Range<u32> {
    let start = band as u32 * BAND_ROWS;
    start..rows.height().min(start + BAND_ROWS)
}
