//! How builds are laid out.

use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use lamp_build::{
    CellShape, FreeTurns, HeightOptions, LayoutFile, MeshOptions, MeshPattern, Moat, Pack, PackBy,
    TileOptions, Turns,
};
use lamp_machine::Machine;
use lamp_stack::{Length, Size};
use serde::{Deserialize, Serialize};

use crate::documents::{document, is_file, recorded_name};
use crate::error::{Error, ErrorKind};
use crate::words::{optional, optional_path, path, text, words_of};

/// How a build is laid out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct TileSettings {
    /// The machine: a built-in one or a file.
    #[serde(with = "optional_path", skip_serializing_if = "Option::is_none")]
    pub machine: Option<PathBuf>,
    /// The build area; `None` is the machine's.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub area: Option<Size>,
    /// Copies of a single stack; `None` is as many as fit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub copies: Option<u32>,
    /// Takes the counts of several stacks for shares.
    pub shares: bool,
    /// Smallest distance between copies; `None` is what the mesh needs.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub gap: Option<Length>,
    /// Smallest distance of copies to the area's edges.
    #[serde(with = "text")]
    pub edge_gap: Length,
    /// Places parts by the extent of what is white in any layer.
    pub fit: bool,
    /// Shape by which copies are kept apart.
    #[serde(with = "text")]
    pub pack: PackBy,
    /// Turns that packing may use.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub turns: Option<TileTurns>,
    /// A file that says where copies lie.
    #[serde(with = "optional_path", skip_serializing_if = "Option::is_none")]
    pub layout: Option<PathBuf>,
    /// Counts heights from each stack's first layer.
    pub settle: bool,
    /// Accepts layers that do not match.
    pub resample: bool,
    /// The mesh around the parts.
    #[serde(flatten)]
    pub mesh: MeshSettings,
}

/// The mesh around the parts. `None` is the default of [`MeshOptions`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct MeshSettings {
    /// A shape of cells, the file of an image that is repeated, or `none`.
    #[serde(with = "path")]
    pub mesh: PathBuf,
    /// Distance between the centers of neighboring cells.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub cell: Option<Length>,
    /// Thickness of the walls between cells.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub wall: Option<Length>,
    /// Width of the moat that stays free around each part.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub clearance: Option<Length>,
    /// Shape that the moat follows.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub moat: Option<Moat>,
    /// Least area of a piece of mesh in a layer, in square millimeters.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub least_piece: Option<f64>,
    /// Width of the break lines; 0 makes none.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub break_width: Option<Length>,
    /// Distance between the break lines of a part.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub break_pitch: Option<Length>,
    /// Layers of mesh alone below the parts.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub base_layers: Option<u32>,
}

/// The turns that packing may use.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TileTurns {
    /// Turns of images.
    Images(Turns),
    /// Turns that take stacks sliced at other angles, too.
    Free(FreeTurns),
}

/// As `--turns` takes it.
impl fmt::Display for TileTurns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Images(turns) => turns.fmt(f),
            Self::Free(turns) => turns.fmt(f),
        }
    }
}

impl FromStr for TileTurns {
    type Err = String;

    /// Parses `none`, `half`, `quarters`, or an angle such as `15deg`.
    fn from_str(text: &str) -> Result<Self, String> {
        if let Ok(turns) = text.parse() {
            return Ok(Self::Images(turns));
        }
        if !text.starts_with(|first: char| first.is_ascii_digit()) {
            return Err("write none, half, quarters or an angle, such as 15deg".to_owned());
        }
        let free: FreeTurns = text.parse().map_err(|wrong| format!("{wrong}"))?;
        let is_right = free.degrees().is_empty();
        Ok(if is_right { Self::Images(Turns::Quarters) } else { Self::Free(free) })
    }
}

impl Default for TileSettings {
    fn default() -> Self {
        Self {
            machine: None,
            area: None,
            copies: None,
            shares: false,
            gap: None,
            edge_gap: Length::from_um(0.0),
            fit: false,
            pack: PackBy::default(),
            turns: None,
            layout: None,
            settle: false,
            resample: false,
            mesh: MeshSettings::default(),
        }
    }
}

impl Default for MeshSettings {
    fn default() -> Self {
        Self {
            mesh: "hexagon".into(),
            cell: None,
            wall: None,
            clearance: None,
            moat: None,
            least_piece: None,
            break_width: None,
            break_pitch: None,
            base_layers: None,
        }
    }
}

impl TileSettings {
    /// Returns the settings as one text, the same for all that mean the same; files go without their
    /// folders.
    pub fn canonical(&self) -> String {
        let mut settings = self.clone();
        if let Some(machine) = &mut settings.machine {
            *machine = recorded_name::<Machine>(machine).into();
        }
        for file in settings.files_mut() {
            *file = file.file_name().unwrap_or_default().into();
        }
        format!("tile{}", words_of(&settings))
    }

    /// Returns the files that settings name, to be changed.
    pub fn files_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let machine = self.machine.iter_mut().filter(|path| is_file::<Machine>(path));
        machine.chain(&mut self.layout).chain(self.mesh.file_mut())
    }

    /// Reads the machine, if there is one.
    ///
    /// # Errors
    /// Returns an error if its file cannot be read, or its area is smaller than is asked for.
    pub fn machine(&self) -> Result<Option<Machine>, Error> {
        let machine: Option<Machine> = self.machine.as_deref().map(document).transpose()?;
        if let Some((machine, area)) = machine.as_ref().zip(self.area) {
            let is_in = machine.check_area(area);
            is_in.map_err(|error| Error::new(ErrorKind::Settings, error))?;
        }
        Ok(machine)
    }

    /// Returns the build area, given the machine and a file of positions.
    pub fn area_of(&self, file: Option<&LayoutFile>, machine: Option<&Machine>) -> Size {
        let machine_area = machine.map(|machine| machine.area.value);
        let file_area = file.and_then(LayoutFile::area);
        self.area.or(machine_area).or(file_area).unwrap_or(TileOptions::default().area)
    }

    /// Returns the least distance between copies that are packed.
    pub fn gap_of(&self, mesh: Option<&MeshOptions>) -> Length {
        self.gap.or(mesh.map(MeshOptions::gap)).unwrap_or(TileOptions::default().gap)
    }

    /// Returns how copies are packed.
    pub fn packing(&self) -> Pack {
        let usual = match self.pack {
            PackBy::Boxes => Turns::None,
            PackBy::Outlines => Turns::Quarters,
        };
        let turns = match self.turns {
            Some(TileTurns::Images(turns)) => turns,
            Some(TileTurns::Free(_)) => Turns::Quarters,
            None => usual,
        };
        Pack { by: self.pack, turns, edge_gap: self.edge_gap, shares: self.shares }
    }

    /// Returns the turns that take stacks sliced at other angles, if any.
    pub fn free_turns(&self) -> Option<FreeTurns> {
        match self.turns? {
            TileTurns::Free(turns) => Some(turns),
            TileTurns::Images(_) => None,
        }
    }

    /// Returns how layers are matched by their heights.
    pub fn heights(&self) -> HeightOptions {
        HeightOptions { settle: self.settle, resample: self.resample }
    }

    /// Returns whether the outlines of parts are needed, so that stacks are read twice.
    pub fn needs_outlines(&self) -> bool {
        self.fit || self.pack == PackBy::Outlines || self.mesh.needs_outlines()
    }
}

impl MeshSettings {
    /// Returns whether the mesh needs the parts' outlines.
    pub fn needs_outlines(&self) -> bool {
        self.moat == Some(Moat::Outline)
    }

    /// Returns whether the mesh of a layer depends on the layers below it.
    pub fn needs_layers_below(&self) -> bool {
        self.mesh != Path::new("none") && !self.needs_outlines()
    }

    /// Returns the file of the mesh's pattern, if any.
    pub fn file(&self) -> Option<&PathBuf> {
        let is_shape = self.mesh.to_str().is_some_and(|name| name.parse::<CellShape>().is_ok());
        (!is_shape && self.mesh != Path::new("none")).then_some(&self.mesh)
    }

    /// Returns the place of the file of the mesh's pattern, if any.
    pub fn file_mut(&mut self) -> Option<&mut PathBuf> {
        self.file().is_some().then_some(&mut self.mesh)
    }

    /// Checks that no option is without effect.
    ///
    /// # Errors
    /// Returns a sentence about the first option that has none.
    pub fn check(&self) -> Result<(), Error> {
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
            return Err(Error::settings(format!("{option} has no effect with --mesh none")));
        }
        match (self.file(), given(&of_cells)) {
            (Some(_), Some(option)) => Err(Error::settings(format!(
                "{option} needs --mesh hexagon or square: an image has its own walls"
            ))),
            _ => Ok(()),
        }
    }

    /// Returns the mesh, unless it is `none`. `image` reads the image that is repeated.
    ///
    /// # Errors
    /// Returns the error of `image`.
    pub fn options<E>(
        &self,
        image: impl FnOnce(&Path) -> Result<MeshPattern, E>,
    ) -> Result<Option<MeshOptions>, E> {
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
            _ => image(&self.mesh)?,
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
