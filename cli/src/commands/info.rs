//! `lamp info`: describes a stack.

use clap::Args;
use lamp_stack::{Compression, Image, Layer, Page, StackInfo, map_in_order};

use crate::exit::Exit;
use crate::options::Input;
use crate::streams::{failed_at, input_name, print, read_pages};

/// Describe a stack: pages, size, resolution, heights, runs, bytes
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp info build.tif
  slice blade.stl | lamp info")]
pub(crate) struct InfoArgs {
    #[command(flatten)]
    input: Input,
}

pub(crate) fn run(args: &InfoArgs) -> Result<(), Exit> {
    let name = input_name(&args.input.stack);
    let decoded = map_in_order(read_pages(&args.input)?, |(page, stack): (Page, _)| {
        let (bytes, compression) = (page.strip_bytes(), page.compression());
        let mut layer = page.decode().map_err(|error| failed_at(name.clone(), error))?;
        layer.info.stack = stack;
        Ok((layer, bytes, compression))
    });
    let mut totals: Option<StackTotals> = None;
    for page in decoded {
        let (layer, bytes, compression) = page?;
        totals.get_or_insert_with(|| StackTotals::new(&layer)).add(&layer, bytes, compression);
    }
    totals.map_or(Ok(()), |totals| print(&totals.text(&name)))
}

/// Sums over the layers.
struct StackTotals {
    first: Layer,
    last: Layer,
    /// Those of the pages, in the order of their first use.
    compressions: Vec<Compression>,
    pages: u64,
    gray_pages: u64,
    changes: u64,
    bytes: u64,
    stray_rows: u64,
    stray_layers: u64,
    one_size: bool,
    thickness_um: NumberRange,
    exposure_ms: NumberRange,
}

/// The range and sum of the numbers that pages state.
#[derive(Default)]
struct NumberRange {
    ends: Option<[f64; 2]>,
    sum: f64,
}

impl NumberRange {
    fn add(&mut self, number: Option<f64>) {
        let Some(number) = number else { return };
        let [least, greatest] = self.ends.unwrap_or([number; 2]);
        self.ends = Some([least.min(number), greatest.max(number)]);
        self.sum += number;
    }

    fn text(&self, unit: &str) -> Option<String> {
        let [least, greatest] = self.ends?;
        let one = least == greatest;
        Some(if one { format!("{least} {unit}") } else { format!("{least} to {greatest} {unit}") })
    }
}

impl StackTotals {
    fn new(first: &Layer) -> Self {
        Self {
            first: first.clone(),
            last: first.clone(),
            compressions: Vec::new(),
            pages: 0,
            gray_pages: 0,
            changes: 0,
            bytes: 0,
            stray_rows: 0,
            stray_layers: 0,
            one_size: true,
            thickness_um: NumberRange::default(),
            exposure_ms: NumberRange::default(),
        }
    }

    fn add(&mut self, layer: &Layer, bytes: u64, compression: Compression) {
        self.pages += 1;
        self.gray_pages += u64::from(matches!(*layer.image, Image::Gray(_)));
        if !self.compressions.contains(&compression) {
            self.compressions.push(compression);
        }
        self.changes += layer.image.change_count() as u64;
        self.bytes += bytes;
        self.stray_rows += layer.info.stray_rows.len() as u64;
        self.stray_layers += u64::from(!layer.info.stray_rows.is_empty());
        let (first, image) = (&self.first.image, &layer.image);
        self.one_size &= first.width() == image.width() && first.height() == image.height();
        self.thickness_um.add(layer.info.thickness_um);
        self.exposure_ms.add(layer.info.exposure_ms);
        self.last.info = layer.info.clone();
    }

    fn text(&self, name: &str) -> String {
        let Layer { info, dpi, image } = &self.first;
        let mut lines = vec![("stack", name.to_owned())];
        if let Some(stack) = &info.stack {
            lines.extend(stack_lines(stack));
        }
        let (first, last) = (info.index, self.last.info.index);
        let gray = match self.gray_pages {
            0 => String::new(),
            pages => format!(", {pages} of them gray"),
        };
        lines.push(("layers", format!("{} ({first} to {last}){gray}", self.pages)));
        let others = if self.one_size { "" } else { " on the first page; others differ" };
        lines.push(("size", format!("{} x {} pixels{others}", image.width(), image.height())));
        match dpi {
            Some(dpi) => {
                let mm = |pixels: u32| f64::from(pixels) * dpi.pitch().mm();
                let (width, height) = (mm(image.width()), mm(image.height()));
                lines.push(("resolution", format!("{dpi} dpi ({width:.3} x {height:.3} mm)")));
            }
            None => lines.push(("resolution", "not stated".to_owned())),
        }
        if let (Some(bottom), Some(top)) = (info.z(), self.top_mm()) {
            lines.push(("z", format!("{:.3} to {top:.3} mm", bottom.mm())));
        }
        lines.extend(self.thickness_um.text("um").map(|text| ("thickness", text)));
        if let Some(text) = self.exposure_ms.text("ms") {
            let seconds = self.exposure_ms.sum / 1000.0;
            lines.push(("exposure", format!("{text}, {seconds:.1} s in all")));
        }
        lines.push(("runs", format!("{} transitions", self.changes)));
        let names: Vec<_> = self.compressions.iter().map(|each| compression_name(*each)).collect();
        lines.push(("data", format!("{} bytes, {}", self.bytes, names.join(" and "))));
        lines.push((
            "stray rows",
            match self.stray_rows {
                0 => "none known".to_owned(),
                rows => format!("{rows} in {} layers", self.stray_layers),
            },
        ));
        // Names come from files: they must not steer the terminal.
        let plain = |text: String| text.replace(char::is_control, "?");
        lines
            .into_iter()
            .map(|(key, value)| (key, plain(value)))
            .map(|(key, value)| format!("{:<12}{value}\n", format!("{key}:")))
            .collect()
    }

    fn top_mm(&self) -> Option<f64> {
        let info = &self.last.info;
        Some((info.z_um? + info.thickness_um?) / 1000.0)
    }
}

fn stack_lines(stack: &StackInfo) -> Vec<(&'static str, String)> {
    let mut lines = vec![("part", stack.part.clone())];
    lines.extend(stack.commands.iter().map(|command| ("made by", command.clone())));
    lines.push(("input", stack.digest.clone()));
    lines.retain(|(_, value)| !value.is_empty());
    lines
}

fn compression_name(compression: Compression) -> &'static str {
    match compression {
        Compression::Uncompressed => "uncompressed",
        Compression::ModifiedHuffman => "CCITT modified Huffman",
        Compression::Group3 => "CCITT Group 3",
        Compression::Group3TwoDimensional => "CCITT Group 3, two-dimensional",
        Compression::G4 => "CCITT Group 4",
        Compression::Lzw => "LZW",
        Compression::Deflate => "Deflate",
        Compression::PackBits => "PackBits",
        Compression::Png => "PNG",
        Compression::Picture(format) => format.name(),
    }
}
