//! The light of a projector from a camera's picture of it.

use std::path::PathBuf;

use lamp_grayscale::resin::ExposureTime;
use lamp_planning::projector::{CameraError, CameraFit, CameraPicture, Projector};
use lamp_planning::{MirrorSeconds, ShownBitmap};
use lamp_stack::Length;

use super::target::of_work;
use super::{bitmaps_of, gray_picture};
use crate::Error;

/// A camera's picture, and the image that the display showed.
#[derive(Clone, Debug)]
pub struct CameraSettings {
    /// The picture: a PNG of gray levels.
    pub picture: PathBuf,
    /// The image: a stack of one page, as wide and high as the display.
    pub shown: PathBuf,
    /// The side of the picture's pixels on the glass, where it is known.
    pub pixel: Option<Length>,
}

impl CameraSettings {
    /// Finds the light of a projector.
    ///
    /// # Errors
    /// Returns an error if a file cannot be read, if the image has another size than the display, or if the picture does
    /// not show its light.
    pub fn fit(&self, projector: &Projector) -> Result<CameraFit, Error> {
        let at_picture = |error: Error| error.at(self.picture.display().to_string());
        let picture = gray_picture(&self.picture)?;
        let images = bitmaps_of(&self.shown, projector)?;
        let [ShownBitmap { image, .. }] = &images[..] else {
            let error = Error::work(format!(
                "{} images, but a picture shows one: take it out with `lamp split --layers`",
                images.len()
            ));
            return Err(error.at(self.shown.display().to_string()));
        };
        // Any time: the camera's own is not the display's.
        let on = ShownBitmap { image: image.clone(), time: ExposureTime::from_ms(1000.0) };
        let shown = MirrorSeconds::of(&[on], |level| projector.share(level));
        let camera = CameraPicture { picture: &picture, pixel: self.pixel, shown: &shown };
        camera.fit(projector).map_err(|error| match error {
            CameraError::NothingShown | CameraError::Symmetric => {
                of_work(error).at(self.shown.display().to_string())
            }
            _ => at_picture(of_work(error)),
        })
    }
}
