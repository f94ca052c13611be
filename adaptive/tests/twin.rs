//! Compares swept layers with brute force: sections at many heights, each compared with the top
//! one row by row.

use lamp_adaptive::{LayeredPart, SweptLayer};
use lamp_fixtures::{Mesh, cube_with_hole, sphere, torus, tower};
use lamp_slicing::{
    Axis, FacetIndex, Fill, Inside, Part, Placement, SectionOptions, Side, Units, section,
};
use lamp_stack::{Length, Pitch};

/// 1270 dpi: rows 0.02 mm apart, so that sums over them are near what facets say exactly.
const PITCH_MM: f64 = 0.02;
const DPI: f64 = 1270.0;
const SECTIONS: u32 = 100;

struct Twin {
    mesh: Mesh,
    placement: Placement,
    fill: Fill,
}

impl Twin {
    fn model(&self) -> Part {
        Part::from_facets("part", self.mesh.facets.clone())
    }

    fn section(&self, z_um: f64, top_mm: f64, rows: u32) -> Vec<Inside> {
        let options = SectionOptions {
            units: Units::Millimetres,
            placement: self.placement,
            fill: self.fill,
            z: Length::from_um(z_um),
            pitch: Pitch::of_dpi(DPI).unwrap(),
            top_mm,
            rows,
        };
        section(self.model(), &options).unwrap()
    }

    fn check(&self, layers: &[[f64; 2]]) {
        let facets = FacetIndex::new(self.model(), &self.placement, Units::Millimetres).unwrap();
        let [min, max] = [facets.min(), facets.max()];
        let rows = ((max[1] - min[1]) / PITCH_MM).ceil() as u32;
        let part = |facets| LayeredPart::new(facets, Length::from_mm(PITCH_MM), self.fill).unwrap();
        let on_side = |side| {
            let facets = FacetIndex::new(self.model(), &self.placement, Units::Millimetres);
            part(facets.unwrap()).on_side(side)
        };
        let [inside, outside] = [Side::Inside, Side::Outside].map(on_side);
        let part = part(facets);
        let height = max[2] - min[2];
        for layer in layers {
            let [bottom, top] = layer.map(|share| min[2] + share * height);
            // Among other tops, as in the search.
            let tops = [0.5, 0.75, 1.0, 1.2].map(|share| bottom + share * (top - bottom));
            let [layer, inside, outside] =
                [&part, &inside, &outside].map(|part| part.layers(bottom, &tops).each[2]);
            let top_section = self.section(top.min(max[2]), max[1], rows);
            let (mut lost, mut gained, mut volume) = (0.0, 0.0, 0.0);
            let mut both: Vec<[Vec<[f64; 2]>; 2]> = Vec::new();
            let mut first_area = 0.0;
            let each = (top - bottom) / f64::from(SECTIONS) / 1000.0 * PITCH_MM;
            for k in 0..SECTIONS {
                let z = bottom + (top - bottom) * (f64::from(k) + 0.5) / f64::from(SECTIONS);
                let sections = self.section(z, max[1], rows);
                // At a flat face there, the section is that below.
                if z - bottom < 1.5 {
                    both.clear();
                } else if both.is_empty() {
                    first_area = sections.iter().map(|row| length(row)).sum::<f64>() * PITCH_MM;
                    both = sections.iter().map(|row| [row.to_vec(), row.to_vec()]).collect();
                }
                for ([all, any], here) in both.iter_mut().zip(&sections) {
                    *all = intersected(all, here);
                    *any = united(any, here);
                }
                for (here, above) in sections.iter().zip(&top_section) {
                    let common = common(here, above);
                    lost += (length(here) - common) * each;
                    gained += (length(above) - common) * each;
                    volume += length(here) * each;
                }
            }
            // A flat face may count in one section more or less.
            let face = 0.002 * volume + 2.0 * (lost + gained + volume) / f64::from(SECTIONS);
            let near = |found: f64, expected: f64| (found - expected).abs() < face;
            let SweptLayer { lost_mm3, gained_mm3, volume_mm3, .. } = layer;
            assert!(near(lost_mm3, lost), "{layer:?}, {lost} lost");
            assert!(near(gained_mm3, gained), "{layer:?}, {gained} gained");
            assert!(near(volume_mm3, volume), "{layer:?}, {volume}");
            let thickness_mm = (top - bottom) / 1000.0;
            let of_side = |k: usize| {
                both.iter().map(|row| length(&row[k])).sum::<f64>() * PITCH_MM * thickness_mm
            };
            // Sections below the first one here may be smaller or larger.
            let below = face + (layer.bottom_area_mm2 - first_area).abs() * thickness_mm;
            let near = |found: f64, expected: f64| (found - expected).abs() < below;
            assert!(near(inside.lost_mm3, volume - of_side(0)), "{inside:?}, {}", of_side(0));
            assert!(near(outside.gained_mm3, of_side(1) - volume), "{outside:?}, {}", of_side(1));
            assert_eq!([inside.gained_mm3, outside.lost_mm3], [0.0; 2]);
            assert_eq!([inside.volume_mm3, outside.volume_mm3], [volume_mm3; 2]);
            let area = top_section.iter().map(|row| length(row)).sum::<f64>() * PITCH_MM;
            assert!((layer.top_area_mm2 - area).abs() < 1e-3 * (0.5 + area), "{layer:?}: {area}");
        }
    }
}

fn intersected(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let common = |[p, q]: [f64; 2], [r, s]: [f64; 2]| [p.max(r), q.min(s)];
    let all = a.iter().flat_map(|&p| b.iter().map(move |&q| common(p, q)));
    all.filter(|[from, to]| from < to).collect()
}

fn united(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut all = [a, b].concat();
    all.sort_by(|p, q| p[0].total_cmp(&q[0]));
    let mut united: Vec<[f64; 2]> = Vec::new();
    for [from, to] in all {
        match united.last_mut() {
            Some(last) if from <= last[1] => last[1] = last[1].max(to),
            _ => united.push([from, to]),
        }
    }
    united
}

fn length(inside: &[[f64; 2]]) -> f64 {
    inside.iter().map(|[from, to]| to - from).sum()
}

fn common(a: &Inside, b: &Inside) -> f64 {
    let overlap = |[p, q]: [f64; 2], [r, s]: [f64; 2]| (q.min(s) - p.max(r)).max(0.0);
    a.iter().flat_map(|&p| b.iter().map(move |&q| overlap(p, q))).sum()
}

/// Checks thin and thick layers at all heights.
const LAYERS: [[f64; 2]; 8] = [
    [0.0, 0.01],
    [0.1, 0.13],
    [0.31, 0.32],
    [0.45, 0.55],
    [0.2, 0.9],
    [0.62, 0.7],
    [0.9, 0.95],
    [0.93, 1.0],
];

fn joined(meshes: &[Mesh]) -> Mesh {
    Mesh { facets: meshes.iter().flat_map(|mesh| mesh.facets.iter().copied()).collect() }
}

#[test]
fn parts_that_stand() {
    for mesh in [tower(4_000), torus(6.0, 2.0, 2_000), cube_with_hole(8.0, 2.0, 400)] {
        let placement = Placement::default();
        Twin { mesh, placement, fill: Fill::EvenOdd }.check(&LAYERS);
    }
}

/// All faces are inclined, columns pass several of them, and holes lie across.
#[test]
fn parts_that_lie_and_lean() {
    let placements = [
        Placement::default().rotated(Axis::X, 90.0),
        Placement::default().rotated(Axis::X, 33.0).rotated(Axis::Y, 21.0),
    ];
    for placement in placements {
        for fill in [Fill::EvenOdd, Fill::Solid] {
            let mesh = cube_with_hole(8.0, 2.0, 400);
            Twin { mesh, placement, fill }.check(&LAYERS);
        }
    }
}

/// Two overlapping balls, cut out of each other or united.
#[test]
fn bodies_that_pass_through_each_other() {
    let balls = [sphere(4.0, 1_000), sphere(4.0, 1_000).map(|[x, y, z]| [x + 2.0, y, z + 3.0])];
    for fill in [Fill::EvenOdd, Fill::Solid] {
        let mesh = joined(&balls);
        Twin { mesh, placement: Placement::default(), fill }.check(&LAYERS);
    }
}
