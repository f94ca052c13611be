//! Findings about a mesh, as text.

use std::fmt::Write;

use lamp_slicing::topology::{
    CornerTable, Lump, Mass, MeshCheck, ShellOverlap, ShellReport, facet_of,
};

use crate::commands::mesh::check::MeshFindings;
use crate::output::numbers::grouped;

/// The most shells that are described one by one.
const MAX_SHELLS: usize = 10;
/// The most findings of a kind that are named.
const MAX_NAMED: usize = 5;

/// Returns the answer to `lamp mesh check`.
pub(super) fn check_text(name: &str, findings: &MeshFindings) -> String {
    let MeshFindings { table, check, welded, crossings, overlaps } = findings;
    let [facets, vertices, edges] = [table.facet_count(), table.points().len(), table.edge_count()]
        .map(|it| grouped(it as u64));
    let mut text = format!(
        "part:       {name}\nmesh:       {facets} facets, {vertices} vertices, {edges} edges\n\
         shells:     {}\nlumps:      {}\n",
        check.shells.len(),
        lumps(&check.lumps),
    );
    if *welded > 0 {
        line(&mut text, "welded", &count(*welded, "corner", "corners"));
    }
    let mut found = faults(table, check);
    if let Some(crossings) = crossings.as_ref().filter(|it| it.count > 0 || it.is_partial) {
        let pairs = crossings.pairs.iter().map(|[a, b]| format!("{a} and {b}"));
        let partial = if crossings.is_partial { "; too many overlap to examine all" } else { "" };
        found.push(format!(
            "{} of facets pass through each other{}{partial}",
            count(crossings.count, "pair", "pairs"),
            named(pairs, crossings.count),
        ));
    }
    if found.is_empty() {
        line(&mut text, "faults", "none");
    }
    found.iter().for_each(|found| line(&mut text, "found", found));
    for ShellOverlap { shells: [a, b], box_mm, volume_mm3 } in overlaps.iter().take(MAX_NAMED) {
        let place = box_text(*box_mm);
        let shells = format!("shells {} and {}", a + 1, b + 1);
        line(&mut text, "overlap", &format!("{shells} share {volume_mm3:.3} mm3, {place}"));
    }
    if overlaps.len() > MAX_NAMED {
        let more = overlaps.len() - MAX_NAMED;
        line(&mut text, "overlap", &format!("{more} more pairs of shells are in --json"));
    }
    for (number, shell) in (1..).zip(&check.shells).take(MAX_SHELLS) {
        text += &shell_text(number, shell);
    }
    if check.shells.len() > MAX_SHELLS {
        let more = check.shells.len() - MAX_SHELLS;
        writeln!(text, "{more} more shells are in --json").expect("a string takes all");
    }
    text
}

fn line(text: &mut String, title: &str, words: &str) {
    writeln!(text, "{:<12}{words}", format!("{title}:")).expect("a string takes all");
}

/// Formats a number of things.
fn count(number: usize, one: &str, many: &str) -> String {
    format!("{number} {}", if number == 1 { one } else { many })
}

/// Lists the first of some things after a colon.
fn named(things: impl Iterator<Item = String>, all: usize) -> String {
    let some: Vec<String> = things.take(MAX_NAMED).collect();
    let more = if all > some.len() { ", ..." } else { "" };
    if some.is_empty() { String::new() } else { format!(": {}{more}", some.join(", ")) }
}

fn lumps(lumps: &[Lump]) -> String {
    let voids: usize = lumps.iter().map(|lump| lump.voids.len()).sum();
    let volume: f64 = lumps.iter().filter_map(|lump| lump.mass).map(|mass| mass.volume_mm3).sum();
    match lumps.len() {
        0 => "none, because no shell is closed".to_owned(),
        number => format!("{number} with {}, {volume:.6} mm3", count(voids, "void", "voids")),
    }
}

/// Returns a sentence for each kind of fault.
pub(super) fn faults(table: &CornerTable, check: &MeshCheck) -> Vec<String> {
    let facets = |facets: &[u32]| named(facets.iter().map(u32::to_string), facets.len());
    let of_facets = |found: &[u32], what: &str| {
        let text = || format!("{} {what}{}", count(found.len(), "facet", "facets"), facets(found));
        (!found.is_empty()).then(text)
    };
    let doubled: Vec<u32> = check.doubled.iter().map(|doubled| doubled.facet).collect();
    let kinds = [
        of_facets(&check.not_finite, "with a coordinate that is not finite"),
        loops(check),
        crowded(table, check),
        of_facets(&check.turned, "turned over against the neighbors"),
        shells(check.inside_out(), "facing into the material"),
        shells(one_sided(check), "with one side only"),
        of_facets(&doubled, "doubled"),
        of_facets(&check.flat, "without area (degenerate)"),
    ];
    kinds.into_iter().flatten().collect()
}

fn one_sided(check: &MeshCheck) -> impl Iterator<Item = u32> {
    let shells = (0..).zip(&check.shells);
    shells.filter(|(_, shell)| shell.is_one_sided).map(|(number, _)| number)
}

fn shells(found: impl Iterator<Item = u32>, what: &str) -> Option<String> {
    let found: Vec<String> = found.map(|shell| (shell + 1).to_string()).collect();
    let text = || {
        format!(
            "{} {what}{}",
            count(found.len(), "shell", "shells"),
            named(found.iter().cloned(), found.len())
        )
    };
    (!found.is_empty()).then(text)
}

fn loops(check: &MeshCheck) -> Option<String> {
    // A line has room for one loop, and the longest matters most.
    let longest = check.loops.iter().max_by(|a, b| a.length_mm.total_cmp(&b.length_mm))?;
    let facet = facet_of(longest.corners[0]);
    let which = if check.loops.len() == 1 { "it" } else { "the longest" };
    Some(format!(
        "{}; {which} has {}, {:.3} mm long, at facet {facet}, {}",
        count(check.loops.len(), "loop of boundary edges", "loops of boundary edges"),
        count(longest.corners.len(), "edge", "edges"),
        longest.length_mm,
        box_text(longest.box_mm),
    ))
}

fn crowded(table: &CornerTable, check: &MeshCheck) -> Option<String> {
    let first = table.crowded().next()?;
    let ends = table
        .edge_ends(first[0])
        .map(|vertex| table.points()[vertex as usize].map(|c| format!("{c:.3}")).join(", "));
    let which = if check.crowded == 1 { "it" } else { "the first" };
    Some(format!(
        "{}; {which} has {} facets, from ({}) to ({})",
        count(check.crowded, "non-manifold edge", "non-manifold edges"),
        first.len(),
        ends[0],
        ends[1],
    ))
}

fn box_text([low, high]: [[f64; 3]; 2]) -> String {
    let side = |k: usize| format!("{:.3} to {:.3}", low[k], high[k]);
    format!("x {}, y {}, z {} mm", side(0), side(1), side(2))
}

fn shell_text(number: usize, shell: &ShellReport) -> String {
    let facets = count(shell.facets as usize, "facet", "facets");
    let around =
        shell.within.map_or(String::new(), |outer| format!(", within shell {}", outer + 1));
    let kind = if shell.is_void { "a void" } else { "outer" };
    format!(
        "shell {number}\n  facets:   {facets}, the first is {}; Euler number {}{}\n\
         \x20 box:      {}\n  area:     {:.6} mm2\n{}",
        shell.first_facet,
        shell.euler(),
        match shell.mass {
            Some(_) => format!("; {kind}{around}"),
            None => String::new(),
        },
        box_text(shell.box_mm),
        shell.area_mm2,
        shell.mass.as_deref().map_or_else(|| not_closed(shell), mass_text),
    )
}

fn not_closed(shell: &ShellReport) -> String {
    let why = match shell.open_sides {
        0 if shell.is_one_sided => "none, because it has only one side".to_owned(),
        0 => "none, because its numbers are too large".to_owned(),
        1 => "not closed: 1 side of a facet has no neighbor".to_owned(),
        sides => format!("not closed: {sides} sides of facets have no neighbor"),
    };
    format!("  volume:   {why}\n")
}

fn mass_text(mass: &Mass) -> String {
    let [x, y, z] = mass.centre_mm;
    let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = mass.inertia_mm5;
    format!(
        "  volume:   {:.6} mm3\n  center:   {x:.6}, {y:.6}, {z:.6} mm\n\
         \x20 inertia:  xx {xx:.6e}, yy {yy:.6e}, zz {zz:.6e}, xy {xy:.6e}, yz {yz:.6e}, xz {xz:.6e} mm5\n",
        mass.volume_mm3,
    )
}
