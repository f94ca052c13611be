//! Images that are repeated as a mesh.

use std::path::Path;

use lamp_build::MeshPattern;
use lamp_grayscale::{DitherMethod, dither_image};
use lamp_stack::{Image, StackError};

use crate::exit::Exit;
use crate::streams::{failed_at, input_name, is_stream, layers_of, open_pages};

/// Reads the first image of a file; a gray one becomes white where it is at least half as bright as
/// white.
pub(super) fn template(path: &Path) -> Result<MeshPattern, Exit> {
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
