//! UVJ, UVtools' own format, which is for any printer: `config.json`, images `slice/00000000.png`
//! and up, and two pictures in `preview/`. Images are as the panel shows them.

use serde::{Deserialize, Serialize};

use crate::error::StackError;
use crate::printer::archive::read::{Archive, images};
use crate::printer::archive::{Plate, PlateLayer, json};
use crate::printer::fault::PrinterFault;
use crate::printer::panel::orientation;
use crate::printer::total::PrintLayer;
use crate::printer::write::Print;
use crate::record::{PrintRecord, PrintStep};

pub(crate) const CONFIG: &str = "config.json";
pub(crate) const PICTURES: [(&str, [u32; 2]); 2] =
    [("preview/tiny.png", [400, 400]), ("preview/huge.png", [800, 480])];

#[derive(Deserialize, Serialize)]
#[serde(rename_all = "PascalCase")]
struct Config {
    properties: Properties,
    #[serde(default)]
    layers: Option<Vec<LayerText>>,
}

#[derive(Deserialize, Serialize)]
#[serde(rename_all = "PascalCase")]
struct Properties {
    size: Size,
    #[serde(default)]
    exposure: Exposure,
    #[serde(default)]
    bottom: Bottom,
    #[serde(default)]
    vendor: Option<Vendor>,
    #[serde(default)]
    anti_alias_level: u32,
}

#[derive(Deserialize, Serialize)]
#[serde(rename_all = "PascalCase")]
struct Size {
    x: u32,
    y: u32,
    #[serde(default)]
    millimeter: Millimeter,
    layers: u32,
    layer_height: f64,
}

#[derive(Default, Deserialize, Serialize)]
#[serde(rename_all = "PascalCase", default)]
struct Millimeter {
    x: f64,
    y: f64,
}

#[derive(Default, Deserialize, Serialize)]
#[serde(rename_all = "PascalCase", default)]
struct Exposure {
    wait_time_before_cure: f64,
    light_off_time: f64,
    light_on_time: f64,
    #[serde(rename = "LightPWM")]
    light_pwm: u16,
    wait_time_after_cure: f64,
    lift_height: f64,
    lift_speed: f64,
    lift_height2: f64,
    lift_speed2: f64,
    wait_time_after_lift: f64,
    retract_height: f64,
    retract_speed: f64,
    retract_height2: f64,
    retract_speed2: f64,
}

#[derive(Default, Deserialize, Serialize)]
#[serde(rename_all = "PascalCase", default)]
struct Bottom {
    count: u32,
    #[serde(flatten)]
    exposure: Exposure,
}

#[derive(Deserialize, Serialize)]
#[serde(rename_all = "PascalCase")]
struct LayerText {
    z: f64,
    #[serde(default)]
    exposure: Exposure,
}

/// The texts that the format leaves to each program.
#[derive(Default, Deserialize, Serialize)]
#[serde(default)]
struct Vendor {
    #[serde(rename = "LAMP", skip_serializing_if = "Option::is_none")]
    lamp: Option<Own>,
}

#[derive(Default, Deserialize, Serialize)]
#[serde(default)]
struct Own {
    printer: String,
    resin: String,
    mirrored: [bool; 2],
    height_mm: f64,
    transition_layers: u32,
}

impl Exposure {
    fn of(step: &PrintStep) -> Self {
        Self {
            wait_time_before_cure: step.wait_before_s,
            light_off_time: step.light_off_s,
            light_on_time: step.exposure_s,
            light_pwm: step.light,
            wait_time_after_cure: step.wait_after_s,
            lift_height: step.lift_mm[0],
            lift_speed: step.lift_mm_per_min[0],
            lift_height2: step.lift_mm[1],
            lift_speed2: step.lift_mm_per_min[1],
            wait_time_after_lift: step.wait_lifted_s,
            retract_height: step.retract_mm[0],
            retract_speed: step.retract_mm_per_min[0],
            retract_height2: step.retract_mm[1],
            retract_speed2: step.retract_mm_per_min[1],
        }
    }

    fn step(&self) -> PrintStep {
        PrintStep {
            exposure_s: self.light_on_time,
            light: self.light_pwm,
            light_off_s: self.light_off_time,
            wait_before_s: self.wait_time_before_cure,
            wait_after_s: self.wait_time_after_cure,
            wait_lifted_s: self.wait_time_after_lift,
            lift_mm: [self.lift_height, self.lift_height2],
            lift_mm_per_min: [self.lift_speed, self.lift_speed2],
            retract_mm: [self.retract_height, self.retract_height2],
            retract_mm_per_min: [self.retract_speed, self.retract_speed2],
        }
    }
}

pub(crate) fn read(archive: &mut Archive) -> Result<Plate, StackError> {
    let config: Option<Config> = json(archive, CONFIG)?;
    let config = config.ok_or_else(|| PrinterFault::Missing(CONFIG.to_owned()))?;
    let Properties { size, exposure, bottom, vendor, .. } = config.properties;
    let own = vendor.and_then(|vendor| vendor.lamp).unwrap_or_default();
    let record = PrintRecord {
        printer: own.printer,
        resin: own.resin,
        panel_px: [size.x, size.y],
        panel_mm: [size.millimeter.x, size.millimeter.y],
        mirrored: own.mirrored,
        height_mm: own.height_mm,
        first_layers: bottom.count,
        transition_layers: own.transition_layers,
        first: bottom.exposure.step(),
        normal: exposure.step(),
    };
    let index = |name: &str| name.strip_prefix("slice/")?.strip_suffix(".png")?.parse().ok();
    let files = images(archive, size.layers, index, image_name)?;
    let texts = config.layers.unwrap_or_default();
    // Layers without a text of their own are the printer's.
    let layer = |(number, file): (u32, usize)| match texts.get(number as usize) {
        Some(text) => {
            PlateLayer { file, top_mm: text.z, step: text.exposure.step(), pauses: false }
        }
        None => PlateLayer {
            file,
            top_mm: (f64::from(number + 1) * size.layer_height * 1e6).round() / 1e6,
            step: record.step(number),
            pauses: false,
        },
    };
    let layers = (0..).zip(files).map(layer).collect();
    let orientation = orientation(record.mirrored);
    Ok(Plate { part: String::new(), orientation, layers, record })
}

/// Returns the name of a layer's image.
pub(crate) fn image_name(layer: u32) -> String {
    format!("slice/{layer:08}.png")
}

/// Returns the text of a file.
pub(crate) fn text(print: &Print<'_>, layers: &[PrintLayer]) -> String {
    let Print { record, totals, .. } = print;
    let [x, y] = record.panel_mm;
    let layer =
        |layer: &PrintLayer| LayerText { z: layer.top_mm, exposure: Exposure::of(&layer.step) };
    let properties = Properties {
        size: Size {
            x: record.panel_px[0],
            y: record.panel_px[1],
            millimeter: Millimeter { x, y },
            layers: totals.layers,
            layer_height: totals.thickness_um / 1000.0,
        },
        exposure: Exposure::of(&record.normal),
        bottom: Bottom { count: record.first_layers, exposure: Exposure::of(&record.first) },
        vendor: Some(Vendor {
            lamp: Some(Own {
                printer: record.printer.clone(),
                resin: record.resin.clone(),
                mirrored: record.mirrored,
                height_mm: record.height_mm,
                transition_layers: record.transition_layers,
            }),
        }),
        anti_alias_level: 1,
    };
    let config = Config { properties, layers: Some(layers.iter().map(layer).collect()) };
    serde_json::to_string(&config).expect("texts are keys, and numbers are finite")
}
