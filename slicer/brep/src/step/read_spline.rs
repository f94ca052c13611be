//! Reads B-spline curves and surfaces from STEP entities.

use super::entities::{Entities, Item, Value};
use super::error::StepError;
use super::read_placement::GeometryReader;
use crate::geometry::spline::{Knots, SplineCurve, WeightedPoint, weighted};
use crate::geometry::spline_surface::SplineSurface;

impl GeometryReader<'_> {
    /// Reads a `B_SPLINE_CURVE` of any kind, simple or complex.
    pub(super) fn spline_curve(&self, id: u64) -> Result<Option<SplineCurve>, StepError> {
        let Some(part) = SplineRecords::find(self.entities, id, &CURVE) else {
            return Ok(None);
        };
        let bad = StepError::Numbers { id, what: "curve" };
        let degree = part.base.count(part.skip)?;
        let points = part.base.references(part.skip + 1)?;
        let weights = match part.weights {
            Some(weights) => weights.numbers(0)?,
            None => vec![1.0; points.len()],
        };
        let points = self.weighted(&points, &weights, id)?;
        // The five attributes before the knots: degree, points, form, closed,
        // self-intersecting.
        let knots = part.knots(self.entities, degree, points.len(), 5, 0, 1)?;
        let knots = knots.ok_or(bad)?;
        Ok(Some(SplineCurve { knots, points }))
    }

    fn weighted(
        &self,
        ids: &[u64],
        weights: &[f64],
        of: u64,
    ) -> Result<Vec<WeightedPoint>, StepError> {
        let is_weight = |w: &f64| *w > 0.0 && w.is_finite();
        if ids.len() != weights.len() || !weights.iter().all(is_weight) {
            return Err(StepError::Numbers { id: of, what: "spline" });
        }
        self.entities.spend(ids.len())?;
        ids.iter().zip(weights).map(|(&id, &w)| Ok(weighted(self.point(id)?, w))).collect()
    }

    pub(super) fn spline_surface(&self, id: u64) -> Result<Option<SplineSurface>, StepError> {
        let Some(part) = SplineRecords::find(self.entities, id, &SURFACE) else {
            return Ok(None);
        };
        let bad = || StepError::Numbers { id, what: "surface" };
        let degrees = [part.base.count(part.skip)?, part.base.count(part.skip + 1)?];
        let rows = part.base.list(part.skip + 2)?;
        let flat = |value: &Value| value.list().map(<[Value]>::to_vec);
        let cells: Option<Vec<Vec<Value>>> = rows.iter().map(flat).collect();
        let cells = cells.ok_or_else(bad)?;
        let columns = cells.first().map_or(0, Vec::len);
        let ids: Option<Vec<u64>> = cells.iter().flatten().map(Value::reference).collect();
        let ids = ids.ok_or_else(bad)?;
        let weights = match part.weights {
            Some(weights) => {
                let rows = weights.list(0)?.iter().filter_map(Value::list).flatten();
                rows.filter_map(Value::number).collect()
            }
            None => vec![1.0; ids.len()],
        };
        let points = self.weighted(&ids, &weights, id)?;
        // The seven attributes before the knots: two degrees, points, form, closed twice,
        // self-intersecting.
        let u = part.knots(self.entities, degrees[0], cells.len(), 7, 0, 2)?;
        let v = part.knots(self.entities, degrees[1], columns, 7, 1, 3)?;
        let surface = SplineSurface::new(u.ok_or_else(bad)?, v.ok_or_else(bad)?, points);
        surface.ok_or_else(bad).map(Some)
    }
}

/// The entity names of a kind of spline.
struct SplineNames {
    base: &'static str,
    rational: &'static str,
    /// The entities that give the knots.
    knots: [&'static str; 4],
}

const CURVE: SplineNames = SplineNames {
    base: "B_SPLINE_CURVE",
    rational: "RATIONAL_B_SPLINE_CURVE",
    knots: ["B_SPLINE_CURVE_WITH_KNOTS", "UNIFORM_CURVE", "QUASI_UNIFORM_CURVE", "BEZIER_CURVE"],
};

const SURFACE: SplineNames = SplineNames {
    base: "B_SPLINE_SURFACE",
    rational: "RATIONAL_B_SPLINE_SURFACE",
    knots: [
        "B_SPLINE_SURFACE_WITH_KNOTS",
        "UNIFORM_SURFACE",
        "QUASI_UNIFORM_SURFACE",
        "BEZIER_SURFACE",
    ],
};

/// The records of a B-spline, in one entity or several.
struct SplineRecords<'a> {
    id: u64,
    /// The record with degree and points, and the number of attributes before them.
    base: Item<'a>,
    skip: usize,
    /// The entity that gives the knots.
    kind: &'static str,
    /// The weights, if the spline is rational.
    weights: Option<Item<'a>>,
}

impl<'a> SplineRecords<'a> {
    fn find(entities: &'a Entities, id: u64, names: &SplineNames) -> Option<Self> {
        let kind = names.knots.into_iter().find(|kind| entities.find(id, kind).is_some())?;
        let (base, skip) = match entities.find(id, names.base) {
            Some(base) => (base, 0),
            // A simple entity has all attributes in one record, after its name.
            None => (entities.find(id, kind)?, 1),
        };
        Some(Self { id, base, skip, kind, weights: entities.find(id, names.rational) })
    }

    /// Reads the knots along one parameter. `before` attributes precede the first list;
    /// `multiplicities` and `values` are the positions of both lists.
    fn knots(
        &self,
        entities: &Entities,
        degree: usize,
        count: usize,
        before: usize,
        multiplicities: usize,
        values: usize,
    ) -> Result<Option<Knots>, StepError> {
        if degree == 0 || count <= degree {
            return Ok(None);
        }
        let knots = match self.kind {
            "B_SPLINE_CURVE_WITH_KNOTS" | "B_SPLINE_SURFACE_WITH_KNOTS" => {
                let Some(given) = entities.find(self.id, self.kind) else { return Ok(None) };
                let first = if self.skip == 1 { 1 + before } else { 0 };
                let times = given.numbers(first + multiplicities)?;
                let values = given.numbers(first + values)?;
                let most = (count + degree + 1) as f64;
                // Checked before knots are repeated, as damaged multiplicities could take all
                // memory.
                if times.len() != values.len() || times.iter().sum::<f64>() > most {
                    return Ok(None);
                }
                let repeat = |(t, n): (f64, f64)| std::iter::repeat_n(t, n.max(0.0) as usize);
                values.into_iter().zip(times).flat_map(repeat).collect()
            }
            "UNIFORM_CURVE" | "UNIFORM_SURFACE" => {
                // No knot is repeated, so the domain begins at 0 after as many knots as the degree.
                (0..count + degree + 1).map(|k| k as f64 - degree as f64).collect()
            }
            // Quasi-uniform knots, or the knots of one or several Bézier pieces.
            kind => {
                let pieces =
                    if kind.starts_with("BEZIER") { (count - 1) / degree } else { count - degree };
                // Bézier pieces only share their ends, which takes a knot of full multiplicity.
                let times = if kind.starts_with("BEZIER") { degree } else { 1 };
                let mut knots = vec![0.0; degree + 1];
                for k in 1..pieces {
                    knots.extend(std::iter::repeat_n(k as f64, times));
                }
                knots.extend(std::iter::repeat_n(pieces as f64, degree + 1));
                knots
            }
        };
        Ok(Knots::new(degree, knots, count))
    }
}
