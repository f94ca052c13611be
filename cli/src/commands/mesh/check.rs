//! `lamp mesh check`: finds what is wrong with a mesh.

use clap::Args;
use lamp_slicing::topology::{CornerTable, Crossings, MeshCheck, ShellOverlap, Shells};
use lamp_slicing::{Placement, SliceError};
use lamp_stack::Length;

use crate::args::options::{Common, parse_distance};
use crate::commands::mesh::MeshPart;
use crate::commands::mesh::answer::{MAX_LISTED, check_fields};
use crate::commands::mesh::text::check_text;
use crate::exit::Exit;
use crate::output::json_report::print_answer;
use crate::streams::print;

/// Find faults in a mesh, and the volumes that its shells enclose
///
/// It lists shells with their Euler numbers, areas, volumes, centers of mass and inertia, and the
/// lumps of material that they form with their voids. It also lists holes, non-manifold
/// edges, overlapping shells, and facets that are flipped, doubled, degenerate or not finite.
/// Facets are numbered from 0.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp mesh check blade.stl
  lamp mesh check blade.stl --strict --self-intersections
  lamp mesh check blade.stl --weld 5um --json | jq .boundary_loops")]
pub(super) struct MeshCheckArgs {
    #[command(flatten)]
    part: MeshPart,

    /// Merge vertices of boundary edges that are no farther apart than this
    #[arg(long, value_name = "LENGTH", default_value = "0um", value_parser = parse_distance)]
    weld: Length,

    /// Also look for facets that pass through each other
    #[arg(long)]
    self_intersections: bool,

    /// Exit with status 3 if anything was found
    #[arg(long)]
    strict: bool,

    /// Print JSON, as docs/json.md describes it
    #[arg(long)]
    json: bool,
}

/// Findings of a check.
pub(super) struct MeshFindings {
    pub(super) table: CornerTable,
    pub(super) check: MeshCheck,
    /// The corners that welding moved.
    pub(super) welded: usize,
    /// Facets that pass through each other, if these were looked for.
    pub(super) crossings: Option<Crossings>,
    /// Shells that enclose some volume more than once.
    pub(super) overlaps: Vec<ShellOverlap>,
}

impl MeshFindings {
    fn are_none(&self) -> bool {
        let crossings = self.crossings.as_ref().map_or(0, |crossings| crossings.count);
        self.check.is_clean() && crossings == 0
    }
}

pub(super) fn run(args: &MeshCheckArgs, common: &Common) -> Result<(), Exit> {
    let name = args.part.name();
    let (part, _) = args.part.open("mesh check", common)?;
    let table = CornerTable::of_part(&part, &Placement::default(), args.part.units);
    let table = table.map_err(|error: SliceError| Exit::from(error).at(name.clone()))?;
    let (table, welded) = table.welded(args.weld.mm());
    let shells = Shells::new(&table);
    let check = MeshCheck::of_shells(&table, &shells);
    let overlaps = ShellOverlap::all(&table, &shells, &check)
        .map_err(|error| Exit::from(error).at(name.clone()))?;
    let crossings = args.self_intersections.then(|| Crossings::new(&table, MAX_LISTED));
    let findings = MeshFindings { table, check, welded: welded.len(), crossings, overlaps };
    match args.json {
        true => print_answer("lamp-mesh-2", &check_fields(&name, &findings))?,
        false => print(&check_text(&name, &findings))?,
    }
    // After the answer: a script reads what was found, and the status.
    match args.strict && !findings.are_none() {
        true => Err(Exit::Findings(format!("{name}: its mesh has faults"))),
        false => Ok(()),
    }
}
