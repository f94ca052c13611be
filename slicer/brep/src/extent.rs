//! How far surfaces reach.

use crate::kernel::Jet;
use crate::placed::Placed;
use crate::vector::Vec3;

/// Facets that are looked at for each end; around a level ring all are as high.
const MOST_FACETS: usize = 64;
const MOST_STEPS: usize = 30;
/// Steps for differences, in parts of a facet.
pub(crate) const DIFFERENCE: f64 = 1e-5;

/// Along an axis, or with `up` -1 against it.
#[derive(Clone, Copy)]
pub(crate) struct Way {
    axis: usize,
    up: f64,
}

impl Way {
    /// Upwards.
    pub(crate) const UP: Self = Self { axis: 2, up: 1.0 };
}

impl Way {
    fn along(self, vector: Vec3) -> f64 {
        self.up * vector[self.axis]
    }
}

impl Placed {
    /// The least and the greatest corner of the surfaces' box, in millimetres: that of
    /// the facets where surfaces end at a corner or an edge, and further by as much as
    /// facets cut off where they are round. Nothing if there are no facets.
    pub fn box_mm(&self) -> Option<[[f64; 3]; 2]> {
        if self.mesh().facets.is_empty() {
            return None;
        }
        let end = |up: f64| [0, 1, 2].map(|axis| up * self.end_mm(Way { axis, up }));
        Some([end(-1.0), end(1.0)])
    }

    /// How far the surfaces reach one way.
    fn end_mm(&self, way: Way) -> f64 {
        let top = |facet: u32| {
            self.corners(facet).map(|corner| way.along(corner)).into_iter().fold(f64::MIN, f64::max)
        };
        let tops: Vec<f64> = (0..self.mesh().facets.len() as u32).map(top).collect();
        let of_facets = tops.iter().copied().fold(f64::MIN, f64::max);
        let mut near: Vec<u32> = (0u32..)
            .zip(&tops)
            .filter(|(_, top)| **top >= of_facets - self.tolerance_mm())
            .map(|(facet, _)| facet)
            .filter(|&facet| !self.is_flat(facet))
            .collect();
        near.sort_by(|&a, &b| tops[b as usize].total_cmp(&tops[a as usize]));
        near.truncate(MOST_FACETS);
        let ends = near.into_iter().filter_map(|facet| self.end_on(facet, way));
        let most = of_facets + 2.0 * self.tolerance_mm();
        ends.filter(|end| *end <= most).fold(of_facets, f64::max)
    }

    /// How far a facet's surface reaches where it is level.
    fn end_on(&self, facet: u32, way: Way) -> Option<f64> {
        self.level(facet, way).map(|level| way.along(level.jet.point))
    }

    /// Where a facet's surface is level, by Newton's method with differences.
    pub(crate) fn level(&self, facet: u32, way: Way) -> Option<Level> {
        let uv = self.facet(facet).uv;
        let size = self.uv_size(facet);
        let by = size.map(|size| DIFFERENCE * size);
        let mut at = [0, 1].map(|k| uv.iter().map(|uv| uv[k]).sum::<f64>() / 3.0);
        for _ in 0..MOST_STEPS {
            let jets = self.jets(facet, at, by);
            // How far it goes over a facet's width along either parameter.
            let rise = |jet: &Jet| [way.along(jet.du) * size[0], way.along(jet.dv) * size[1]];
            let [g, gu, gv] = [rise(&jets[0]), rise(&jets[1]), rise(&jets[2])];
            let [a, b, d] = [gu[0] - g[0], (gu[1] - g[1] + gv[0] - g[0]) / 2.0, gv[1] - g[1]]
                .map(|bend| bend / DIFFERENCE);
            if g.iter().all(|g| g.abs() < 1e-11) {
                let bend = [a / size[0] / size[0], b / size[0] / size[1], d / size[1] / size[1]];
                let level = Level { uv: at, jet: jets[0], bend };
                return self.is_below(facet, jets[0].point).then_some(level);
            }
            // Along a level ring there is no bend: a little keeps it in place.
            let least = 1e-9 * (a.abs() + d.abs());
            let (a, d) = (a - least, d - least);
            let det = a * d - b * b;
            let step = [(b * g[1] - d * g[0]) / det, (b * g[0] - a * g[1]) / det];
            if !step.iter().all(|step| step.abs() < 4.0) {
                return None;
            }
            at = [0, 1].map(|k| at[k] + step[k] * size[k]);
        }
        None
    }
}

/// A point where a surface is level.
pub(crate) struct Level {
    pub(crate) uv: [f64; 2],
    pub(crate) jet: Jet,
    /// The second derivatives of the height: by u twice, by u and v, by v twice.
    pub(crate) bend: [f64; 3],
}
