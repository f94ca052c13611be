use lamp_fixtures::{Plate, Quad};
use lamp_stack::{Dpi, Frame, Image, Layer, Mask, MaskBuilder, Op, PageInfo, Pitch};

use super::super::testing::mask_of;
use super::super::{PackBy, Turns};
use super::*;
use lamp_offset::offset_one_bit;

/// Half a millimeter.
const DPI: f64 = 50.8;
const GAP: Length = Length::from_mm(1.0);
const BY_OUTLINES: Pack = Pack {
    by: PackBy::Outlines,
    turns: Turns::Quarters,
    edge_gap: Length::from_um(0.0),
    shares: false,
};

/// Returns corners turned about a center, counterclockwise.
fn turned_quads(plate: Plate, [x0, y0]: [f64; 2], degrees: f64) -> Vec<Quad> {
    let (sin, cos) = degrees.to_radians().sin_cos();
    let turned = |[x, y]: [f64; 2]| {
        let (x, y) = (x - x0, y - y0);
        [x0 + cos * x - sin * y, y0 + sin * x + cos * y]
    };
    plate.quads().into_iter().map(|quad| quad.map(turned)).collect()
}

/// Returns the part of quads as one layer, by a look at each pixel's center.
fn sampled(name: &str, quads: &[Quad], origin_mm: [f64; 2], pixels: [u32; 2]) -> PartStack {
    let pitch = 25.4 / DPI;
    let is_in = |[a, b, c, d]: &Quad, [x, y]: [f64; 2]| {
        let left = |p: &[f64; 2], q: &[f64; 2]| {
            (q[0] - p[0]) * (y - p[1]) - (q[1] - p[1]) * (x - p[0]) >= 0.0
        };
        left(a, b) && left(b, c) && left(c, d) && left(d, a)
    };
    let mut mask = MaskBuilder::new(pixels[0]);
    for row in 0..pixels[1] {
        let y = origin_mm[1] - (f64::from(row) + 0.5) * pitch;
        let is_white = |column: u32| {
            let x = origin_mm[0] + (f64::from(column) + 0.5) * pitch;
            quads.iter().any(|quad| is_in(quad, [x, y]))
        };
        let white: Vec<bool> = (0..pixels[0]).map(is_white).collect();
        let changes = (0..white.len()).filter(|&c| white[c] != (c > 0 && white[c - 1]));
        mask.push_row(&changes.map(|column| column as u32).collect::<Vec<_>>()).unwrap();
    }
    let info = PageInfo { origin_mm: Some(origin_mm), ..PageInfo::default() };
    let image = Image::Mask(mask.finish()).into();
    let layer = Layer { info, pitch: Pitch::of_dpi(DPI), image };
    PartStack::of_outline(name, std::iter::once(Ok::<_, TileError>(layer))).unwrap().unwrap()
}

/// Returns a plate as it lies; all are within 64 mm of where they begin.
fn part(plate: Plate) -> PartStack {
    sampled("plates/plate.tif", &plate.quads(), [-40.1, 65.3], [215, 215])
}

/// Returns a plate as it is sliced for a plan.
fn sliced(name: &str, plate: Plate, centre: [f64; 2], slicing: &TurnedSlicing) -> PartStack {
    let TurnedSlicing { degrees, origin_mm, size } = slicing;
    let dpi = Dpi::new(DPI).unwrap();
    let pixels = [size.width, size.height].map(|side| (side.pixels(dpi) - 1e-6).ceil() as u32);
    sampled(name, &turned_quads(plate, centre, *degrees), *origin_mm, pixels)
}

/// Returns the outline in the whole image.
fn whole(part: &PartStack) -> Mask {
    let frame = part.frame();
    let image = part.image();
    let around =
        Frame { left: -frame.left, top: -frame.top, width: image.width, height: image.height };
    part.outline().unwrap().framed(around)
}

#[test]
fn turned_outlines_hold_what_is_sliced_at_that_angle_and_little_more() {
    for plate in Plate::ALL {
        let part = part(plate);
        for (degrees, centre) in
            [(15.0, [0.0, 0.0]), (45.0, [3.0, -7.5]), (77.5, [-20.0, 9.0]), (200.0, [0.0, 0.0])]
        {
            let (planned, slicing) = part.turned(centre, degrees).unwrap();
            let sliced = sliced("p.tif", plate, centre, &slicing);
            assert_eq!(planned.image(), sliced.image());
            let [planned, sliced] = [&planned, &sliced].map(whole);
            let beyond = sliced.combined(Op::Difference, &planned).unwrap();
            assert_eq!(beyond.white_pixels(), 0, "{} at {degrees}", plate.name());
            let more = planned.combined(Op::Difference, &offset_one_bit(&sliced, -5.0)).unwrap();
            assert_eq!(more.white_pixels(), 0, "{} at {degrees}", plate.name());
        }
    }
}

#[test]
fn a_plan_holds_when_its_stacks_are_sliced() {
    let area: Size = "110x100mm".parse().unwrap();
    let mut gained = 0;
    for plate in [Plate::Triangle, Plate::T, Plate::U, Plate::Crescent, Plate::Aerofoil] {
        let centre = [5.0, 2.0];
        let plan = TurnedPlan::new(
            &[part(plate)],
            &[centre],
            &[None],
            area,
            GAP,
            BY_OUTLINES,
            "15deg".parse().unwrap(),
        )
        .unwrap();
        let plain = Layout::packed(vec![part(plate)], &[None], area, GAP, BY_OUTLINES).unwrap();
        assert_eq!(plan.plain_copies(), plain.placements().len());
        let copies = plan.layout().placements().len();
        let stack = |stack: &PlannedStack| match &stack.slicing {
            Some(slicing) => sliced(&stack.name, plate, centre, slicing),
            None => part(plate),
        };
        let stacks: Vec<PartStack> = plan.stacks().iter().map(stack).collect();
        let needs_none = plan.stacks().iter().all(|stack| stack.slicing.is_none());
        assert_eq!(needs_none, copies == plain.placements().len());
        assert!(copies >= plain.placements().len());
        gained += copies - plain.placements().len();
        let built = plan.layout().to_file().place(stacks, area).unwrap();
        assert_eq!(built.placements().len(), copies);
        assert!(built.nearer_than(GAP).is_empty(), "{}", plate.name());
    }
    assert!(gained > 0, "no plate gains by turns of 15 degrees");
}

#[test]
fn a_part_longer_than_the_area_lies_aslant() {
    // 62 mm long and some 8 mm wide.
    let area: Size = "52x52mm".parse().unwrap();
    let plan = |turns: &str| {
        let parts = vec![part(Plate::Aerofoil)];
        TurnedPlan::new(
            &parts,
            &[[0.0; 2]],
            &[Some(1)],
            area,
            GAP,
            BY_OUTLINES,
            turns.parse().unwrap(),
        )
    };
    assert!(matches!(plan("90deg"), Err(TileError::TooLarge { .. })));
    let found = plan("45deg").unwrap();
    assert_eq!((found.plain_copies(), found.layout().placements().len()), (0, 1));
    assert_eq!(found.stacks()[0].name, "plates/plate-z45.tif");
    assert_eq!(found.stacks()[0].slicing.map(|slicing| slicing.degrees), Some(45.0));
}

#[test]
fn what_fits_as_it_is_takes_no_other_stacks() {
    let area: Size = "90x90mm".parse().unwrap();
    let plan = |count| {
        let parts = vec![part(Plate::L)];
        let turns = "30deg".parse().unwrap();
        TurnedPlan::new(&parts, &[[0.0; 2]], &[count], area, GAP, BY_OUTLINES, turns).unwrap()
    };
    let found = plan(Some(4));
    assert_eq!((found.plain_copies(), found.stacks().len()), (4, 1));
    assert_eq!(found.stacks()[0].slicing, None);
    let again = [plan(None), plan(None)].map(|plan| plan.layout().to_file());
    assert_eq!(again[0], again[1]);
}

#[test]
fn parts_without_a_place_or_an_outline_are_not_turned() {
    let image = Image::Mask(mask_of(&["##", "#."])).into();
    let layer = Layer { info: PageInfo::default(), pitch: Pitch::of_dpi(DPI), image };
    let box_alone = PartStack::of_image("p.tif", &layer).unwrap();
    assert!(matches!(box_alone.turned([0.0; 2], 15.0), Err(TileError::NoOutline { .. })));
    let layers = std::iter::once(Ok::<_, TileError>(layer));
    let nowhere = PartStack::of_outline("p.tif", layers).unwrap().unwrap();
    assert!(matches!(nowhere.turned([0.0; 2], 15.0), Err(TileError::NoPlace { .. })));
}

#[test]
fn stacks_are_named_by_their_angles() {
    assert_eq!(name_of("blade.tif", 15.0), "blade-z15.tif");
    assert_eq!(name_of("a.b/blade", 22.5), "a.b/blade-z22.5");
    assert_eq!(name_of("a/.tif", 5.0), "a/.tif-z5");
}
