//! Reads the slices of the slice extension: polygons that represent an object from one height to
//! the next.

use std::collections::BTreeMap;

use quick_xml::events::BytesStart;

use super::error::ModelFault;
use super::xml::{attribute, number, numbers};
use crate::fill::Fill;
use crate::prisms::Drawing;

/// Slices, from below.
#[derive(Debug, Default)]
pub(super) struct SliceStack {
    bottom: f64,
    slices: Vec<Slice>,
    /// The stacks in other files of the package that follow.
    pub(super) references: Vec<(String, u32)>,
}

#[derive(Debug, Default)]
struct Slice {
    top: f64,
    vertices: Vec<[f64; 2]>,
    /// The vertex numbers of each polygon; the first is repeated at the end.
    polygons: Vec<Vec<u32>>,
}

/// Reads the slices of a model.
#[derive(Debug, Default)]
pub(super) struct SliceReader {
    pub(super) stacks: BTreeMap<u32, SliceStack>,
    stack: Option<(u32, SliceStack)>,
}

impl SliceReader {
    /// Reads the start of an element of the extension.
    pub(super) fn start(&mut self, tag: &BytesStart<'_>) -> Result<(), ModelFault> {
        let local = tag.local_name();
        if local.as_ref() == "slicestack" {
            let bottom = match attribute(tag, "zbottom")? {
                Some(_) => number(tag, "zbottom")?,
                None => 0.0,
            };
            self.stack = Some((number(tag, "id")?, SliceStack { bottom, ..SliceStack::default() }));
        }
        let Some((_, stack)) = &mut self.stack else { return Ok(()) };
        match (local.as_ref(), stack.slices.last_mut()) {
            ("sliceref", _) => {
                let path = attribute(tag, "slicepath")?.unwrap_or_default();
                stack.references.push((path, number(tag, "slicestackid")?));
            }
            ("slice", _) => {
                stack.slices.push(Slice { top: number(tag, "ztop")?, ..Slice::default() });
            }
            ("vertex", Some(slice)) => slice.vertices.push(numbers(tag, ["x", "y"])?),
            ("polygon", Some(slice)) => {
                let start = slice.vertex(number(tag, "startv")?)?;
                slice.polygons.push(vec![start]);
            }
            ("segment", Some(slice)) => {
                let vertex = slice.vertex(number(tag, "v2")?)?;
                if let Some(polygon) = slice.polygons.last_mut() {
                    polygon.push(vertex);
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Reads the end of an element of the extension.
    pub(super) fn end(&mut self, name: &str) {
        if name == "slicestack"
            && let Some((id, stack)) = self.stack.take()
        {
            self.stacks.insert(id, stack);
        }
    }
}

impl Slice {
    fn vertex(&self, vertex: u32) -> Result<u32, ModelFault> {
        let count = self.vertices.len();
        if (vertex as usize) < count {
            Ok(vertex)
        } else {
            Err(ModelFault::NoVertex { of: "segment", vertex, count })
        }
    }

    /// Adds the area between each side of the polygons and the y axis.
    fn area(&self) -> f64 {
        let sides = self.polygons.iter().flat_map(|polygon| polygon.windows(2));
        let twice = sides.map(|side| {
            let [a, b] = [side[0], side[1]].map(|number| self.vertices[number as usize]);
            // Gauss's area formula: clockwise polygons, which are holes, count negative.
            a[0] * b[1] - b[0] * a[1]
        });
        0.5 * twice.sum::<f64>()
    }
}

/// Slices converted to a solid: a prism for each polygon.
#[derive(Debug)]
pub(super) struct SliceSolid {
    pub(super) drawing: Drawing,
    pub(super) volume: f64,
    corners: u64,
    top: Option<f64>,
}

impl SliceSolid {
    pub(super) fn new() -> Self {
        Self { drawing: Drawing::new(Fill::Solid), volume: 0.0, corners: 0, top: None }
    }

    /// Adds the slices of a stack. Returns the reason if this is not possible.
    pub(super) fn add(&mut self, stack: &SliceStack, most_facets: u64) -> Result<(), &'static str> {
        let mut bottom = stack.bottom;
        for slice in &stack.slices {
            // A further stack begins where the last one ends, or higher.
            let rises = slice.top > bottom && self.top.is_none_or(|top| bottom >= top);
            if !rises || !slice.top.is_finite() {
                return Err("slices whose heights do not rise");
            }
            if slice.polygons.iter().any(|polygon| polygon.first() != polygon.last()) {
                return Err("slices of lines that are not closed");
            }
            self.volume += slice.area() * (slice.top - bottom);
            let slab = self.drawing.add_slab([bottom, slice.top]);
            for polygon in &slice.polygons {
                // A polygon has four facets at each corner.
                self.corners += polygon.len() as u64;
                let ring = polygon.iter().map(|&vertex| slice.vertices[vertex as usize]);
                if 4 * self.corners > most_facets {
                    return Err("more slices than a package of its size can hold");
                }
                let added = self.drawing.add(slab, ring);
                added.map_err(|_| "slices with coordinates that are not finite, or too many")?;
            }
            bottom = slice.top;
            self.top = Some(slice.top);
        }
        Ok(())
    }
}
