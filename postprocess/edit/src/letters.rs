//! Outlines of labels' letters, as closed lines.

use lamp_stack::{FONT, Orientation};
use skrifa::instance::{LocationRef, Size};
use skrifa::outline::pen::PathStyle;
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, GlyphId, MetadataProvider};

use super::edit_error::EditProblem;
use super::fill::PixelPoint;

/// The end of a text, or its middle, that is at its place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Align {
    #[default]
    Left,
    Center,
    Right,
}

/// Returns a text's outlines as closed lines, x to the right and y up from the text's
/// place on its base line, in units of a capital's height. Straight pieces approximate
/// curves within `tolerance`.
///
/// # Errors
/// Returns the first letter that the font lacks.
pub(super) fn outlines(
    text: &str,
    align: Align,
    turn: Orientation,
    tolerance: f64,
) -> Result<Vec<Vec<PixelPoint>>, char> {
    let font = FontRef::new(FONT).expect("the font that comes with the program is one");
    // Places in units of the font, as whole numbers.
    let (size, location) = (Size::unscaled(), LocationRef::default());
    let (glyphs, metrics) = (font.outline_glyphs(), font.glyph_metrics(size, location));
    let capital = glyph(&font, 'H').expect("the font has capitals");
    let capital = metrics.bounds(capital).expect("capitals have outlines");
    let scale = 1.0 / f64::from(capital.y_max);
    let mut pen = Pen { lines: Vec::new(), x: 0.0, shift: 0.0, scale, tolerance };
    for letter in text.chars() {
        let id = glyph(&font, letter).ok_or(letter)?;
        // Rasterizers of screens, which skrifa follows, move an outline to where the letter's
        // bearing says that it begins. In this font some bearings are off by a unit, so the outline
        // stays where it is.
        let (bounds, bearing) = (metrics.bounds(id), metrics.left_side_bearing(id));
        pen.shift = bounds.zip(bearing).map_or(0.0, |(bounds, bearing)| bounds.x_min - bearing);
        if let Some(outline) = glyphs.get(id) {
            // Of the two styles, this one begins lines where the font does.
            let settings = DrawSettings::unhinted(size, location);
            let drawn = outline.draw(settings.with_path_style(PathStyle::HarfBuzz), &mut pen);
            drawn.expect("the outlines of the font that comes with the program are whole");
        }
        pen.x += f64::from(metrics.advance_width(id).unwrap_or(0.0)) * scale;
    }
    let shift = match align {
        Align::Left => 0.0,
        Align::Center => -pen.x / 2.0,
        Align::Right => -pen.x,
    };
    let placed = |line: Vec<PixelPoint>| {
        line.into_iter().map(|[x, y]| turned([x + shift, y], turn)).collect()
    };
    Ok(pen.lines.into_iter().map(placed).collect())
}

fn glyph(font: &FontRef<'_>, letter: char) -> Option<GlyphId> {
    font.charmap().map(letter).filter(|&id| id != GlyphId::NOTDEF)
}

/// Turns a point about the origin, with y up.
pub(super) fn turned([x, y]: PixelPoint, turn: Orientation) -> PixelPoint {
    let start = if turn.is_mirrored() { [-x, y] } else { [x, y] };
    (0..turn.quarters()).fold(start, |[x, y], _| [-y, x])
}

/// Draws a font's curves as straight lines.
struct Pen {
    lines: Vec<Vec<PixelPoint>>,
    /// The start of the letter.
    x: f64,
    /// The distance to move the letter to the right, in units of the font.
    shift: f32,
    scale: f64,
    tolerance: f64,
}

impl Pen {
    fn point(&self, x: f32, y: f32) -> PixelPoint {
        [self.x + f64::from(x + self.shift) * self.scale, f64::from(y) * self.scale]
    }

    fn last(&self) -> PixelPoint {
        *self.lines.last().and_then(|line| line.last()).expect("a curve starts somewhere")
    }

    fn draw_to(&mut self, point: PixelPoint) {
        self.lines.last_mut().expect("a curve starts somewhere").push(point);
    }

    /// Draws a curve whose second derivative is at most `bend`. The chord of an `n`th of
    /// it is off by at most `bend / (8 n^2)`.
    fn draw(&mut self, bend: f64, at: impl Fn(f64) -> PixelPoint) {
        let pieces = (bend / (8.0 * self.tolerance)).sqrt().ceil().clamp(1.0, 1000.0) as u32;
        for piece in 1..=pieces {
            self.draw_to(at(f64::from(piece) / f64::from(pieces)));
        }
    }
}

impl OutlinePen for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        let point = self.point(x, y);
        self.lines.push(vec![point]);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.draw_to(self.point(x, y));
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let (a, b, c) = (self.last(), self.point(x1, y1), self.point(x, y));
        // The second derivative: twice a - 2 b + c.
        let bend = 2.0 * (a[0] - 2.0 * b[0] + c[0]).hypot(a[1] - 2.0 * b[1] + c[1]);
        self.draw(bend, |t| {
            let at =
                |k: usize| (1.0 - t).powi(2) * a[k] + 2.0 * t * (1.0 - t) * b[k] + t * t * c[k];
            [at(0), at(1)]
        });
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let (a, b) = (self.last(), self.point(x1, y1));
        let (c, d) = (self.point(x2, y2), self.point(x, y));
        // The second derivative lies between six times these two differences.
        let second = |a: PixelPoint, b: PixelPoint, c: PixelPoint| {
            (a[0] - 2.0 * b[0] + c[0]).hypot(a[1] - 2.0 * b[1] + c[1])
        };
        let bend = 6.0 * second(a, b, c).max(second(b, c, d));
        self.draw(bend, |t| {
            let s = 1.0 - t;
            let at = |k: usize| {
                s.powi(3) * a[k]
                    + 3.0 * s * s * t * b[k]
                    + 3.0 * s * t * t * c[k]
                    + t.powi(3) * d[k]
            };
            [at(0), at(1)]
        });
    }

    fn close(&mut self) {}
}

/// The place of a serial number in a label's text.
pub(super) const SERIAL: &str = "{list}";

/// Puts the number `n` into a text for `{n}`, or for `{n:4}` and `{n:04}` with four
/// digits, filled with blanks or zeros, and a serial number for `{list}`.
///
/// # Errors
/// Returns an error if the text has single braces, or something else in them.
pub(super) fn numbered(text: &str, n: i64, serial: &str) -> Result<String, EditProblem> {
    let mut out = String::new();
    let mut rest = text;
    while let Some(start) = rest.find(['{', '}']) {
        out += &rest[..start];
        let (field, after) = rest[start..]
            .strip_prefix('{')
            .and_then(|inside| inside.split_once('}'))
            .ok_or_else(|| EditProblem::Brace(text.to_owned()))?;
        if field == "list" {
            out += serial;
        } else {
            out += &number(field, n).ok_or_else(|| EditProblem::NumberField(field.to_owned()))?;
        }
        rest = after;
    }
    Ok(out + rest)
}

/// Formats a number as a field of a text asks for it.
fn number(field: &str, n: i64) -> Option<String> {
    let Some(places) = field.strip_prefix("n:") else {
        return (field == "n").then(|| n.to_string());
    };
    let width: usize = places.parse().ok().filter(|width| *width <= 64)?;
    if !places.bytes().all(|byte| byte.is_ascii_digit()) {
        return None;
    }
    Some(if places.starts_with('0') { format!("{n:0width$}") } else { format!("{n:width$}") })
}

#[cfg(test)]
mod tests {
    use super::super::fill::RunSet;
    use super::*;

    #[test]
    fn numbers_stand_where_they_are_asked_for() {
        assert_eq!(numbered("SN {n:04}/{n}", 17, "").unwrap(), "SN 0017/17");
        assert_eq!(numbered("{n:3}", -1, "").unwrap(), " -1");
        assert_eq!(numbered("plain", 1, "").unwrap(), "plain");
        assert_eq!(numbered("SN {list} ({n})", 2, "{A}").unwrap(), "SN {A} (2)");
        for wrong in
            ["{", "}", "{n", "{m}", "{n:}", "{n:x}", "{n:+4}", "{n:99999999999}", "{}}", "{List}"]
        {
            assert!(numbered(wrong, 1, "").is_err(), "{wrong}");
        }
    }

    #[test]
    fn the_font_has_what_labels_need() {
        let letters: String = (' '..='~').collect();
        assert!(outlines(&letters, Align::Left, Orientation::default(), 0.01).is_ok());
        assert_eq!(outlines("a\u{3a9}", Align::Left, Orientation::default(), 0.01), Err('\u{3a9}'));
    }

    /// The bearings of these three differ from their outlines, which begin at these units.
    #[test]
    fn letters_stand_where_the_font_draws_them() {
        for (letter, first) in [("&", 102.0), ("8", 113.0), ("\u{2013}", 161.602_05)] {
            let lines = outlines(letter, Align::Left, Orientation::default(), 0.001).unwrap();
            let found = lines.iter().flatten().map(|[x, _]| x * 1456.0).fold(f64::MAX, f64::min);
            assert!((found - first).abs() < 0.01, "{letter} begins at {found}, not {first}");
        }
    }

    fn drawn(text: &str, align: Align, turn: &str) -> Vec<String> {
        let lines = outlines(text, align, turn.parse().unwrap(), 0.01).unwrap();
        let pixel = |[x, y]: PixelPoint| [10.0 + 10.0 * x - 0.5, 12.0 - 10.0 * y - 0.5];
        let lines: Vec<Vec<PixelPoint>> =
            lines.into_iter().map(|line| line.into_iter().map(pixel).collect()).collect();
        let mut runs = RunSet::new(20, 14);
        runs.add_polygons(&lines);
        let mask = runs.into_mask().unwrap();
        let row = |row| {
            (0..20).map(|column| if mask.is_white(column, row) { '#' } else { '.' }).collect()
        };
        (0..14).map(row).collect()
    }

    #[test]
    fn a_capital_is_as_high_as_asked_for() {
        let picture = drawn("L", Align::Left, "0");
        let white: Vec<_> = (0..14).filter(|&row: &usize| picture[row].contains('#')).collect();
        assert_eq!((white[0], white.len()), (2, 10), "{picture:#?}");
        let mirrored = drawn("L", Align::Left, "0m");
        let reversed = |row: &String| row.chars().rev().collect::<String>();
        assert_eq!(mirrored, picture.iter().map(reversed).collect::<Vec<_>>());
    }

    #[test]
    fn the_round_letter_has_a_hole() {
        let picture = drawn("O", Align::Center, "0");
        let runs = |row: &String| row.split('.').filter(|run| !run.is_empty()).count();
        assert_eq!(runs(&picture[7]), 2, "{picture:#?}");
        assert_eq!(runs(&picture[2]), 1, "{picture:#?}");
        // It stands about its place.
        let (first, last) = (picture[7].find('#').unwrap(), picture[7].rfind('#').unwrap());
        assert!((first + last).abs_diff(19) <= 1, "{picture:#?}");
    }
}
