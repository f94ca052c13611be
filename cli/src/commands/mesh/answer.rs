//! Findings about a mesh, as JSON.

use lamp_slicing::topology::{
    Crossings, Deed, Doubled, Lump, Mass, MeshCheck, Repaired, RimLoop, ShellOverlap, ShellReport,
    facet_of,
};
use serde::Serialize;

use crate::commands::mesh::check::MeshFindings;
use crate::output::json_report::schemas;

/// The most items of a list; a mesh may have millions of faults.
pub(super) const MAX_LISTED: usize = 10_000;

/// Findings about a mesh, by `lamp mesh check PART --json`. Facets, shells and bodies are numbered from 0.
/// Lists end after 10000 items.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct MeshAnswer<'a> {
    /// Name of the part or of its file.
    part: &'a str,
    /// Number of facets.
    facets: usize,
    /// Number of vertices.
    vertices: usize,
    /// Number of edges.
    edges: usize,
    /// Number of bodies.
    bodies: usize,
    /// Corners that `--weld` moved.
    welded_corners: usize,
    /// Whether nothing was found, self-intersections aside.
    clean: bool,
    /// Numbers of all findings.
    counts: MeshCounts,
    /// The shells.
    shells: Vec<Shell>,
    /// The lumps: solids, each of an outer shell and the voids in it.
    lumps: Vec<LumpShells>,
    /// Boundary edges in a row.
    boundary_loops: Vec<BoundaryLoop>,
    /// Edges of three or more facets.
    non_manifold_edges: Vec<NonManifoldEdge>,
    /// Facets turned over against their neighbors.
    turned: &'a [u32],
    /// Shells that face into the material.
    inside_out: Vec<u32>,
    /// Facets with the vertices of another.
    doubled: Vec<DoubledFacet>,
    /// Facets without area.
    flat: &'a [u32],
    /// Facets with a vertex that is not finite.
    not_finite: &'a [u32],
    /// Pairs of shells that share volume.
    overlaps: Vec<SharedVolume>,
    /// Facets that cut through each other, with the option.
    self_intersections: Option<SelfIntersections<'a>>,
}

/// Numbers of all findings of each kind.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct MeshCounts {
    /// Shells.
    shells: usize,
    /// Shells with boundary edges.
    open_shells: usize,
    /// Shells with one side only.
    one_sided_shells: usize,
    /// Lumps.
    lumps: usize,
    /// Boundary loops.
    boundary_loops: usize,
    /// Edges of three or more facets.
    non_manifold_edges: usize,
    /// Facets turned over against their neighbors.
    turned: usize,
    /// Shells that face into the material.
    inside_out: usize,
    /// Facets with the vertices of another.
    doubled: usize,
    /// Facets without area.
    flat: usize,
    /// Facets with a vertex that is not finite.
    not_finite: usize,
}

/// A shell.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Shell {
    /// Its body, in the file's order.
    body: u32,
    /// Its first facet.
    first_facet: u32,
    /// Number of its facets.
    facets: u32,
    /// Number of its vertices.
    vertices: u32,
    /// Number of its edges.
    edges: u32,
    /// Vertices less edges plus facets.
    euler: i64,
    /// Sides of facets without a neighbor.
    open_sides: u32,
    /// Whether it has one side only.
    one_sided: bool,
    /// Its area, in square millimeters.
    area_mm2: f64,
    /// Its box: least x, y and z, and greatest, in millimeters.
    box_mm: [[f64; 3]; 2],
    /// Its volume, or null if it is not closed.
    mass: Option<Enclosed>,
    /// The closed shell directly around it.
    within: Option<u32>,
    /// Whether it is a void.
    void: bool,
}

/// The volume of a closed shell or of a lump.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct Enclosed {
    /// Volume, in cubic millimeters.
    volume_mm3: f64,
    /// Center of mass: x, y and z, in millimeters.
    center_mm: [f64; 3],
    /// Inertia about the center for a density of 1, in millimeters to the fifth.
    inertia_mm5: [[f64; 3]; 3],
}

/// An outer shell and the voids in it.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct LumpShells {
    /// Number of the outer shell.
    outer: u32,
    /// Numbers of the shells of voids.
    voids: Vec<u32>,
    /// Its volume, without the voids.
    mass: Option<Enclosed>,
}

/// Boundary edges in a row.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct BoundaryLoop {
    /// The facets of its edges, at most 10000.
    facets: Vec<u32>,
    /// Number of its edges.
    boundary_edges: usize,
    /// Whether it closes; others end at non-manifold edges.
    closed: bool,
    /// Its length, in millimeters.
    length_mm: f64,
    /// Diagonal of its box, in millimeters.
    width_mm: f64,
    /// Its box: least x, y and z, and greatest, in millimeters.
    box_mm: [[f64; 3]; 2],
}

/// An edge of three or more facets.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct NonManifoldEdge {
    /// The facets.
    facets: Vec<u32>,
    /// Its ends: x, y and z, in millimeters.
    ends_mm: [[f64; 3]; 2],
}

/// A facet with the vertices of another.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct DoubledFacet {
    /// The facet.
    facet: u32,
    /// The first facet of these vertices.
    of: u32,
    /// Whether both face the same way.
    same_way: bool,
}

/// Two shells that share volume.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct SharedVolume {
    /// The shells.
    shells: [u32; 2],
    /// Box of the shared volume: least x, y and z, and greatest, in millimeters.
    box_mm: [[f64; 3]; 2],
    /// The shared volume, in cubic millimeters.
    volume_mm3: f64,
}

/// Facets that cut through each other.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct SelfIntersections<'a> {
    /// Number of pairs.
    count: usize,
    /// Whether there were too many boxes to try all.
    partial: bool,
    /// Pairs of facets.
    pairs: &'a [[u32; 2]],
}

schemas! { "lamp-mesh-2": MeshAnswer<'_>; }

/// Returns the fields of an answer to `lamp mesh check`.
pub(super) fn check_fields<'a>(name: &'a str, findings: &'a MeshFindings) -> MeshAnswer<'a> {
    let MeshFindings { table, check, welded, crossings, overlaps } = findings;
    let crowded = table.crowded().map(|corners| NonManifoldEdge {
        facets: corners.iter().map(|&corner| facet_of(corner)).collect(),
        ends_mm: table
            .edge_ends(corners[0])
            .map(|vertex| table.points()[vertex as usize].map(f64::from)),
    });
    MeshAnswer {
        part: name,
        facets: table.facet_count(),
        vertices: table.points().len(),
        edges: table.edge_count(),
        bodies: table.bodies().count(),
        welded_corners: *welded,
        clean: check.is_clean(),
        counts: counts(check),
        shells: check.shells.iter().take(MAX_LISTED).map(shell_fields).collect(),
        lumps: check.lumps.iter().take(MAX_LISTED).map(lump_fields).collect(),
        boundary_loops: check.loops.iter().take(MAX_LISTED).map(loop_fields).collect(),
        non_manifold_edges: crowded.take(MAX_LISTED).collect(),
        turned: first(&check.turned),
        inside_out: check.inside_out().take(MAX_LISTED).collect(),
        doubled: check.doubled.iter().take(MAX_LISTED).map(doubled_fields).collect(),
        flat: first(&check.flat),
        not_finite: first(&check.not_finite),
        overlaps: overlaps.iter().take(MAX_LISTED).map(overlap_fields).collect(),
        self_intersections: crossings.as_ref().map(crossing_fields),
    }
}

fn overlap_fields(overlap: &ShellOverlap) -> SharedVolume {
    let ShellOverlap { shells, box_mm, volume_mm3 } = overlap;
    SharedVolume { shells: *shells, box_mm: *box_mm, volume_mm3: *volume_mm3 }
}

fn first(facets: &[u32]) -> &[u32] {
    &facets[..facets.len().min(MAX_LISTED)]
}

/// The number of all findings of each kind.
pub(super) fn counts(check: &MeshCheck) -> MeshCounts {
    MeshCounts {
        shells: check.shells.len(),
        open_shells: check.shells.iter().filter(|shell| shell.open_sides > 0).count(),
        one_sided_shells: check.shells.iter().filter(|shell| shell.is_one_sided).count(),
        lumps: check.lumps.len(),
        boundary_loops: check.loops.len(),
        non_manifold_edges: check.crowded,
        turned: check.turned.len(),
        inside_out: check.inside_out().count(),
        doubled: check.doubled.len(),
        flat: check.flat.len(),
        not_finite: check.not_finite.len(),
    }
}

fn shell_fields(shell: &ShellReport) -> Shell {
    Shell {
        body: shell.body,
        first_facet: shell.first_facet,
        facets: shell.facets,
        vertices: shell.vertices,
        edges: shell.edges,
        euler: shell.euler(),
        open_sides: shell.open_sides,
        one_sided: shell.is_one_sided,
        area_mm2: shell.area_mm2,
        box_mm: shell.box_mm,
        mass: shell.mass.as_deref().map(mass_fields),
        within: shell.within,
        void: shell.is_void,
    }
}

fn mass_fields(mass: &Mass) -> Enclosed {
    Enclosed {
        volume_mm3: mass.volume_mm3,
        center_mm: mass.centre_mm,
        inertia_mm5: mass.inertia_mm5,
    }
}

fn lump_fields(lump: &Lump) -> LumpShells {
    LumpShells {
        outer: lump.outer,
        voids: lump.voids.clone(),
        mass: lump.mass.as_ref().map(mass_fields),
    }
}

fn loop_fields(rims: &RimLoop) -> BoundaryLoop {
    // A hole may have as many edges as the mesh: their number is in `boundary_edges`.
    let facets = rims.corners.iter().take(MAX_LISTED).map(|&corner| facet_of(corner));
    BoundaryLoop {
        facets: facets.collect(),
        boundary_edges: rims.corners.len(),
        closed: rims.is_closed,
        length_mm: rims.length_mm,
        width_mm: rims.width_mm(),
        box_mm: rims.box_mm,
    }
}

fn doubled_fields(doubled: &Doubled) -> DoubledFacet {
    DoubledFacet { facet: doubled.facet, of: doubled.of, same_way: doubled.is_same_way }
}

fn crossing_fields(crossings: &Crossings) -> SelfIntersections<'_> {
    SelfIntersections {
        count: crossings.count,
        partial: crossings.is_partial,
        pairs: &crossings.pairs,
    }
}

/// Returns the number of facets of each repair action, in the order of [`Deed::ALL`], without
/// actions of no facet.
pub(super) fn deeds(repaired: &Repaired) -> impl Iterator<Item = (&'static str, usize)> {
    let count = |deed| repaired.touched.iter().filter(|touched| touched.deed == deed).count();
    let counts = Deed::ALL.map(|deed| (deed.name(), count(deed)));
    counts.into_iter().filter(|(_, count)| *count > 0)
}
