//! Writes the report of `slice --report`: the faulty edges of a mesh, and the bands of rows they
//! leave.

use std::path::Path;

use lamp_pipeline::slice::Counts;
use lamp_slicing::{EdgeFacet, Facet, FaultyEdge, OpenEnd, Trace, TracedBand};
use lamp_stack::Pitch;
use lamp_stack::to_nm;
use serde::Serialize;

use crate::exit::Exit;
use crate::output::json_report::JsonReport;

/// The head of the report: the part's files and the counts.
#[derive(Serialize)]
pub(crate) struct MeshReport<'a> {
    pub(crate) files: Vec<String>,
    pub(crate) fill: &'a str,
    #[serde(flatten)]
    pub(crate) counts: Counts,
}

#[derive(Serialize)]
struct EdgeLine {
    edge: usize,
    fault: &'static str,
    ends: [[f32; 3]; 2],
    facets: Vec<FacetLine>,
}

#[derive(Serialize)]
struct FacetLine {
    file: usize,
    facet: usize,
    corners: Facet,
}

#[derive(Serialize)]
struct BandLine {
    layer: u32,
    plane_mm: f64,
    first_row: u32,
    last_row: u32,
    y_mm: [f64; 2],
    ends: Vec<EndLine>,
}

#[derive(Serialize)]
struct EndLine {
    at_mm: [f64; 2],
    edges: Vec<usize>,
}

/// Position of the images' rows in the part.
#[derive(Clone, Copy)]
pub(crate) struct RowPositions {
    /// The top of the first row.
    pub(crate) top_mm: f64,
    pub(crate) pitch: Pitch,
}

impl MeshReport<'_> {
    /// Writes the report.
    pub(crate) fn write(&self, trace: &Trace, rows: RowPositions, path: &Path) -> Result<(), Exit> {
        let bands = trace.bands.iter().map(|band| band_line(band, rows));
        JsonReport::of_schema("lamp-slice-report-1", self)
            .list("edges", trace.edges.iter().enumerate().map(edge_line))
            .list("bands", bands)
            .write(path)
    }
}

fn edge_line((edge, FaultyEdge { ends, facets }): (usize, &FaultyEdge)) -> EdgeLine {
    let facet = |&EdgeFacet { file, facet, corners, .. }: &_| FacetLine { file, facet, corners };
    EdgeLine {
        edge,
        fault: match &facets[..] {
            // A faulty edge has an odd number of facets, so all others have three and more.
            [_] => "open",
            _ => "shared by more than two",
        },
        ends: *ends,
        facets: facets.iter().map(facet).collect(),
    }
}

fn band_line(TracedBand { band, plane, ends }: &TracedBand, rows: RowPositions) -> BandLine {
    let y_mm = |row: u32| to_nm(rows.top_mm - f64::from(row) * rows.pitch.y.pitch().mm());
    let end = |OpenEnd { at_mm, edges }: &OpenEnd| EndLine {
        at_mm: at_mm.map(to_nm),
        edges: edges.clone(),
    };
    BandLine {
        layer: band.layer,
        plane_mm: to_nm(plane.mm()),
        first_row: band.rows.start,
        last_row: band.rows.end - 1,
        y_mm: [y_mm(band.rows.end), y_mm(band.rows.start)],
        ends: ends.iter().map(end).collect(),
    }
}
