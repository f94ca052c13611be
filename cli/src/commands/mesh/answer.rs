//! Findings about a mesh, as JSON.

use lamp_slicing::topology::{
    Crossings, Deed, Doubled, Lump, Mass, MeshCheck, Repaired, RimLoop, ShellOverlap, ShellReport,
    facet_of,
};
use serde_json::{Value, json};

use crate::commands::mesh::check::MeshFindings;

/// The most items of a list; a mesh may have millions of faults.
pub(super) const MAX_LISTED: usize = 10_000;

/// Returns the fields of an answer to `lamp mesh check`.
pub(super) fn check_fields(name: &str, findings: &MeshFindings) -> Value {
    let MeshFindings { table, check, welded, crossings, overlaps } = findings;
    let crowded = table.crowded().map(|corners| {
        let ends = table.edge_ends(corners[0]).map(|vertex| table.points()[vertex as usize]);
        let facets: Vec<u32> = corners.iter().map(|&corner| facet_of(corner)).collect();
        json!({"facets": facets, "ends_mm": ends})
    });
    json!({
        "part": name,
        "facets": table.facet_count(),
        "vertices": table.points().len(),
        "edges": table.edge_count(),
        "bodies": table.bodies().count(),
        "welded_corners": welded,
        "clean": check.is_clean(),
        "counts": counts(check),
        "shells": check.shells.iter().take(MAX_LISTED).map(shell_fields).collect::<Vec<_>>(),
        "lumps": check.lumps.iter().take(MAX_LISTED).map(lump_fields).collect::<Vec<_>>(),
        "boundary_loops": check.loops.iter().take(MAX_LISTED).map(loop_fields).collect::<Vec<_>>(),
        "non_manifold_edges": crowded.take(MAX_LISTED).collect::<Vec<_>>(),
        "turned": first(&check.turned),
        "inside_out": check.inside_out().take(MAX_LISTED).collect::<Vec<_>>(),
        "doubled": check.doubled.iter().take(MAX_LISTED).map(doubled_fields).collect::<Vec<_>>(),
        "flat": first(&check.flat),
        "not_finite": first(&check.not_finite),
        "overlaps": overlaps.iter().take(MAX_LISTED).map(overlap_fields).collect::<Vec<_>>(),
        "self_intersections": crossings.as_ref().map(crossing_fields),
    })
}

fn overlap_fields(overlap: &ShellOverlap) -> Value {
    let ShellOverlap { shells, box_mm, volume_mm3 } = overlap;
    json!({"shells": shells, "box_mm": box_mm, "volume_mm3": volume_mm3})
}

fn first(facets: &[u32]) -> &[u32] {
    &facets[..facets.len().min(MAX_LISTED)]
}

/// The number of all findings of each kind.
pub(super) fn counts(check: &MeshCheck) -> Value {
    json!({
        "shells": check.shells.len(),
        "open_shells": check.shells.iter().filter(|shell| shell.open_sides > 0).count(),
        "one_sided_shells": check.shells.iter().filter(|shell| shell.is_one_sided).count(),
        "lumps": check.lumps.len(),
        "boundary_loops": check.loops.len(),
        "non_manifold_edges": check.crowded,
        "turned": check.turned.len(),
        "inside_out": check.inside_out().count(),
        "doubled": check.doubled.len(),
        "flat": check.flat.len(),
        "not_finite": check.not_finite.len(),
    })
}

fn shell_fields(shell: &ShellReport) -> Value {
    json!({
        "body": shell.body,
        "first_facet": shell.first_facet,
        "facets": shell.facets,
        "vertices": shell.vertices,
        "edges": shell.edges,
        "euler": shell.euler(),
        "open_sides": shell.open_sides,
        "one_sided": shell.is_one_sided,
        "area_mm2": shell.area_mm2,
        "box_mm": shell.box_mm,
        "mass": shell.mass.as_deref().map(mass_fields),
        "within": shell.within,
        "void": shell.is_void,
    })
}

fn mass_fields(mass: &Mass) -> Value {
    json!({
        "volume_mm3": mass.volume_mm3,
        "center_mm": mass.centre_mm,
        "inertia_mm5": mass.inertia_mm5,
    })
}

fn lump_fields(lump: &Lump) -> Value {
    json!({
        "outer": lump.outer,
        "voids": lump.voids,
        "mass": lump.mass.as_ref().map(mass_fields),
    })
}

fn loop_fields(rims: &RimLoop) -> Value {
    // A hole may have as many edges as the mesh: their number is in `boundary_edges`.
    let facets = rims.corners.iter().take(MAX_LISTED).map(|&corner| facet_of(corner));
    json!({
        "facets": facets.collect::<Vec<_>>(),
        "boundary_edges": rims.corners.len(),
        "closed": rims.is_closed,
        "length_mm": rims.length_mm,
        "width_mm": rims.width_mm(),
        "box_mm": rims.box_mm,
    })
}

fn doubled_fields(doubled: &Doubled) -> Value {
    json!({"facet": doubled.facet, "of": doubled.of, "same_way": doubled.is_same_way})
}

fn crossing_fields(crossings: &Crossings) -> Value {
    json!({
        "count": crossings.count,
        "partial": crossings.is_partial,
        "pairs": crossings.pairs,
    })
}

/// Returns the number of facets of each repair action, in the order of [`Deed::ALL`], without
/// actions of no facet.
pub(super) fn deeds(repaired: &Repaired) -> impl Iterator<Item = (&'static str, usize)> {
    let count = |deed| repaired.touched.iter().filter(|touched| touched.deed == deed).count();
    let counts = Deed::ALL.map(|deed| (deed.name(), count(deed)));
    counts.into_iter().filter(|(_, count)| *count > 0)
}
