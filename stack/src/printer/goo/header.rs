//! The numbers of a GOO file and of its layers, as bytes.

use crate::printer::fault::PrinterFault;
use crate::printer::fields::Fields;
use crate::printer::goo::{MAGIC, VERSION};
use crate::printer::total::{PrintLayer, PrintTotals};
use crate::record::{PrintRecord, PrintStep};

/// The columns, and rows, of the two previews.
pub(crate) const PREVIEWS: [u32; 2] = [116, 290];
/// Where the texts behind the version and the fixed text begin.
pub(crate) const TEXTS_AT: u64 = 12;
pub(crate) const TEXT_BYTES: u64 = 182;
/// Where the numbers behind the previews begin.
pub(crate) const NUMBERS_AT: u64 = 195_310;
pub(crate) const NUMBER_BYTES: u64 = 167;
/// The bytes of a layer's numbers.
pub(crate) const LAYER_BYTES: u64 = 70;
/// The most columns or rows, and layers.
pub(crate) const MOST_SIDE: u32 = u16::MAX as u32;
const DELIMITER: [u8; 2] = *b"\r\n";

/// A GOO file's statements.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct GooHeader {
    pub(crate) record: PrintRecord,
    pub(crate) layers: u32,
    /// Whether each layer's own numbers count, not the record's.
    pub(crate) has_steps: bool,
    pub(crate) layers_at: u64,
    pub(crate) is_little_endian: bool,
}

/// A layer's statements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct GooLayer {
    pub(crate) top_mm: f64,
    pub(crate) step: PrintStep,
    /// Whether the printer waits here for a person.
    pub(crate) pauses: bool,
    /// The bytes of its image.
    pub(crate) bytes: u32,
}

impl GooHeader {
    /// Reads the bytes from [`TEXTS_AT`] and from [`NUMBERS_AT`].
    pub(crate) fn new(texts: &[u8], numbers: &[u8]) -> Result<Self, PrinterFault> {
        let mut texts = Fields { rest: texts, is_little_endian: false };
        // The slicer, its version and the date.
        let _: [u8; 80] = texts.bytes();
        let printer = texts.text::<32>();
        // A printer's kind is DLP for all.
        let _: [u8; 32] = texts.bytes();
        let resin = texts.text::<32>();
        // The place of the layers shows the order of bytes: the header ends there.
        let place = (NUMBERS_AT + NUMBER_BYTES) as u32;
        let is_little_endian = numbers[160..164] == place.to_le_bytes();
        let mut fields = Fields { rest: numbers, is_little_endian };
        let layers = fields.u32();
        let panel_px = [fields.u16(), fields.u16()].map(u32::from);
        let mirrored = fields.bytes::<2>().map(|flag| flag != 0);
        let panel_mm = [fields.f32(), fields.f32()];
        let height_mm = fields.f32();
        let _thickness = fields.f32();
        let mut normal = PrintStep { exposure_s: fields.f32(), ..PrintStep::default() };
        let mut first = PrintStep::default();
        let [delay] = fields.bytes::<1>();
        let light_off_s = fields.f32();
        for step in [&mut first, &mut normal] {
            step.wait_after_s = fields.f32();
            step.wait_lifted_s = fields.f32();
            step.wait_before_s = fields.f32();
            // Only one of the two ways to state a wait is in use.
            step.light_off_s = if delay == 0 { light_off_s } else { 0.0 };
        }
        first.exposure_s = fields.f32();
        let first_layers = fields.u32();
        for stage in 0..2 {
            // Both lifts come before both retractions, stage by stage.
            for step in [&mut first, &mut normal] {
                step.lift_mm[stage] = fields.f32();
                step.lift_mm_per_min[stage] = fields.f32();
            }
            for step in [&mut first, &mut normal] {
                step.retract_mm[stage] = fields.f32();
                step.retract_mm_per_min[stage] = fields.f32();
            }
        }
        for step in [&mut first, &mut normal] {
            step.light = fields.u16();
        }
        let [has_steps] = fields.bytes::<1>();
        // The time, the volume, the weight and the price follow from the layers.
        let _: [u8; 24] = fields.bytes();
        let layers_at = fields.u32();
        let [_levels] = fields.bytes::<1>();
        let transition_layers = fields.u16().into();
        let record = PrintRecord {
            printer,
            resin,
            panel_px,
            panel_mm,
            mirrored,
            height_mm,
            first_layers,
            transition_layers,
            first,
            normal,
        };
        if u64::from(layers_at) < NUMBERS_AT + NUMBER_BYTES {
            return Err(PrinterFault::Damaged("header"));
        }
        let mut numbers = panel_mm.into_iter().chain([height_mm]);
        let is_finite =
            numbers.all(f64::is_finite) && record.first.is_finite() && record.normal.is_finite();
        if panel_px.contains(&0) || !is_finite {
            return Err(PrinterFault::Damaged("header"));
        }
        let (has_steps, layers_at) = (has_steps != 0, layers_at.into());
        Ok(Self { record, layers, has_steps, layers_at, is_little_endian })
    }
}

impl GooLayer {
    /// Reads a layer's numbers.
    pub(crate) fn new(bytes: &[u8], is_little_endian: bool) -> Result<Self, PrinterFault> {
        let mut fields = Fields { rest: bytes, is_little_endian };
        let pauses = fields.u16() == 1;
        let _pause_at = fields.f32();
        let top_mm = fields.f32();
        let mut step = PrintStep {
            exposure_s: fields.f32(),
            light_off_s: fields.f32(),
            wait_after_s: fields.f32(),
            wait_lifted_s: fields.f32(),
            wait_before_s: fields.f32(),
            ..PrintStep::default()
        };
        for stage in 0..2 {
            step.lift_mm[stage] = fields.f32();
            step.lift_mm_per_min[stage] = fields.f32();
        }
        for stage in 0..2 {
            step.retract_mm[stage] = fields.f32();
            step.retract_mm_per_min[stage] = fields.f32();
        }
        step.light = fields.u16();
        let delimiter: [u8; 2] = fields.bytes();
        if delimiter != DELIMITER || !step.is_finite() {
            return Err(PrinterFault::Damaged("layer"));
        }
        Ok(Self { top_mm, step, pauses, bytes: fields.u32() })
    }
}

fn put_f32(out: &mut Vec<u8>, numbers: impl IntoIterator<Item = f64>) {
    for number in numbers {
        out.extend_from_slice(&(number as f32).to_be_bytes());
    }
}

/// Appends a text of `N` bytes, the last of them zero.
fn put_text<const N: usize>(out: &mut Vec<u8>, text: &str) {
    let end = (0..N).rev().find(|end| text.is_char_boundary(*end)).unwrap_or(0);
    let mut field = [0; N];
    field[..end].copy_from_slice(&text.as_bytes()[..end]);
    out.extend_from_slice(&field);
}

/// Returns a file's header; a preview has 5 or 6 bits for each of red, green and blue.
pub(crate) fn header(
    record: &PrintRecord,
    totals: &PrintTotals,
    previews: [Vec<u8>; 2],
) -> Vec<u8> {
    let mut out = [&VERSION[..], MAGIC].concat();
    put_text::<32>(&mut out, "LAMP");
    put_text::<24>(&mut out, env!("CARGO_PKG_VERSION"));
    // No date: the same stack gives the same bytes.
    put_text::<24>(&mut out, "");
    put_text::<32>(&mut out, &record.printer);
    put_text::<32>(&mut out, "DLP");
    put_text::<32>(&mut out, &record.resin);
    // Levels of smoothing, which has happened already.
    for level in [1u16, 1, 0] {
        out.extend_from_slice(&level.to_be_bytes());
    }
    for levels in previews {
        for level in levels.into_iter().map(u16::from) {
            let pixel = (level >> 3) << 11 | (level >> 2) << 5 | level >> 3;
            out.extend_from_slice(&pixel.to_be_bytes());
        }
        out.extend_from_slice(&DELIMITER);
    }
    let PrintRecord { first, normal, .. } = record;
    out.extend_from_slice(&totals.layers.to_be_bytes());
    for side in record.panel_px {
        out.extend_from_slice(&(side as u16).to_be_bytes());
    }
    out.extend(record.mirrored.map(u8::from));
    put_f32(&mut out, record.panel_mm);
    put_f32(&mut out, [record.height_mm, totals.thickness_um / 1000.0, normal.exposure_s]);
    let is_delayed = normal.light_off_s > 0.0;
    out.push(u8::from(!is_delayed));
    put_f32(&mut out, [normal.light_off_s]);
    for step in [first, normal] {
        put_f32(&mut out, [step.wait_after_s, step.wait_lifted_s, step.wait_before_s]);
    }
    put_f32(&mut out, [first.exposure_s]);
    out.extend_from_slice(&record.first_layers.to_be_bytes());
    for stage in 0..2 {
        for step in [first, normal] {
            put_f32(&mut out, [step.lift_mm[stage], step.lift_mm_per_min[stage]]);
        }
        for step in [first, normal] {
            put_f32(&mut out, [step.retract_mm[stage], step.retract_mm_per_min[stage]]);
        }
    }
    for step in [first, normal] {
        out.extend_from_slice(&step.light.to_be_bytes());
    }
    // Every layer has its own numbers.
    out.push(1);
    out.extend_from_slice(&(totals.time_s.round() as u32).to_be_bytes());
    // The weight and the price of the resin are not known.
    put_f32(&mut out, [totals.volume_mm3, 0.0, 0.0]);
    put_text::<8>(&mut out, "$");
    out.extend_from_slice(&((NUMBERS_AT + NUMBER_BYTES) as u32).to_be_bytes());
    // Levels have 8 bits.
    out.push(1);
    out.extend_from_slice(&(record.transition_layers.min(u16::MAX.into()) as u16).to_be_bytes());
    out
}

/// Returns a layer's numbers and image.
pub(crate) fn layer(layer: &PrintLayer, image: &[u8]) -> Vec<u8> {
    let PrintLayer { top_mm, step, pauses } = layer;
    let mut out = Vec::with_capacity(LAYER_BYTES as usize + image.len() + 2);
    out.extend_from_slice(&u16::from(*pauses).to_be_bytes());
    put_f32(&mut out, [*top_mm, *top_mm, step.exposure_s, step.light_off_s]);
    put_f32(&mut out, [step.wait_after_s, step.wait_lifted_s, step.wait_before_s]);
    for stage in 0..2 {
        put_f32(&mut out, [step.lift_mm[stage], step.lift_mm_per_min[stage]]);
    }
    for stage in 0..2 {
        put_f32(&mut out, [step.retract_mm[stage], step.retract_mm_per_min[stage]]);
    }
    out.extend_from_slice(&step.light.to_be_bytes());
    out.extend_from_slice(&DELIMITER);
    out.extend_from_slice(&(image.len() as u32).to_be_bytes());
    out.extend_from_slice(image);
    out.extend_from_slice(&DELIMITER);
    out
}

/// The bytes behind the last layer.
pub(crate) fn footer() -> Vec<u8> {
    [&[0; 3][..], MAGIC].concat()
}
