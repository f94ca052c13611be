//! Options of the mesh around the parts.

use std::path::{Path, PathBuf};

use clap::Args;
use lamp_build::{CellShape, MeshOptions, MeshPattern, Moat};
use lamp_grayscale::{DitherMethod, dither_image};
use lamp_pipeline::words::{optional, path};
use lamp_stack::{Image, Length, StackError};
use serde::Serialize;

use crate::args::options::{one_of_described, parse_area, parse_distance, parse_thickness};
use crate::exit::Exit;
use crate::streams::{failed_at, input_name, is_stream, layers_of, open_pages};

const HEADING: &str = "Mesh around the parts";

/// Options of the mesh.
#[derive(Args, Clone, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) struct MeshArgs {
    /// Mesh around the parts, which keeps the suspension from sloshing: hexagon, square, an image
    /// that is repeated, or none
    #[arg(long, value_name = "hexagon|square|none|FILE", default_value = "hexagon")]
    #[arg(help_heading = HEADING)]
    #[serde(with = "path")]
    mesh: PathBuf,

    /// Distance between the centers of neighboring cells [default: 5mm]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEADING)]
    #[serde(with = "optional")]
    cell: Option<Length>,

    /// Thickness of the walls between cells [default: 500um]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEADING)]
    #[serde(with = "optional")]
    wall: Option<Length>,

    /// Width of the moat that stays free around each part [default: 1mm]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance, help_heading = HEADING)]
    #[serde(with = "optional")]
    clearance: Option<Length>,

    /// Shape that the moat follows [default: rising]
    #[arg(long, help_heading = HEADING, value_parser = one_of_described::<Moat>(&[
        "The part in each layer and in those below it: no mesh stands on faces that look up",
        "The part in each layer: mesh cures onto faces that look up, and in cross bores",
        "The part's outline over all layers, also below faces that look down; implies --fit",
    ]))]
    #[serde(with = "optional")]
    moat: Option<Moat>,

    /// Least area of a piece of mesh in a layer: smaller pieces are left out, and so are pieces
    /// that hang on no mesh below; 0 keeps all that hang [default: 1mm2]
    #[arg(long, value_name = "AREA", value_parser = parse_area, help_heading = HEADING)]
    #[arg(allow_hyphen_values = true)]
    #[serde(with = "optional")]
    least_piece: Option<f64>,

    /// Width of the break lines, which cut the mesh from each part up, down, left and right to the
    /// next part or the area's edge; 0 makes none [default: 500um]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance, help_heading = HEADING)]
    #[serde(with = "optional")]
    break_width: Option<Length>,

    /// Distance between the break lines of a part [default: 20mm]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEADING)]
    #[serde(with = "optional")]
    break_pitch: Option<Length>,

    /// Number of layers of mesh alone below the parts, for them to break off from [default: 5]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(..100_000))]
    #[arg(help_heading = HEADING)]
    base_layers: Option<u32>,
}

impl MeshArgs {
    /// Returns whether the mesh needs the parts' outlines.
    pub(super) fn needs_outlines(&self) -> bool {
        self.moat == Some(Moat::Outline)
    }

    /// Returns whether the mesh of a layer depends on the layers below it.
    pub(super) fn needs_layers_below(&self) -> bool {
        self.mesh != Path::new("none") && !self.needs_outlines()
    }

    /// Returns the file of the mesh's pattern, if any.
    pub(super) fn file(&self) -> Option<&PathBuf> {
        let is_shape = self.mesh.to_str().is_some_and(|name| name.parse::<CellShape>().is_ok());
        (!is_shape && self.mesh != Path::new("none")).then_some(&self.mesh)
    }

    /// Returns the place of the file of the mesh's pattern, if any.
    pub(super) fn file_mut(&mut self) -> Option<&mut PathBuf> {
        self.file().is_some().then_some(&mut self.mesh)
    }

    /// Checks that no option is without effect.
    pub(super) fn check(&self) -> Result<(), Exit> {
        let lengths = [
            ("--clearance", self.clearance),
            ("--break-width", self.break_width),
            ("--break-pitch", self.break_pitch),
        ];
        let of_cells = [("--cell", self.cell), ("--wall", self.wall)];
        let given = |options: &[(&'static str, Option<Length>)]| {
            options.iter().find(|(_, length)| length.is_some()).map(|(name, _)| *name)
        };
        let base = self.base_layers.map(|_| "--base-layers").or(self.moat.map(|_| "--moat"));
        let base = base.or(self.least_piece.map(|_| "--least-piece"));
        if self.mesh == Path::new("none")
            && let Some(option) = given(&of_cells).or(given(&lengths)).or(base)
        {
            return Err(Exit::usage(format!("{option} has no effect with --mesh none")));
        }
        match (self.file(), given(&of_cells)) {
            (Some(_), Some(option)) => Err(Exit::usage(format!(
                "{option} needs --mesh hexagon or square: an image has its own walls"
            ))),
            _ => Ok(()),
        }
    }

    /// Returns the mesh, unless it is `none`.
    pub(super) fn options(&self) -> Result<Option<MeshOptions>, Exit> {
        if self.mesh == Path::new("none") {
            return Ok(None);
        }
        let shape = self.mesh.to_str().and_then(|name| name.parse().ok());
        let plain = MeshOptions::default();
        let pattern = match (shape, plain.pattern) {
            (Some(shape), MeshPattern::Cells { cell, wall, .. }) => {
                let (cell, wall) = (self.cell.unwrap_or(cell), self.wall.unwrap_or(wall));
                MeshPattern::Cells { shape, cell, wall }
            }
            _ => template(&self.mesh)?,
        };
        Ok(Some(MeshOptions {
            pattern,
            clearance: self.clearance.unwrap_or(plain.clearance),
            moat: self.moat.unwrap_or_default(),
            least_piece_mm2: self.least_piece.unwrap_or(plain.least_piece_mm2),
            break_width: self.break_width.unwrap_or(plain.break_width),
            break_pitch: self.break_pitch.unwrap_or(plain.break_pitch),
            base_layers: self.base_layers.unwrap_or(plain.base_layers),
        }))
    }
}

/// Reads the first image of a file; a gray one becomes white where it is at least half as bright as
/// white.
fn template(path: &Path) -> Result<MeshPattern, Exit> {
    let place = input_name(path);
    if !is_stream(path) && !path.exists() {
        return Err(Exit::usage(format!(
            "--mesh {place}: there is no such image: write hexagon, square, none, or the name of \
             an image file"
        )));
    }
    let first = layers_of(open_pages(path)?, path, None).next();
    let layer = first.unwrap_or_else(|| Err(failed_at(place.clone(), StackError::NoLayers)))?;
    let image = match layer.image.into_image() {
        Image::Mask(image) => image,
        Image::Gray(gray) => dither_image(&gray, DitherMethod::Threshold, 0)
            .map_err(|error| Exit::Failed(error.into()).at(place))?,
    };
    // Without blanks, as the stack's commands are words.
    let name = path.file_name().unwrap_or_default().to_string_lossy().replace(' ', "_");
    Ok(MeshPattern::Image { name, image })
}
