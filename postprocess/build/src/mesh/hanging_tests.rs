//! The kept pieces of a mesh, against a pixel-by-pixel referee.

use lamp_stack::{Image, Layer, Length, Mask, Op};
use proptest::prelude::*;

use super::super::testing::{layer, mask_of};
use super::super::{Layout, PartStack, TileError};
use super::mesh_tests::{AREA, blobs, built, drawn_alone, free, layout, mask, mesh, pixels, place};
use super::{CellShape, MeshOptions, Moat};

type Pixels = Vec<bool>;

/// Returns the pieces of what is white, joined at the sides of pixels.
fn pieces(white: &Pixels) -> Vec<Vec<usize>> {
    let mut left = white.clone();
    let mut all = Vec::new();
    for start in 0..left.len() {
        let mut todo = vec![start];
        let mut piece = Vec::new();
        while let Some(at) = todo.pop() {
            if !std::mem::take(&mut left[at]) {
                continue;
            }
            piece.push(at);
            let (x, y) = (at as u32 % AREA.0, at as u32 / AREA.0);
            let sides = [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)];
            let inside = sides.into_iter().filter(|side| side.0 < AREA.0 && side.1 < AREA.1);
            todo.extend(inside.map(|(x, y)| place(x, y)));
        }
        if !piece.is_empty() {
            all.push(piece);
        }
    }
    all
}

/// Returns the pixels of a layer's mesh that are kept on the mesh of the layer below.
fn kept(white: &Pixels, below: &Pixels, least: usize) -> Pixels {
    let mut out = vec![false; white.len()];
    for piece in pieces(white) {
        if piece.len() >= least && piece.iter().any(|&at| below[at]) {
            piece.into_iter().for_each(|at| out[at] = true);
        }
    }
    out
}

fn white_of(mask: &Mask) -> Pixels {
    pixels().map(|(x, y)| mask.is_white(x, y)).collect()
}

fn layers_of(images: &[Mask]) -> Vec<Layer> {
    (0..).zip(images).map(|(k, image)| layer(k, Image::Mask(image.clone()))).collect()
}

fn standing(layout: &Layout) -> Pixels {
    let rows = &layout.mesh.as_ref().unwrap().standing;
    pixels().map(|(x, y)| rows.row(y).partition_point(|&column| column <= x) % 2 == 1).collect()
}

/// The pixels that the moats of two copies leave in each layer, and the pixels of the parts.
fn cut(images: &[Mask], copies: &[Copy], moat: Moat, wide: f64) -> Vec<[Pixels; 2]> {
    let drawn = |copy: &Copy| -> Vec<Mask> {
        images.iter().map(|image| drawn_alone(std::slice::from_ref(image), *copy)).collect()
    };
    let drawn: Vec<Vec<Mask>> = copies.iter().map(drawn).collect();
    let union = |masks: &[Mask]| {
        let black = Mask::black(AREA.0, AREA.1);
        masks.iter().fold(black, |all, mask| all.combined(Op::Union, mask).unwrap())
    };
    let of_layer = |k: usize| {
        let followed = |masks: &Vec<Mask>| match moat {
            Moat::Layer => masks[k].clone(),
            Moat::Rising => union(&masks[..=k]),
            Moat::Outline => union(masks),
        };
        let any = |all: Vec<Pixels>| {
            (0..all[0].len()).map(|at| all.iter().any(|one| one[at])).collect::<Pixels>()
        };
        let free = any(drawn.iter().map(|masks| free(&followed(masks), wide)).collect());
        [free, any(drawn.iter().map(|masks| white_of(&masks[k])).collect())]
    };
    (0..images.len()).map(of_layer).collect()
}

type Copy = (usize, u32, u32, u32, bool);

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(24) })]

    /// Of all that moats leave, the pieces that are large enough and hang together down to the
    /// base stay, and nothing else; by default none lies above a part.
    #[test]
    fn what_is_kept_hangs_together_down_to_the_base(
        images in prop::collection::vec(blobs(16, 13), 2..5),
        places in prop::array::uniform2((0..25u32, 0..40u32, 0..4u32, any::<bool>())),
        moat in prop::sample::select(Moat::ALL.to_vec()),
        lengths in (5.0..14.0, 0.6..4.0, 0.0..3.0).prop_map(|(a, b, c)| [a, b, c]),
        [least, break_width] in [0..40u32, 0..3],
    ) {
        let [a, b] = places.map(|(x, y, turn, mirror)| (0, x, y, 90 * turn, mirror));
        let copies = [a, (b.0, b.1 + 30, b.2, b.3, b.4)];
        let Some(layout) = layout(&images[..1], &copies, "70x60mm") else { return Ok(()) };
        let outline = PartStack::of_outline("p0", layers_of(&images).into_iter().map(Ok::<_, TileError>));
        let whole = layout.parts[0].frame();
        let mut layout = layout;
        layout.parts[0] = outline.unwrap().unwrap().on(whole);
        let options = MeshOptions {
            moat,
            least_piece_mm2: least.into(),
            break_width: Length::from_mm(break_width.into()),
            ..mesh(CellShape::Hexagon, lengths)
        };
        let layout = layout.with_mesh(&options).unwrap();
        let walls = standing(&layout);
        let build = built(&layout, vec![layers_of(&images)]);
        let mut below = vec![true; walls.len()];
        let mut part_below = vec![false; walls.len()];
        for (made, [free, part]) in build.iter().zip(cut(&images, &copies, moat, lengths[2] + 1.0)) {
            let left: Pixels = walls.iter().zip(&free).map(|(wall, free)| *wall && !free).collect();
            let expected = kept(&left, &below, least as usize);
            let white = white_of(mask(made));
            for at in 0..walls.len() {
                prop_assert_eq!(white[at], part[at] || expected[at]);
                let is_above = part_below[at] && !part[at];
                prop_assert!(!(is_above && white[at]) || moat == Moat::Layer);
                part_below[at] |= part[at];
            }
            below = expected;
        }
    }
}

/// A mushroom: mesh below its hat, none above its foot, and no pin of mesh beside.
#[test]
fn no_mesh_stands_on_faces_that_look_up() {
    let wide = mask_of(&["########"; 8]);
    let narrow = {
        let mut rows = ["........"; 8];
        rows[3..5].fill("...##...");
        mask_of(&rows)
    };
    let images = [narrow.clone(), wide.clone(), narrow];
    let copies = [(0, 10, 10, 0, false)];
    let layout = layout(&images[..1], &copies, "70x60mm").unwrap();
    let white = |moat: Moat| {
        let options = MeshOptions { moat, ..mesh(CellShape::Square, [4.0, 3.9, 0.0]) };
        let build = built(&layout.clone().with_mesh(&options).unwrap(), vec![layers_of(&images)]);
        let square = || (42..50u32).flat_map(|y| (10..18).map(move |x| (x, y)));
        let count = |layer: &Layer| square().filter(|&(x, y)| mask(layer).is_white(x, y)).count();
        build.iter().map(count).collect::<Vec<_>>()
    };
    assert_eq!(white(Moat::Rising), [64, 64, 4]);
    assert_eq!(white(Moat::Layer), [64, 64, 64]);
}

/// A range of layers is what it is in the whole, because the layers below are known.
#[test]
fn layers_from_one_on_are_those_of_the_whole() {
    let [wide, narrow] =
        [mask_of(&["######"; 4]), mask_of(&["......", ".####.", ".####.", "......"])];
    let images = [&narrow, &wide, &narrow, &narrow].map(Clone::clone);
    let layout = layout(&images[1..2], &[(0, 8, 7, 0, false)], "70x60mm").unwrap();
    for moat in [Moat::Rising, Moat::Layer] {
        let options =
            MeshOptions { moat, least_piece_mm2: 9.0, ..mesh(CellShape::Hexagon, [6.0, 2.0, 1.0]) };
        let layout = layout.clone().with_mesh(&options).unwrap();
        let whole = built(&layout, vec![layers_of(&images)]);
        let upper = built(&layout.clone().from_layer(2), vec![layers_of(&images)]);
        assert_eq!(upper.len(), 2);
        for (a, b) in whole[2..].iter().zip(&upper) {
            assert!(mask(a) == mask(b) && a.info.index == b.info.index);
        }
        assert!(upper[0].info.stack.is_some() && upper[1].info.stack.is_none());
    }
}
