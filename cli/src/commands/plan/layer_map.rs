//! Maps the doses of a layer, by white light and as planned.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use clap::Args;
use lamp_grayscale::resin::ExposureTime;
use lamp_planning::{LayerTime, Light, RegionDoses};
use lamp_stack::{Layer, Length, format_significant};

use crate::exit::Exit;
use lamp_plots::PictureRegion;
use lamp_plots::{DoseMap, dose_map};

/// The options of a map.
#[derive(Args, Clone)]
pub(super) struct MapOptions {
    /// Draw the doses of a layer, voxel by voxel, under white light and as planned: a file that
    /// ends in .svg or .png
    #[arg(long, value_name = "FILE", requires = "map_layer")]
    pub(super) map: Option<PathBuf>,

    /// Layer to map
    #[arg(long, value_name = "N", requires = "map")]
    map_layer: Option<u32>,

    /// Pixels to map: left column, top row, width, height [default: all]
    #[arg(long, value_name = "X,Y,W,H", requires = "map")]
    map_region: Option<PictureRegion>,
}

/// The widest and highest map, in voxels.
const MOST: usize = 200;

/// A map that is being made.
pub(super) struct LayerMap<'a> {
    options: &'a MapOptions,
    light: Light,
    wanted_from: u8,
    begun: Option<Begun>,
}

struct Begun {
    title: String,
    width: usize,
    corner: [u32; 2],
    wanted: Vec<bool>,
    before: RegionDoses,
    after: RegionDoses,
}

impl<'a> LayerMap<'a> {
    pub(super) fn new(options: &'a MapOptions, light: Light, wanted_from: u8) -> Self {
        Self { options, light, wanted_from, begun: None }
    }

    /// Looks at a layer of the part. They come from the bottom up.
    pub(super) fn before(&mut self, layer: &Layer) -> Result<(), Exit> {
        let Some((number, exposed)) = self.options.map_layer.zip(time_of(layer)) else {
            return Ok(());
        };
        // Light goes down: layers below the mapped one add nothing to its doses.
        if layer.info.index == number {
            self.begun = self.begin(layer)?;
        }
        let from = self.wanted_from;
        if let Some(begun) = &mut self.begun {
            let white = |level| f64::from(u8::from(level >= from));
            begun.before.expose(&layer.image, exposed, white);
        }
        Ok(())
    }

    fn begin(&self, layer: &Layer) -> Result<Option<Begun>, Exit> {
        // Plans refuse other pages themselves.
        let Some(pitch) = layer.pitch else { return Ok(None) };
        self.light.check_spread(pitch)?;
        let (image, name) = (&layer.image, layer.info.name());
        let all = PictureRegion::of(image);
        let region = self.options.map_region.as_ref().unwrap_or(&all).on(image);
        let Some(PictureRegion { columns, rows }) = region else {
            return Err(Exit::usage(format!("--map-region lies outside the image of {name}")));
        };
        if columns.len().max(rows.len()) > MOST {
            let (width, height) = (columns.len(), rows.len());
            return Err(Exit::usage(format!(
                "{width} x {height} voxels are too many to draw: give a --map-region of at most \
                 {MOST} x {MOST}"
            )));
        }
        let wanted = rows.clone().flat_map(|row| {
            let runs: Vec<_> =
                image.runs(row).filter(|(_, _, level)| *level >= self.wanted_from).collect();
            let is_wanted = move |column| runs.iter().any(|run| (run.0..run.1).contains(&column));
            columns.clone().map(is_wanted)
        });
        let wanted = wanted.collect();
        let doses = || RegionDoses::new(self.light, pitch, columns.clone(), rows.clone());
        let corner = [columns.start, rows.start];
        let [wide, high] = pitch.mm().map(|mm| format_significant(1000.0 * mm, 5));
        let title = format!("Doses of {name} in mJ/cm2, voxels of {wide} x {high} µm");
        let (before, after) = (doses(), doses());
        Ok(Some(Begun { title, width: columns.len(), corner, wanted, before, after }))
    }

    /// Checks, once all layers were looked at, that the layer was there.
    pub(super) fn check(&self) -> Result<(), Exit> {
        match (&self.begun, self.options.map_layer) {
            (None, Some(layer)) => Err(Exit::Failed(anyhow!("there is no layer {layer} to map"))),
            _ => Ok(()),
        }
    }

    /// Looks at a layer as planned. They come from the bottom up.
    pub(super) fn after(&mut self, layer: &Layer) {
        let light = self.light;
        let from = self.options.map_layer.unwrap_or(u32::MAX);
        if let Some((begun, exposed)) = self.begun.as_mut().zip(time_of(layer))
            && layer.info.index >= from
        {
            begun.after.expose(&layer.image, exposed, |level| light.of_level(level));
        }
    }

    /// Draws the map. Returns its file and bytes, if it was asked for.
    pub(super) fn drawn(self) -> Result<Option<(&'a Path, Vec<u8>)>, Exit> {
        let Some((path, begun)) = self.options.map.as_deref().zip(self.begun) else {
            return Ok(None);
        };
        let map = DoseMap {
            title: begun.title,
            critical_mj: self.light.critical_dose.mj_per_cm2(),
            width: begun.width,
            corner: begun.corner,
            wanted: begun.wanted,
            cases: [
                ("by white light", begun.before.doses().to_vec()),
                ("as planned", begun.after.doses().to_vec()),
            ],
        };
        Ok(Some((path, dose_map(&map, path)?)))
    }
}

fn time_of(layer: &Layer) -> Option<LayerTime> {
    let thickness = Length::from_um(layer.info.thickness_um?);
    Some(LayerTime { thickness, time: ExposureTime::from_ms(layer.info.exposure_ms?) })
}
