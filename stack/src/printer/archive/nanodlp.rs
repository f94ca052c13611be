//! NanoDLP's plates: `plate.json`, `slicer.json` or `options.json`, `profile.json`, images `1.png`
//! and up, and a picture `3d.png`.
//!
//! A profile has two steps, of the first layers (called support) and of all others; lifts are all
//! that is known of moves. Formulas of a profile are not evaluated.

use serde::Deserialize;
use serde_json::{Value, json};

use crate::error::StackError;
use crate::printer::archive::read::{Archive, images};
use crate::printer::archive::{Plate, even_layers, json as parsed, rounded};
use crate::printer::fault::PrinterFault;
use crate::printer::panel::orientation;
use crate::printer::write::Print;
use crate::record::{PrintRecord, PrintStep};

pub(crate) const PLATE: &str = "plate.json";
const SLICER: [&str; 2] = ["slicer.json", "options.json"];
const PROFILE: &str = "profile.json";
/// A profile of the plate alone, which counts in place of the other.
const OVERRIDE: &str = "override.json";
const META: &str = "meta.json";
pub(crate) const PICTURE: &str = "3d.png";
/// The version of the format.
const VERSION: u32 = 2;

#[derive(Default, Deserialize)]
#[serde(rename_all = "PascalCase", default)]
struct Meta {
    format_version: u32,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "PascalCase", default)]
struct PlateText {
    path: Option<String>,
    layers_count: u32,
    cure_times: Option<Vec<f64>>,
    dynamic_thickness: Option<Vec<f64>>,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "PascalCase", default)]
struct Slicer {
    p_width: u32,
    p_height: u32,
    x_pixel_size: f64,
    y_pixel_size: f64,
    /// In micrometers.
    thickness: f64,
    image_mirror: u8,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "PascalCase", default)]
struct Profile {
    title: String,
    desc: String,
    depth: f64,
    support_layer_number: u32,
    transitional_layer: u32,
    cure_time: f64,
    wait_before_print: f64,
    wait_after_print: f64,
    top_wait: f64,
    wait_height: f64,
    support_cure_time: f64,
    support_wait_before_print: f64,
    support_wait_after_print: f64,
    support_top_wait: f64,
    support_wait_height: f64,
    custom_values: Custom,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "PascalCase", default)]
struct Custom {
    /// The light, from 0 to 1.
    uv_pwm_value: Option<String>,
}

pub(crate) fn read(archive: &mut Archive) -> Result<Plate, StackError> {
    let meta: Meta = parsed(archive, META)?.unwrap_or_default();
    if meta.format_version > VERSION {
        let found = meta.format_version.to_string();
        return Err(PrinterFault::Version { found, read: "2" }.into());
    }
    let plate: PlateText = parsed(archive, PLATE)?.unwrap_or_default();
    let mut slicer: Option<Slicer> = None;
    for name in SLICER {
        slicer = slicer.or(parsed(archive, name)?);
    }
    let slicer = slicer.ok_or_else(|| PrinterFault::Missing(SLICER[0].to_owned()))?;
    let own = parsed(archive, OVERRIDE)?;
    let profile: Option<Profile> = if own.is_some() { own } else { parsed(archive, PROFILE)? };
    let profile = profile.ok_or_else(|| PrinterFault::Missing(PROFILE.to_owned()))?;
    if plate.cure_times.is_some_and(|times| !times.is_empty()) {
        return Err(PrinterFault::Unread("times of single layers (CureTimes)").into());
    }
    if plate.dynamic_thickness.is_some_and(|thickness| !thickness.is_empty()) {
        return Err(PrinterFault::Unread("thicknesses of single layers (DynamicThickness)").into());
    }
    let index = |name: &str| name.strip_suffix(".png")?.parse::<u32>().ok()?.checked_sub(1);
    // Without a count, all images count.
    let layers = match plate.layers_count {
        0 => archive.names().filter_map(|name| index(&name)).max().map_or(0, |last| last + 1),
        layers => layers,
    };
    let files = images(archive, layers, index, |layer| format!("{}.png", u64::from(layer) + 1))?;
    let light = profile.custom_values.uv_pwm_value.and_then(|value| value.parse::<f64>().ok());
    let light = light.map_or(255, |part| (part * 255.0).round() as u16);
    let step = |exposure_s, wait_before_s, wait_after_s, wait_lifted_s, lift| PrintStep {
        exposure_s,
        light,
        wait_before_s,
        wait_after_s,
        wait_lifted_s,
        lift_mm: [lift, 0.0],
        ..PrintStep::default()
    };
    let record = PrintRecord {
        printer: profile.title,
        resin: profile.desc,
        panel_px: [slicer.p_width, slicer.p_height],
        panel_mm: [
            rounded(f64::from(slicer.p_width) * slicer.x_pixel_size),
            rounded(f64::from(slicer.p_height) * slicer.y_pixel_size),
        ],
        mirrored: [slicer.image_mirror != 0, false],
        height_mm: 0.0,
        first_layers: profile.support_layer_number,
        transition_layers: profile.transitional_layer,
        first: step(
            profile.support_cure_time,
            profile.support_wait_before_print,
            profile.support_wait_after_print,
            profile.support_top_wait,
            profile.support_wait_height,
        ),
        normal: step(
            profile.cure_time,
            profile.wait_before_print,
            profile.wait_after_print,
            profile.top_wait,
            profile.wait_height,
        ),
    };
    let thickness_um = if slicer.thickness > 0.0 { slicer.thickness } else { profile.depth };
    Ok(Plate {
        part: plate.path.unwrap_or_default(),
        orientation: orientation(record.mirrored),
        layers: even_layers(files, thickness_um, &record)?,
        record,
    })
}

/// Returns the name of a layer's image.
pub(crate) fn image_name(layer: u32) -> String {
    format!("{}.png", layer + 1)
}

/// Returns the texts of a plate.
pub(crate) fn texts(print: &Print<'_>) -> Vec<(&'static str, Value)> {
    let Print { record, totals, part, .. } = print;
    let PrintRecord { first, normal, .. } = record;
    let pitch_mm = |side: usize| rounded(record.panel_mm[side] / f64::from(record.panel_px[side]));
    let seconds = totals.time_s.round() as u64;
    let lift = |step: &PrintStep| step.lift_mm[0] + step.lift_mm[1];
    let version = env!("CARGO_PKG_VERSION");
    let slicer = json!({
        "PWidth": record.panel_px[0],
        "PHeight": record.panel_px[1],
        "Thickness": totals.thickness_um,
        "XPixelSize": pitch_mm(0),
        "YPixelSize": pitch_mm(1),
        "XRes": rounded(pitch_mm(0) * 1000.0),
        "YRes": rounded(pitch_mm(1) * 1000.0),
        "SupportLayerNumber": record.first_layers,
        "ImageMirror": u8::from(record.mirrored[0]),
        "LayerCount": totals.layers,
        "FillColor": "#ffffff",
        "BlankColor": "#000000",
    });
    vec![
        (META, json!({"FormatVersion": VERSION, "Program": "LAMP", "Version": version})),
        (SLICER[0], slicer.clone()),
        (SLICER[1], slicer),
        (
            PLATE,
            json!({
                "Path": part,
                "LayersCount": totals.layers,
                "PrintTime": seconds,
                "PrintEst": seconds,
                "Processed": true,
                // In cubic centimeters.
                "TotalSolidArea": totals.volume_mm3 / 1000.0,
                "ZMax": totals.height_um / 1000.0,
            }),
        ),
        (
            PROFILE,
            json!({
                "Title": record.printer,
                "Desc": record.resin,
                "Depth": totals.thickness_um,
                "SupportDepth": totals.thickness_um,
                "SupportLayerNumber": record.first_layers,
                "TransitionalLayer": record.transition_layers,
                "CureTime": normal.exposure_s,
                "WaitBeforePrint": normal.wait_before_s,
                "WaitAfterPrint": normal.wait_after_s,
                "TopWait": normal.wait_lifted_s,
                "WaitHeight": lift(normal),
                "SupportCureTime": first.exposure_s,
                "SupportWaitBeforePrint": first.wait_before_s,
                "SupportWaitAfterPrint": first.wait_after_s,
                "SupportTopWait": first.wait_lifted_s,
                "SupportWaitHeight": lift(first),
                "CustomValues": {"UvPwmValue": (f64::from(normal.light) / 255.0).to_string()},
            }),
        ),
    ]
}
