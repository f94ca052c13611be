//! Raises a plane from all minima at once, and finds where their surfaces meet.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use lamp_stack::sets::root;

use super::HeightField;

/// No component has reached the vertex.
const NONE: u32 = u32::MAX;
/// The component of all minima that are followed no further: older than all others.
const DEEP: u32 = 0;

/// Returns the depth of each minimum, at most `deepest_mm`. The minima come by ascending height.
/// Where two surfaces meet, the older minimum, which comes first, continues.
///
/// This is the merge tree of the heights on vertices and edges. Each vertex waits once in a queue
/// by height; a component deeper than `deepest_mm` requests no more vertices. A component that then
/// finds a vertex below it that no component requested has met a component with a lower minimum.
pub(super) fn depths(field: &HeightField<'_>, minima: &[Vec<u32>], deepest_mm: f64) -> Vec<f64> {
    let mut sweep = HeightSweep::new(field, minima, deepest_mm);
    while let Some(Reverse((_, vertex))) = sweep.waiting.pop() {
        sweep.pass(vertex);
    }
    let HeightSweep { births, tops, mut depths, .. } = sweep;
    for (depth, (birth, top)) in depths.iter_mut().zip(births.iter().zip(&tops)) {
        // It never met a lower minimum.
        if depth.is_nan() {
            *depth = top - birth;
        }
    }
    // The first is `DEEP`, which is not a minimum.
    depths.split_off(1)
}

struct HeightSweep<'a> {
    field: &'a HeightField<'a>,
    deepest_mm: f64,
    /// Vertices by height, encoded as bits in the same order.
    waiting: BinaryHeap<Reverse<(u64, u32)>>,
    is_known: Vec<bool>,
    /// The component that first reached each vertex.
    of_vertex: Vec<u32>,
    /// For each component, the component that it became part of, or itself. Older components have
    /// lower numbers.
    parents: Vec<u32>,
    /// For each component, the heights of its minimum and of the last vertex, and the depth once
    /// known.
    births: Vec<f64>,
    tops: Vec<f64>,
    depths: Vec<f64>,
}

impl<'a> HeightSweep<'a> {
    fn new(field: &'a HeightField<'a>, minima: &[Vec<u32>], deepest_mm: f64) -> Self {
        let births: Vec<f64> = std::iter::once(f64::NEG_INFINITY)
            .chain(minima.iter().map(|region| field.height(region[0])))
            .collect();
        let vertices = field.heights.len();
        let mut sweep = Self {
            field,
            deepest_mm,
            waiting: BinaryHeap::new(),
            is_known: vec![false; vertices],
            of_vertex: vec![NONE; vertices],
            parents: (0..births.len() as u32).collect(),
            tops: births.clone(),
            depths: vec![f64::NAN; births.len()],
            births,
        };
        for (component, region) in (1..).zip(minima) {
            for &vertex in region {
                sweep.of_vertex[vertex as usize] = component;
                sweep.ask_for(vertex);
            }
        }
        sweep
    }

    fn ask_for(&mut self, vertex: u32) {
        if !self.is_known[vertex as usize] {
            self.is_known[vertex as usize] = true;
            self.waiting.push(Reverse((rank(self.field.height(vertex)), vertex)));
        }
    }

    /// Joins the components below a vertex, and requests the vertices above it.
    fn pass(&mut self, vertex: u32) {
        let field = self.field;
        let height = field.height(vertex);
        let mut component = self.of_vertex[vertex as usize];
        for beside in field.beside(vertex) {
            let other = match self.of_vertex[beside as usize] {
                // A lower vertex without a component belongs to one that is followed no further.
                NONE if field.height(beside) < height => DEEP,
                NONE => continue,
                _ if field.height(beside) > height => continue,
                other => other,
            };
            component =
                if component == NONE { other } else { self.joined(component, other, height) };
        }
        component = root(&mut self.parents, component);
        if component != DEEP && height - self.births[component as usize] > self.deepest_mm {
            self.end(component, DEEP, self.deepest_mm);
            component = DEEP;
        }
        self.of_vertex[vertex as usize] = component;
        if component != DEEP {
            self.tops[component as usize] = height;
            field
                .beside(vertex)
                .filter(|&v| field.height(v) >= height)
                .for_each(|v| self.ask_for(v));
        }
    }

    /// Joins two components at a height, and returns the older one.
    fn joined(&mut self, a: u32, b: u32, height: f64) -> u32 {
        let (a, b) = (root(&mut self.parents, a), root(&mut self.parents, b));
        let [elder, younger] = [a.min(b), a.max(b)];
        if elder != younger {
            self.end(younger, elder, height - self.births[younger as usize]);
        }
        elder
    }

    fn end(&mut self, component: u32, parent: u32, depth_mm: f64) {
        self.parents[component as usize] = parent;
        self.depths[component as usize] = depth_mm.min(self.deepest_mm);
    }
}

/// Returns bits in the order of finite heights; both zeros are the same height.
fn rank(height: f64) -> u64 {
    let bits = (height + 0.0).to_bits();
    // Bits rise with positive numbers and fall with negative ones.
    if bits >> 63 == 0 { bits | 1 << 63 } else { !bits }
}
