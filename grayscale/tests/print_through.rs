//! Checks gray levels that are chosen for doses that add up: column by column, against sections of
//! the part through the pixels' centers.

use lamp_fixtures::{Mesh, cube_with_hole, sphere, tower};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::{ExposureTime, FadingLight, Resin};
use lamp_grayscale::{CuredLine, PixelLine, SolidHeights, SummedLine, excess};
use lamp_slicing::{
    Axis, Fill, LayerHeights, LayerLevels, Part, PixelGrid, Placement, SectionOptions, Shading,
    SliceOptions, Slices, Units, section,
};
use lamp_stack::{Catalogued, Image, Layer, Length, Pitch};

const DPI: f64 = 600.0;

struct Build {
    mesh: Mesh,
    heights: Option<LayerHeights>,
    thickness: Length,
    overcure: f64,
}

fn light() -> (Resin, FadingLight) {
    let material = Material::builtin("lamp-suspension").unwrap();
    (material.resin().unwrap(), material.fading().unwrap())
}

impl Build {
    fn new(mesh: Mesh, thickness_um: f64) -> Self {
        Self { mesh, heights: None, thickness: Length::from_um(thickness_um), overcure: 1.0 }
    }

    fn time(&self, thickness: Length) -> ExposureTime {
        light().0.exposure_time(thickness, self.overcure).unwrap()
    }

    fn part(&self) -> Part {
        Part::from_facets("part", self.mesh.facets.clone())
    }

    fn slices(&self, gray: bool, more: SliceOptions) -> Slices {
        let levels = |thickness| light().1.levels(self.time(thickness));
        let of_layers = || match &self.heights {
            Some(heights) => {
                LayerLevels::by_thickness(heights, |um| Ok::<_, ()>(levels(um))).unwrap()
            }
            None => LayerLevels::from(levels(self.thickness)),
        };
        let shading = if gray { Shading::PrintThrough(of_layers()) } else { Shading::White };
        let options = SliceOptions {
            pitch: Pitch::of_dpi(DPI).unwrap(),
            thickness: self.thickness,
            heights: self.heights.clone(),
            shading,
            ..more
        };
        Slices::new(self.part(), &options).unwrap()
    }

    fn layers(&self, gray: bool) -> (Vec<Layer>, PixelGrid) {
        let slices = self.slices(gray, SliceOptions::default());
        let grid = *slices.grid();
        (slices.collect::<Result<_, _>>().unwrap(), grid)
    }

    /// Returns what a row of the layers cures, at each pixel.
    fn cured(&self, layers: &[Layer], row: u32) -> Vec<SolidHeights> {
        let mut line = SummedLine::new(light().1, layers[0].image.width());
        for Layer { info, image, .. } in layers {
            let thickness = Length::from_um(info.thickness_um.unwrap());
            let runs = PixelLine::Row(row).runs(image);
            line.expose(runs, info.z().unwrap(), thickness, self.time(thickness));
        }
        line.cured(layers[0].info.z_um.unwrap())
    }

    /// Returns where the part is below each pixel center of a row, above the platform.
    fn inside(&self, grid: &PixelGrid, row: u32, floor_um: f64) -> Vec<SolidHeights> {
        let options = SectionOptions {
            units: Units::Millimetres,
            // y up, z along the rows, x across them.
            placement: Placement::default().rotated(Axis::Y, 90.0).rotated(Axis::X, 90.0),
            fill: Fill::EvenOdd,
            z: Length::from_mm(grid.to_mm(0.0, f64::from(row))[1]),
            pitch: grid.pitch,
            top_mm: grid.origin_mm[0] + f64::from(grid.width) * grid.pitch.mm()[0],
            rows: grid.width,
        };
        let lines = section(self.part(), &options).unwrap();
        let in_um = |ends: &[f64; 2]| ends.map(|mm| (mm * 1000.0).max(floor_um));
        lines.iter().rev().map(|line| line.iter().map(in_um).collect()).collect()
    }
}

/// Two plates of a staircase each, above each other with a gap of 150 um that slopes.
fn plates() -> Mesh {
    let plate = |low: f32, thick: f32, slope: f32| {
        cube_with_hole(6.0, 1.0, 200).facets.into_iter().map(move |facet| {
            facet.map(|[x, y, z]| [x, 0.2 * y, low + thick * z / 6.0 + slope * (x + 3.0)])
        })
    };
    let stand = |x0: f32| {
        cube_with_hole(2.0, 0.3, 100)
            .facets
            .into_iter()
            .map(move |facet| facet.map(|[x, y, z]| [0.1 * x + x0, 0.1 * y + 2.0, 1.15 * z]))
    };
    let facets = plate(0.3, 0.25, 0.1).chain(plate(0.7, 0.6, 0.1)).chain(stand(5.0));
    Mesh { facets: facets.collect() }
}

/// Returns the overshoot and what is missing of white, and of gray, in the columns through pixels'
/// centers, in micrometers summed over the rows looked at; what white layers miss is what none is
/// exposed for, without what others print through.
fn errors(build: &Build, every: usize) -> [[f64; 2]; 2] {
    let (white, grid) = build.layers(false);
    let (gray, _) = build.layers(true);
    let floor_um = white[0].info.z_um.unwrap();
    let mut sums = [[0.0; 2]; 2];
    for row in (0..grid.height).step_by(every) {
        let mut alone = CuredLine::default();
        for Layer { info, image, .. } in &white {
            let thickness = Length::from_um(info.thickness_um.unwrap());
            let top = Length::from_um(info.z_um.unwrap() + thickness.um());
            alone.expose(PixelLine::Row(row), image, top, |_| thickness);
        }
        let by_white = build.cured(&white, row);
        let by_gray = build.cured(&gray, row);
        for (pixel, part) in build.inside(&grid, row, floor_um).iter().enumerate() {
            // Columns beside the part are rounding to pixels, the same for both.
            if !part.is_empty() {
                sums[0][0] += excess(&by_white[pixel], part).um();
                sums[0][1] += excess(part, &alone.pixels()[pixel]).um();
                sums[1][0] += excess(&by_gray[pixel], part).um();
                sums[1][1] += excess(part, &by_gray[pixel]).um();
            }
        }
    }
    sums
}

#[test]
fn columns_cure_down_to_their_undersides() {
    let uneven = [0.0, 80.0, 230.0, 280.0, 400.0, 600.0, 650.0, 800.0, 1000.0, 1100.0, 1300.0];
    let uneven: Vec<f64> = (0..10)
        .flat_map(|k| uneven[..10].iter().map(move |um| um + 1300.0 * f64::from(k)))
        .collect();
    let builds = [
        ("sphere, 100 um", Build::new(sphere(6.0, 6_000), 100.0), 41),
        ("sphere, 30 um", Build::new(sphere(3.0, 6_000), 30.0), 23),
        ("sphere, 400 um", Build::new(sphere(6.0, 6_000), 400.0), 41),
        (
            "sphere, overcure 1.7",
            Build { overcure: 1.7, ..Build::new(sphere(6.0, 6_000), 100.0) },
            41,
        ),
        (
            "sphere, uneven",
            Build {
                heights: Some(LayerHeights::new(uneven).unwrap()),
                ..Build::new(sphere(6.0, 6_000), 100.0)
            },
            41,
        ),
        ("tower", Build::new(tower(6_000), 300.0), 61),
        ("plates", Build::new(plates(), 50.0), 3),
    ];
    for (name, build, every) in builds {
        let [white, gray] = errors(&build, every);
        println!("{name}: overshoot and missing, um: {white:.1?} white, {gray:.1?} gray");
        assert!(gray[0] < 0.02 * white[0], "{name}: {white:?} {gray:?}");
        // What gray lacks more is rounding to levels.
        assert!(gray[1] < white[1] + 0.01 * white[0], "{name}: {white:?} {gray:?}");
    }
}

fn levels(image: &Image, row: u32) -> Vec<u8> {
    let mut levels = vec![0; image.width() as usize];
    for (start, end, level) in image.runs(row) {
        levels[start as usize..end as usize].fill(level);
    }
    levels
}

/// The least light is taken away: below the one level in between all are least, above it white.
#[test]
fn low_layers_are_darkened_first() {
    let build = Build::new(sphere(6.0, 6_000), 100.0);
    let ((white, grid), (gray, _)) = (build.layers(false), build.layers(true));
    let mut between = 0;
    for row in (0..grid.height).step_by(29) {
        let rows = |layers: &[Layer]| -> Vec<Vec<u8>> {
            layers.iter().map(|layer| levels(&layer.image, row)).collect()
        };
        let (white, gray) = (rows(&white), rows(&gray));
        for column in 0..grid.width as usize {
            // A ball has one solid in each column.
            let own = gray.iter().map(|row| row[column]).skip_while(|&level| level == 0);
            let own: Vec<u8> = own.take_while(|&level| level > 0).collect();
            let middle = own.iter().position(|&level| level > 1).unwrap_or(own.len());
            assert!(
                own.iter().skip(middle + 1).all(|&level| level == 255),
                "{row} {column}: {own:?}"
            );
            between += usize::from(own.get(middle).is_some_and(|&level| level < 255));
            let is_same = |(a, b): (&Vec<u8>, &Vec<u8>)| (a[column] > 0) == (b[column] > 0);
            // Pixels whose centers are on the underside are black.
            let differing = white.iter().zip(&gray).filter(|pair| !is_same(*pair)).count();
            assert!(differing <= 1, "{row} {column}");
        }
    }
    assert!(between > 1_000, "{between}");
}

#[test]
fn memory_ranges_and_threads_change_no_pixel() {
    let build = Build::new(tower(4_000), 300.0);
    let (all, _) = build.layers(true);
    let some = |layers, memory| {
        let more = SliceOptions { layers, memory, ..SliceOptions::default() };
        let slices = build.slices(true, more);
        slices.collect::<Result<Vec<_>, _>>().unwrap()
    };
    let images = |layers: &[Layer]| layers.iter().map(|l| l.image.clone()).collect::<Vec<_>>();
    assert!(images(&some(None, 1 << 16)) == images(&all));
    assert!(images(&some(Some(130..170), 64 << 20)) == images(&all[130..170]));
    assert!(images(&some(Some(250..254), 1 << 20)) == images(&all[250..254]));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert!(pool.install(|| images(&some(None, 64 << 20))) == images(&all));
}

#[test]
fn what_white_does_not_reach_is_told() {
    let short = |overcure: f64| -> u64 {
        let build = Build { overcure, ..Build::new(plates(), 200.0) };
        let pixels = |layer: &Layer| layer.info.slice_record().short_px.unwrap_or(0);
        build.layers(true).0.iter().map(pixels).sum()
    };
    assert_eq!(short(1.0), 0);
    assert!(short(0.3) > 1_000, "{}", short(0.3));
}
