//! Reads curves from STEP entities.

use super::entities::{Item, Value};
use super::error::StepError;
use super::read_placement::{GeometryReader, MAX_NESTED};
use crate::geometry::spline::{Knots, SplineCurve, WeightedPoint, weighted};
use crate::geometry::{Curve, CurveChain, Link, edge_range};
use crate::vector::{Vec3, along, cross, distance, dot, unit};

impl GeometryReader<'_> {
    /// Reads the curve of an edge.
    pub(crate) fn curve(&self, id: u64) -> Result<Curve, StepError> {
        self.curve_within(id, 0)
    }

    /// Reads the curve of an edge from its first to its last point, along the curve.
    pub(super) fn curve_between(&self, id: u64, ends: [Vec3; 2]) -> Result<Curve, StepError> {
        match self.entities.find(id, "PCURVE") {
            Some(item) => self.pcurve(item, Some(ends), 0),
            None => self.curve(id),
        }
    }

    fn curve_within(&self, id: u64, depth: usize) -> Result<Curve, StepError> {
        if let Some(spline) = self.spline_curve(id)? {
            return Ok(Curve::Spline(spline));
        }
        let item = self.entities.simple(id)?;
        let unsupported = || StepError::Unsupported { id, name: item.name().to_owned() };
        match item.name() {
            "LINE" => {
                let vector = self.entities.get(item.reference(2)?, "VECTOR")?;
                let direction = unit(self.direction(vector.reference(1)?)?);
                Ok(Curve::Line {
                    point: self.point(item.reference(1)?)?,
                    direction: direction.ok_or(StepError::Numbers { id, what: "direction" })?,
                })
            }
            "CIRCLE" => {
                let radius = self.length(item, 2)?;
                Ok(Curve::Ellipse { axes: self.axes(item.reference(1)?)?, radii: [radius; 2] })
            }
            "ELLIPSE" => Ok(Curve::Ellipse {
                axes: self.axes(item.reference(1)?)?,
                radii: [self.length(item, 2)?, self.length(item, 3)?],
            }),
            "HYPERBOLA" => Ok(Curve::Hyperbola {
                axes: self.axes(item.reference(1)?)?,
                half_axes: [self.length(item, 2)?, self.length(item, 3)?],
            }),
            "PARABOLA" => Ok(Curve::Parabola {
                axes: self.axes(item.reference(1)?)?,
                focal: self.length(item, 2)?,
            }),
            "POLYLINE" => self.polyline(item),
            "SURFACE_CURVE" | "SEAM_CURVE" | "INTERSECTION_CURVE" if depth < MAX_NESTED => {
                self.curve_within(item.reference(1)?, depth + 1)
            }
            // The edge's vertices bound it, so only the direction of the trim matters.
            "TRIMMED_CURVE" if depth < MAX_NESTED => {
                let curve = self.curve_within(item.reference(1)?, depth + 1)?;
                Ok(if item.truth(4)? { curve } else { curve.reversed() })
            }
            "COMPOSITE_CURVE"
            | "COMPOSITE_CURVE_ON_SURFACE"
            | "BOUNDARY_CURVE"
            | "OUTER_BOUNDARY_CURVE"
                if depth < MAX_NESTED =>
            {
                self.composite(item, depth)
            }
            "PCURVE" if depth < MAX_NESTED && !self.is_flat => self.pcurve(item, None, depth),
            "CURVE_REPLICA" if depth < MAX_NESTED => {
                let parent = item.reference(1)?;
                self.copied(item.reference(2)?, |copy| copy.curve_within(parent, depth + 1))
            }
            "OFFSET_CURVE_3D" if depth < MAX_NESTED => {
                let basis = self.curve_within(item.reference(1)?, depth + 1)?;
                self.offset(&basis, item)?.ok_or_else(unsupported)
            }
            _ => Err(unsupported()),
        }
    }

    fn polyline(&self, item: Item) -> Result<Curve, StepError> {
        let points = item.references(1)?;
        self.entities.spend(points.len())?;
        let points: Vec<WeightedPoint> = points
            .iter()
            .map(|&id| Ok(weighted(self.point(id)?, 1.0)))
            .collect::<Result<_, _>>()?;
        let count = points.len();
        // Degree 1: a knot at each point, and both ends twice.
        let knots = (0..count + 2).map(|k| k.clamp(1, count) as f64).collect();
        let knots = Knots::new(1, knots, count);
        let knots = knots.ok_or(StepError::Numbers { id: item.id, what: "curve" })?;
        Ok(Curve::Spline(SplineCurve { knots, points }))
    }

    /// Moves a line or a circle sideways, along the cross product of a direction and its own
    /// direction. Returns `None` if the result is neither (ISO 10303-42, `offset_curve_3d`).
    fn offset(&self, basis: &Curve, item: Item) -> Result<Option<Curve>, StepError> {
        let by_mm = item.number(2)? * self.units.mm;
        let up = self.direction(item.reference(4)?)?;
        let bad = || StepError::Numbers { id: item.id, what: "offset curve" };
        let up = unit(up).filter(|_| by_mm.is_finite()).ok_or_else(bad)?;
        Ok(match *basis {
            Curve::Line { point, direction } => {
                let sideways = unit(cross(up, direction)).ok_or_else(bad)?;
                let by_mm = if self.place.is_mirrored() { -by_mm } else { by_mm };
                Some(Curve::Line { point: along(point, sideways, by_mm), direction })
            }
            Curve::Ellipse { axes, radii: [a, b] } if a == b => {
                // The product points inward where the circle goes around the direction.
                let rise = dot(up, axes.directions[2]);
                let radius = a - by_mm * rise.signum();
                let is_flat = rise.abs() > 1.0 - 1e-9;
                let circle = Curve::Ellipse { axes, radii: [radius; 2] };
                if radius <= 0.0 {
                    return Err(bad());
                }
                is_flat.then_some(circle)
            }
            _ => None,
        })
    }

    /// Reads bounded curves joined end to end.
    fn composite(&self, item: Item, depth: usize) -> Result<Curve, StepError> {
        let bad = StepError::Numbers { id: item.id, what: "chain of curves" };
        CurveChain::new(self.links(item, depth)?).map(Curve::Chain).ok_or(bad)
    }

    /// Reads the pieces of a chain of curves.
    pub(super) fn links(&self, item: Item, depth: usize) -> Result<Vec<Link>, StepError> {
        let link = |id: u64| {
            // A piece costs as much as several points.
            self.entities.spend(10)?;
            let segment = self.entities.get(id, "COMPOSITE_CURVE_SEGMENT")?;
            let mut link = self.bounded(segment.reference(2)?, depth + 1)?;
            if !segment.truth(1)? {
                link.range.reverse();
            }
            Ok(link)
        };
        item.references(1)?.into_iter().map(link).collect()
    }

    /// Reads a bounded curve.
    pub(super) fn bounded(&self, id: u64, depth: usize) -> Result<Link, StepError> {
        if let Some(trimmed) = self.entities.find(id, "TRIMMED_CURVE") {
            return self.trimmed(trimmed, depth);
        }
        let on_surfaces = ["SURFACE_CURVE", "SEAM_CURVE", "INTERSECTION_CURVE"];
        if let Some(item) = on_surfaces.iter().find_map(|name| self.entities.find(id, name))
            && depth < MAX_NESTED
        {
            return self.bounded(item.reference(1)?, depth + 1);
        }
        let curve = self.curve_within(id, depth)?;
        let range = curve.domain().ok_or(StepError::Numbers { id, what: "bounded curve" })?;
        Ok(Link { curve, range })
    }

    /// Reads a part of a curve between points or parameters.
    fn trimmed(&self, item: Item, depth: usize) -> Result<Link, StepError> {
        let basis = item.reference(1)?;
        let curve = self.curve_within(basis, depth + 1)?;
        let forward = item.truth(4)?;
        let point = |k: usize| {
            let mut all = item.list(k)?.iter().filter_map(Value::reference);
            let id = all.find(|id| self.entities.find(*id, "CARTESIAN_POINT").is_some());
            id.map(|id| self.point(id)).transpose()
        };
        // Points first: unlike parameters, they do not depend on the unit of angles.
        if let (Some(start), Some(end)) = (point(2)?, point(3)?) {
            let range = edge_range(&curve, start, end, forward);
            return Ok(Link { curve, range });
        }
        let scale = self.parameter(basis, &curve)?;
        let parameter = |k: usize| {
            let number = item.list(k)?.iter().find_map(Value::number);
            number.map(|t| t * scale).ok_or(StepError::Attribute { id: item.id, attribute: k + 1 })
        };
        let [from, mut to] = [parameter(2)?, parameter(3)?];
        if let Some(period) = curve.period() {
            let way = if forward { to - from } else { from - to }.rem_euclid(period);
            let way = if way > 0.0 { way } else { period };
            to = if forward { from + way } else { from - way };
        }
        Ok(Link { curve, range: [from, to] })
    }

    /// Returns the curve's parameter that corresponds to a parameter of the file.
    pub(super) fn parameter(&self, id: u64, curve: &Curve) -> Result<f64, StepError> {
        match curve {
            Curve::Line { .. } => {
                // The file's parameter counts vectors; ours counts millimeters.
                let line = self.entities.get(id, "LINE")?;
                self.length(self.entities.get(line.reference(2)?, "VECTOR")?, 2)
            }
            Curve::Ellipse { .. } => Ok(self.units.radians),
            _ => Ok(1.0),
        }
    }
}

/// Returns whether a piece of a curve is a point, as at a pole.
pub(super) fn is_short(link: &Link) -> bool {
    const POINT_MM: f64 = 1e-6;
    let Link { curve, range: [from, to] } = link;
    let place = |k: u32| curve.place(from + (to - from) * f64::from(k) / 4.0);
    (1..=4).all(|k| distance(place(0), place(k)) < POINT_MM)
}
