//! What `fix` found and did, as JSON, and where it was.

use std::io::{self, Write};

use lamp_postprocess::{Band, FixOptions, Fixed, Kind, Outcome};
use lamp_stack::Layer;
use serde_json::{Value, json};

/// Collects what is found.
pub(crate) struct Findings {
    options: FixOptions,
    bands: Vec<Value>,
    corrected: usize,
    pixels: u64,
}

impl Findings {
    pub(crate) fn new(options: FixOptions) -> Self {
        Self { options, bands: Vec::new(), corrected: 0, pixels: 0 }
    }

    /// Adds what was found in a layer.
    pub(crate) fn add(&mut self, fixed: &Fixed<'_>) {
        for band in fixed.bands {
            if band.outcome == Outcome::Corrected {
                self.corrected += 1;
                self.pixels += band.pixels;
            }
            self.bands.push(self.entry(fixed.before, band));
        }
    }

    /// How many bands were left as they are.
    pub(crate) fn left(&self) -> usize {
        self.bands.len() - self.corrected
    }

    /// Writes all as one JSON object, a line for each band.
    pub(crate) fn write(&self, layers: usize, out: &mut dyn Write) -> io::Result<()> {
        let head = json!({
            "method": self.options.method.name(),
            "max_width": self.options.max_width,
            "min_confidence": self.options.min_confidence,
            "use_neighbours": self.options.use_neighbours,
            "layers": layers,
            "bands_corrected": self.corrected,
            "bands_left": self.left(),
            "pixels_changed": self.pixels,
        });
        write_with_list(&head, "bands", &self.bands, out)
    }

    fn entry(&self, layer: &Layer, band: &Band) -> Value {
        let place = Place::of(layer, band);
        let mut entry = json!({
            "layer": layer.info.index,
            "rows": [band.first_row, band.end() - 1],
            "kinds": band.kinds.iter().map(Kind::name).collect::<Vec<_>>(),
            "method": self.options.method.name(),
            "confidence": (band.confidence * 1e4).round() / 1e4,
            "outcome": match band.outcome {
                Outcome::Corrected => "corrected",
                Outcome::TooWide => "left: too wide",
                Outcome::Doubtful => "left: doubtful",
            },
            "pixels": band.pixels,
        });
        let mut set = |key: &str, value: Option<Value>| {
            if let Some(value) = value {
                entry[key] = value;
            }
        };
        set("z_mm", layer.info.z().map(|z| json!(rounded(z.mm()))));
        set("y_mm", place.y_mm.map(|y| json!(y.map(rounded))));
        let columns = (!band.columns.is_empty()).then(|| band.columns.clone());
        for (columns, key, key_mm) in
            [(columns, "columns", "x_mm"), (band.gap.clone(), "gap_columns", "gap_x_mm")]
        {
            let Some(columns) = columns else { continue };
            set(key, Some(json!([columns.start, columns.end - 1])));
            set(key_mm, place.x_mm(&columns).map(|x| json!(x.map(rounded))));
        }
        entry
    }
}

/// Writes a JSON object and in it, last, a list with a line for each item.
pub(crate) fn write_with_list(
    head: &Value,
    name: &str,
    list: &[Value],
    out: &mut dyn Write,
) -> io::Result<()> {
    let head = head.to_string();
    write!(out, "{},\"{name}\":[", head.trim_end_matches('}'))?;
    for (i, item) in list.iter().enumerate() {
        write!(out, "{}\n{item}", if i > 0 { "," } else { "" })?;
    }
    writeln!(out, "\n]}}")
}

/// To a micrometre hundredth: what follows is rounding.
fn rounded(mm: f64) -> f64 {
    (mm * 1e5).round() / 1e5
}

/// Where a band lies in part coordinates, if its page says where the image is.
struct Place {
    /// The image's left edge, and the pixel pitch.
    left_mm: Option<[f64; 2]>,
    /// From the band's lower edge to its upper one.
    y_mm: Option<[f64; 2]>,
}

impl Place {
    fn of(layer: &Layer, band: &Band) -> Self {
        let known = layer.info.origin_mm.zip(layer.dpi.map(|dpi| dpi.pitch().mm()));
        let y = |([_, top], pitch): ([f64; 2], f64)| {
            [band.end(), band.first_row].map(|row| top - f64::from(row) * pitch)
        };
        Self { left_mm: known.map(|([left, _], pitch)| [left, pitch]), y_mm: known.map(y) }
    }

    fn x_mm(&self, columns: &std::ops::Range<u32>) -> Option<[f64; 2]> {
        let [left, pitch] = self.left_mm?;
        Some([columns.start, columns.end].map(|column| left + f64::from(column) * pitch))
    }
}

/// Where the mesh is to be repaired: `x 31.4-33.0 y 12.1-12.8 mm`.
pub(crate) fn whereabouts(layer: &Layer, band: &Band) -> String {
    let place = Place::of(layer, band);
    let columns = match &band.gap {
        Some(gap) => gap,
        None => &band.columns,
    };
    let millimetres = |[low, high]: [f64; 2]| {
        let text = format!("{low:.1}-{high:.1}");
        // A minus after the dash would read as two.
        if high < 0.0 { format!("{low:.1} to {high:.1}") } else { text }
    };
    match (place.y_mm, place.x_mm(columns)) {
        (Some(y), Some(x)) if !columns.is_empty() => {
            format!("x {} y {} mm", millimetres(x), millimetres(y))
        }
        (Some(y), _) => format!("y {} mm", millimetres(y)),
        _ if !columns.is_empty() => format!("columns {}-{}", columns.start, columns.end - 1),
        _ => "these rows".to_owned(),
    }
}
