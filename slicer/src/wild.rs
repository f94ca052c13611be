//! Finds vertices far outside the rest of a part.
//!
//! One damaged number in a file can make a part a thousand times as large, and make images of
//! nothing for hours. A vertex counts as damaged if all of these conditions hold:
//!
//! - Seen from the middle of the part, it is 32 times as far away as the end of the rest, or 8
//!   times if the part is larger than any machine.
//! - At most one facet in eight reaches out there. Slender parts with few facets have many facets
//!   along their length; a cone's tip is a corner of half of its facets.
//! - At most one facet is out there with all of its corners. Another body has four or more, and
//!   even the end of a square bar has two. So several parts in one file, however far apart, and
//!   large plates with fine details stay.
//!
//! The damage is then a spike at most one facet wide, on a body of a thirtieth of its length:
//! nothing that is built from layers.

use std::io;

use rayon::prelude::*;

use crate::error::SliceError;
use crate::facet::{Facet, PlacedFacet};
use crate::placed_part::PlacedPart;
use crate::survey::FacetSurvey;

/// The factor for a damaged vertex outside the rest, and the factor for a part larger than any
/// machine.
const FAR: f64 = 32.0;
const FAR_IF_LARGE: f64 = 8.0;
/// The largest build area known is 23 x 23 inches.
const LARGE_MM: f64 = 1000.0;
/// The share of facets that damage may reach.
const REACHED: usize = 8;
/// The number of facets examined to find the middle.
const SAMPLES: usize = 1024;
/// Distances are counted by the upper bits of 32-bit numbers: four steps from one power
/// of two to the next.
const STEP_BITS: u32 = 21;
const STEPS: usize = 1 << (32 - STEP_BITS);

/// Checks that no vertex is far outside the rest.
///
/// # Errors
/// Returns an error that names the first such vertex, or an error if the part cannot be read.
pub(crate) fn check(part: &PlacedPart, survey: &FacetSurvey) -> Result<(), SliceError> {
    let samples = samples(part)?;
    let middle =
        std::array::from_fn(|axis| median(samples.iter().map(|point| point[axis]).collect()));
    let middle_half_mm = median(samples.iter().map(|point| distance(*point, middle)).collect());
    let [low, high] = [survey.min, survey.max].map(in_mm);
    let reach = distance(low, middle).max(distance(high, middle));
    let size = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
    let far = if size > LARGE_MM { FAR_IF_LARGE } else { FAR };
    // Nearly all parts end here: they are not that much larger than their middle half.
    if reach < far * middle_half_mm {
        return Ok(());
    }
    let counts = FacetCounts::of(part, middle)?;
    let facets = part.model.facet_count();
    let is_rest =
        |&step: &usize| counts.reaching[step] <= facets / REACHED && counts.outside[step] <= 1;
    let Some(rest_mm) = (0..STEPS).find(is_rest).map(distance_of) else { return Ok(()) };
    let far_out = step_of(far * rest_mm);
    match counts.reaching[far_out] {
        0 => Ok(()),
        reaching => Err(first_beyond(part, middle, far_out, reaching)?),
    }
}

/// A point, in millimeters.
type Point = [f64; 3];

fn in_mm([x, y, z_um]: Point) -> Point {
    [x, y, z_um / 1000.0]
}

/// Returns the greatest distance along an axis.
#[inline]
fn distance(a: Point, b: Point) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f64::max)
}

/// Returns the least and the greatest distance of a facet's corners.
#[inline]
fn distances(facet: &PlacedFacet, middle: Point) -> [f64; 2] {
    let [a, b, c] = facet.map(|corner| distance(in_mm(corner), middle));
    [a.min(b).min(c), a.max(b).max(c)]
}

/// Returns the corners of facets spread over the files.
fn samples(part: &PlacedPart) -> io::Result<Vec<Point>> {
    let step = part.model.facet_count().div_ceil(SAMPLES).max(1);
    let mut samples = Vec::new();
    let mut next = 0;
    for (number, piece) in part.model.pieces().iter().enumerate() {
        let count = piece.facets.count();
        while next < count {
            let facet: Facet = part.model.facet(number, next)?;
            samples.extend(part.transform_of(number).placed(&facet).map(in_mm));
            next += step;
        }
        // Counted on into the next piece, so that small pieces are not sampled too often.
        next -= count;
    }
    Ok(samples)
}

fn median(mut values: Vec<f64>) -> f64 {
    let half = values.len() / 2;
    *values.select_nth_unstable_by(half, f64::total_cmp).1
}

/// Returns the step that a distance falls into.
#[inline]
fn step_of(distance_mm: f64) -> usize {
    // The bits of numbers above zero rise with the numbers, so this is a logarithm without its
    // cost.
    ((distance_mm as f32).to_bits() >> STEP_BITS) as usize
}

/// Returns the least distance of a step.
fn distance_of(step: usize) -> f64 {
    f64::from(f32::from_bits((step as u32) << STEP_BITS))
}

/// The numbers of facets beyond each step: facets that reach there, and facets with all corners
/// there.
struct FacetCounts {
    reaching: Vec<usize>,
    outside: Vec<usize>,
}

impl FacetCounts {
    fn of(part: &PlacedPart, middle: Point) -> io::Result<Self> {
        let none = || [vec![0; STEPS], vec![0; STEPS]];
        let blocks = (0..part.model.block_count()).into_par_iter();
        let counted = blocks.try_fold(none, |[mut outside, mut reaching], block| {
            part.for_each_in_block(block, |facet| {
                let [least, greatest] = distances(facet, middle).map(step_of);
                outside[least] += 1;
                reaching[greatest] += 1;
            })?;
            io::Result::Ok([outside, reaching])
        });
        let sum = |a: Vec<usize>, b: Vec<usize>| a.iter().zip(&b).map(|(a, b)| a + b).collect();
        let [outside, reaching] =
            counted.try_reduce(none, |[a, b], [c, d]| Ok([sum(a, c), sum(b, d)]))?;
        let beyond = |mut counts: Vec<usize>| {
            for step in (1..STEPS).rev() {
                counts[step - 1] += counts[step];
            }
            counts
        };
        Ok(Self { reaching: beyond(reaching), outside: beyond(outside) })
    }
}

/// Returns the error that names the first facet with a corner beyond a step.
fn first_beyond(
    part: &PlacedPart,
    middle: Point,
    step: usize,
    reaching: usize,
) -> io::Result<SliceError> {
    let beyond = |corner: &Point| step_of(distance(in_mm(*corner), middle)) >= step;
    let mut found = None;
    for block in 0..part.model.block_count() {
        let (piece, facets) = part.model.place_of(block);
        // In the file's order, on one thread: the error names the first such facet.
        let mut numbers = facets.start..;
        part.for_each_in_block(block, |placed| {
            let facet = numbers.next().unwrap_or_default();
            let corner = placed.iter().position(beyond);
            found = found.or(corner.map(|corner| (piece, facet, corner)));
        })?;
        if found.is_some() {
            break;
        }
    }
    // There is one, unless the file changed.
    let (piece, facet, corner) = found.unwrap_or_default();
    let corner = part.model.facet(piece, facet)?[corner];
    let of_file = &part.model.pieces()[piece];
    let corner = std::array::from_fn(|axis| corner[axis] + of_file.offset[axis] as f32);
    let (file, facet) = (of_file.file, of_file.first_facet + facet);
    Ok(SliceError::WildVertex { file, facet, corner, reaching, facets: part.model.facet_count() })
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::{Mesh, Sample, build, sphere, tower};

    use super::*;
    use crate::facet::Units;
    use crate::part::Part;
    use crate::placement::{Axis, Placement};

    fn found(facets: &[Facet]) -> Option<(usize, [f32; 3])> {
        let tilted = Placement::default().rotated(Axis::X, 40.0).translated([9.0, 0.0, 1e4]);
        let [here, there] = [Placement::default(), tilted].map(|placement| {
            let part = Part::from_facets("part", facets.to_vec());
            let part = PlacedPart::new(part, &placement, Units::Millimetres);
            match check(&part, &FacetSurvey::of(&part).unwrap()) {
                Ok(()) => None,
                Err(SliceError::WildVertex { facet, corner, .. }) => Some((facet, corner)),
                Err(error) => panic!("{error}"),
            }
        });
        assert_eq!(here, there, "a placement decides");
        here
    }

    /// Moves a vertex, in all facets that have it.
    fn moved(mesh: &Mesh, vertex: [f32; 3], to: [f32; 3]) -> Vec<Facet> {
        let place = |corner: [f32; 3]| if corner == vertex { to } else { corner };
        mesh.facets.iter().map(|facet| facet.map(place)).collect()
    }

    #[test]
    fn a_damaged_vertex_is_found_in_one_facet_and_in_all_that_share_it() {
        for mesh in [sphere(10.0, 200), sphere(10.0, 20_000), tower(3_000)] {
            let corner = mesh.facets[100][0];
            for far in [[0.0, 0.0, 1e5], [-3e6, 10.0, 0.0], [2e4, 2e4, 2e4]] {
                let mut alone = mesh.facets.clone();
                alone[100][0] = far;
                assert_eq!(found(&alone), Some((100, far)));
                let (facet, at) = found(&moved(&mesh, corner, far)).unwrap();
                assert!(facet <= 100 && at == far);
            }
            let mut whole = mesh.facets.clone();
            whole[100] = [[1e5, 0.0, 0.0], [1e5, 1.0, 0.0], [1e5, 0.0, 1.0]];
            assert_eq!(found(&whole), Some((100, [1e5, 0.0, 0.0])));
        }
    }

    fn scaled(mesh: &Mesh, by: [f32; 3], shift: [f32; 3]) -> Vec<Facet> {
        let place = |corner: [f32; 3]| std::array::from_fn(|k| corner[k] * by[k] + shift[k]);
        mesh.facets.iter().map(|facet| facet.map(place)).collect()
    }

    /// A box between the origin and a corner, of twelve facets.
    fn block(size: [f32; 3]) -> Vec<Facet> {
        const SIDES: [[usize; 4]; 6] =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let corner =
            |k: usize| [0, 1, 2].map(|axis| if k >> axis & 1 == 1 { size[axis] } else { 0.0 });
        SIDES
            .iter()
            .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]].map(|f| f.map(corner)))
            .collect()
    }

    #[test]
    fn real_shapes_are_not_damaged() {
        let octahedron = sphere(1.0, 8);
        let ball = sphere(1.0, 20_000);
        let none = [0.0; 3];
        // Needles, plates and rods of few facets.
        for by in [[1.0, 1.0, 1e4], [1e4, 1e4, 1.0], [1e-3, 1.0, 1.0], [5e3, 1.0, 1.0]] {
            assert_eq!(found(&block(by)), None, "{by:?}");
            assert_eq!(found(&scaled(&sphere(1.0, 100), by, none)), None, "{by:?}");
        }
        // Parts far apart, and a large one with a fine detail, or at the end of a long bar.
        for other in [
            scaled(&octahedron, [1.0; 3], [1e5, 0.0, 0.0]),
            block([300.0, 300.0, 5.0]),
            block([0.5, 0.5, 900.0]),
        ] {
            assert_eq!(found(&[ball.facets.clone(), other].concat()), None);
        }
        assert_eq!(found(&octahedron.facets), None);
        // Cones are half tip.
        let tip: Vec<Facet> = (0..500)
            .map(|k| {
                let at = |k: i32| {
                    let angle = std::f32::consts::TAU * k as f32 / 500.0;
                    [angle.cos(), angle.sin(), 0.0]
                };
                [at(k), at(k + 1), [0.0, 0.0, 900.0]]
            })
            .collect();
        assert_eq!(found(&tip), None);
        for sample in Sample::ALL {
            let mesh = build(sample, sample.min_facets().max(60_000)).unwrap();
            assert_eq!(found(&mesh.facets), None, "{sample:?}");
        }
    }
}
