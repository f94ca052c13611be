//! The tables of a CTB file, as bytes.

use crate::printer::fault::PrinterFault;
use crate::printer::fields::Fields;
use crate::printer::total::{PrintLayer, PrintTotals};
use crate::record::{PrintRecord, PrintStep};

pub(crate) const HEADER_BYTES: u64 = 112;
/// The columns and rows of the two previews.
pub(crate) const PREVIEWS: [[u32; 2]; 2] = [[400, 300], [200, 125]];
pub(crate) const PREVIEW_BYTES: u64 = 32;
pub(crate) const PRINT_BYTES: u64 = 60;
pub(crate) const SLICER_BYTES: u64 = 76;
pub(crate) const VERSION_4_BYTES: u64 = 464;
/// The bytes of a row of the table of layers.
pub(crate) const ROW_BYTES: u64 = 36;
/// The bytes of a layer's numbers before its image, from version 3 on: its row again, and its moves.
pub(crate) const LAYER_BYTES: u64 = 84;
/// The most bytes of a name, and layers: a build of 2^20 layers of 10 um is 10 m high.
pub(crate) const MOST_NAME: u32 = 256;
pub(crate) const MOST_LAYERS: u32 = 1 << 20;
/// The version that is written.
pub(crate) const VERSION: u32 = 4;
/// Where the numbers of layers count, in version 4.
const OWN_STEPS: u8 = 0x40;

/// Returns numbers in a row, the lowest byte of each first.
fn fields(bytes: &[u8]) -> Fields<'_> {
    Fields { rest: bytes, is_little_endian: true }
}

/// The header's statements, and where the other tables are.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Header {
    pub(crate) version: u32,
    panel_mm: [f64; 2],
    height_mm: f64,
    exposure_s: f64,
    first_exposure_s: f64,
    first_layers: u32,
    panel_px: [u32; 2],
    pub(crate) layers_at: u32,
    pub(crate) layers: u32,
    mirrored: bool,
    pub(crate) print_at: u32,
    images_of_a_layer: u32,
    light: u16,
    first_light: u16,
    pub(crate) key: u32,
    pub(crate) slicer_at: u32,
}

impl Header {
    pub(crate) fn new(bytes: &[u8]) -> Result<Self, PrinterFault> {
        let mut fields = fields(bytes);
        let _magic = fields.u32();
        let version = fields.u32();
        let panel_mm = [fields.f32(), fields.f32()];
        let height_mm = fields.f32();
        let _: [u8; 16] = fields.bytes();
        let (exposure_s, first_exposure_s) = (fields.f32(), fields.f32());
        let _light_off = fields.f32();
        let first_layers = fields.u32();
        let panel_px = [fields.u32(), fields.u32()];
        let _preview = fields.u32();
        let (layers_at, layers) = (fields.u32(), fields.u32());
        let (_preview, _time) = (fields.u32(), fields.u32());
        let mirrored = fields.u32() != 0;
        let (print_at, _bytes) = (fields.u32(), fields.u32());
        let images_of_a_layer = fields.u32();
        let (light, first_light) = (fields.u16(), fields.u16());
        let (key, slicer_at) = (fields.u32(), fields.u32());
        let header = Self {
            version,
            panel_mm,
            height_mm,
            exposure_s,
            first_exposure_s,
            first_layers,
            panel_px,
            layers_at,
            layers,
            mirrored,
            print_at,
            images_of_a_layer,
            light,
            first_light,
            key,
            slicer_at,
        };
        let is_known = (2..=5).contains(&version);
        if !is_known {
            let found = version.to_string();
            return Err(PrinterFault::Version { found, read: "CTB 2 to 5, unencrypted," });
        }
        if images_of_a_layer > 1 {
            return Err(PrinterFault::Unread("several images of a layer"));
        }
        let numbers = panel_mm.into_iter().chain([height_mm, exposure_s, first_exposure_s]);
        if panel_px.contains(&0) || layers > MOST_LAYERS || !numbers.into_iter().all(f64::is_finite)
        {
            return Err(PrinterFault::Damaged("header"));
        }
        Ok(header)
    }

    /// Returns where the numbers of each layer count that stand before its image.
    pub(crate) fn has_layer_numbers(&self) -> bool {
        self.version >= 3
    }
}

/// The statements of the table of the slicer beside moves.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Slicer {
    lift_2: [[f64; 2]; 2],
    retract_2: [f64; 2],
    wait_lifted_s: f64,
    pub(crate) name_at: u32,
    pub(crate) name_bytes: u32,
    pub(crate) has_steps: bool,
    wait_before_s: f64,
    transition_layers: u32,
    pub(crate) version_4_at: u32,
}

impl Slicer {
    pub(crate) fn new(bytes: &[u8]) -> Self {
        let mut fields = fields(bytes);
        let lift_2 = [[fields.f32(), fields.f32()], [fields.f32(), fields.f32()]];
        let retract_2 = [fields.f32(), fields.f32()];
        let wait_lifted_s = fields.f32();
        let (name_at, name_bytes) = (fields.u32(), fields.u32());
        let _: [u8; 3] = fields.bytes();
        let [own] = fields.bytes::<1>();
        let _: [u8; 12] = fields.bytes();
        let wait_before_s = fields.f32();
        let _ = fields.f32();
        let transition_layers = fields.u32();
        let version_4_at = fields.u32();
        Self {
            lift_2,
            retract_2,
            wait_lifted_s,
            name_at,
            name_bytes: name_bytes.min(MOST_NAME),
            has_steps: own != 0,
            wait_before_s,
            transition_layers,
            version_4_at,
        }
    }
}

/// Returns the first stage of a way of two, of which the second is known. Differences of decimal
/// numbers are meant to be decimal.
fn first_stage(all: f64, second: f64) -> f64 {
    ((all - second) * 1e6).round() / 1e6
}

/// Returns how the printer exposes, from the tables of a print; the last is of version 4.
pub(crate) fn record(
    header: &Header,
    print: &[u8],
    slicer: &Slicer,
    version_4: Option<&[u8]>,
    printer: String,
) -> PrintRecord {
    let mut fields = fields(print);
    let lifts = [[fields.f32(), fields.f32()], [fields.f32(), fields.f32()]];
    let retract_mm_per_min = fields.f32();
    let _: [u8; 12] = fields.bytes();
    let light_off_s = [fields.f32(), fields.f32()];
    let mut of_4 = version_4.map(self::fields);
    let [first_speed, first_speed_2] = match &mut of_4 {
        Some(fields) => {
            let speeds = [fields.f32(), fields.f32()];
            let _: [u8; 16] = fields.bytes();
            speeds
        }
        None => [retract_mm_per_min, 0.0],
    };
    let (wait_before_s, wait_lifted_s, wait_after_s, first_retract_2) = match &mut of_4 {
        Some(fields) => (fields.f32(), fields.f32(), fields.f32(), fields.f32()),
        None => (slicer.wait_before_s, slicer.wait_lifted_s, 0.0, 0.0),
    };
    // Stages are of version 4.
    let is_4 = version_4.is_some();
    let stages = |[mm, speed]: [f64; 2], [mm_2, speed_2]: [f64; 2]| match is_4 {
        true => ([first_stage(mm, mm_2), mm_2], [speed, speed_2]),
        false => ([mm, 0.0], [speed, 0.0]),
    };
    let step = |exposure_s, light, light_off_s, kind: usize, retract: [f64; 3]| {
        let (lift_mm, lift_mm_per_min) = stages(lifts[kind], slicer.lift_2[kind]);
        let [speed, mm_2, speed_2] = retract;
        let (retract_mm, retract_mm_per_min) = stages([lifts[kind][0], speed], [mm_2, speed_2]);
        PrintStep {
            exposure_s,
            light,
            light_off_s,
            wait_before_s,
            wait_after_s,
            wait_lifted_s,
            lift_mm,
            lift_mm_per_min,
            retract_mm,
            retract_mm_per_min,
        }
    };
    let [retract_2_mm, retract_2_speed] = slicer.retract_2;
    let first = [first_speed, first_retract_2, first_speed_2];
    let normal = [retract_mm_per_min, retract_2_mm, retract_2_speed];
    PrintRecord {
        printer,
        resin: String::new(),
        panel_px: header.panel_px,
        panel_mm: header.panel_mm,
        mirrored: [header.mirrored, false],
        height_mm: header.height_mm,
        first_layers: header.first_layers,
        transition_layers: if header.version >= 3 { slicer.transition_layers } else { 0 },
        first: step(header.first_exposure_s, header.first_light, light_off_s[0], 0, first),
        normal: step(header.exposure_s, header.light, light_off_s[1], 1, normal),
    }
}

/// A row of the table of layers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Row {
    pub(crate) top_mm: f64,
    exposure_s: f64,
    light_off_s: f64,
    /// Where its image is.
    pub(crate) at: u64,
    pub(crate) bytes: u32,
}

impl Row {
    pub(crate) fn new(bytes: &[u8]) -> Self {
        let mut fields = fields(bytes);
        let (top_mm, exposure_s, light_off_s) = (fields.f32(), fields.f32(), fields.f32());
        let (at, bytes, page) = (fields.u32(), fields.u32(), fields.u32());
        // Addresses have 32 bits; a page has 2^32 bytes.
        let at = u64::from(page) << 32 | u64::from(at);
        Self { top_mm, exposure_s, light_off_s, at, bytes }
    }

    /// Returns the steps of the layer, given the record's and the layer's numbers where they count.
    pub(crate) fn step(&self, usual: PrintStep, numbers: Option<&[u8]>, version: u32) -> PrintStep {
        let usual =
            PrintStep { exposure_s: self.exposure_s, light_off_s: self.light_off_s, ..usual };
        let Some(numbers) = numbers else { return usual };
        let mut fields = fields(&numbers[ROW_BYTES as usize + 4..]);
        let lift = [fields.f32(), fields.f32()];
        let lift_2 = [fields.f32(), fields.f32()];
        let speed = fields.f32();
        let retract_2 = [fields.f32(), fields.f32()];
        let (wait_after_s, wait_lifted_s, wait_before_s) =
            (fields.f32(), fields.f32(), fields.f32());
        let light = fields.f32() as u16;
        if version < 4 {
            return PrintStep {
                lift_mm: [lift[0], 0.0],
                lift_mm_per_min: [lift[1], 0.0],
                retract_mm: [lift[0], 0.0],
                retract_mm_per_min: [speed, 0.0],
                light,
                ..usual
            };
        }
        PrintStep {
            light,
            wait_before_s,
            wait_after_s,
            wait_lifted_s,
            lift_mm: [first_stage(lift[0], lift_2[0]), lift_2[0]],
            lift_mm_per_min: [lift[1], lift_2[1]],
            retract_mm: [first_stage(lift[0], retract_2[0]), retract_2[0]],
            retract_mm_per_min: [speed, retract_2[1]],
            ..usual
        }
    }
}

fn put_u32(out: &mut Vec<u8>, numbers: impl IntoIterator<Item = u32>) {
    numbers.into_iter().for_each(|number| out.extend_from_slice(&number.to_le_bytes()));
}

fn put_f32(out: &mut Vec<u8>, numbers: impl IntoIterator<Item = f64>) {
    numbers.into_iter().for_each(|number| out.extend_from_slice(&(number as f32).to_le_bytes()));
}

/// Where the tables of a file are, in their order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Places {
    previews: [u64; 2],
    print: u64,
    slicer: u64,
    name: u64,
    name_bytes: u64,
    version_4: u64,
    pub(crate) rows: u64,
    /// Behind the table of layers.
    pub(crate) end: u64,
}

impl Places {
    /// Returns the places for a number of layers and a printer's name.
    pub(crate) fn new(layers: u32, printer: &str) -> Self {
        let [large, small] = PREVIEWS.map(|[width, height]| {
            // Two bytes for each pixel are enough, whatever the picture.
            PREVIEW_BYTES + 2 * u64::from(width) * u64::from(height)
        });
        let print = HEADER_BYTES + large + small;
        let slicer = print + PRINT_BYTES;
        let name = slicer + SLICER_BYTES;
        let name_bytes = name_of(printer).len() as u64;
        let version_4 = name + name_bytes;
        let rows = version_4 + VERSION_4_BYTES;
        Self {
            previews: [HEADER_BYTES, HEADER_BYTES + large],
            print,
            slicer,
            name,
            name_bytes,
            version_4,
            rows,
            end: rows + ROW_BYTES * u64::from(layers),
        }
    }

    /// Returns all bytes before the table of layers; previews are gray levels.
    pub(crate) fn start(
        &self,
        record: &PrintRecord,
        totals: &PrintTotals,
        previews: [Vec<u8>; 2],
    ) -> Vec<u8> {
        let PrintRecord { first, normal, .. } = record;
        let mut out = Vec::with_capacity(self.rows as usize);
        put_u32(&mut out, [super::MAGIC_4, VERSION]);
        put_f32(&mut out, record.panel_mm);
        put_f32(&mut out, [record.height_mm]);
        put_u32(&mut out, [0; 2]);
        put_f32(&mut out, [totals.height_um / 1000.0, totals.thickness_um / 1000.0]);
        put_f32(&mut out, [normal.exposure_s, first.exposure_s, normal.light_off_s]);
        put_u32(&mut out, [record.first_layers, record.panel_px[0], record.panel_px[1]]);
        put_u32(&mut out, [self.previews[0] as u32, self.rows as u32, totals.layers]);
        put_u32(&mut out, [self.previews[1] as u32, totals.time_s.round() as u32]);
        put_u32(&mut out, [record.mirrored[0].into(), self.print as u32, PRINT_BYTES as u32]);
        // One image of each layer.
        put_u32(&mut out, [1]);
        out.extend([normal, first].iter().flat_map(|step| step.light.min(255).to_le_bytes()));
        // No key: images are not encrypted.
        put_u32(&mut out, [0, self.slicer as u32, SLICER_BYTES as u32]);
        for ((side, levels), at) in PREVIEWS.into_iter().zip(previews).zip(self.previews) {
            let picture = picture(&levels);
            let image_at = at + PREVIEW_BYTES;
            put_u32(&mut out, [side[0], side[1], image_at as u32, picture.len() as u32]);
            put_u32(&mut out, [0; 4]);
            out.extend_from_slice(&picture);
            let end = image_at + 2 * u64::from(side[0]) * u64::from(side[1]);
            out.resize(end as usize, 0);
        }
        let all = |mm: [f64; 2]| mm[0] + mm[1];
        for step in [first, normal] {
            put_f32(&mut out, [all(step.lift_mm), step.lift_mm_per_min[0]]);
        }
        // In milliliters. The weight and the price of the resin are not known.
        put_f32(&mut out, [normal.retract_mm_per_min[0], totals.volume_mm3 / 1000.0, 0.0, 0.0]);
        put_f32(&mut out, [first.light_off_s, normal.light_off_s]);
        put_u32(&mut out, [record.first_layers, 0, 0, 0, 0]);
        for step in [first, normal] {
            put_f32(&mut out, [step.lift_mm[1], step.lift_mm_per_min[1]]);
        }
        put_f32(&mut out, [normal.retract_mm[1], normal.retract_mm_per_min[1]]);
        put_f32(&mut out, [normal.wait_lifted_s]);
        put_u32(&mut out, [self.name as u32, self.name_bytes as u32]);
        out.extend_from_slice(&[0x0F, 0, 0, OWN_STEPS]);
        // No date: the same stack gives the same bytes. One level of smoothing, which has happened
        // already; the slicer's version that this version of the format needs.
        put_u32(&mut out, [0, 1, 0x0109_0000]);
        put_f32(&mut out, [normal.wait_before_s, normal.wait_lifted_s]);
        put_u32(&mut out, [record.transition_layers, self.version_4 as u32, 0, 0]);
        out.extend_from_slice(name_of(&record.printer));
        put_f32(&mut out, first.retract_mm_per_min);
        put_u32(&mut out, [0]);
        put_f32(&mut out, [4.0]);
        put_u32(&mut out, [0]);
        put_f32(&mut out, [4.0, normal.wait_before_s, normal.wait_lifted_s, normal.wait_after_s]);
        put_f32(&mut out, [first.retract_mm[1], 0.0]);
        put_u32(&mut out, [0, 5, totals.layers.saturating_sub(1)]);
        out.resize(self.rows as usize, 0);
        out
    }
}

/// Returns as much of a printer's name as a file takes.
fn name_of(printer: &str) -> &[u8] {
    let most = printer.len().min(MOST_NAME as usize);
    let end = (0..=most).rev().find(|end| printer.is_char_boundary(*end)).unwrap_or(0);
    &printer.as_bytes()[..end]
}

/// Codes a gray picture: 16 bits with five of red, green and blue each, and a mark whether a length
/// follows.
fn picture(levels: &[u8]) -> Vec<u8> {
    const REPEATED: u16 = 0x20;
    let mut out = Vec::new();
    for run in levels.chunk_by(|a, b| a >> 3 == b >> 3).flat_map(|run| run.chunks(0xFFF)) {
        let level = u16::from(run[0] >> 3);
        let pixel = level << 11 | level << 6 | level;
        match run.len() as u16 {
            length @ 3.. => {
                out.extend_from_slice(&(pixel | REPEATED).to_le_bytes());
                out.extend_from_slice(&((length - 1) | 0x3000).to_le_bytes());
            }
            length => (0..length).for_each(|_| out.extend_from_slice(&pixel.to_le_bytes())),
        }
    }
    out
}

/// Returns a layer's row of the table, whose image is at `at`.
pub(crate) fn row(layer: &PrintLayer, at: u64, bytes: usize) -> Vec<u8> {
    let PrintLayer { top_mm, step, .. } = layer;
    let mut out = Vec::with_capacity(LAYER_BYTES as usize);
    put_f32(&mut out, [*top_mm, step.exposure_s, step.light_off_s]);
    put_u32(&mut out, [at as u32, bytes as u32, (at >> 32) as u32, LAYER_BYTES as u32, 0, 0]);
    out
}

/// Returns a layer's numbers before its image, beginning with its row.
pub(crate) fn numbers(row: &[u8], step: &PrintStep, bytes: usize) -> Vec<u8> {
    let mut out = row.to_vec();
    put_u32(&mut out, [LAYER_BYTES as u32 + bytes as u32]);
    let [lift, lift_2] = step.lift_mm;
    put_f32(&mut out, [lift + lift_2, step.lift_mm_per_min[0], lift_2, step.lift_mm_per_min[1]]);
    put_f32(&mut out, [step.retract_mm_per_min[0], step.retract_mm[1], step.retract_mm_per_min[1]]);
    put_f32(&mut out, [step.wait_after_s, step.wait_lifted_s, step.wait_before_s]);
    put_f32(&mut out, [step.light.min(255).into()]);
    out
}
