//! Writes the report of `slice --report`: the faulty edges of a mesh, and the bands of rows they
//! leave.

use std::path::Path;

use lamp_pipeline::slice::Counts;
use lamp_slicing::{EdgeFacet, Facet, FaultyEdge, OpenEnd, Trace, TracedBand};
use lamp_stack::Pitch;
use lamp_stack::to_nm;
use serde::Serialize;

use crate::exit::Exit;
use crate::output::json_report::{JsonReport, schemas};

/// Facets behind stray rows, by `slice --report`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(crate) struct MeshReport<'a> {
    /// Names of the part's files, without folders.
    pub(crate) files: Vec<String>,
    /// The rule for the inside of surfaces, by `--fill`.
    pub(crate) fill: &'a str,
    #[serde(flatten)]
    pub(crate) counts: Counts,
}

/// A faulty edge.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct EdgeLine {
    /// Number of the edge, from 0.
    edge: usize,
    /// `open`, or `shared by more than two`.
    fault: &'static str,
    /// Its ends: x, y and z in the file's coordinates and units, before any placement.
    ends: [[f32; 3]; 2],
    /// The facets that have it.
    facets: Vec<FacetLine>,
}

/// A facet with a faulty edge.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct FacetLine {
    /// Place of its file in the list of files, from 0.
    file: usize,
    /// Number of the facet in its file, from 0.
    facet: usize,
    /// Its corners: x, y and z in the file's coordinates and units, before any placement.
    corners: Facet,
}

/// Stray rows of a layer that follow one another.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct BandLine {
    /// Index of the layer.
    layer: u32,
    /// Height of the layer's section, in millimeters.
    plane_mm: f64,
    /// First row of the band.
    first_row: u32,
    /// Last row of the band.
    last_row: u32,
    /// Least and greatest y of the band's rows, in millimeters.
    y_mm: [f64; 2],
    /// Points where contours break off.
    ends: Vec<EndLine>,
}

/// A point where a contour breaks off.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct EndLine {
    /// Its x and y, in millimeters.
    at_mm: [f64; 2],
    /// Numbers of the edges that end there.
    edges: Vec<usize>,
}

schemas! { "lamp-slice-report-1": MeshReport<'_>, "edges": [EdgeLine], "bands": [BandLine]; }

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
