//! The folder of a plan on a fixed glass: bitmaps in order, and other files next to the stack.

use std::io;
use std::path::{Path, PathBuf};

use lamp_stack::{
    Destination, FolderBeside, Format, Layer, Length, PageInfo, Pitch, StackError, StackInfo,
    write_stack,
};
use thiserror::Error;

use crate::bitmaps::ShownBitmap;

/// A folder for a plan, which gets its name when it is completely written.
pub struct PlanFolder {
    folder: FolderBeside,
    name: PathBuf,
}

/// The bitmaps of a plan, and the data of their pages.
#[derive(Clone, Copy, Debug)]
pub struct PlanPages<'a> {
    /// The target's name, or another for the cured part.
    pub part: &'a str,
    /// The command that made the plan.
    pub command: &'a str,
    /// The distance between neighboring mirrors' images.
    pub pitch: Length,
    /// The bitmaps, in the order in which they are displayed.
    pub bitmaps: &'a [ShownBitmap],
}

/// Why a plan's folder is not written.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PlanFolderError {
    /// The bitmaps cannot be written.
    #[error("{}", file.display())]
    Bitmaps {
        /// Their file.
        file: PathBuf,
        /// Why.
        #[source]
        problem: StackError,
    },
    /// Another file cannot be written.
    #[error("{}", file.display())]
    File {
        /// The file.
        file: PathBuf,
        /// Why.
        #[source]
        problem: io::Error,
    },
    /// The folder cannot get its name.
    #[error("{}", folder.display())]
    Name {
        /// The folder.
        folder: PathBuf,
        /// Why.
        #[source]
        problem: StackError,
    },
}

impl PlanFolder {
    /// The name of the stack of bitmaps.
    pub const BITMAPS: &'static str = "bitmaps.tif";

    /// Takes a folder and the name that it is to get.
    pub fn new(folder: FolderBeside, name: &Path) -> Self {
        Self { folder, name: name.to_owned() }
    }

    /// Adds the bitmaps, one a page with its time.
    ///
    /// # Errors
    /// Returns an error if they cannot be written.
    pub fn add_bitmaps(&self, pages: &PlanPages<'_>) -> Result<(), PlanFolderError> {
        let to = Destination::File(self.folder.path().join(Self::BITMAPS));
        write_stack(pages.layers(), to, Format::Big).map_err(|problem| PlanFolderError::Bitmaps {
            file: self.name.join(Self::BITMAPS),
            problem,
        })
    }

    /// Adds another file.
    ///
    /// # Errors
    /// Returns an error if it cannot be written.
    pub fn add(&self, file: &str, bytes: &[u8]) -> Result<(), PlanFolderError> {
        self.folder
            .add(file, |out| out.write_all(bytes))
            .map_err(|problem| PlanFolderError::File { file: self.name.join(file), problem })
    }

    /// Gives the folder its name.
    ///
    /// # Errors
    /// Returns an error if the disk cannot take it, or if the name already exists.
    pub fn finish(self) -> Result<(), PlanFolderError> {
        let folder = self.name;
        self.folder.persist().map_err(|problem| PlanFolderError::Name { folder, problem })
    }
}

impl PlanPages<'_> {
    /// Returns the pages, each with its time.
    pub fn layers(&self) -> impl Iterator<Item = Result<Layer, StackError>> {
        let stack = StackInfo {
            part: self.part.to_owned(),
            commands: vec![self.command.to_owned()],
            layers: u32::try_from(self.bitmaps.len()).ok(),
            ..StackInfo::default()
        };
        self.bitmaps.iter().zip(0..).map(move |(bitmap, index)| {
            // The middle of the display is on the optical axis.
            let half_mm = |mirrors: u32| f64::from(mirrors) * self.pitch.mm() / 2.0;
            let corner = [-half_mm(bitmap.image.width()), half_mm(bitmap.image.height())];
            let info = PageInfo {
                index,
                origin_mm: Some(corner.map(|mm| (mm * 1e6).round() / 1e6)),
                exposure_ms: Some(bitmap.time.ms()),
                stack: (index == 0).then(|| stack.clone()),
                ..PageInfo::default()
            };
            let (pitch, image) = (resolution(self.pitch), bitmap.image.clone().into());
            Ok(Layer { info, pitch, image })
        })
    }
}

/// Mirrors per inch on the glass, to the four decimals that stacks have.
fn resolution(pitch: Length) -> Option<Pitch> {
    Pitch::of_dpi((25_400.0 / pitch.um() * 1e4).round() / 1e4)
}

#[cfg(test)]
mod tests {
    use lamp_grayscale::resin::ExposureTime;
    use lamp_stack::Mask;

    use super::*;

    #[test]
    fn pages_lie_about_the_axis_and_state_their_times() {
        let bitmap = |ms: f64| ShownBitmap {
            image: Mask::black(6, 4).into(),
            time: ExposureTime::from_ms(ms),
        };
        let pages = PlanPages {
            part: "lens",
            command: "lamp plan",
            pitch: Length::from_um(10.0),
            bitmaps: &[bitmap(20.0), bitmap(30.0)],
        };
        let layers: Vec<Layer> = pages.layers().map(Result::unwrap).collect();
        let corners = layers.iter().map(|layer| layer.info.origin_mm.unwrap());
        assert!(corners.eq([[-0.03, 0.02]; 2]));
        assert_eq!(layers[1].info.exposure_ms, Some(30.0));
        assert!(layers[0].info.stack.is_some() && layers[1].info.stack.is_none());
        assert_eq!(layers[0].pitch, Pitch::of_dpi(2540.0));
    }
}
