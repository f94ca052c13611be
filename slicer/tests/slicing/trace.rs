//! Stray rows traced to the edges they come from.

use std::collections::BTreeSet;

use lamp_fixtures::{Defect, Facet, Mesh, Sample, build, inject, sphere};
use lamp_slicing::{
    Axis, EdgeFacet, Fill, Part, Placement, SliceError, SliceOptions, Slices, StrayBand, Trace,
};
use proptest::prelude::*;

use super::common::{cases, joined, model, options};

/// The bands of a part, and their trace.
fn traced(model: Part, options: &SliceOptions) -> (Vec<StrayBand>, Trace) {
    let mut slices = Slices::new(model, options).unwrap();
    let layers = slices.by_ref().map(|layer| layer.unwrap().info);
    let bands: Vec<_> = layers.flat_map(|info| StrayBand::of(&info).collect::<Vec<_>>()).collect();
    let trace = slices.trace(&bands).unwrap();
    (bands, trace)
}

fn coarse(fill: Fill) -> SliceOptions {
    SliceOptions { fill, ..options(100.0, 500.0) }
}

fn broken(part: Sample, defect: Defect, count: usize, seed: u64) -> Mesh {
    let mut mesh = build(part, part.min_facets().max(1_500)).unwrap();
    inject(&mut mesh, defect, count, seed);
    mesh
}

/// An edge's corners in one order, whichever way a facet goes.
fn edge([a, b]: [[f32; 3]; 2]) -> [[u32; 3]; 2] {
    let mut ends = [a, b].map(|corner| corner.map(|v| (v + 0.0).to_bits()));
    ends.sort_unstable();
    ends
}

fn edges_of(facet: &Facet) -> [[[u32; 3]; 2]; 3] {
    [[0, 1], [1, 2], [2, 0]].map(|ends| edge(ends.map(|k| facet[k])))
}

/// Checks a trace against the mesh, by looking at every facet.
fn check(mesh: &Mesh, bands: &[StrayBand], trace: &Trace, options: &SliceOptions) {
    let found: Vec<_> = trace.bands.iter().map(|traced| traced.band.clone()).collect();
    assert_eq!(found, bands);
    let grid = *Slices::new(model(mesh), options).unwrap().grid();
    let mut used = BTreeSet::new();
    for traced in &trace.bands {
        // Where the balance changes: the first row at or below the end.
        let rows: Vec<f64> =
            traced.ends.iter().map(|end| grid.to_pixels(end.at_mm[0], end.at_mm[1])[1]).collect();
        let (first, end) = (f64::from(traced.band.rows.start), f64::from(traced.band.rows.end));
        let changes = |row: f64| rows.iter().any(|y| (row - 1.0 - 1e-6..row + 1e-6).contains(y));
        assert!(changes(first) && changes(end), "{traced:?}");
        assert!(rows.iter().all(|&y| y > first - 1.0 - 1e-6 && y < end + 1e-6), "{traced:?}");
        assert!(rows.is_sorted());
        used.extend(traced.ends.iter().flat_map(|end| end.edges.iter().copied()));
    }
    assert!(used.into_iter().eq(0..trace.edges.len()));
    for faulty in &trace.edges {
        let having: Vec<usize> = (0..mesh.facets.len())
            .filter(|&k| edges_of(&mesh.facets[k]).contains(&edge(faulty.ends)))
            .collect();
        let named: Vec<usize> = faulty.facets.iter().map(|facet| facet.facet).collect();
        assert_eq!(named, having);
        for EdgeFacet { file, facet, corners, forwards } in &faulty.facets {
            assert_eq!((*file, corners), (0, &mesh.facets[*facet]));
            let goes = (0..3).any(|k| [corners[k], corners[(k + 1) % 3]] == faulty.ends);
            assert_eq!(*forwards, goes);
        }
        let forwards = faulty.facets.iter().filter(|facet| facet.forwards).count();
        match options.fill {
            Fill::EvenOdd => assert_eq!(having.len() % 2, 1),
            Fill::Solid => assert_ne!(2 * forwards, having.len()),
        }
    }
}

proptest! {
    #![proptest_config(cases(60))]

    #[test]
    fn every_band_lies_between_open_ends_on_faulty_edges(
        part in prop::sample::select(vec![Sample::Tower, Sample::Sphere, Sample::Torus, Sample::Cube]),
        defect in prop::sample::select(vec![
            Defect::Drop, Defect::Flip, Defect::Duplicate, Defect::Nudge { by_mm: 0.3 },
        ]),
        count in 1usize..30,
        seed in any::<u64>(),
        degrees in prop::sample::select(vec![0.0, 90.0, 12.3]),
        non_zero in any::<bool>(),
    ) {
        let mesh = broken(part, defect, count, seed);
        let fill = if non_zero { Fill::Solid } else { Fill::EvenOdd };
        let placement = Placement::default().rotated(Axis::X, degrees);
        let options = SliceOptions { placement, ..coarse(fill) };
        let (bands, trace) = traced(model(&mesh), &options);
        check(&mesh, &bands, &trace, &options);
    }
}

#[test]
fn a_whole_part_has_nothing_to_trace() {
    let mesh = build(Sample::Tower, 2_000).unwrap();
    let (bands, trace) = traced(model(&mesh), &coarse(Fill::Solid));
    assert_eq!((bands, trace), (Vec::new(), Trace::default()));
}

#[test]
fn threads_memory_and_order_do_not_change_a_trace() {
    let mut broken = build(Sample::Tower, 30_000).unwrap();
    inject(&mut broken, Defect::Nudge { by_mm: 0.2 }, 3_000, 4);
    let (bands, expected) = traced(model(&broken), &coarse(Fill::EvenOdd));
    assert!(expected.bands.len() > 500 && expected.edges.len() > 2_000);
    let mut reversed = bands.clone();
    reversed.reverse();
    for threads in 1..=3 {
        for memory in [1, 30_000, 1 << 30] {
            let options = SliceOptions { memory, ..coarse(Fill::EvenOdd) };
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let slices = Slices::new(model(&broken), &options).unwrap();
            let trace = pool.install(|| slices.trace(&reversed)).unwrap();
            assert!(trace == expected, "{threads} threads, {memory} bytes");
        }
    }
}

#[test]
fn facets_are_numbered_in_their_files() {
    let ball = sphere(5.0, 6_000);
    let away = ball.map(|[x, y, z]| [x + 20.0, y, z]);
    let mut second = away.clone();
    inject(&mut second, Defect::Drop, 1, 12);
    let models = || [model(&ball), model(&second)].into();
    let options = coarse(Fill::EvenOdd);
    let (bands, trace) = traced(Part::joined(models()), &options);
    let (_, alone) = traced(model(&joined(&[ball.clone(), second])), &options);
    assert!(!bands.is_empty() && trace.edges.len() == alone.edges.len());
    for (of_file, of_all) in trace.edges.iter().zip(&alone.edges) {
        for (of_file, of_all) in of_file.facets.iter().zip(&of_all.facets) {
            assert_eq!((of_file.file, of_file.facet + ball.facets.len()), (1, of_all.facet));
        }
    }
}

#[test]
fn a_band_of_no_layer_is_refused() {
    let slices = Slices::new(model(&sphere(5.0, 500)), &coarse(Fill::EvenOdd)).unwrap();
    let band = |layer| StrayBand { layer, rows: 0..5 };
    let refused = slices.trace(&[band(20), band(3)]);
    assert!(matches!(refused, Err(SliceError::NoSuchLayers { start: 20, .. })), "{refused:?}");
    // One that is not stray has no open ends.
    let trace = slices.trace(&[band(3)]).unwrap();
    assert!(trace.bands[0].ends.is_empty() && trace.edges.is_empty());
}
