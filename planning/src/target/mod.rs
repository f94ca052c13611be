//! Targets of planners on a fixed glass: the shape to be cured, as a height above each point of the
//! glass (000 section 3.3).
//!
//! A target is one of three: shapes by their dimensions ([`Shapes`]), a height map as a PNG, or a
//! part with a flat bottom. All give heights at the middles of square columns.
//!
//! ```
//! use lamp_planning::target::{Grid, Target};
//!
//! let sphere = Target::builtin("sphere").unwrap();
//! let map = sphere.heights(&Grid { columns: 300, rows: 300, pitch_um: 10.0 })?;
//! assert_eq!((map.highest_um().round(), map.height_um(0, 0)), (400.0, 0.0));
//! # Ok::<(), lamp_planning::target::TargetError>(())
//! ```

mod error;
mod file;
mod gray_picture;
mod map;
mod open;
mod part;
mod picture;
mod round;
mod shapes;

use lamp_slicing::Part;
use lamp_stack::{Catalogued, Length};

pub use error::TargetError;
pub use gray_picture::GrayPicture;
pub use map::{Grid, HeightMap, Place};
pub use open::TargetOptions;
pub use picture::MapScale;
pub use round::Round;
pub use shapes::{Base, Channels, Direction, LensShape, Shapes, ShapesError};

use part::PartColumns;
use picture::HeightPicture;

use crate::projector::Projector;

/// The shape to be cured, centered on the optical axis.
#[derive(Debug)]
pub struct Target(Source);

#[derive(Debug)]
enum Source {
    Shapes(Shapes),
    Picture(HeightPicture),
    Part(Box<PartColumns>),
}

impl Target {
    /// Returns the built-in target of a name.
    pub fn builtin(name: &str) -> Option<Self> {
        Shapes::builtin(name).map(Self::from)
    }

    /// Returns its name: the one in its file, or the file's.
    pub fn name(&self) -> &str {
        match &self.0 {
            Source::Shapes(shapes) => &shapes.name,
            Source::Picture(picture) => picture.name(),
            Source::Part(columns) => columns.part().name(),
        }
    }

    /// Returns the part that it was read from, if any.
    pub fn part(&self) -> Option<&Part> {
        match &self.0 {
            Source::Part(columns) => Some(columns.part()),
            _ => None,
        }
    }

    /// Returns the width and height of its bounding rectangle on the glass.
    pub fn size(&self) -> [Length; 2] {
        let size_um = match &self.0 {
            Source::Shapes(shapes) => shapes.size_um(),
            Source::Picture(picture) => picture.size_um(),
            Source::Part(part) => part.size_um(),
        };
        size_um.map(Length::from_um)
    }

    /// Checks that a projector lights all of it.
    ///
    /// # Errors
    /// Returns an error if it is wider than the display's image.
    pub fn check_width(&self, projector: &Projector) -> Result<(), TargetError> {
        let (size, light) = (self.size(), projector.image());
        let fits = |axis: usize| size[axis].um() <= light[axis].um();
        if fits(0) && fits(1) {
            return Ok(());
        }
        Err(TargetError::Wide {
            size: size.map(Length::to_whole_nm),
            light: light.map(Length::to_whole_nm),
        })
    }

    /// Returns the height of each column of a grid, at its middle (000 section 3.3.1). Everything
    /// outside the grid is left out.
    ///
    /// # Errors
    /// Returns an error if no column has a height, or if a column of a part has an overhang, a hole
    /// or no bottom on the glass.
    pub fn heights(&self, grid: &Grid) -> Result<HeightMap, TargetError> {
        let heights_um = match &self.0 {
            Source::Shapes(shapes) => grid.map(|x, y| shapes.height_um(x, y)),
            Source::Picture(picture) => grid.map(|x, y| picture.height_um(x, y)),
            Source::Part(part) => part.heights_um(grid)?,
        };
        let map = HeightMap { grid: *grid, heights_um };
        if map.highest_um() > 0.0 { Ok(map) } else { Err(TargetError::Empty { grid: *grid }) }
    }

    /// Returns its height over the distance from the axis. Height maps and parts are sampled at
    /// points `step` apart.
    ///
    /// # Errors
    /// Returns an error if it is not round, or as [`heights`](Self::heights).
    pub fn round(&self, step: Length) -> Result<Round, TargetError> {
        match &self.0 {
            Source::Shapes(shapes) => Round::of_shapes(shapes),
            Source::Picture(_) | Source::Part(_) => {
                Round::of_map(&self.heights(&Grid::around(self.size(), step))?)
            }
        }
    }
}

impl From<Shapes> for Target {
    fn from(shapes: Shapes) -> Self {
        Self(Source::Shapes(shapes))
    }
}
