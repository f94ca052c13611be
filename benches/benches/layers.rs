//! Times the hot loops.
//!
//! Throughput is in transitions for slicing, coding (beside the `fax` crate) and compensating
//! layers of the blade mould; in gray pixels for dithering a page of 900 megapixels; in layer
//! bottoms for the errors of layers of 25 to 100 um.

use std::io::Cursor;

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use fax::{Color, VecWriter, decoder, encoder};
use lamp_adaptive::LayeredPart;
use lamp_fixtures::{Sample, build};
use lamp_grayscale::{DitherMethod, dither_image};
use lamp_offset::{Widths, offset, offset_one_bit, shrink};
use lamp_slicing::{FacetIndex, Fill, Part, Placement, Shading, SliceOptions, Slices, Units};
use lamp_stack::{
    DepthLevels, EncodedPage, Format, GrayMask, Image, Layer, LayerImage, Length, Mask, PageInfo,
    PageWriter, Pitch, g4,
};

/// Layers with pins and holes, 1500 dpi.
const LAYERS: std::ops::Range<u32> = 440..460;

fn slices(facets: usize, shading: Shading) -> impl Fn() -> Slices {
    let facets = build(Sample::Blade, facets).expect("enough facets").facets;
    move || {
        let model = Part::from_facets("blade", facets.clone());
        let shading = shading.clone();
        let options = SliceOptions { layers: Some(LAYERS), shading, ..SliceOptions::default() };
        Slices::new(model, &options).expect("the blade slices")
    }
}

/// Gray levels proportional to depths up to a layer's thickness.
fn depth_levels() -> DepthLevels {
    DepthLevels::new(Length::from_um(100.0), |gray| Length::from_um(100.0 * gray))
}

fn masks(slices: Slices) -> Vec<Mask> {
    let image = |layer: Result<Layer, _>| layer.expect("facets in memory can be read").image;
    let mask = |image: LayerImage| match image.into_image() {
        Image::Mask(mask) => mask,
        Image::Gray(_) => unreachable!("slices are masks"),
    };
    slices.map(|layer| mask(image(layer))).collect()
}

fn filled(mut slices: Slices) -> Slices {
    slices.fill_slab().expect("facets in memory can be read");
    slices
}

fn fax_encode(mask: &Mask) -> Vec<u8> {
    let mut encoder = encoder::Encoder::new(VecWriter::new());
    for row in mask.rows() {
        let (mut next, mut white) = (0, false);
        let pixels = (0..mask.width()).map(|column| {
            if row.get(next) == Some(&column) {
                (next, white) = (next + 1, !white);
            }
            if white { Color::Black } else { Color::White }
        });
        encoder.encode_line(pixels, mask.width()).expect("a Vec takes all bits");
    }
    encoder.finish().expect("a Vec takes all bits").finish()
}

fn layers(criterion: &mut Criterion) {
    let slice = slices(100_000, Shading::White);
    let masks = masks(slice());
    let transitions: usize = masks.iter().map(Mask::change_count).sum();
    let strips: Vec<Vec<u8>> = masks.iter().map(g4::encode).collect();
    let size = (masks[0].width(), masks[0].height());

    let mut group = criterion.benchmark_group("blade");
    group.throughput(Throughput::Elements(transitions as u64));
    group.bench_function("table", |b| b.iter_batched(&slice, filled, BatchSize::PerIteration));
    group.bench_function("sort", |b| {
        b.iter_batched(|| filled(slice()), self::masks, BatchSize::PerIteration);
    });
    let gray = slices(100_000, Shading::ByDepth(depth_levels().into()));
    group.bench_function("table, gray", |b| {
        b.iter_batched(&gray, filled, BatchSize::PerIteration);
    });
    group.bench_function("sort, gray", |b| {
        let count = |slices: Slices| slices.filter_map(Result::ok).count();
        b.iter_batched(|| filled(gray()), count, BatchSize::PerIteration);
    });
    group.bench_function("encode", |b| {
        b.iter(|| masks.iter().map(|mask| g4::encode(mask).len()).sum::<usize>());
    });
    group.bench_function("decode", |b| {
        let decode = |strip: &Vec<u8>| g4::decode(strip, size.0, size.1).expect("our own strip");
        b.iter(|| strips.iter().map(|strip| decode(strip).change_count()).sum::<usize>());
    });
    group.bench_function("encode, fax crate", |b| {
        b.iter(|| masks.iter().map(|mask| fax_encode(mask).len()).sum::<usize>());
    });
    group.bench_function("decode, fax crate", |b| {
        b.iter(|| {
            let mut count = 0;
            for strip in &strips {
                let bytes = strip.iter().copied();
                decoder::decode_g4(bytes, size.0, Some(size.1), |row| count += row.len())
                    .expect("our own strip");
            }
            count
        });
    });
    group.finish();
}

/// Returns a white page of a large machine, 34,500 x 26,000 pixels, with `runs` gray runs per row.
fn page(runs: u32, length: u32) -> GrayMask {
    let mut page = GrayMask::new(34_500);
    for row in 0..26_000 {
        let level = |run: u32| (row / 16 + run * 41) % 254 + 1;
        let pair = |run: u32| [(34_500 / runs - length, 255), (length, level(run) as u8)];
        page.push_runs((0..runs).flat_map(pair)).expect("as many pixels as the width");
    }
    page
}

fn heights(criterion: &mut Criterion) {
    let facets = build(Sample::Blade, 750_000).expect("enough facets").facets;
    let model = Part::from_facets("blade", facets);
    let facets =
        FacetIndex::new(model, &Placement::default(), Units::Millimetres).expect("it is finite");
    let part = LayeredPart::new(facets, Length::from_um(68.0), Fill::EvenOdd);
    let part = part.expect("its rows are few");
    let mut group = criterion.benchmark_group("heights");
    group.throughput(Throughput::Elements(LAYERS.len() as u64));
    for steps in [1, 76] {
        group.bench_function(format!("{steps} tops"), |b| {
            b.iter(|| {
                for layer in LAYERS {
                    let bottom_um = f64::from(layer) * 100.0;
                    let tops: Vec<f64> =
                        (0..steps).map(|step| bottom_um + 100.0 - f64::from(step)).rev().collect();
                    std::hint::black_box(part.layers(bottom_um, &tops));
                }
            });
        });
    }
    group.finish();
}

fn dither(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("dither");
    group.sample_size(10);
    let mut bench = |name: String, page: &GrayMask, runs: u32, length: u32, method| {
        group.throughput(Throughput::Elements(u64::from(26_000 * runs * length)));
        group.bench_function(name, |b| b.iter(|| dither_image(page, method, 1)));
    };
    for runs in [22, 43, 86] {
        let name = format!("blue-noise, {runs} runs of 40 gray pixels in a row");
        bench(name, &page(runs, 40), runs, 40, DitherMethod::BlueNoise);
    }
    for (runs, length) in [(43, 40), (2, 860), (430, 4)] {
        let page = page(runs, length);
        for method in DitherMethod::ALL {
            let name = format!("{}, {runs} runs of {length}", method.name());
            bench(name, &page, runs, length, method);
        }
    }
    group.finish();
}

/// Returns a layer's pixels, eight to a byte, as a program without runs would hold them.
fn bitmap(strip: &[u8], width: u32, height: u32) -> Vec<u8> {
    let stride = width.div_ceil(8) as usize;
    let mut bytes = Vec::with_capacity(stride * height as usize);
    decoder::decode_g4(strip.iter().copied(), width, Some(height), |row| {
        let start = bytes.len();
        bytes.resize(start + stride, 0);
        for run in row.chunks(2) {
            let end = run.get(1).copied().unwrap_or(width).min(width);
            fill(&mut bytes[start..], run[0].min(end) as usize, end as usize);
        }
    })
    .expect("our own strip");
    bytes
}

/// Sets the bits from the first up to the second, exclusive.
fn fill(bytes: &mut [u8], first: usize, end: usize) {
    if first == end {
        return;
    }
    let (from, to) = (first / 8, (end - 1) / 8);
    let [left, right] = [0xff >> (first % 8), 0xff << (7 - (end - 1) % 8)];
    if from == to {
        bytes[from] |= left & right;
    } else {
        bytes[from] |= left;
        bytes[from + 1..to].fill(0xff);
        bytes[to] |= right;
    }
}

/// Times cure-width compensation of whole layers, beside decoding them to bitmaps.
fn compensation(criterion: &mut Criterion) {
    let masks = masks(slices(100_000, Shading::White)());
    let transitions: usize = masks.iter().map(Mask::change_count).sum();
    let strips: Vec<Vec<u8>> = masks.iter().map(g4::encode).collect();
    let size = (masks[0].width(), masks[0].height());
    let by = 25.0 * 1500.0 / 25_400.0;
    let widths = Widths::uniform(by);
    let kept = |mask: &Mask| shrink(mask, &widths, 2.0).0.change_count();

    let mut group = criterion.benchmark_group("compensate");
    group.throughput(Throughput::Elements(transitions as u64));
    group.bench_function("walls kept", |b| b.iter(|| masks.iter().map(kept).sum::<usize>()));
    group.bench_function("gray edges", |b| {
        b.iter(|| masks.iter().map(|mask| offset(mask, by).change_count()).sum::<usize>());
    });
    group.bench_function("1 bit", |b| {
        let moved = |mask| offset_one_bit(mask, by).change_count();
        b.iter(|| masks.iter().map(moved).sum::<usize>());
    });
    group.bench_function("decode to bitmaps, fax crate", |b| {
        b.iter(|| strips.iter().map(|strip| bitmap(strip, size.0, size.1).len()).sum::<usize>());
    });
    group.bench_function("decode to bitmaps, tiff crate", |b| {
        let files: Vec<Vec<u8>> = masks.iter().map(tiff_file).collect();
        let decode = |file: &Vec<u8>| {
            let mut decoder = tiff::decoder::Decoder::new(Cursor::new(file)).expect("our own file");
            match decoder.read_image().expect("our own page") {
                tiff::decoder::DecodingResult::U8(bytes) => bytes.len(),
                _ => unreachable!("1-bit pages are read as bytes"),
            }
        };
        b.iter(|| files.iter().map(decode).sum::<usize>());
    });
    group.finish();
}

/// Encodes a stack of one page in memory.
fn tiff_file(mask: &Mask) -> Vec<u8> {
    let layer = Layer {
        info: PageInfo::default(),
        pitch: Pitch::of_dpi(1500.0),
        image: mask.clone().into(),
    };
    let mut file = Vec::new();
    let mut writer = PageWriter::new(&mut file, Format::Classic);
    writer.push(EncodedPage::new(&layer)).expect("memory takes all");
    writer.finish().expect("memory takes all");
    file
}

criterion_group!(benches, layers, heights, dither, compensation);
criterion_main!(benches);
