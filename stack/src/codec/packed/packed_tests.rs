//! Packs stacks of all kinds, and reads them back whole, in any order, cut and damaged.

use std::io::{Cursor, Write};
use std::sync::{Arc, Mutex};

use proptest::prelude::*;

use super::{KEY_LAYERS, PackLevel, join_packed, write_packed};
use crate::files::output::Destination;
use crate::image::Image;
use crate::image::mask::Mask;
use crate::layer::page_info::PageInfo;
use crate::layer::{Layer, LayerImage, Strip};
use crate::testing::{arbitrary_gray, arbitrary_mask, mask_of};
use crate::{
    Compression, Format, IndexedStack, JoinError, Pages, Pitch, StackError, g4, write_stack,
};

/// The bytes that are written to a stream.
#[derive(Clone, Default)]
struct Shared(Arc<Mutex<Vec<u8>>>);

impl Shared {
    fn bytes(&self) -> Vec<u8> {
        self.0.lock().unwrap().clone()
    }
}

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

fn packed(layers: &[Layer]) -> Vec<u8> {
    let out = Shared::default();
    let to = Destination::Stream(Box::new(out.clone()));
    let layers = layers.iter().cloned().map(Ok::<_, StackError>);
    write_packed(layers, to, Format::Big, PackLevel::default()).unwrap();
    out.bytes()
}

fn tiff(layers: impl Iterator<Item = Result<Layer, StackError>>) -> Vec<u8> {
    let out = Shared::default();
    write_stack(layers, Destination::Stream(Box::new(out.clone())), Format::Big).unwrap();
    out.bytes()
}

fn read(bytes: Vec<u8>) -> Result<Vec<Layer>, StackError> {
    Pages::from_stream(Cursor::new(bytes))?.layers().collect()
}

fn layers_of(first: u32, images: Vec<Image>) -> Vec<Layer> {
    let of = |(index, image): (u32, Image)| Layer {
        info: PageInfo { index, z_um: Some(f64::from(index)), ..PageInfo::default() },
        pitch: Pitch::of_dpi(1500.0),
        image: image.into(),
    };
    (first..).zip(images).map(of).collect()
}

/// A mask whose edges move a little from layer to layer, with features that come and go.
fn drifting(layer: u32) -> Image {
    let rows = (0..60u32).map(|row| {
        let wave = (row * row / 40 + layer * (1 + row % 3)) % 50;
        let mut edges = vec![20 + wave, 200 + wave / 2, 260 - wave];
        if (row + layer) % 17 < 5 {
            edges.extend([300, 310 + wave]);
        }
        if row % 20 > 12 {
            edges.clear();
        }
        edges.sort_unstable();
        edges.dedup();
        edges
    });
    let rows: Vec<Vec<u32>> = rows.collect();
    Image::Mask(mask_of(400, rows.iter().map(Vec::as_slice)))
}

fn images() -> impl Strategy<Value = Vec<Image>> {
    let mask = arbitrary_mask()
        .prop_filter("pages have pixels", |mask| mask.width() > 0 && mask.height() > 0);
    let image = prop_oneof![
        mask.prop_map(Image::Mask),
        arbitrary_gray()
            .prop_filter("pages have pixels", |gray| gray.height() > 0)
            .prop_map(Image::Gray),
        (0u32..200).prop_map(drifting),
    ];
    // Images that repeat are coded against each other.
    prop::collection::vec((image, 1usize..4), 1..6).prop_map(|images| {
        images.into_iter().flat_map(|(image, times)| std::iter::repeat_n(image, times)).collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn unpacking_undoes_packing(images in images(), first in 0u32..130) {
        let layers = layers_of(first, images);
        let bytes = packed(&layers);
        let back = read(bytes).unwrap();
        prop_assert_eq!(&back, &layers);
        let (ours, theirs) = (tiff(back.into_iter().map(Ok)), tiff(layers.into_iter().map(Ok)));
        prop_assert!(ours == theirs);
    }

    #[test]
    fn pages_come_in_any_order(
        count in 1u32..150,
        order in prop::collection::vec(any::<prop::sample::Index>(), 1..12),
    ) {
        let layers = layers_of(5, (0..count).map(drifting).collect());
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), packed(&layers)).unwrap();
        let stack = IndexedStack::open(file.path()).unwrap().into_whole().unwrap();
        prop_assert_eq!(stack.headers().len(), layers.len());
        for position in order {
            let position = position.index(layers.len());
            prop_assert_eq!(&stack.layer(position).unwrap(), &layers[position]);
        }
    }

    #[test]
    fn a_changed_byte_or_a_cut_is_an_error(
        images in images(),
        at in any::<prop::sample::Index>(),
        bit in 0u8..8,
    ) {
        let layers = layers_of(60, images);
        let bytes = packed(&layers);
        let at = at.index(bytes.len());
        prop_assert!(read(bytes[..at].to_vec()).is_err(), "cut at {at}");
        let mut changed = bytes.clone();
        changed[at] ^= 1 << bit;
        // The ninth byte says what TIFF it was.
        prop_assert!(at == 8 || read(changed).is_err(), "changed at {at}");
        prop_assert!(read([&bytes[..], &[0]].concat()).is_err(), "one byte more");
    }
}

#[test]
fn a_tall_stack_has_key_frames_and_keeps_its_bytes() {
    let layers = layers_of(0, (0..3 * KEY_LAYERS + 7).map(drifting).collect());
    let bytes = packed(&layers);
    let file = tiff(layers.iter().cloned().map(Ok));
    assert!(tiff(read(bytes.clone()).unwrap().into_iter().map(Ok)) == file);
    assert!(bytes.len() * 3 < file.len(), "{} of {}", bytes.len(), file.len());
    let one_thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert!(one_thread.install(|| packed(&layers)) == bytes, "threads change bytes");
}

#[test]
fn a_cut_stack_keeps_its_first_layers() {
    let layers = layers_of(0, (0..150).map(drifting).collect());
    let bytes = packed(&layers);
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), &bytes[..bytes.len() - 40]).unwrap();
    let stack = IndexedStack::open(file.path()).unwrap();
    let whole = stack.headers().len();
    assert!(whole >= 128, "{whole}");
    assert!(matches!(stack.end(), Some(StackError::CutOff { last_whole: Some(_) })));
    assert_eq!(stack.layer(whole - 1).unwrap(), layers[whole - 1]);
    assert_eq!(stack.layer(1).unwrap(), layers[1]);
}

#[test]
fn codes_of_other_programs_are_kept() {
    // The same image with a pass more than needed: T.6 of `..##....` in two horizontal modes.
    let mask = mask_of(64, [&[8, 16, 40, 56][..], &[8, 16, 40, 56]]);
    let canonical = g4::encode(&mask);
    let mut foreign = canonical.clone();
    foreign.extend([0, 0]);
    let info = PageInfo { index: 3, ..PageInfo::default() };
    let strip = Strip { compression: Compression::G4, bytes: foreign.into() };
    let image = LayerImage::of_page(mask.into(), Some(strip.clone()), None);
    let layers = [Layer { info, pitch: None, image }];
    let back = read(packed(&layers)).unwrap();
    assert_eq!(back[0].image.strip(), Some(&strip));
    assert!(tiff(back.into_iter().map(Ok)) == tiff(layers.into_iter().map(Ok)));
}

#[test]
fn a_stage_that_gives_up_says_why() {
    let out = Shared::default();
    let layers = layers_of(0, vec![drifting(0)]).into_iter().map(Ok);
    let layers = layers.chain([Err(StackError::NoPages)]);
    let to = Destination::Stream(Box::new(out.clone()));
    assert!(write_packed(layers, to, Format::Big, PackLevel::default()).is_err());
    let error = read(out.bytes()).unwrap_err().to_string();
    assert!(error.contains(&StackError::NoPages.to_string()), "{error}");
}

#[test]
fn a_header_that_promises_much_is_refused() {
    let image = Image::Mask(Mask::black(20, super::MOST_ROWS + 1));
    let out = Destination::Stream(Box::new(Shared::default()));
    let layers = layers_of(0, vec![image]).into_iter().map(Ok::<_, StackError>);
    let error = write_packed(layers, out, Format::Big, PackLevel::default()).unwrap_err();
    assert!(error.to_string().contains("too many to pack"), "{error}");
}

/// Joins packed stacks, written to files.
fn joined(ranges: &[Vec<u8>]) -> Result<Vec<u8>, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = |k: usize| folder.path().join(format!("{k}.lamp"));
    let paths: Vec<_> = (0..ranges.len()).map(path).collect();
    for (path, bytes) in paths.iter().zip(ranges) {
        std::fs::write(path, bytes).unwrap();
    }
    let out = Shared::default();
    let to = Destination::Stream(Box::new(out.clone()));
    let said = |error: JoinError| match &error {
        JoinError::In { path, source } => format!("{}: {source}", path.display()),
        _ => error.to_string(),
    };
    join_packed(&paths, to, Format::Big, PackLevel::default()).map_err(said)?;
    Ok(out.bytes())
}

#[test]
fn joined_ranges_are_the_whole() {
    let layers = layers_of(0, (0..3 * KEY_LAYERS + 7).map(drifting).collect());
    let whole = packed(&layers);
    let cut_at = |cuts: &[usize]| {
        let ends = [&[0], cuts, &[layers.len()]].concat();
        let ranges: Vec<_> =
            ends.windows(2).map(|ends| packed(&layers[ends[0]..ends[1]])).collect();
        joined(&ranges).unwrap()
    };
    for cuts in [&[64][..], &[64, 128, 192], &[128]] {
        assert!(cut_at(cuts) == whole, "{cuts:?}");
    }
    for cuts in [&[17][..], &[63, 65], &[1, 128, 198]] {
        let joined = cut_at(cuts);
        assert!(joined != whole, "{cuts:?}: frames are copied, so there are more");
        assert_eq!(read(joined).unwrap(), layers, "{cuts:?}");
    }
}

#[test]
fn damaged_ranges_are_not_joined() {
    let layers = layers_of(0, (0..2 * KEY_LAYERS).map(drifting).collect());
    let [low, high] = [packed(&layers[..64]), packed(&layers[64..])];
    assert!(joined(&[low.clone(), high.clone()]).is_ok());
    for at in [30, high.len() / 2, high.len() - 2] {
        let mut damaged = high.clone();
        damaged[at] ^= 1;
        let error = joined(&[low.clone(), damaged]).unwrap_err();
        assert!(error.contains("1.lamp: "), "{error}");
    }
    let error = joined(&[low, high[..high.len() - 20].to_vec()]).unwrap_err();
    assert!(error.contains("cut off"), "{error}");
}

#[test]
fn rows_may_go_on_behind_their_reference() {
    // Four transitions that end with the row below, and rows that do not end there.
    let below = [10, 20, 30, 40];
    let rows = [&below[..], &[10, 20, 30, 40, 50, 60], &[10, 20], &[], &[9, 21, 29, 41, 399]];
    let of = |row: &[u32]| Image::Mask(mask_of(400, std::iter::repeat_n(row, 12)));
    let images = rows.iter().flat_map(|row| [of(&below), of(row)]).collect();
    let layers = layers_of(1, images);
    assert_eq!(read(packed(&layers)).unwrap(), layers);
}

#[test]
fn noise_takes_a_bit_a_pixel() {
    let mut state = 1u32;
    let mut is_white = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state >> 31 == 1
    };
    let mut image = || {
        let rows: Vec<Vec<u32>> = (0..90)
            .map(|_| {
                let pixels: Vec<bool> = (0..203).map(|_| is_white()).collect();
                let before = [false].into_iter().chain(pixels.iter().copied());
                let changes = (0..).zip(before.zip(&pixels));
                changes.filter(|(_, (a, b))| a != *b).map(|(column, _)| column).collect()
            })
            .collect();
        Image::Mask(mask_of(203, rows.iter().map(Vec::as_slice)))
    };
    let layers = layers_of(63, (0..4).map(|_| image()).collect());
    let bytes = packed(&layers);
    assert!(bytes.len() < 4 * 90 * 26 + 1000, "{}", bytes.len());
    assert_eq!(read(bytes).unwrap(), layers);
}
