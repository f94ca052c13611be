//! SL1 and SL1S files of Prusa's printers: `config.ini`, `prusaslicer.ini`, images
//! `NAME00000.png` and up, and pictures in `thumbnail/`.
//!
//! The exposure falls over `numFade` layers, from the first layer's to the others'. The printer
//! knows its moves.

use std::collections::HashMap;
use std::fmt::Write;

use crate::error::StackError;
use crate::printer::archive::read::{Archive, first_size, images};
use crate::printer::archive::{Plate, PlateLayer, even_layers};
use crate::printer::fault::PrinterFault;
use crate::printer::panel::orientation;
use crate::printer::write::Print;
use crate::record::{PrintRecord, PrintStep};

pub(crate) const CONFIG: &str = "config.ini";
const SLICER: &str = "prusaslicer.ini";

/// The `key = value` lines of a text.
struct Ini(HashMap<String, String>);

impl Ini {
    fn read(archive: &mut Archive, name: &str) -> Result<Option<Self>, StackError> {
        let Some(bytes) = archive.text(name)? else { return Ok(None) };
        let text = String::from_utf8_lossy(&bytes);
        let pair = |line: &str| {
            let (key, value) = line.split_once('=')?;
            Some((key.trim().to_owned(), value.trim().to_owned()))
        };
        Ok(Some(Self(text.lines().filter_map(pair).collect())))
    }

    fn text(&self, key: &str) -> String {
        self.0.get(key).cloned().unwrap_or_default()
    }

    /// Returns a number; 0 if it is absent, as the format has it.
    fn number(&self, key: &str, file: &str) -> Result<f64, PrinterFault> {
        let Some(value) = self.0.get(key) else { return Ok(0.0) };
        let number = value.parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| PrinterFault::Text {
            file: file.to_owned(),
            problem: format!("{key} is no number"),
        })
    }
}

pub(crate) fn read(archive: &mut Archive) -> Result<Plate, StackError> {
    let config = Ini::read(archive, CONFIG)?.ok_or_else(|| PrinterFault::Missing(CONFIG.into()))?;
    let slicer = Ini::read(archive, SLICER)?.unwrap_or(Ini(HashMap::new()));
    let of_config = |key| config.number(key, CONFIG);
    let of_slicer = |key| slicer.number(key, SLICER);
    let layers = of_config("numFast")? + of_config("numSlow")?;
    // The number of a layer ends its name; images in folders are no layers.
    let index = |name: &str| {
        let stem = name.strip_suffix(".png").filter(|stem| !stem.contains(['/', '\\']))?;
        let digits = stem.bytes().rev().take_while(u8::is_ascii_digit).take(5).count();
        stem[stem.len() - digits..].parse().ok()
    };
    let job = config.text("jobDir");
    let files = images(archive, layers as u32, index, |layer| image_name(&job, layer))?;
    let size = first_size(archive, &files)?;
    let sides = [of_slicer("display_pixels_x")?, of_slicer("display_pixels_y")?];
    let mut panel_mm = [of_slicer("display_width")?, of_slicer("display_height")?];
    let mut mirrored =
        [of_slicer("display_mirror_x")? != 0.0, of_slicer("display_mirror_y")? != 0.0];
    // A panel that stands upright has its images turned.
    if sides != size.map(f64::from) && sides == [size[1], size[0]].map(f64::from) {
        panel_mm.reverse();
        mirrored.reverse();
    }
    let faded = of_config("numFade")? as u32;
    let step = |exposure_s| PrintStep { exposure_s, light: 255, ..PrintStep::default() };
    let record = PrintRecord {
        printer: config.text("printerModel"),
        resin: config.text("materialName"),
        panel_px: size,
        panel_mm,
        mirrored,
        height_mm: of_slicer("max_print_height")?,
        first_layers: faded.min(1),
        transition_layers: faded.saturating_sub(1),
        first: step(of_config("expTimeFirst")?),
        normal: step(of_config("expTime")?),
    };
    let mut layers = even_layers(files, of_config("layerHeight")? * 1000.0, &record)?;
    let first_mm = of_slicer("initial_layer_height")?;
    if let Some(&PlateLayer { top_mm, .. }) = layers.first()
        && first_mm > 0.0
    {
        let higher = |layer: &mut PlateLayer| layer.top_mm += first_mm - top_mm;
        layers.iter_mut().for_each(higher);
    }
    Ok(Plate { part: job, orientation: orientation(mirrored), layers, record })
}

/// Returns the name of a layer's image.
pub(crate) fn image_name(job: &str, layer: u32) -> String {
    format!("{job}{layer:05}.png")
}

/// Returns the name of a job for a part: letters, digits and some signs.
pub(crate) fn job_name(part: &str) -> String {
    let is_plain = |letter: &char| letter.is_ascii_alphanumeric() || matches!(letter, '-' | '_');
    let name: String = part.chars().filter(is_plain).take(100).collect();
    // A digit at its end would count as a layer's.
    match name.trim_end_matches(|letter: char| letter.is_ascii_digit()) {
        "" => "print".to_owned(),
        plain if plain.len() == name.len() => name,
        plain => format!("{plain}_"),
    }
}

/// Returns the texts of a file.
pub(crate) fn texts(print: &Print<'_>) -> Vec<(&'static str, String)> {
    let Print { record, totals, .. } = print;
    let PrintRecord { first, normal, panel_px, panel_mm, .. } = record;
    let faded = record.first_layers.saturating_add(record.transition_layers);
    let ini = |pairs: &[(&str, &dyn std::fmt::Display)]| {
        pairs.iter().fold(String::new(), |mut text, (key, value)| {
            // A name that breaks lines would be two keys.
            let value = crate::text::one_line(&value.to_string());
            writeln!(text, "{key} = {value}").expect("writing to a String cannot fail");
            text
        })
    };
    let thickness_mm = totals.thickness_um / 1000.0;
    let config = ini(&[
        ("action", &"print"),
        ("expTime", &normal.exposure_s),
        ("expTimeFirst", &first.exposure_s),
        ("expUserProfile", &0),
        ("jobDir", &job_name(print.part)),
        ("layerHeight", &thickness_mm),
        ("materialName", &record.resin),
        ("numFade", &faded),
        ("numFast", &totals.layers),
        ("numSlow", &0),
        ("printTime", &totals.time_s),
        ("printerModel", &record.printer),
        ("printerVariant", &"default"),
        // In milliliters.
        ("usedMaterial", &(totals.volume_mm3 / 1000.0)),
    ]);
    let slicer = ini(&[
        ("display_height", &panel_mm[1]),
        ("display_mirror_x", &u8::from(record.mirrored[0])),
        ("display_mirror_y", &u8::from(record.mirrored[1])),
        ("display_orientation", &"landscape"),
        ("display_pixels_x", &panel_px[0]),
        ("display_pixels_y", &panel_px[1]),
        ("display_width", &panel_mm[0]),
        ("exposure_time", &normal.exposure_s),
        ("faded_layers", &faded),
        ("initial_exposure_time", &first.exposure_s),
        ("initial_layer_height", &thickness_mm),
        ("layer_height", &thickness_mm),
        ("max_print_height", &record.height_mm),
        ("printer_model", &record.printer),
        ("printer_technology", &"SLA"),
    ]);
    vec![(CONFIG, config), (SLICER, slicer)]
}
