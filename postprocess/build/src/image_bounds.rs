//! Where a stack's pixels lie in the part's coordinates.

use std::fmt;

use lamp_stack::{Frame, Orientation, PageInfo, Pitch};

/// The rectangle that a stack's images cover in the part's coordinates.
///
/// It is written as `x 1.000 to 4.000 and y 3.000 to 5.000 mm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageBounds {
    /// The top left corner, in millimeters.
    pub origin_mm: [f64; 2],
    /// The resolution, if it is known.
    pub pitch: Option<Pitch>,
    /// The number of columns.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
}

impl ImageBounds {
    /// Returns the bounds of an image of that many columns and rows. If its page does not state
    /// them, the lower left corner is 0, 0.
    pub fn of(info: &PageInfo, pitch: Option<Pitch>, [width, height]: [u32; 2]) -> Self {
        let height_mm = f64::from(height) * pitch.map_or(0.0, |pitch| pitch.y.pitch().mm());
        let origin_mm = info.origin_mm.unwrap_or([0.0, height_mm]);
        Self { origin_mm, pitch, width, height }
    }

    /// Makes a page say that its image lies here, if it says where it lies.
    pub fn locate(&self, info: &mut PageInfo) {
        info.origin_mm = info.origin_mm.map(|_| self.origin_mm);
    }

    /// Returns true if a point in pixels is on the image.
    pub fn holds(&self, [x, y]: [f64; 2]) -> bool {
        // Places count from the center of the first pixel, half a pixel inside the edge.
        let on = |place: f64, size: u32| (-0.5..=f64::from(size) - 0.5).contains(&place);
        on(x, self.width) && on(y, self.height)
    }

    /// Returns the bounds of a frame of the image.
    pub fn framed(&self, frame: Frame) -> Self {
        let [pitch_x, pitch_y] = self.pitch_mm();
        let [x0, y1] = self.origin_mm;
        Self {
            origin_mm: [x0 + frame.left as f64 * pitch_x, y1 - frame.top as f64 * pitch_y],
            width: frame.width,
            height: frame.height,
            ..*self
        }
    }

    /// Returns the bounds after the part is turned about x = y = 0.
    pub fn turned(&self, turn: Orientation) -> Self {
        let [mut x0, mut y1] = self.origin_mm;
        let [mut width, mut height] = self.size_mm();
        let mut pitch = self.pitch;
        if turn.is_mirrored() {
            // In the mirror x = 0 the right edge becomes the left one.
            x0 = -(x0 + width);
        }
        for _ in 0..turn.quarters() {
            // A quarter counterclockwise takes (x, y) to (-y, x): the top becomes the left edge,
            // and the right edge the top.
            (x0, y1) = (-y1, x0 + width);
            (width, height) = (height, width);
            pitch = pitch.map(Pitch::turned);
        }
        let (width, height) = turn.size(self.width, self.height);
        Self { origin_mm: [x0, y1], pitch, width, height }
    }

    fn pitch_mm(&self) -> [f64; 2] {
        self.pitch.map_or([0.0; 2], Pitch::mm)
    }

    fn size_mm(&self) -> [f64; 2] {
        let [x, y] = self.pitch_mm();
        [f64::from(self.width) * x, f64::from(self.height) * y]
    }
}

impl fmt::Display for ImageBounds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.origin_mm;
        let [width, height] = self.size_mm();
        let (right, bottom) = (x + width, y - height);
        write!(f, "x {x:.3} to {right:.3} and y {bottom:.3} to {y:.3} mm")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(origin_mm: [f64; 2], width: u32, height: u32) -> ImageBounds {
        ImageBounds { origin_mm, pitch: Pitch::of_dpi(25.4), width, height }
    }

    #[test]
    fn turning_moves_the_corner_about_zero() {
        // One pixel is one millimeter: x 1 to 4, y 3 to 5.
        let image = place([1.0, 5.0], 3, 2);
        for (turn, origin) in [
            ("0", [1.0, 5.0]),
            ("90", [-5.0, 4.0]),
            ("180", [-4.0, -3.0]),
            ("270", [3.0, -1.0]),
            ("0m", [-4.0, 5.0]),
            ("90m", [-5.0, -1.0]),
        ] {
            let turn: Orientation = turn.parse().unwrap();
            let (width, height) = turn.size(3, 2);
            assert_eq!(image.turned(turn), place(origin, width, height), "{turn}");
        }
    }

    #[test]
    fn a_frame_begins_at_its_own_corner() {
        assert_eq!(
            place([1.0, 5.0], 9, 9).framed(Frame { left: 2, top: -3, width: 1, height: 1 }),
            place([3.0, 8.0], 1, 1)
        );
    }
}
