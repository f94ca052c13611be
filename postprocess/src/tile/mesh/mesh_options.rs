//! What a mesh is to be.

use lamp_stack::{Dpi, Length, MAX_RUNS, Mask};

use super::super::{PixelSize, TileError};
use super::lattice::{Cells, Lattice};

/// Mesh between two copies is so wide at least, unless it is asked for less.
const MIN_MESH_WIDTH: Length = Length::from_um(2000.0);
/// Smaller cells have no holes worth the name.
const MIN_CELL_PIXELS: f64 = 4.0;

/// The mesh of a build. The seed gives no numbers: the defaults are ours.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshOptions {
    /// Its walls.
    pub pattern: MeshPattern,
    /// How far from a part the mesh begins.
    pub clearance: Length,
    /// What it keeps away from.
    pub moat: Moat,
    /// How wide break lines are; there are none where this is zero.
    pub break_width: Length,
    /// How far apart those of one part are.
    pub break_pitch: Length,
    /// How many layers of mesh alone there are below the parts.
    pub base_layers: u32,
}

/// What a mesh keeps away from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Moat {
    /// Each layer of the part: the mesh follows it, stands on its faces that look up,
    /// carries those that look down, and enters bores that lie across.
    #[default]
    Layer,
    /// What is white in any layer, so that no mesh is above, below or in the part.
    Outline,
}

lamp_stack::named!(Moat { Layer = "layer", Outline = "outline" });

/// The walls of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub enum MeshPattern {
    /// Cells of one shape.
    Cells {
        /// Their shape.
        shape: CellShape,
        /// From the middle of a cell to that of the next.
        cell: Length,
        /// The thickness of the walls between them.
        wall: Length,
    },
    /// An image that is repeated over the area.
    Image {
        /// What the build's first page calls it.
        name: String,
        /// White is cured.
        image: Mask,
    },
}

/// The shape of a mesh's cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellShape {
    /// Hexagons with a corner up, and a wall at the left and at the right.
    Hexagon,
    /// Squares.
    Square,
}

lamp_stack::named!(CellShape { Hexagon = "hexagon", Square = "square" });

impl Default for MeshOptions {
    /// Hexagons of 5 mm with walls of 0.5 mm, 1 mm from the parts; break lines of
    /// 0.5 mm, 20 mm apart; five layers of mesh alone.
    fn default() -> Self {
        let [cell, wall] = [5.0, 0.5].map(Length::from_mm);
        Self {
            pattern: MeshPattern::Cells { shape: CellShape::Hexagon, cell, wall },
            clearance: Length::from_mm(1.0),
            moat: Moat::default(),
            break_width: Length::from_mm(0.5),
            break_pitch: Length::from_mm(20.0),
            base_layers: 5,
        }
    }
}

impl MeshOptions {
    /// How far apart copies are unless another gap is given: a moat around each, and
    /// 2 mm of mesh between.
    pub fn gap(&self) -> Length {
        Length::from_um(2.0 * self.clearance.um() + MIN_MESH_WIDTH.um())
    }

    /// The options of the command that makes this mesh.
    pub(super) fn command(&self) -> String {
        let moat = match self.moat {
            Moat::Layer => String::new(),
            moat => format!(" --moat {moat}"),
        };
        let Self { clearance, break_width, break_pitch, base_layers, .. } = self;
        let pattern = match &self.pattern {
            MeshPattern::Cells { shape, cell, wall } => {
                format!("{shape} --cell {cell} --wall {wall}")
            }
            MeshPattern::Image { name, .. } => name.clone(),
        };
        format!(
            " --mesh {pattern} --clearance {clearance}{moat} --break-width {break_width} \
             --break-pitch {break_pitch} --base-layers {base_layers}"
        )
    }

    pub(super) fn lattice(&self, dpi: Dpi, build: PixelSize) -> Result<Lattice, TileError> {
        let runs_of_row = match &self.pattern {
            MeshPattern::Cells { cell, wall, .. } => {
                if cell.pixels(dpi) < MIN_CELL_PIXELS || wall >= cell || wall.um() <= 0.0 {
                    return Err(TileError::NoCells { cell: *cell, wall: *wall });
                }
                2.0 * f64::from(build.width) / cell.pixels(dpi)
            }
            MeshPattern::Image { name, image } => {
                if image.width() == 0 || image.height() == 0 {
                    return Err(TileError::NoTemplate { name: name.clone() });
                }
                // Where a row ends white and the next copy begins so, nothing changes.
                let changes = |row: &[u32]| match row {
                    [0, ..] if row.len() % 2 == 1 => row.len() - 1,
                    row => row.len() + row.len() % 2,
                };
                let rows = image.rows().map(changes).max().unwrap_or(0);
                rows as f64 * f64::from(build.width) / f64::from(image.width())
            }
        };
        if runs_of_row * f64::from(build.height) > MAX_RUNS as f64 / 2.0 {
            return Err(TileError::FineMesh);
        }
        Ok(match &self.pattern {
            MeshPattern::Cells { shape, cell, wall } => {
                let [cell, wall] = [cell, wall].map(|length| length.pixels(dpi));
                Lattice::Cells(match shape {
                    CellShape::Hexagon => Cells::hexagon(cell, wall),
                    CellShape::Square => Cells::square(cell, wall),
                })
            }
            MeshPattern::Image { image, .. } => Lattice::Image(image.clone()),
        })
    }
}
