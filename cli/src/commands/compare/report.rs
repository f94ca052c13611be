//! The result of a comparison: lines for people, and JSON.

use std::cmp::Reverse;

use lamp_stack::to_nm;
use lamp_stack::{PageHeader, Pairing};
use serde::Serialize;

use super::walk::{DifferenceBox, SectionDifference};
use crate::output::json_report::schemas;
use crate::output::numbers::{grouped, number_of};
use crate::terminal::progress::printable;

/// The most layers, and the most boxes of a layer, that are printed unless all are asked for.
const MOST_LINES: usize = 20;
const MOST_BOX_LINES: usize = 3;

/// Differences between two stacks.
pub(super) struct StackComparison<'a> {
    pub(super) names: [String; 2],
    pub(super) pairing: &'a Pairing,
    /// The headers of the pages of the first and of the second stack.
    pub(super) headers: [&'a [PageHeader]; 2],
    /// In pixels.
    pub(super) tolerance: [f64; 2],
    /// The sections that differ or in which something was forgiven, from the bottom up.
    pub(super) sections: Vec<SectionDifference>,
}

impl StackComparison<'_> {
    /// Returns the sections that differ, from the bottom up.
    fn told(&self) -> impl Iterator<Item = &SectionDifference> {
        self.sections.iter().filter(|found| found.is_told())
    }

    pub(super) fn is_same(&self) -> bool {
        self.told().next().is_none()
    }

    /// Returns the section with the most pixels that differ, if any do; of equal ones the lowest.
    pub(super) fn worst(&self) -> Option<&SectionDifference> {
        let differing = self.told().filter(|found| found.pixels() > 0);
        differing.min_by_key(|found| Reverse(found.pixels()))
    }

    /// Returns the page whose pixels boxes are in: the first stack's page, if it has one there.
    fn header(&self, found: &SectionDifference) -> &PageHeader {
        let of_stack = |stack: usize, position: Option<usize>| {
            position.map(|position| &self.headers[stack][position])
        };
        let header = of_stack(0, found.section.a).or_else(|| of_stack(1, found.section.b));
        header.expect("a section has a layer")
    }

    fn name(&self, found: &SectionDifference) -> String {
        let name = self.header(found).info.name();
        let Some([bottom, top]) = found.section.heights_um.map(|ends| ends.map(|um| um / 1000.0))
        else {
            return name;
        };
        let is_whole_layer = |stack: usize, position: Option<usize>| {
            let page = position.map(|position| &self.headers[stack][position].info);
            // Heights are stated to the nanometer, so 10 nm forgive the rounding of both ends.
            page.and_then(|info| info.thickness_um)
                .is_none_or(|um| (um / 1000.0 - (top - bottom)).abs() < 1e-5)
        };
        if is_whole_layer(0, found.section.a) && is_whole_layer(1, found.section.b) {
            name
        } else {
            format!("{name}, z {bottom:.3} to {top:.3} mm")
        }
    }

    fn sum(&self, of: fn(&SectionDifference) -> u64) -> u64 {
        // A report must not fail for the size of a sum.
        self.sections.iter().map(of).fold(0, u64::saturating_add)
    }
}

/// Returns the lines to print: the worst layers first.
pub(super) fn text(comparison: &StackComparison<'_>, all: bool) -> String {
    let [a, b] = &comparison.names;
    let sections = comparison.pairing.sections().len();
    let unit = if comparison.pairing.is_by_height() { "heights" } else { "layers" };
    let mut told: Vec<_> = comparison.told().collect();
    let forgiven = comparison.sum(|found| found.forgiven);
    let [but, besides] = match forgiven {
        0 => [String::new(), String::new()],
        1 => [", except 1 pixel that the tolerance forgives", "; the tolerance forgives 1 more"]
            .map(str::to_owned),
        pixels => [
            format!(", except {} that the tolerance forgives", number_of(pixels, "pixel")),
            format!("; the tolerance forgives {} more", grouped(pixels)),
        ],
    };
    let mut text = match told.len() {
        0 => format!("{a} and {b} are the same at {sections} {unit}{but}\n"),
        differ => format!(
            "{a} and {b} differ at {differ} of {sections} {unit}: {} added, {} missing{besides}\n",
            number_of(comparison.sum(|found| found.added), "pixel"),
            number_of(comparison.sum(|found| found.missing), "pixel"),
        ),
    };
    told.sort_by_key(|found| Reverse(found.pixels()));
    let shown = if all { told.len() } else { told.len().min(MOST_LINES) };
    for found in &told[..shown] {
        text += &lines(comparison, found, all);
    }
    if shown < told.len() {
        text += &format!("  {} more (--verbose or --json lists them)\n", told.len() - shown);
    }
    // Names come from files: they must not steer the terminal.
    text.lines().map(|line| format!("{}\n", printable(line))).collect()
}

fn lines(comparison: &StackComparison<'_>, found: &SectionDifference, all: bool) -> String {
    let [a, b] = &comparison.names;
    let only = match (found.section.a, found.section.b) {
        (Some(_), None) => format!(", only in {a}"),
        (None, Some(_)) => format!(", only in {b}"),
        _ => String::new(),
    };
    let (name, added, missing) = (comparison.name(found), found.added, found.missing);
    let mut text = format!(
        "  {name}{only}: {} added, {} missing\n",
        number_of(added, "pixel"),
        number_of(missing, "pixel")
    );
    let boxes = if all { found.boxes.len() } else { found.boxes.len().min(MOST_BOX_LINES) };
    for each in &found.boxes[..boxes] {
        let ([left, right], [top, bottom]) = (each.columns, each.rows);
        let place = match box_mm(comparison, found, each) {
            Some([x0, x1, y0, y1]) => format!(" (x {x0:.3} to {x1:.3}, y {y0:.3} to {y1:.3} mm)"),
            None => String::new(),
        };
        text += &format!(
            "    {} in columns {left} to {}, rows {top} to {}{place}\n",
            number_of(each.pixels, "pixel"),
            right - 1,
            bottom - 1
        );
    }
    match found.box_count - boxes as u64 {
        0 => {}
        more => text += &format!("    {more} more places\n"),
    }
    text
}

/// Returns least and greatest x and y of a box, if the page says where its image lies.
fn box_mm(
    comparison: &StackComparison<'_>,
    found: &SectionDifference,
    each: &DifferenceBox,
) -> Option<[f64; 4]> {
    let header = comparison.header(found);
    let ([x, y], [pitch_x, pitch_y]) = (header.info.origin_mm?, header.pitch?.mm());
    let [x0, x1] = each.columns.map(|column| to_nm(x + column as f64 * pitch_x));
    let [y1, y0] = each.rows.map(|row| to_nm(y - row as f64 * pitch_y));
    Some([x0, x1, y0, y1])
}

/// Differences of two stacks, by `lamp compare A B --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct CompareAnswer<'a> {
    /// Name of the first stack.
    a: &'a str,
    /// Name of the second stack.
    b: &'a str,
    /// Whether nothing differs.
    same: bool,
    /// Pairing of layers: by `heights` or by `indices`.
    by: &'static str,
    /// Number of compared pairs.
    compared: usize,
    /// Number of pairs that differ.
    different: usize,
    /// Distance within which edges may differ, in widths of a pixel.
    tolerance_px: f64,
    /// Pixels that are brighter in the second stack, in all layers.
    added_px: u64,
    /// Pixels that are darker in the second stack, in all layers.
    missing_px: u64,
    /// Pixels that differ within the tolerance, in all layers.
    forgiven_px: u64,
    /// Layers with such pixels, from the bottom up.
    layers: Vec<ComparedLayer>,
}

/// A pair of layers with pixels that differ.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct ComparedLayer {
    /// Index of the first stack's layer, or null if it has none.
    layer_a: Option<u32>,
    /// Index of the second stack's layer, or null if it has none.
    layer_b: Option<u32>,
    /// Bottom of what was compared, in millimeters.
    bottom_mm: Option<f64>,
    /// Top of what was compared, in millimeters.
    top_mm: Option<f64>,
    /// Pixels that are brighter in the second stack.
    added_px: u64,
    /// Pixels that are darker in the second stack.
    missing_px: u64,
    /// Pixels that differ within the tolerance.
    forgiven_px: u64,
    /// Number of boxes with pixels that differ.
    box_count: u64,
    /// The largest boxes, at most 100.
    boxes: Vec<ComparedBox>,
}

/// A box around pixels that differ.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct ComparedBox {
    /// Number of its pixels that differ.
    pixels: u64,
    /// First column and the one after the last, first row and the one after the last, in the first
    /// stack's layer, or in the second stack's where the first has none; may be negative.
    box_px: [i64; 4],
    /// Least x, greatest x, least y and greatest y, in millimeters.
    box_mm: Option<[f64; 4]>,
}

schemas! { "lamp-compare-1": CompareAnswer<'_>; }

/// Returns the answer for scripts.
pub(super) fn answer<'a>(comparison: &'a StackComparison<'_>) -> CompareAnswer<'a> {
    let page = |stack: usize, position: Option<usize>| {
        position.map(|position| comparison.headers[stack][position].info.index)
    };
    let layers = comparison.sections.iter().map(|found| {
        let mm = |end: usize| found.section.heights_um.map(|ends| to_nm(ends[end] / 1000.0));
        let boxes = found.boxes.iter().map(|each| compared_box(comparison, found, each));
        ComparedLayer {
            layer_a: page(0, found.section.a),
            layer_b: page(1, found.section.b),
            bottom_mm: mm(0),
            top_mm: mm(1),
            added_px: found.added,
            missing_px: found.missing,
            forgiven_px: found.forgiven,
            box_count: found.box_count,
            boxes: boxes.collect(),
        }
    });
    CompareAnswer {
        a: &comparison.names[0],
        b: &comparison.names[1],
        same: comparison.is_same(),
        by: if comparison.pairing.is_by_height() { "heights" } else { "indices" },
        compared: comparison.pairing.sections().len(),
        different: comparison.told().count(),
        tolerance_px: comparison.tolerance[0],
        added_px: comparison.sum(|found| found.added),
        missing_px: comparison.sum(|found| found.missing),
        forgiven_px: comparison.sum(|found| found.forgiven),
        layers: layers.collect(),
    }
}

fn compared_box(
    comparison: &StackComparison<'_>,
    found: &SectionDifference,
    each: &DifferenceBox,
) -> ComparedBox {
    let ([left, right], [top, bottom]) = (each.columns, each.rows);
    ComparedBox {
        pixels: each.pixels,
        box_px: [left, right, top, bottom],
        box_mm: box_mm(comparison, found, each),
    }
}
