//! Surface nets, a few planes of cells at a time.

use fast_surface_nets::ndshape::RuntimeShape;
use fast_surface_nets::{SignedDistance, SurfaceNetsBuffer, surface_nets};

use super::pinches::fill_pinches;
use super::{StackSurface, SurfaceError, SurfaceUnit};

/// The number of planes worked on at a time.
const SLAB: usize = 18;
/// The number of these with which the next slab begins: nets are made between two planes, and one
/// plane of the nets' vertices is in both slabs.
const OVERLAP: usize = 2;
/// Black cells before the first; the crate leaves out what is at the far border, so there are two
/// behind the last.
const BEFORE: u32 = 1;
const BEHIND: u32 = 2;

/// The level of a cell as a distance: white is inside. No level is on the surface itself.
#[derive(Clone, Copy)]
pub(super) struct Level(pub(super) u8);

impl Level {
    pub(super) fn is_white(self) -> bool {
        self.0 > 127
    }
}

impl From<Level> for f32 {
    fn from(level: Level) -> Self {
        127.5 - f32::from(level.0)
    }
}

impl SignedDistance for Level {
    fn is_negative(self) -> bool {
        self.is_white()
    }
}

/// Makes a surface from planes of cells, lowest first.
pub(super) struct Nets {
    /// Cells along x and y, without the black ones around.
    size: [u32; 2],
    max_triangles: usize,
    /// The planes of the slab, with black around them.
    levels: Vec<Level>,
    /// The number of the slab's first plane.
    first: usize,
    buffer: SurfaceNetsBuffer,
    /// In cells.
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Nets {
    pub(super) fn new(size: [u32; 2], max_triangles: usize) -> Self {
        let mut nets = Self {
            size,
            max_triangles,
            levels: Vec::new(),
            first: 0,
            buffer: SurfaceNetsBuffer::default(),
            vertices: Vec::new(),
            triangles: Vec::new(),
        };
        (0..BEFORE).for_each(|_| nets.lay(&[]));
        nets
    }

    /// Adds a plane of levels.
    pub(super) fn push(&mut self, plane: &[u8]) -> Result<(), SurfaceError> {
        self.lay(plane);
        if self.levels.len() < SLAB * self.plane_cells() {
            return Ok(());
        }
        self.net()?;
        self.first += SLAB - OVERLAP;
        self.levels.drain(..(SLAB - OVERLAP) * self.plane_cells());
        Ok(())
    }

    /// Returns the surface, given the place of each position in cells.
    pub(super) fn finish(
        mut self,
        place: impl Fn([f64; 3]) -> [f32; 3],
        unit: SurfaceUnit,
    ) -> Result<StackSurface, SurfaceError> {
        (0..BEHIND).try_for_each(|_| self.push(&[]))?;
        self.net()?;
        let vertices: Vec<_> = self.vertices.into_iter().map(place).collect();
        let normals = normals(&vertices, &self.triangles);
        Ok(StackSurface { unit, vertices, normals, triangles: self.triangles })
    }

    /// Returns the columns and rows of a plane with black around.
    fn padded(&self) -> [u32; 2] {
        self.size.map(|cells| BEFORE + cells + BEHIND)
    }

    fn plane_cells(&self) -> usize {
        self.padded().into_iter().map(|cells| cells as usize).product()
    }

    /// Lays a plane on the slab, black if it has no levels.
    fn lay(&mut self, plane: &[u8]) {
        let start = self.levels.len();
        self.levels.resize(start + self.plane_cells(), Level(0));
        let width = self.padded()[0] as usize;
        let lines = self.levels[start..].chunks_exact_mut(width).skip(BEFORE as usize);
        for (line, levels) in lines.zip(plane.chunks_exact(self.size[0] as usize)) {
            let cells = line[BEFORE as usize..].iter_mut();
            cells.zip(levels).for_each(|(cell, &level)| *cell = Level(level));
        }
        if let Some(below) = start.checked_sub(self.plane_cells()) {
            let (below, plane) = self.levels[below..].split_at_mut(start - below);
            fill_pinches(below, plane, width);
        }
    }

    /// Adds the surface in the slab. Its first plane of vertices is the last one of the previous
    /// slab.
    fn net(&mut self) -> Result<(), SurfaceError> {
        let [columns, rows] = self.padded();
        let planes = (self.levels.len() / self.plane_cells()) as u32;
        let shape = RuntimeShape::<u32, 3>::new([columns, rows, planes]);
        let last = [columns - 1, rows - 1, planes - 1];
        surface_nets(&self.levels, &shape, [0; 3], last, &mut self.buffer);
        let found = &self.buffer;
        // Checked for each slab, before memory runs out.
        if self.triangles.len() + found.indices.len() / 3 > self.max_triangles {
            return Err(SurfaceError::TooManyTriangles { most: self.max_triangles });
        }
        // Vertices come plane by plane, so those known from the slab below are the first ones.
        let known = match self.first {
            0 => 0,
            _ => found.surface_points.iter().take_while(|[_, _, plane]| *plane == 0).count(),
        };
        let offset = (self.vertices.len() - known) as u32;
        // A position counts from the middle of the first black cell.
        let from_corner = |at: f32| f64::from(at) - f64::from(BEFORE) + 0.5;
        let first = self.first as f64;
        let places = found.positions[known..].iter().map(|place| place.map(from_corner));
        self.vertices.extend(places.map(|[x, y, z]| [x, y, z + first]));
        // Rows go down and y goes up, which turns triangles over.
        let triangles = found.indices.chunks_exact(3);
        self.triangles.extend(triangles.map(|abc| [abc[0], abc[2], abc[1]].map(|k| k + offset)));
        Ok(())
    }
}

/// Returns the mean direction of the triangles at each vertex, by their areas. It is smoother than
/// the slope of levels where cells are as small as pixels.
fn normals(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Vec<[f32; 3]> {
    let mut sums = vec![[0.0; 3]; vertices.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|vertex| vertices[vertex as usize]);
        let [e, f] = [b, c].map(|to| [0, 1, 2].map(|axis| to[axis] - a[axis]));
        let across = |i: usize, j: usize| e[i] * f[j] - e[j] * f[i];
        let normal = [across(1, 2), across(2, 0), across(0, 1)];
        for &vertex in triangle {
            let sum = &mut sums[vertex as usize];
            (0..3).for_each(|axis| sum[axis] += normal[axis]);
        }
    }
    sums.into_iter().map(unit).collect()
}

/// Returns a direction of length one; one without a length points up.
fn unit(direction: [f32; 3]) -> [f32; 3] {
    let length = direction.iter().map(|d| d * d).sum::<f32>().sqrt();
    if length > 0.0 { direction.map(|d| d / length) } else { [0.0, 0.0, 1.0] }
}
