//! Faces that designers put on the planes of layers, in files that round them to 32 bits.
//!
//! A part of boxes is meant in whole layers and pixels. Its coordinates are decimals (millimeters,
//! mils, inches) that 32 bits cannot hold. Which pixels are white follows from the whole numbers
//! alone.

use std::collections::BTreeSet;
use std::fs;

use lamp_fixtures::{Mesh, SplitMix, three_mf, three_mf_model};
use lamp_slicing::topology::{CornerTable, StepSolids};
use lamp_slicing::{
    Axis, LayerHeights, OpenOptions, Part, Placement, PlaneRule, SliceOptions, Slices, Units,
};
use lamp_stack::{Layer, Length, Pitch};
use proptest::prelude::*;

use super::common::{cases, mask};

/// A part of unit boxes: so many columns and rows, each with heights from one layer up to another.
#[derive(Clone, Debug)]
struct Stepped {
    columns: usize,
    rows: usize,
    /// By row and column.
    heights: Vec<[usize; 2]>,
}

/// The width of a box in pixels.
const BOX_PIXELS: usize = 3;

impl Stepped {
    fn random(seed: u64) -> Self {
        let mut random = SplitMix(seed);
        let [columns, rows] = [1 + random.below(4), 1 + random.below(3)];
        // All hold one core, so the part is one solid with ledges, undersides, pockets and towers.
        let core = 6 + random.below(20);
        let heights = (0..columns * rows)
            .map(|_| [core - random.below(6), core + 1 + random.below(12)])
            .collect();
        Self { columns, rows, heights }
    }

    fn is_solid(&self, [column, row, layer]: [i64; 3]) -> bool {
        let (Ok(column), Ok(row)) = (usize::try_from(column), usize::try_from(row)) else {
            return false;
        };
        let is_there = column < self.columns && row < self.rows;
        is_there && {
            let [low, high] = self.heights[row * self.columns + column];
            (low as i64..high as i64).contains(&layer)
        }
    }

    fn ends(&self) -> [usize; 2] {
        let low = self.heights.iter().map(|[low, _]| *low).min().unwrap();
        [low, self.heights.iter().map(|[_, high]| *high).max().unwrap()]
    }

    /// Returns the surface in unit squares, as whole numbers.
    fn surface(&self) -> Vec<[[i64; 3]; 3]> {
        let mut facets = Vec::new();
        let end = self.ends()[1] as i64;
        let cells = (0..self.columns as i64).flat_map(|x| {
            (0..self.rows as i64).flat_map(move |y| (0..end).map(move |z| [x, y, z]))
        });
        for cell in cells.filter(|&cell| self.is_solid(cell)) {
            for (axis, up) in (0..3).flat_map(|axis| [(axis, 0), (axis, 1)]) {
                let mut beside = cell;
                beside[axis] += 2 * up - 1;
                if self.is_solid(beside) {
                    continue;
                }
                let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
                let corner = |a: i64, b: i64| {
                    let mut at = cell;
                    at[axis] += up;
                    at[u] += a;
                    at[v] += b;
                    at
                };
                let square = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                let [a, b, c, d] = square;
                let sides = if up == 1 { [[a, b, c], [a, c, d]] } else { [[a, c, b], [a, d, c]] };
                facets.extend(sides);
            }
        }
        facets
    }
}

/// The numbers in a file: thousandths of its unit, from which decimals are rounded once.
#[derive(Clone, Copy, Debug)]
struct Numbers {
    units: Units,
    /// The width of boxes and the thickness of layers.
    step: [i64; 2],
    /// Where the part begins.
    origin: [i64; 3],
}

impl Numbers {
    const ALL: [(Units, [i64; 2]); 6] = [
        (Units::Millimetres, [300, 100]),
        (Units::Millimetres, [600, 25]),
        (Units::Millimetres, [700, 30]),
        (Units::Micrometres, [330_000, 50_000]),
        (Units::Inches, [30, 4]),
        (Units::Centimetres, [90, 7]),
    ];

    fn at(&self, whole: [i64; 3]) -> [f32; 3] {
        let [width, thickness] = self.step;
        let [x, y, z] = self.origin;
        let thousandths = [x + whole[0] * width, y + whole[1] * width, z + whole[2] * thickness];
        thousandths.map(|number| (number as f64 / 1000.0) as f32)
    }

    fn thickness(&self) -> Length {
        Length::from_mm(self.step[1] as f64 * self.units.mm() / 1000.0)
    }

    fn options(&self, plane: PlaneRule) -> SliceOptions {
        let pitch_mm = self.step[0] as f64 * self.units.mm() / 1000.0 / BOX_PIXELS as f64;
        SliceOptions {
            pitch: Pitch::of_dpi(25.4 / pitch_mm).unwrap(),
            thickness: self.thickness(),
            plane,
            units: self.units,
            ..SliceOptions::default()
        }
    }
}

/// The ways in which files hold the part.
#[derive(Clone, Copy, Debug)]
enum Format {
    Stl,
    Obj,
    ThreeMf,
    Step,
}

fn open(mesh: &Mesh, format: Format, units: Units) -> Option<Part> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("part");
    match format {
        Format::Stl => {
            let mut bytes = Vec::new();
            mesh.write_stl("part", &mut bytes).unwrap();
            fs::write(&path, bytes).unwrap();
        }
        Format::Obj => fs::write(&path, mesh.obj()).unwrap(),
        Format::ThreeMf => {
            let unit = match units {
                Units::Millimetres => "millimeter",
                Units::Micrometres => "micron",
                Units::Inches => "inch",
                _ => return None,
            };
            let model = three_mf_model(unit, &mesh.three_mf_object(1), "<item objectid=\"1\"/>\n");
            fs::write(&path, three_mf(&model, &[])).unwrap();
        }
        Format::Step => {
            if units != Units::Millimetres {
                return None;
            }
            let table = CornerTable::of_facets(&mesh.facets).unwrap();
            // Boxes that touch along an edge alone are no solid.
            let solids = StepSolids::new(table).ok()?;
            let mut text = Vec::new();
            solids.write("part", &mut text).unwrap();
            fs::write(&path, text).unwrap();
        }
    }
    Some(Part::open(&path, &OpenOptions::default()).unwrap())
}

/// Compares every pixel of every layer with the whole numbers that were meant.
fn compare(part: &Stepped, layers: &[Layer], ends: &[usize], plane: PlaneRule) {
    assert_eq!(layers.len(), ends.len() - 1);
    for (k, layer) in layers.iter().enumerate() {
        // The unit of height that holds the limit.
        let unit = match plane {
            PlaneRule::Top => ends[k + 1] - 1,
            PlaneRule::Middle => (ends[k] + ends[k + 1] - 1) / 2,
            PlaneRule::Bottom => ends[k],
        };
        let mask = mask(layer);
        let mut white = BTreeSet::new();
        for row in 0..mask.height() {
            for run in mask.row(row).chunks(2) {
                white.extend((run[0]..run[1]).map(|column| (row, column)));
            }
        }
        // One black pixel around.
        let pixels = (0..part.rows * BOX_PIXELS)
            .flat_map(|y| (0..part.columns * BOX_PIXELS).map(move |x| (x, y)));
        let is_solid = |(x, y): &(usize, usize)| {
            part.is_solid([(x / BOX_PIXELS) as i64, (y / BOX_PIXELS) as i64, unit as i64])
        };
        let place = |(x, y)| ((part.rows * BOX_PIXELS - y) as u32, x as u32 + 1);
        let expected: BTreeSet<_> = pixels.filter(is_solid).map(place).collect();
        assert_eq!(white, expected, "layer {k} at {plane:?}");
    }
}

fn try_part(seed: u64) {
    let part = Stepped::random(seed);
    let mut random = SplitMix(!seed);
    let (units, step) = Numbers::ALL[random.below(Numbers::ALL.len())];
    let mut far = || random.below(400_000) as i64 - 200_000;
    let numbers = Numbers { units, step, origin: [far(), far(), far()] };
    let surface = part.surface();
    let facets = surface.iter().map(|facet| facet.map(|at| numbers.at(at))).collect();
    let mut mesh = Mesh { facets };
    // A file with another axis up, which a quarter turn puts right.
    let mut placement = Placement::default();
    for _ in 0..random.below(3) {
        for corner in mesh.facets.iter_mut().flatten() {
            let [x, y, z] = *corner;
            *corner = [x, z, -y];
        }
        placement = placement.rotated(Axis::X, 90.0);
    }
    let [low, high] = part.ends();
    let all: Vec<usize> = (low..=high).collect();
    let mut some: Vec<usize> = all.iter().copied().filter(|_| random.below(2) == 0).collect();
    some.extend([low, high]);
    some.sort_unstable();
    some.dedup();
    for format in [Format::Stl, Format::Obj, Format::ThreeMf, Format::Step] {
        let Some(model) = open(&mesh, format, units) else { continue };
        for plane in [PlaneRule::Top, PlaneRule::Middle, PlaneRule::Bottom] {
            let options = SliceOptions { placement, ..numbers.options(plane) };
            let slices = Slices::new(model.clone(), &options).unwrap();
            let bottom_um = slices.box_mm()[0][2] * 1000.0;
            let layers: Vec<Layer> = slices.map(Result::unwrap).collect();
            compare(&part, &layers, &all, plane);
            let height = |&end: &usize| bottom_um + (end - low) as f64 * numbers.thickness().um();
            let heights = LayerHeights::new(some.iter().map(height).collect()).unwrap();
            let options = SliceOptions { heights: Some(heights), ..options };
            let layers: Vec<Layer> =
                Slices::new(model.clone(), &options).unwrap().map(Result::unwrap).collect();
            compare(&part, &layers, &some, plane);
        }
    }
}

proptest! {
    #![proptest_config(cases(64))]

    #[test]
    fn every_pixel_is_as_meant(seed in any::<u64>()) {
        try_part(seed);
    }
}
