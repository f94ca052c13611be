//! Options of a mesh, and the walls that they ask for.

use lamp_stack::{Length, MAX_RUNS, Mask, Pitch, quoted};

use super::super::{PixelSize, TileError};
use super::lattice::{Lattice, LatticeCells};

/// The least width of mesh between two copies, unless a smaller gap is given.
const MIN_MESH_WIDTH: Length = Length::from_um(2000.0);
/// Smaller cells have no holes worth the name.
const MIN_CELL_PIXELS: f64 = 4.0;

/// The mesh of a build.
///
/// 002 gives no measures for meshes: the defaults are ours.
///
/// ```
/// use lamp_build::{CellShape, MeshOptions, MeshPattern};
/// use lamp_stack::Length;
///
/// let options = MeshOptions {
///     pattern: MeshPattern::Cells {
///         shape: CellShape::Square,
///         cell: Length::from_mm(4.0),
///         wall: Length::from_mm(0.4),
///     },
///     ..MeshOptions::default()
/// };
/// // Two moats of 1 mm, and 2 mm of mesh between them.
/// assert_eq!(options.gap(), Length::from_mm(4.0));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct MeshOptions {
    /// The walls.
    pub pattern: MeshPattern,
    /// The distance between a part and the mesh.
    pub clearance: Length,
    /// The pixels that moats follow.
    pub moat: Moat,
    /// The least area of a piece of mesh in a layer, in square millimeters. Smaller pieces are left
    /// out, and so is mesh that would hang on them alone.
    pub least_piece_mm2: f64,
    /// The width of break lines; zero makes none.
    pub break_width: Length,
    /// The distance between the break lines of a part.
    pub break_pitch: Length,
    /// The number of layers of mesh alone below the parts.
    pub base_layers: u32,
}

/// The pixels that moats follow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Moat {
    /// The pixels that are white in a layer of the part or in one below it. No mesh stands on faces
    /// that look up; it carries faces that look down.
    #[default]
    Rising,
    /// Each layer of the part. Mesh stands on faces that look up, carries faces that look down, and
    /// enters bores that are open to the side.
    Layer,
    /// The part's outline in all layers. No mesh is above, below or in the part.
    Outline,
}

lamp_stack::named!(Moat { Rising = "rising", Layer = "layer", Outline = "outline" });

/// The walls of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub enum MeshPattern {
    /// Cells of one shape.
    Cells {
        /// Their shape.
        shape: CellShape,
        /// The distance between the centers of neighboring cells.
        cell: Length,
        /// The thickness of the walls between them.
        wall: Length,
    },
    /// An image that is repeated over the area.
    Image {
        /// Its name on the build's first page.
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
    /// Returns hexagons of 5 mm with walls of 0.5 mm, 1 mm from the parts; break lines
    /// of 0.5 mm, 20 mm apart; pieces of 1 mm2 and more; five base layers.
    fn default() -> Self {
        let [cell, wall] = [5.0, 0.5].map(Length::from_mm);
        Self {
            pattern: MeshPattern::Cells { shape: CellShape::Hexagon, cell, wall },
            clearance: Length::from_mm(1.0),
            moat: Moat::default(),
            least_piece_mm2: 1.0,
            break_width: Length::from_mm(0.5),
            break_pitch: Length::from_mm(20.0),
            base_layers: 5,
        }
    }
}

impl MeshOptions {
    /// Returns the gap between copies that leaves a moat around each and 2 mm of mesh
    /// between.
    pub fn gap(&self) -> Length {
        Length::from_um(2.0 * self.clearance.um() + MIN_MESH_WIDTH.um())
    }

    /// Returns the options of the command that makes this mesh, for the build's first
    /// page.
    pub(super) fn command(&self) -> String {
        let moat = match self.moat {
            Moat::Rising => String::new(),
            moat => format!(" --moat {moat}"),
        };
        let Self { clearance, least_piece_mm2, break_width, break_pitch, base_layers, .. } = self;
        let pattern = match &self.pattern {
            MeshPattern::Cells { shape, cell, wall } => {
                format!("{shape} --cell {cell} --wall {wall}")
            }
            MeshPattern::Image { name, .. } => quoted(name).into_owned(),
        };
        format!(
            " --mesh {pattern} --clearance {clearance}{moat} \
             --least-piece {least_piece_mm2}mm2 --break-width {break_width} --break-pitch {break_pitch} --base-layers {base_layers}"
        )
    }

    /// Returns the walls in pixels.
    ///
    /// # Errors
    /// Returns an error if they leave no holes, or have more runs than an image can hold.
    pub(super) fn lattice(&self, pitch: Pitch, build: PixelSize) -> Result<Lattice, TileError> {
        let (lattice, runs_of_row) = match &self.pattern {
            &MeshPattern::Cells { shape, cell, wall } => {
                let [cells, thickness] = [cell, wall].map(|length| pitch.pixels(length));
                if cells[0].min(cells[1]) < MIN_CELL_PIXELS || wall >= cell || wall.um() <= 0.0 {
                    return Err(TileError::NoCells { cell, wall });
                }
                // A hole has two edges. Hexagons of two rows interlock in a third of the rows at
                // most, for which the half below has room, too.
                let runs = 2.0 * f64::from(build.width) / cells[0];
                (
                    Lattice::Cells(LatticeCells::new(
                        shape,
                        cells[0],
                        thickness[0],
                        pitch.aspect(),
                    )),
                    runs,
                )
            }
            MeshPattern::Image { name, image } => {
                if image.width() == 0 || image.height() == 0 {
                    return Err(TileError::NoTemplate { name: name.clone() });
                }
                // Where a row ends white and its next copy begins white, nothing changes.
                let changes = |row: &[u32]| match row {
                    [0, ..] if row.len() % 2 == 1 => row.len() - 1,
                    row => row.len() + row.len() % 2,
                };
                let changes = image.rows().map(changes).max().unwrap_or(0);
                let runs = changes as f64 * f64::from(build.width) / f64::from(image.width());
                (Lattice::Image(image.clone()), runs)
            }
        };
        // Half the limit leaves room for the parts.
        if runs_of_row * f64::from(build.height) > MAX_RUNS as f64 / 2.0 {
            return Err(TileError::FineMesh);
        }
        Ok(lattice)
    }
}
