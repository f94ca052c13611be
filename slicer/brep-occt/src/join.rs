//! Joins OpenCASCADE's facets of single faces along the edges.

use std::collections::HashMap;

use rayon::prelude::*;

use crate::calls::{Chain, Mesh, Node};
use crate::refine::Patch;
use lamp_brep::{
    BrepError, BrepFacet, BrepFinding, FaceFault, KernelModel, MAX_FACETS, Tessellation,
};

/// A missing index.
const NONE: u32 = u32::MAX;
/// The bits of a face's status.
const OPEN_WIRE: u32 = 0x1;
const CROSSING_WIRE: u32 = 0x2;
const MISDIRECTED_WIRE: u32 = 0x10;
/// The distance of facets from their surface that is reported, in chords.
const FAR: f64 = 4.0;

/// Returns the facets, with shared points along edges.
pub(super) fn joined(
    kernel: &dyn KernelModel,
    mesh: &Mesh,
    chord_mm: f64,
) -> Result<Tessellation, BrepError> {
    let mut patches = patches(mesh);
    let refine = |patch: &mut Patch| {
        let edges_mm = patch.edges_off_mm(kernel);
        (patch.face, edges_mm, patch.refine(kernel, chord_mm))
    };
    let off: Vec<(u32, f64, f64)> = patches.par_iter_mut().map(refine).collect();
    let count: usize = patches.iter().map(|patch| patch.triangles.len()).sum();
    if count > MAX_FACETS {
        return Err(BrepError::TooMany { most: MAX_FACETS });
    }
    let mut joined = Tessellation { chord_mm, ..Tessellation::default() };
    let mut points = Points { same: joins(mesh), numbers: vec![NONE; mesh.nodes().len()] };
    for patch in &patches {
        let of_nodes = points.of_patch(patch, &mut joined.points);
        for nodes in &patch.triangles {
            let corners = nodes.map(|node| of_nodes[node as usize]);
            let uv = nodes.map(|node| patch.nodes[node as usize].uv);
            let [a, b, c] = corners;
            let is_tip = a == b || b == c || c == a;
            let list = if is_tip { &mut joined.tips } else { &mut joined.facets };
            list.push(BrepFacet { corners, uv, face: patch.face });
        }
    }
    let faults = mesh.faults().iter().map(|bad| (bad.face, fault(bad.status)));
    let of_face = |(face, edges_mm, facets_mm): (u32, f64, f64)| {
        let edges = (edges_mm > chord_mm).then_some(FaceFault::Off { off_mm: edges_mm });
        let facets =
            (facets_mm > FAR * chord_mm).then_some(FaceFault::Coarse { off_mm: facets_mm });
        [edges, facets].into_iter().flatten().map(move |fault| (face, fault))
    };
    let faults = faults.chain(off.into_iter().flat_map(of_face));
    let finding = |(face, fault)| BrepFinding { face, entity: kernel.face(face).entity, fault };
    joined.findings = faults.map(finding).collect();
    joined.findings.sort_by_key(|finding| finding.face);
    Ok(joined)
}

/// Returns the faces with their facets.
fn patches(mesh: &Mesh) -> Vec<Patch> {
    let mut triangles = mesh.triangles();
    let mut first = 0;
    let patch = |nodes: &[Node]| {
        let end = first + nodes.len() as u32;
        let count = triangles.partition_point(|corners| corners[0] < end);
        let (of_face, others) = triangles.split_at(count);
        let local = |corners: &[u32; 3]| corners.map(|node| node - first);
        let patch = Patch {
            face: nodes[0].face as u32,
            first,
            count: nodes.len(),
            nodes: nodes.to_vec(),
            triangles: of_face.iter().map(local).collect(),
        };
        (triangles, first) = (others, end);
        patch
    };
    mesh.nodes().chunk_by(|a, b| a.face == b.face).map(patch).collect()
}

/// The nodes that are the same point, and the indices of points.
struct Points {
    /// For each node of the mesh, the first that is the same point.
    same: Vec<u32>,
    /// The point's index, by that node.
    numbers: Vec<u32>,
}

impl Points {
    /// Returns the points of a patch's nodes; new ones are added to the list.
    fn of_patch(&mut self, patch: &Patch, list: &mut Vec<[f64; 3]>) -> Vec<u32> {
        let mut add = |point| {
            list.push(point);
            list.len() as u32 - 1
        };
        let number = |(k, node): (usize, &Node)| {
            if k >= patch.count {
                return add(node.point);
            }
            let first = self.same[patch.first as usize + k] as usize;
            if self.numbers[first] == NONE {
                self.numbers[first] = add(node.point);
            }
            self.numbers[first]
        };
        patch.nodes.iter().enumerate().map(number).collect()
    }
}

fn fault(status: u32) -> FaceFault {
    if status & CROSSING_WIRE != 0 {
        FaceFault::Crossing
    } else if status & (OPEN_WIRE | MISDIRECTED_WIRE) != 0 {
        FaceFault::Broken
    } else {
        FaceFault::Missing
    }
}

/// Returns, for each node, the first that is the same point.
fn joins(mesh: &Mesh) -> Vec<u32> {
    let mut same = Same((0..mesh.nodes().len() as u32).collect());
    let mut edges: HashMap<u32, &Chain> = HashMap::new();
    let mut vertices: HashMap<u32, u32> = HashMap::new();
    for chain in mesh.chains() {
        let nodes = mesh.of_chain(chain);
        let other = mesh.of_chain(edges.entry(chain.edge).or_insert(chain));
        // Faces normally have equal node counts along an edge; otherwise it stays open.
        if nodes.len() == other.len() {
            nodes.iter().zip(other).for_each(|(&a, &b)| same.join(a, b));
        }
        for (&vertex, node) in chain.ends.iter().zip([nodes.first(), nodes.last()]) {
            if let (Some(&node), true) = (node, vertex != NONE) {
                same.join(node, *vertices.entry(vertex).or_insert(node));
            }
        }
    }
    (0..same.0.len() as u32).map(|node| same.first(node)).collect()
}

/// For each node, an earlier one that is the same, or itself.
struct Same(Vec<u32>);

impl Same {
    fn first(&mut self, mut node: u32) -> u32 {
        while self.0[node as usize] != node {
            let before = self.0[self.0[node as usize] as usize];
            self.0[node as usize] = before;
            node = before;
        }
        node
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.first(a), self.first(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}
