//! Reads curves that are given by the parameters of a surface (ISO 10303-42, `pcurve`).

use super::entities::Item;
use super::error::StepError;
use super::read_placement::{GeometryReader, MAX_NESTED};
use super::units::RepresentationUnits;
use crate::geometry::{Curve, Link, Surface, SurfaceCurve};
use crate::vector::{Axes, Vec3, distance};

/// The number of periods before and after its own in which a line on a closed surface may be.
const PERIODS: i32 = 3;

impl GeometryReader<'_> {
    /// Reads a `PCURVE`. A straight line is bounded by the first and the last point of the
    /// curve.
    pub(super) fn pcurve(
        &self,
        item: Item,
        ends: Option<[Vec3; 2]>,
        depth: usize,
    ) -> Result<Curve, StepError> {
        let basis = item.reference(1)?;
        let surface = self.surface_within(basis, depth + 1)?;
        let scale = self.parameters(basis, depth + 1)?;
        let plane = self.entities.get(item.reference(2)?, "DEFINITIONAL_REPRESENTATION")?;
        let bad = StepError::Numbers { id: item.id, what: "curve" };
        let id = plane.references(1)?.into_iter().next().ok_or(bad)?;
        let units = RepresentationUnits { mm: 1.0, ..self.units.clone() };
        let (entities, place) = (self.entities, Axes::WORLD);
        let flat = GeometryReader { entities, units: &units, place, is_flat: true };
        let link = match (self.entities.find(id, "LINE"), ends) {
            (Some(_), Some(ends)) => {
                let curve = flat.curve(id)?;
                let range = bounded(&curve, &surface, scale, ends);
                Link { curve, range }
            }
            _ => flat.bounded(id, depth + 1)?,
        };
        Ok(Curve::OnSurface(Box::new(SurfaceCurve::new(surface, link, scale))))
    }

    /// Returns the factors of u and v that convert the file's parameters to the surface's.
    fn parameters(&self, id: u64, depth: usize) -> Result<[f64; 2], StepError> {
        let RepresentationUnits { mm, radians, .. } = *self.units;
        // Of surfaces, only B-splines are complex instances.
        let Ok(item) = self.entities.simple(id) else { return Ok([1.0; 2]) };
        Ok(match item.name() {
            "PLANE" => [mm; 2],
            "CYLINDRICAL_SURFACE" | "CONICAL_SURFACE" => [radians, mm],
            "SPHERICAL_SURFACE" | "TOROIDAL_SURFACE" | "DEGENERATE_TOROIDAL_SURFACE" => {
                [radians; 2]
            }
            "SURFACE_OF_LINEAR_EXTRUSION" => {
                let vector = self.entities.get(item.reference(2)?, "VECTOR")?;
                [self.profile(item.reference(1)?)?, self.length(vector, 2)?]
            }
            "SURFACE_OF_REVOLUTION" => [radians, self.profile(item.reference(1)?)?],
            "OFFSET_SURFACE" | "CURVE_BOUNDED_SURFACE" if depth < MAX_NESTED => {
                self.parameters(item.reference(1)?, depth + 1)?
            }
            "B_SPLINE_SURFACE_WITH_KNOTS"
            | "UNIFORM_SURFACE"
            | "QUASI_UNIFORM_SURFACE"
            | "BEZIER_SURFACE" => [1.0; 2],
            _ => return Err(self.entities.unsupported(id)),
        })
    }

    /// Returns the least and the greatest parameters of a `RECTANGULAR_TRIMMED_SURFACE`.
    pub(super) fn trims(&self, item: Item, surface: &Surface) -> Result<[[f64; 2]; 2], StepError> {
        let scale = self.parameters(item.reference(1)?, 0)?;
        let bad = || StepError::Numbers { id: item.id, what: "trimmed surface" };
        let range = |axis: usize| {
            let ends = [item.number(2 + 2 * axis)?, item.number(3 + 2 * axis)?];
            let [mut from, mut to] = ends.map(|end| end * scale[axis]);
            if !item.truth(6 + axis)? {
                (from, to) = (to, from);
            }
            match surface.periods()[axis] {
                // It may be trimmed across the seam.
                Some(period) if to <= from => to += period,
                None if to < from => (from, to) = (to, from),
                _ => {}
            }
            let is_sound = from < to && to - from < 1e9;
            is_sound.then_some([from, to]).ok_or_else(bad)
        };
        Ok([range(0)?, range(1)?])
    }

    /// Returns the parameter of a swept curve that corresponds to a parameter of the file.
    fn profile(&self, id: u64) -> Result<f64, StepError> {
        // The parameters of these curves begin where the curves begin.
        if ["TRIMMED_CURVE", "COMPOSITE_CURVE"]
            .iter()
            .any(|it| self.entities.find(id, it).is_some())
        {
            return Err(self.entities.unsupported(id));
        }
        self.parameter(id, &self.curve(id)?)
    }
}

/// Returns the parameters of a line on a surface, from the point `first` to `last`.
fn bounded(line: &Curve, surface: &Surface, scale: [f64; 2], [first, last]: [Vec3; 2]) -> [f64; 2] {
    let periods = surface.periods();
    let along = |p: Vec3| -> Vec<f64> {
        let uv = surface.project(p, None);
        let turns = |axis: usize| {
            let period = periods[axis];
            let most = if period.is_some() { PERIODS } else { 0 };
            (-most..=most)
                .map(move |turn| (uv[axis] + f64::from(turn) * period.unwrap_or(0.0)) / scale[axis])
        };
        let all = turns(0).flat_map(|x| turns(1).map(move |y| [x, y, 0.0]));
        let feet: Vec<(f64, f64)> = all
            .map(|at| {
                let t = line.project(at);
                (distance(line.at(t)[0], at), t)
            })
            .collect();
        // The line may pass several copies of the point, one in each period.
        let nearest = feet.iter().map(|foot| foot.0).fold(f64::INFINITY, f64::min);
        feet.into_iter().filter(|foot| foot.0 <= nearest + 1e-6).map(|foot| foot.1).collect()
    };
    let (starts, ends) = (along(first), along(last));
    let least = |all: &mut dyn Iterator<Item = f64>| {
        all.min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0)
    };
    let start = least(&mut starts.into_iter());
    // Around a closed surface, the curve ends where it next reaches its last point.
    let ahead = ends.iter().map(|end| end - start).filter(|way| *way > 1e-9).min_by(f64::total_cmp);
    let end = ahead.map_or_else(|| least(&mut ends.iter().copied()), |way| start + way);
    [start, end]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI, TAU};

    #[test]
    fn a_line_around_a_cylinder_goes_on_to_its_last_point() {
        let surface = Surface::Cylinder { axes: Axes::WORLD, radius: 3.0 };
        let (a, b, up) = ([0.0, 3.0, 0.0], [-3.0, 0.0, 0.0], [0.0, 3.0, 5.0]);
        let line = |x: f64, direction: Vec3| Curve::Line { point: [x, 0.0, 0.0], direction };
        let along = [1.0, 0.0, 0.0];
        for (line, ends, range) in [
            (line(0.0, along), [a, b], [FRAC_PI_2, PI]),
            (line(0.0, along), [b, a], [PI, FRAC_PI_2 + TAU]),
            (line(0.0, along), [a, a], [FRAC_PI_2, FRAC_PI_2 + TAU]),
            (line(TAU, along), [a, b], [FRAC_PI_2, PI]),
            (line(PI, [-1.0, 0.0, 0.0]), [b, a], [0.0, FRAC_PI_2]),
            (line(FRAC_PI_2 - TAU, [0.0, 1.0, 0.0]), [a, up], [0.0, 5.0]),
            // Against its direction only if there is no other way.
            (line(FRAC_PI_2, [0.0, 1.0, 0.0]), [up, a], [5.0, 0.0]),
        ] {
            let found = bounded(&line, &surface, [1.0; 2], ends);
            let [moved, also] = [0, 1].map(|k| (found[k] - range[k]) / TAU);
            let is_same = (moved - moved.round()).abs() < 1e-9 && (moved - also).abs() < 1e-9;
            assert!(is_same, "{line:?} {found:?} {range:?}");
        }
    }
}
