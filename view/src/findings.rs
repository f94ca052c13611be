//! Findings of `lamp check` and `lamp support`, in the form that the page shows.

use std::ops::Range;

use lamp_stack::{Frame, Mask, MaskBuilder, Op, PageHeader};
use lamp_supports::{Feature, FindingRecord, FoundPixels, inner_components};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::overlay::only_in;

/// Something that a person should look at.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Finding {
    /// The kind, as reports of `lamp check` have it, or `support`.
    pub kind: String,
    /// The position of its first layer in the stack, from 0.
    pub layer: usize,
    /// The position of its last layer.
    pub last_layer: usize,
    /// The rectangle around it: left column, top row, and the ends of both; if it has a place.
    #[serde(rename = "box")]
    pub bounds: Option<[u32; 4]>,
    /// A point within it.
    pub at: Option<[f64; 2]>,
    /// The height of the bottom of its first layer, if it is known.
    pub z_mm: Option<f64>,
    /// A line about it, without the name of its kind.
    pub text: String,
    /// The line without its layers.
    pub about: String,
    /// The pixels of the rectangle that are drawn.
    #[serde(skip)]
    pub pixels: FoundPixels,
}

/// The longest list that people can look through.
const MOST: usize = 10_000;

/// Returns what a check found in a stack, given the records that name features, for each a line with its
/// layers and one without, and the stack's pages.
///
/// # Errors
/// Returns a sentence if the findings are about a stack with other layers.
pub fn of_records<'a>(
    records: impl Iterator<Item = (&'a FindingRecord, String, String)>,
    headers: &[PageHeader],
) -> Result<Vec<Finding>, String> {
    let found = records.take(MOST);
    let found = found.map(|(record, text, about)| of_record(record, text, about, headers));
    fitting(found.collect(), headers)
}

/// Reads a report of `lamp check` or `lamp support` about a stack, given its pages.
///
/// # Errors
/// Returns a sentence if it is no such report, or a report about another stack.
pub fn of_report(report: &Value, headers: &[PageHeader]) -> Result<Vec<Finding>, String> {
    let found = match report["schema"].as_str() {
        Some("lamp-check-1" | "lamp-check-2") => check_report(report, headers)?,
        Some("lamp-support-1" | "lamp-support-2" | "lamp-support-3") => {
            support_report(report, headers)
        }
        _ => return Err("this is not a report of lamp check or lamp support".to_owned()),
    };
    fitting(found, headers)
}

fn fitting(found: Vec<Finding>, headers: &[PageHeader]) -> Result<Vec<Finding>, String> {
    if found.iter().all(|finding| finding.last_layer < headers.len()) {
        Ok(found)
    } else {
        Err("the report is about a stack with different layers".to_owned())
    }
}

/// Returns the position of a layer by its index.
fn position(headers: &[PageHeader], index: u64) -> usize {
    let same = headers.iter().position(|header| u64::from(header.info.index) == index);
    // `fitting` refuses a layer that is not there.
    same.unwrap_or(usize::MAX)
}

fn check_report(report: &Value, headers: &[PageHeader]) -> Result<Vec<Finding>, String> {
    let inputs = report["inputs"].as_array().map_or(&[][..], Vec::as_slice);
    let [input] = inputs else {
        return Err(format!("the report is about {} stacks: check only this one", inputs.len()));
    };
    let size = headers.first().map_or([0; 2], |first| first.size);
    // Pixels of findings fit only images of the same size.
    if [&input["width_px"], &input["height_px"]] != size.map(Value::from).each_ref() {
        return Err("the report is about a stack of a different size".to_owned());
    }
    let findings = report["findings"].as_array().map_or(&[][..], Vec::as_slice);
    let record = |number: usize| {
        let json = findings.get(number).unwrap_or(&Value::Null);
        FindingRecord::deserialize(json)
            .map_err(|error| format!("finding {} of the report: {error}", number + 1))
    };
    // Since lamp-check-2 findings belong to features, and the finding that names one is shown.
    let features: Vec<Feature> = match report["features"].as_array() {
        Some(features) => features
            .iter()
            .take(MOST)
            .map(Feature::deserialize)
            .collect::<Result<_, _>>()
            .map_err(|error| format!("a feature of the report: {error}"))?,
        None => (0..findings.len().min(MOST)).map(Feature::of_one).collect(),
    };
    let read = |feature: &Feature| {
        let naming = record(feature.finding)?;
        let text = naming.size_text() + &feature.more_text(|at| record(at).ok());
        Ok(of_record(&naming, text.clone(), text, headers))
    };
    features.iter().map(read).collect()
}

fn of_record(
    record: &FindingRecord,
    text: String,
    about: String,
    headers: &[PageHeader],
) -> Finding {
    let [layer, last_layer] = record.layers().map(|index| position(headers, index.into()));
    let bounds = record.box_px().map(|[left, right, top, bottom]| [left, top, right, bottom]);
    // A report says nothing of heights in stacks without them.
    let z_mm = record.z_mm().or_else(|| z_of(headers.get(layer)?));
    let (kind, at, pixels) = (record.kind().to_owned(), record.at_px(), record.pixels());
    Finding { kind, layer, last_layer, bounds, at, z_mm, text, about, pixels }
}

/// Returns the height of the bottom of a layer.
fn z_of(header: &PageHeader) -> Option<f64> {
    Some(header.info.z()?.mm())
}

/// The half side of the square around an island that is held, in pixels.
const AROUND: u32 = 12;

fn support_report(report: &Value, headers: &[PageHeader]) -> Vec<Finding> {
    let plans = report["plans"].as_array().into_iter().flatten().take(MOST);
    plans.filter_map(|plan| of_plan(plan, headers)).collect()
}

fn of_plan(plan: &Value, headers: &[PageHeader]) -> Option<Finding> {
    let layer = position(headers, plan["layer"].as_u64()?);
    let header = headers.get(layer);
    // A stack without an origin has no place for millimeters: the finding is only listed.
    let at = header.and_then(|header| {
        let at = plan["at_mm"].as_array()?;
        let ([left, top], [pitch_x, pitch_y]) = (header.info.origin_mm?, header.pitch?.mm());
        let [x, y] = [at.first()?.as_f64()?, at.get(1)?.as_f64()?];
        Some([(x - left) / pitch_x, (top - y) / pitch_y])
    });
    let bounds = at.zip(header).map(|(at, header)| {
        let pixel = at.map(|at| at.max(0.0) as u32);
        let low = pixel.map(|at| at.saturating_sub(AROUND));
        let high = |axis: usize| pixel[axis].saturating_add(AROUND).min(header.size[axis]);
        [low[0], low[1], high(0), high(1)]
    });
    let places = plan["places"].as_array().into_iter().flatten();
    let held = places.filter(|place| place["supports"].get(0).is_some()).count();
    let what = match (plan["left"].as_bool().unwrap_or(false), held) {
        (true, _) => "left: no support was found".to_owned(),
        (false, 1) => "held by 1 support".to_owned(),
        (false, held) => format!("held by {held} supports"),
    };
    let number = plan["number"].as_u64().map_or_else(String::new, |n| format!(" {n}"));
    let text = format!("island{number}, {what}");
    let (kind, pixels) = ("support".to_owned(), FoundPixels::All);
    let (z_mm, about) = (header.and_then(z_of), text.clone());
    Some(Finding { kind, layer, last_layer: layer, bounds, at, z_mm, text, about, pixels })
}

impl Finding {
    /// Returns whether it concerns a layer.
    pub(crate) fn is_in(&self, layer: usize) -> bool {
        (self.layer..=self.last_layer).contains(&layer)
    }
}

/// Draws the pixels of the findings of a layer, given the layer below.
pub(crate) fn drawn<'a>(
    findings: impl Iterator<Item = &'a Finding>,
    layer: &Mask,
    below: &Mask,
) -> Mask {
    let mut all = Mask::black(layer.width(), layer.height());
    for finding in findings {
        let Some([left, top, right, bottom]) = finding.bounds else { continue };
        let [width, height] = [layer.width(), layer.height()];
        // Bounds may come from a report, and images of one stack differ in size.
        let bounds = [left.min(width), top.min(height), right.min(width), bottom.min(height)];
        // A margin of a pixel, so that findings do not touch the border.
        let frame = around(bounds);
        let here = layer.framed(frame);
        let found = match finding.pixels {
            FoundPixels::Black => inner_components(&here, false),
            FoundPixels::White => inner_components(&here, true),
            FoundPixels::Unheld => only_in(&here, &below.framed(frame)),
            FoundPixels::All => here,
        };
        let found = cut(&found, &frame, bounds, [width, height]);
        all = all.combined(Op::Union, &found).expect("they have one size");
    }
    all
}

fn around([left, top, right, bottom]: [u32; 4]) -> Frame {
    let length = |from: u32, to: u32| to.saturating_sub(from).saturating_add(2);
    Frame {
        left: i64::from(left) - 1,
        top: i64::from(top) - 1,
        width: length(left, right),
        height: length(top, bottom),
    }
}

/// Puts a frame's content within bounds back into an image of this size, which holds the bounds.
fn cut(found: &Mask, frame: &Frame, bounds: [u32; 4], [width, height]: [u32; 2]) -> Mask {
    let back = Frame { left: -frame.left, top: -frame.top, width, height };
    let [left, top, right, bottom] = bounds;
    let (columns, rows) = (left..right.max(left), top..bottom.max(top));
    let window = window([width, height], columns, rows);
    found.framed(back).combined(Op::Intersect, &window).expect("they have one size")
}

/// Returns a mask that is white in a rectangle.
fn window([width, height]: [u32; 2], columns: Range<u32>, rows: Range<u32>) -> Mask {
    let mut mask = MaskBuilder::new(width);
    let rows = if columns.is_empty() { 0..0 } else { rows };
    mask.push_black(rows.start);
    let ends: Vec<u32> =
        [columns.start, columns.end].into_iter().filter(|&at| at < width).collect();
    for _ in rows.clone() {
        mask.push_row(&ends).expect("the columns increase");
    }
    mask.push_black(height - rows.end);
    mask.finish()
}

#[cfg(test)]
mod tests {
    use lamp_stack::{Compression, PageInfo};
    use serde_json::json;

    use super::*;

    fn headers(layers: u32) -> Vec<PageHeader> {
        let header = |index| PageHeader {
            info: PageInfo { index, origin_mm: Some([0.0, 1.0]), ..PageInfo::default() },
            pitch: lamp_stack::Pitch::of_dpi(254.0),
            size: [60, 40],
            gray: false,
            compression: Compression::G4,
            data_bytes: 0,
            exposed_px: None,
            pages: None,
        };
        (5..5 + layers).map(header).collect()
    }

    #[test]
    fn reports_are_read() {
        let report = json!({
            "schema": "lamp-check-1",
            "inputs": [{"width_px": 60, "height_px": 40}],
            "findings": [
                {"kind": "island", "layer": 6, "box_px": [10, 14, 20, 22], "at_px": [12.0, 21.0],
                 "area_mm2": 0.5, "joins": 8},
                {"kind": "trap", "layer": 5, "last_layer": 7, "box_px": [0, 3, 1, 4], "volume_mm3": 2},
                {"kind": "off-balance", "layer": 7, "base_box_px": [1, 2, 3, 4], "off_mm": 1.25},
            ],
        });
        let found = of_report(&report, &headers(3)).unwrap();
        let island = &found[0];
        assert_eq!((island.layer, island.last_layer, island.at), (1, 1, Some([12.0, 21.0])));
        assert_eq!(island.bounds, Some([10, 20, 14, 22]));
        assert_eq!(island.text, "0.5 mm2, joins in layer 8");
        assert_eq!((found[1].layer, found[1].last_layer), (0, 2));
        assert_eq!(found[2].bounds, Some([1, 3, 2, 4]));
        assert!(of_report(&report, &headers(2)).unwrap_err().contains("different layers"));
    }

    #[test]
    fn features_of_reports_have_their_counts() {
        let overhang = json!({"kind": "overhang", "layer": 6, "last_layer": 6,
            "box_px": [10, 14, 20, 22], "area_px": 8, "area_mm2": 0.5, "span_mm": 4.2, "span_px": 42.0});
        let report = json!({
            "schema": "lamp-check-2",
            "inputs": [{"width_px": 60, "height_px": 40}],
            "findings": [overhang, overhang, overhang],
            "features": [{"severity": "look", "finding": 1, "with": [0], "alike": [2], "input": 0}],
        });
        let found = of_report(&report, &headers(3)).unwrap();
        assert_eq!(found.len(), 1);
        assert_eq!(
            found[0].text,
            "0.5 mm2, bridge of 4.2 mm span; with 1 overhang (bridge of 4.20 mm span); and 1 more like it"
        );
    }

    #[test]
    fn reports_of_other_stacks_are_refused() {
        let with = |inputs| json!({"schema": "lamp-check-1", "inputs": inputs, "findings": []});
        let error = |report: &Value| of_report(report, &headers(3)).unwrap_err();
        assert!(error(&json!({"schema": "lamp-plan-1"})).contains("not a report"));
        assert!(error(&json!([])).contains("not a report"));
        assert!(
            error(&with(json!([{"width_px": 61, "height_px": 40}]))).contains("a different size")
        );
        assert!(error(&with(json!([{}, {}]))).contains("2 stacks"));
    }

    #[test]
    fn plans_of_supports_are_read() {
        let plan = |left: bool, supports: Value| {
            json!({"number": 3, "layer": 6, "at_mm": [2.0, 0.5], "left": left,
                   "places": [{"supports": supports}]})
        };
        let plans = json!([plan(false, json!([{}])), plan(true, json!([]))]);
        let report = json!({"schema": "lamp-support-1", "plans": plans});
        let found = of_report(&report, &headers(3)).unwrap();
        assert_eq!(found[0].text, "island 3, held by 1 support");
        assert_eq!(found[0].bounds, Some([8, 0, 32, 17]));
        let at = found[0].at.unwrap();
        assert!((at[0] - 20.0).abs() < 1e-9 && (at[1] - 5.0).abs() < 1e-9, "{at:?}");
        assert_eq!(found[1].text, "island 3, left: no support was found");
    }

    #[test]
    fn the_pixels_of_findings_are_drawn() {
        let mask = |rows: &[&[u32]]| {
            let mut mask = MaskBuilder::new(12);
            rows.iter().for_each(|row| mask.push_row(row).unwrap());
            mask.finish()
        };
        // A ring, a block next to it, and a block that hangs over to the right.
        let layer = mask(&[&[], &[1, 5, 7, 8, 9], &[1, 2, 4, 5, 7, 8, 9], &[1, 5, 9], &[]]);
        let below = mask(&[&[], &[9, 10], &[9, 10], &[9, 10], &[]]);
        let finding = |pixels, bounds| Finding {
            kind: String::new(),
            layer: 0,
            last_layer: 0,
            bounds: Some(bounds),
            at: None,
            z_mm: None,
            text: String::new(),
            about: String::new(),
            pixels,
        };
        let drawn = |pixels, bounds| drawn([finding(pixels, bounds)].iter(), &layer, &below);
        assert_eq!(drawn(FoundPixels::Black, [2, 2, 4, 3]), mask(&[&[], &[], &[2, 4], &[], &[]]));
        assert_eq!(
            drawn(FoundPixels::White, [7, 1, 8, 3]),
            mask(&[&[], &[7, 8], &[7, 8], &[], &[]])
        );
        let hangs: &[u32] = &[10];
        assert_eq!(
            drawn(FoundPixels::Unheld, [9, 1, 12, 4]),
            mask(&[&[], hangs, hangs, hangs, &[]])
        );
        // Boxes of false reports.
        assert_eq!(drawn(FoundPixels::All, [50, 50, 60, 60]).white_pixels(), 0);
        assert_eq!(drawn(FoundPixels::White, [8, 3, 7, 1]).white_pixels(), 0);
        assert_eq!(drawn(FoundPixels::White, [0, 0, u32::MAX, u32::MAX]), layer);
    }
}
