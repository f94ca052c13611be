use lamp_stack::{Layer, MaskBuilder, PageInfo};
use lamp_supports::{CheckError, CheckOptions, Disagreements, FindingRecord, check, records};

use super::*;

/// Layers of 60 x 40 pixels, a tenth of a millimeter wide and high, each with white rectangles.
fn layers(rectangles: &[&[[u32; 4]]]) -> Vec<Layer> {
    let layer = |(index, rectangles): (u32, &&[[u32; 4]])| {
        let mut mask = MaskBuilder::new(60);
        for row in 0..40 {
            let here = rectangles.iter().filter(|[_, _, top, end]| (*top..*end).contains(&row));
            let ends: Vec<u32> = here.flat_map(|[left, right, ..]| [*left, *right]).collect();
            mask.push_row(&ends).unwrap();
        }
        let info = PageInfo { index, thickness_um: Some(100.0), ..PageInfo::default() };
        Layer { info, pitch: Pitch::of_dpi(254.0), image: mask.finish().into() }
    };
    (0..).zip(rectangles).map(layer).collect()
}

/// The pitch of the axis across the picture gives the height of a layer.
#[test]
fn side_views_of_pixels_that_are_not_square_have_the_height_of_layers() {
    let pitch = Pitch::of_two_dpi([254.0, 127.0]);
    let heights = |arm: [u32; 4]| {
        let mut layers = layers(&[&[POST], &[POST], &[arm]]);
        layers.iter_mut().for_each(|layer| layer.pitch = pitch);
        let layers = layers.into_iter().map(Ok::<_, CheckError>);
        let found = check(layers, Ok, &CheckOptions::default()).unwrap();
        let records = records(&found, &Disagreements::default(), None);
        let overhang = records.iter().find(|it| matches!(it, FindingRecord::Overhang(_))).unwrap();
        let side_view = SideView::new(overhang.shown().unwrap(), &found);
        (side_view.along_row, side_view.heights[&1])
    };
    assert_eq!(heights([2, 14, 10, 30]), (true, [1.0, 2.0]));
    assert_eq!(heights([2, 30, 10, 18]), (false, [0.5, 1.0]));
}

/// Draws the first finding of layers.
fn drawn(layers: &[Layer]) -> ([u32; 2], Vec<[u8; 3]>) {
    let all = layers.iter().cloned().map(Ok::<_, CheckError>);
    let found = check(all, Ok, &CheckOptions::default()).unwrap();
    let records = records(&found, &Disagreements::default(), None);
    let mut picture = EvidencePicture::new(records[0].shown().unwrap(), &found);
    let mut below = None;
    for (position, layer) in (0..).zip(layers) {
        let mask = layer.image.exposed().into_owned();
        if picture.needs(position) {
            picture.add(position, below.as_ref(), &mask);
        }
        below = Some(mask);
    }
    let mut png = Vec::new();
    picture.write_png(&mut png).unwrap();
    let mut reader = png::Decoder::new(io::Cursor::new(png)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    ([info.width, info.height], pixels.as_chunks::<3>().0.to_vec())
}

const POST: [u32; 4] = [2, 8, 10, 30];

#[test]
fn an_island_shows_where_it_floats_and_joins() {
    let island: &[[u32; 4]] = &[POST, [30, 40, 15, 20]];
    let larger: &[[u32; 4]] = &[POST, [30, 50, 15, 25]];
    let stack =
        layers(&[&[POST], &[POST], island, island, larger, larger, &[[2, 50, 15, 25]], &[POST]]);
    let (size, pixels) = drawn(&stack);
    let red = |shade: EvidenceShade| pixels.iter().filter(|at| **at == shade.color()).count();
    // 50 pixels of 8 x 8 in the place, 200 in the layer of the largest area; the whole layer and the
    // side view are enlarged 5 and 8 times.
    let place = ShadedPicture::new(
        PictureRegion { columns: 30..40, rows: 15..20 },
        [60, 40],
        PLACE_SIDE,
        1.0,
    );
    assert_eq!(place.scale(), [8.0; 2]);
    let largest = 200 * 6 * 6;
    let least = 50 * 64 + largest;
    assert!(red(EvidenceShade::Found) > least, "{} {least}", red(EvidenceShade::Found));
    assert!(red(EvidenceShade::Place) > 0 && red(EvidenceShade::Unheld) > 0);
    assert!(size[0] > 480 && size[1] > 480, "{size:?}");
}

#[test]
fn a_cantilever_shows_from_the_side() {
    let arm: &[[u32; 4]] = &[[2, 30, 10, 30]];
    let (_, pixels) = drawn(&layers(&[&[POST], &[POST], &[POST], arm, arm]));
    let red = pixels.iter().filter(|at| **at == EvidenceShade::Found.color()).count();
    assert!(red > 0);
}

#[test]
fn a_scale_is_one_two_or_five_of_its_unit() {
    let dpi = Pitch::of_dpi(254.0);
    assert_eq!(scale_bar(dpi, 1.0, 480.0), (100, "10 mm".to_owned()));
    assert_eq!(scale_bar(dpi, 8.0, 480.0), (160, "2 mm".to_owned()));
    assert_eq!(scale_bar(dpi, 0.1, 300.0), (100, "100 mm".to_owned()));
    assert_eq!(scale_bar(None, 2.0, 320.0), (100, "50 pixels".to_owned()));
    // The narrowest picture of the widest image.
    let (length, words) = scale_bar(dpi, 1e-9, 1.0);
    assert!(length <= 1 && words.ends_with(" mm"), "{length} {words}");
}
