//! Draws islands over the sphere of directions.

use std::f64::consts::SQRT_2;
use std::path::Path;

use lamp_supports::PoseFacts;
use plotters::coord::Shift;
use plotters::drawing::DrawingAreaErrorKind;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use crate::PlotError;
use crate::{Drawing, GRAY_INK, GRID, font, picture_of, with_font};

/// The radius of a half of the sphere, and the room around it, in pixels.
const RADIUS: i32 = 400;
const MARGIN: i32 = 90;
const HEAD: i32 = 80;
const LEGEND: i32 = 110;
const SIZE: (u32, u32) =
    ((4 * RADIUS + 3 * MARGIN) as u32, (2 * RADIUS + 2 * MARGIN + HEAD + LEGEND) as u32);

/// Colors of no island, one, and more, from good to bad: blue over yellow to red, distinct also to
/// people who see few colors (after ColorBrewer's RdYlBu).
const SHADES: [(&str, RGBColor); 5] = [
    ("no island", RGBColor(69, 117, 180)),
    ("1", RGBColor(145, 191, 219)),
    ("2", RGBColor(254, 224, 144)),
    ("3 to 5", RGBColor(252, 141, 89)),
    ("more", RGBColor(215, 48, 39)),
];

const BEST: RGBColor = RGBColor(0, 0, 0);

fn shade(islands: usize) -> RGBColor {
    SHADES[match islands {
        0..=2 => islands,
        3..=5 => 3,
        _ => 4,
    }]
    .1
}

/// The bytes of a picture of both halves of the sphere, seen from its poles: a dot for each
/// direction, colored by islands, and a ring around the dot of the best pose. Areas are true to
/// scale (Lambert's projection).
pub fn sphere_picture(
    title: &str,
    poses: &[PoseFacts],
    best: usize,
    path: &Path,
) -> Result<Vec<u8>, PlotError> {
    picture_of(&SpherePicture { title, poses, best }, SIZE, path)
}

struct SpherePicture<'a> {
    title: &'a str,
    poses: &'a [PoseFacts],
    best: usize,
}

/// Which half of the sphere is drawn.
#[derive(Clone, Copy, PartialEq)]
enum Half {
    Upper,
    Lower,
}

impl Half {
    fn of(up: [f64; 3]) -> Self {
        if up[2] >= 0.0 { Self::Upper } else { Self::Lower }
    }

    fn centre(self) -> (i32, i32) {
        let x = MARGIN + RADIUS + if self == Self::Lower { 2 * RADIUS + MARGIN } else { 0 };
        (x, HEAD + MARGIN + RADIUS)
    }

    /// Returns where a direction of this half is drawn.
    fn at(self, [x, y, z]: [f64; 3]) -> (i32, i32) {
        // The distance from the pole is 2 sin(angle / 2), and for the rim the root of 2.
        let scale = f64::from(RADIUS) / SQRT_2 * (2.0 / (1.0 + z.abs())).sqrt();
        let (cx, cy) = self.centre();
        (cx + (scale * x).round() as i32, cy - (scale * y).round() as i32)
    }
}

impl SpherePicture<'_> {
    /// Returns the radius of a dot: dots that fill half of the sphere, within reason.
    fn dot(&self) -> i32 {
        let share = 1.0 / self.poses.len().max(1) as f64;
        (f64::from(RADIUS) * share.sqrt()).clamp(2.0, 18.0) as i32
    }

    fn draw_half<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        half: Half,
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        let middle = Pos::new(HPos::Center, VPos::Center);
        let (cx, cy) = half.centre();
        area.draw(&Circle::new((cx, cy), RADIUS, GRAY_INK.stroke_width(2)))?;
        // Circles at 30 and 60 degrees from the pole.
        for degrees in [30.0_f64, 60.0] {
            let radius = f64::from(RADIUS) * SQRT_2 * (degrees.to_radians() / 2.0).sin();
            area.draw(&Circle::new((cx, cy), radius.round() as i32, GRID.stroke_width(2)))?;
        }
        let names =
            [("+x", (RADIUS + 30, 0)), ("+y", (0, -RADIUS - 26)), ("-x", (-RADIUS - 30, 0))];
        for (name, (x, y)) in names.into_iter().chain([("-y", (0, RADIUS + 26))]) {
            area.draw(&Text::new(name, (cx + x, cy + y), font(13).pos(middle)))?;
        }
        let in_half = self.poses.iter().filter(|facts| Half::of(facts.pose.up()) == half);
        for facts in in_half {
            let dot =
                Circle::new(half.at(facts.pose.up()), self.dot(), shade(facts.islands).filled());
            area.draw(&dot)?;
        }
        Ok(())
    }

    fn draw_legend<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        let left = Pos::new(HPos::Left, VPos::Center);
        let (mut x, y) = (MARGIN, SIZE.1 as i32 - LEGEND / 2);
        for (text, shade) in SHADES {
            area.draw(&Circle::new((x + 14, y), 14, shade.filled()))?;
            area.draw(&Text::new(text, (x + 40, y), font(13).pos(left)))?;
            x += 210;
        }
        area.draw(&Circle::new((x + 14, y), 14, BEST.stroke_width(4)))?;
        area.draw(&Text::new("best", (x + 40, y), font(13).pos(left)))
    }
}

impl Drawing for SpherePicture<'_> {
    fn draw<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        with_font();
        area.fill(&WHITE)?;
        let middle = Pos::new(HPos::Center, VPos::Center);
        let head = |x: i32, y: i32, text: &str, size: u32| {
            area.draw(&Text::new(text.to_owned(), (x, y), font(size).pos(middle)))
        };
        head(SIZE.0 as i32 / 2, HEAD / 2, self.title, 19)?;
        for (half, name) in [(Half::Upper, "+z up"), (Half::Lower, "-z up")] {
            head(half.centre().0 - RADIUS + 40, HEAD + 30, name, 15)?;
            self.draw_half(area, half)?;
        }
        let up = self.poses[self.best].pose.up();
        // Last, so that no dot covers it.
        area.draw(&Circle::new(Half::of(up).at(up), self.dot() + 6, BEST.stroke_width(4)))?;
        self.draw_legend(area)?;
        area.present()
    }
}

#[cfg(test)]
mod tests {
    use lamp_supports::Pose;

    use super::*;

    fn poses() -> Vec<PoseFacts> {
        let facts = |(pose, islands): (Pose, usize)| PoseFacts {
            pose,
            islands,
            pits: 0,
            overhang_mm2: 0.0,
            height_mm: 1.0,
            footprint_mm: [1.0; 2],
        };
        lamp_supports::poses(20, 180.0).into_iter().zip(0..).map(facts).collect()
    }

    #[test]
    fn each_direction_is_a_dot() {
        let draw = |name: &str| sphere_picture("a & b", &poses(), 3, Path::new(name)).unwrap();
        let text = String::from_utf8(draw("a.svg")).unwrap();
        // Two rims, two circles in each, the legend and the best.
        assert_eq!(text.matches("<circle").count(), 26 + 2 * 3 + 6 + 1);
        assert!(text.contains("a &amp; b"));
        assert_eq!(draw("a.svg"), text.as_bytes());
        assert!(draw("a.png").starts_with(b"\x89PNG"));
    }

    #[test]
    fn directions_stay_in_their_half() {
        for facts in poses() {
            let up = facts.pose.up();
            let (x, y) = Half::of(up).at(up);
            let (cx, cy) = Half::of(up).centre();
            assert!(f64::from(x - cx).hypot(f64::from(y - cy)) < f64::from(RADIUS) + 1.0);
        }
        // The poles are in the middles, and x at the right.
        assert_eq!(Half::Lower.at([0.0, 0.0, -1.0]), Half::Lower.centre());
        assert_eq!(Half::Upper.at([1.0, 0.0, 0.0]).0, Half::Upper.centre().0 + RADIUS);
    }
}
