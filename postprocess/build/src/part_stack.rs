//! The stack of a part before it is placed: its size, and its outline if that is known.

use lamp_stack::{
    Change, Frame, Image, Layer, LevelChange, Mask, MaskBuilder, Op, Orientation, Pitch, RunImage,
    StackInfo,
};

use super::{PixelSize, TileError};

/// The stack of a part, as it is known before it is placed.
#[derive(Clone, Debug)]
pub struct PartStack {
    name: String,
    pitch: Pitch,
    image: PixelSize,
    /// The part of the image that is placed.
    frame: Frame,
    /// Whether the frame holds all that is white.
    is_fit: bool,
    /// The union of all layers, within the frame.
    outline: Option<Mask>,
    pub(super) origin_mm: Option<[f64; 2]>,
    pub(super) stack: Option<StackInfo>,
}

impl PartStack {
    /// Creates a part whose whole image is placed, from its first layer. Messages and
    /// layout files use its `name`.
    ///
    /// # Errors
    /// Returns an error if the layer has no resolution.
    pub fn of_image(name: &str, first: &Layer) -> Result<Self, TileError> {
        let name = name.to_owned();
        let Some(pitch) = first.pitch else {
            return Err(TileError::NoResolution { name, layer: first.info.name() });
        };
        let image = PixelSize::of(&first.image);
        let frame = Frame { left: 0, top: 0, width: image.width, height: image.height };
        let (origin_mm, stack) = (first.info.origin_mm, first.info.stack.clone());
        Ok(Self { name, pitch, image, frame, is_fit: false, outline: None, origin_mm, stack })
    }

    /// Creates a part whose extents are placed: the least frame that holds the white pixels of all
    /// its layers. Returns `None` if there are no layers.
    ///
    /// # Errors
    /// Returns the layers' errors, and one if they have no resolution, differ in
    /// resolution or size, or are all black.
    pub fn of_outline<E: From<TileError>>(
        name: &str,
        layers: impl Iterator<Item = Result<Layer, E>>,
    ) -> Result<Option<Self>, E> {
        let mut found: Option<(Self, Mask)> = None;
        for layer in layers {
            let layer = layer?;
            let white = white_of(&layer.image);
            found = Some(match found.take() {
                None => (Self::of_image(name, &layer)?, white),
                Some((part, outline)) => {
                    part.check(&layer)?;
                    let union = outline.combined(Op::Union, &white);
                    let union = union.ok_or_else(|| TileError::TooManyRuns {
                        copies: 1,
                        layer: layer.info.name(),
                    })?;
                    (part, union)
                }
            });
        }
        let Some((mut part, outline)) = found else { return Ok(None) };
        let frame = extents(&outline);
        part.frame = frame.ok_or_else(|| TileError::Black { name: name.to_owned() })?;
        part.is_fit = true;
        part.outline = Some(outline.framed(part.frame));
        Ok(Some(part))
    }

    /// Places the extents of the part, which were found before. Its outline stays unknown.
    pub(super) fn fit_to(self, frame: Frame) -> Self {
        Self { frame, is_fit: true, outline: None, ..self }
    }

    /// Returns whether the extents are placed, not the whole image.
    pub(super) fn is_fit(&self) -> bool {
        self.is_fit
    }

    /// Returns the part as its images at another angle show it: with another outline, in images of
    /// the outline's size, at another place.
    pub(super) fn of_turned(&self, outline: &Mask, origin_mm: [f64; 2], name: String) -> Self {
        let image = PixelSize { width: outline.width(), height: outline.height() };
        // Black outlines are refused where they are found, and turning only widens them.
        let frame = extents(outline).expect("an outline has a pixel");
        Self {
            name,
            pitch: self.pitch,
            image,
            frame,
            is_fit: true,
            outline: Some(outline.framed(frame)),
            origin_mm: Some(origin_mm),
            stack: None,
        }
    }

    /// Places another part of the images, which holds all white pixels.
    #[cfg(test)]
    pub(super) fn on(self, frame: Frame) -> Self {
        let outline = self.outline.map(|outline| {
            let moved = Frame {
                left: frame.left - self.frame.left,
                top: frame.top - self.frame.top,
                ..frame
            };
            outline.framed(moved)
        });
        Self { frame, outline, ..self }
    }

    /// Returns the part's name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns the resolution.
    pub fn pitch(&self) -> Pitch {
        self.pitch
    }

    /// Returns what the first page says of the stack.
    pub fn stack(&self) -> Option<&StackInfo> {
        self.stack.as_ref()
    }

    /// Returns the part of the image that is placed: all of it, or the extents.
    pub fn frame(&self) -> Frame {
        self.frame
    }

    /// Returns the union of all layers, within the frame, if it is known.
    pub fn outline(&self) -> Option<&Mask> {
        self.outline.as_ref()
    }

    /// Returns the size of the oriented frame.
    pub fn size(&self, turn: Orientation) -> PixelSize {
        let (width, height) = turn.size(self.frame.width, self.frame.height);
        PixelSize { width, height }
    }

    /// Returns the size of the layers' images.
    pub(super) fn image(&self) -> PixelSize {
        self.image
    }

    /// Returns the oriented outline, or all of the frame if no outline is known.
    pub(super) fn silhouette(&self, turn: Orientation) -> Mask {
        let outline = self.outline.as_ref().and_then(|outline| outline.oriented(turn));
        let PixelSize { width, height } = self.size(turn);
        // A turned outline may have too many runs; all of the frame covers it.
        outline.unwrap_or_else(|| Mask::black(width, height).inverted())
    }

    /// Checks that a layer has the size and resolution of the first.
    pub(super) fn check(&self, layer: &Layer) -> Result<(), TileError> {
        let name = self.name.clone();
        let found = PixelSize::of(&layer.image);
        if found != self.image {
            let layer = layer.info.name();
            return Err(TileError::OtherSize { name, layer, found, expected: self.image });
        }
        if layer.pitch != Some(self.pitch) {
            return Err(TileError::OtherResolution { name, layer: layer.info.name() });
        }
        Ok(())
    }

    /// Returns the placed part of a layer.
    ///
    /// # Errors
    /// Returns an error if the layer is not within the extents that were found.
    pub(super) fn framed(&self, layer: &Layer) -> Result<Image, TileError> {
        self.check(layer)?;
        // The extents are from an earlier read of the file, which may have changed since.
        if self.is_fit && !is_within(&layer.image, self.frame) {
            return Err(TileError::Changed { name: self.name.clone(), layer: layer.info.name() });
        }
        Ok(layer.image.framed(self.frame))
    }

    /// Returns the placed part of a layer that lies below the built ones. Where a range's extents
    /// are placed, the layers below may be wider, and are cut off.
    pub(super) fn framed_below(&self, layer: &Layer) -> Result<Image, TileError> {
        self.check(layer)?;
        Ok(layer.image.framed(self.frame))
    }
}

/// Returns a mask of the pixels that are not black.
pub(super) fn white_of(image: &Image) -> Mask {
    let gray = match image {
        Image::Mask(mask) => return mask.clone(),
        Image::Gray(gray) => gray,
    };
    let mut mask = MaskBuilder::new(gray.width());
    let mut row = Vec::new();
    for changes in gray.rows() {
        row.clear();
        for &LevelChange { column, level } in changes {
            // Changes between two gray levels are no transitions.
            if (level > 0) != (row.len() % 2 == 1) {
                row.push(column);
            }
        }
        mask.push_row(&row).expect("changes rise within the width");
    }
    mask.finish()
}

/// Returns the least frame that holds all that is not black, or `None` if nothing is.
fn extents<C: Change>(image: &RunImage<C>) -> Option<Frame> {
    let white = (0..).zip(image.rows()).filter(|(_, row)| !row.is_empty());
    let mut white = white.map(|(y, row): (u32, &[C])| {
        // A row that ends white has no last transition: it goes up to the image's edge.
        let is_black = C::last_pixel(row) == C::Pixel::default();
        (y, row[0].column(), if is_black { row[row.len() - 1].column() } else { image.width() })
    });
    let (top, left, right) = white.next()?;
    let (bottom, left, right) = white.fold((top, left, right), |(_, left, right), row| {
        (row.0, left.min(row.1), right.max(row.2))
    });
    let (width, height) = (right - left, bottom - top + 1);
    Some(Frame { left: left.into(), top: top.into(), width, height })
}

fn is_within(image: &Image, frame: Frame) -> bool {
    let extents = match image {
        Image::Mask(mask) => extents(mask),
        Image::Gray(gray) => extents(gray),
    };
    let ends =
        |frame: Frame| [frame.left + i64::from(frame.width), frame.top + i64::from(frame.height)];
    extents.is_none_or(|white| {
        let [[right, bottom], [last, lowest]] = [ends(frame), ends(white)];
        white.left >= frame.left && white.top >= frame.top && last <= right && lowest <= bottom
    })
}
