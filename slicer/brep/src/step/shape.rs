//! Points, curves and surfaces out of entities.

use super::StepError;
use super::file::{Entities, Item, Value};
use super::units::Units;
use crate::geometry::spline::{Knots, SplineCurve, SplineSurface, Weighted, weighted};
use crate::geometry::{Curve, Surface, TorusPart};
use crate::vector::{Frame, Vec3, dot, scale, unit};

/// Reads shapes of a representation, in millimetres and where it is placed.
pub(crate) struct Shapes<'a> {
    pub(crate) entities: &'a Entities,
    pub(crate) units: &'a Units,
    pub(crate) place: Frame,
}

/// Curves of curves and surfaces of surfaces; more are a circle.
const MOST_NESTED: usize = 8;

impl Shapes<'_> {
    /// A vertex's or a cartesian point's place.
    pub(crate) fn point(&self, id: u64) -> Result<Vec3, StepError> {
        let id = match self.entities.find(id, "VERTEX_POINT") {
            Some(vertex) => vertex.reference(1)?,
            None => id,
        };
        let point = self.entities.get(id, "CARTESIAN_POINT")?.numbers(1)?;
        let &[x, y, z] = point.as_slice() else {
            return Err(StepError::Attribute { id, attribute: 2 });
        };
        let point = self.place.point(scale([x, y, z], self.units.mm));
        let is_near = point.iter().all(|x| x.abs() < 1e9);
        is_near.then_some(point).ok_or(StepError::Numbers { id, what: "point" })
    }

    fn direction(&self, id: u64) -> Result<Vec3, StepError> {
        let ratios = self.entities.get(id, "DIRECTION")?.numbers(1)?;
        let &[x, y, z] = ratios.as_slice() else {
            return Err(StepError::Attribute { id, attribute: 2 });
        };
        Ok(self.place.direction([x, y, z]))
    }

    fn optional_direction(&self, id: Option<u64>) -> Result<Option<Vec3>, StepError> {
        id.map(|id| self.direction(id)).transpose()
    }

    /// An `AXIS2_PLACEMENT_3D`; axes that are left out have their defaults.
    pub(crate) fn frame(&self, id: u64) -> Result<Frame, StepError> {
        let item = self.entities.get(id, "AXIS2_PLACEMENT_3D")?;
        let z = self.optional_direction(item.optional(2))?;
        let x = self.optional_direction(item.optional(3))?;
        let z = z.and_then(unit).unwrap_or(self.place.axes[2]);
        // By default the first axis of the representation, or the second if the
        // first is along z.
        let [first, second, _] = self.place.axes;
        let default = if dot(z, first).abs() < 1.0 - 1e-9 { first } else { second };
        let frame = Frame::new(self.point(item.reference(1)?)?, z, x.or(Some(default)));
        frame.ok_or(StepError::Numbers { id, what: "axes" })
    }

    fn length(&self, item: Item, k: usize) -> Result<f64, StepError> {
        let length = item.number(k)? * self.units.mm;
        let is_length = length > 0.0 && length < 1e9;
        is_length.then_some(length).ok_or(StepError::Numbers { id: item.id, what: "length" })
    }

    /// The curve of an edge.
    pub(crate) fn curve(&self, id: u64) -> Result<Curve, StepError> {
        self.curve_within(id, 0)
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
                Ok(Curve::Ellipse { frame: self.frame(item.reference(1)?)?, radii: [radius; 2] })
            }
            "ELLIPSE" => Ok(Curve::Ellipse {
                frame: self.frame(item.reference(1)?)?,
                radii: [self.length(item, 2)?, self.length(item, 3)?],
            }),
            "HYPERBOLA" => Ok(Curve::Hyperbola {
                frame: self.frame(item.reference(1)?)?,
                axes: [self.length(item, 2)?, self.length(item, 3)?],
            }),
            "PARABOLA" => Ok(Curve::Parabola {
                frame: self.frame(item.reference(1)?)?,
                focal: self.length(item, 2)?,
            }),
            "POLYLINE" => self.polyline(item),
            "SURFACE_CURVE" | "SEAM_CURVE" | "INTERSECTION_CURVE" | "TRIMMED_CURVE"
                if depth < MOST_NESTED =>
            {
                self.curve_within(item.reference(1)?, depth + 1)
            }
            _ => Err(unsupported()),
        }
    }

    fn polyline(&self, item: Item) -> Result<Curve, StepError> {
        let points = item.references(1)?;
        let points: Vec<Weighted> = points
            .iter()
            .map(|&id| Ok(weighted(self.point(id)?, 1.0)))
            .collect::<Result<_, _>>()?;
        let count = points.len();
        let knots = (0..count + 2).map(|k| k.clamp(1, count) as f64).collect();
        let knots = Knots::new(1, knots, count);
        let knots = knots.ok_or(StepError::Numbers { id: item.id, what: "curve" })?;
        Ok(Curve::Spline(SplineCurve { knots, points }))
    }

    /// A `B_SPLINE_CURVE` of any kind, simple or complex.
    fn spline_curve(&self, id: u64) -> Result<Option<SplineCurve>, StepError> {
        let Some(part) = Spline::find(self.entities, id, Shape::Curve) else { return Ok(None) };
        let bad = StepError::Numbers { id, what: "curve" };
        let degree = part.base.count(part.skip)?;
        let points = part.base.references(part.skip + 1)?;
        let weights = match part.weights(self.entities) {
            Some(weights) => weights.numbers(0)?,
            None => vec![1.0; points.len()],
        };
        let points = self.weighted(&points, &weights, id)?;
        // Degree, points, form, closed, self-intersecting.
        let knots = part.knots(self.entities, degree, points.len(), 5, 0, 1)?;
        let knots = knots.ok_or(bad)?;
        Ok(Some(SplineCurve { knots, points }))
    }

    fn weighted(&self, ids: &[u64], weights: &[f64], of: u64) -> Result<Vec<Weighted>, StepError> {
        let is_weight = |w: &f64| *w > 0.0 && w.is_finite();
        if ids.len() != weights.len() || !weights.iter().all(is_weight) {
            return Err(StepError::Numbers { id: of, what: "spline" });
        }
        ids.iter().zip(weights).map(|(&id, &w)| Ok(weighted(self.point(id)?, w))).collect()
    }

    fn spline_surface(&self, id: u64) -> Result<Option<SplineSurface>, StepError> {
        let Some(part) = Spline::find(self.entities, id, Shape::Surface) else { return Ok(None) };
        let bad = || StepError::Numbers { id, what: "surface" };
        let degrees = [part.base.count(part.skip)?, part.base.count(part.skip + 1)?];
        let rows = part.base.list(part.skip + 2)?;
        let flat = |value: &Value| value.list().map(<[Value]>::to_vec);
        let cells: Option<Vec<Vec<Value>>> = rows.iter().map(flat).collect();
        let cells = cells.ok_or_else(bad)?;
        let columns = cells.first().map_or(0, Vec::len);
        let ids: Option<Vec<u64>> = cells.iter().flatten().map(Value::reference).collect();
        let ids = ids.ok_or_else(bad)?;
        let weights = match part.weights(self.entities) {
            Some(weights) => {
                let rows = weights.list(0)?.iter().filter_map(Value::list).flatten();
                rows.filter_map(Value::number).collect()
            }
            None => vec![1.0; ids.len()],
        };
        let points = self.weighted(&ids, &weights, id)?;
        // Degrees, points, form, closed twice, self-intersecting.
        let u = part.knots(self.entities, degrees[0], cells.len(), 7, 0, 2)?;
        let v = part.knots(self.entities, degrees[1], columns, 7, 1, 3)?;
        let surface = SplineSurface::new(u.ok_or_else(bad)?, v.ok_or_else(bad)?, points);
        surface.ok_or_else(bad).map(Some)
    }

    /// The surface of a face.
    pub(crate) fn surface(&self, id: u64) -> Result<Surface, StepError> {
        self.surface_within(id, 0)
    }

    fn surface_within(&self, id: u64, depth: usize) -> Result<Surface, StepError> {
        if let Some(spline) = self.spline_surface(id)? {
            return Ok(Surface::Spline(Box::new(spline)));
        }
        let item = self.entities.simple(id)?;
        let frame = || self.frame(item.reference(1)?);
        Ok(match item.name() {
            "PLANE" => Surface::Plane(frame()?),
            "CYLINDRICAL_SURFACE" => {
                Surface::Cylinder { frame: frame()?, radius: self.length(item, 2)? }
            }
            "CONICAL_SURFACE" => {
                let radius = item.number(2)? * self.units.mm;
                let slope = (item.number(3)? * self.units.radians).tan();
                if !(radius >= 0.0 && slope.is_finite() && radius.is_finite()) {
                    return Err(StepError::Numbers { id, what: "cone" });
                }
                Surface::Cone { frame: frame()?, radius, slope }
            }
            "SPHERICAL_SURFACE" => {
                Surface::Sphere { frame: frame()?, radius: self.length(item, 2)? }
            }
            "TOROIDAL_SURFACE" | "DEGENERATE_TOROIDAL_SURFACE" => {
                let (major, minor) = (self.length(item, 2)?, self.length(item, 3)?);
                let part = match item.truth(4) {
                    _ if minor <= major => TorusPart::Whole,
                    Ok(false) => TorusPart::Lemon,
                    _ => TorusPart::Apple,
                };
                Surface::Torus { frame: frame()?, major, minor, part }
            }
            "SURFACE_OF_LINEAR_EXTRUSION" => {
                let vector = self.entities.get(item.reference(2)?, "VECTOR")?;
                let direction = unit(self.direction(vector.reference(1)?)?);
                let direction = direction.ok_or(StepError::Numbers { id, what: "direction" })?;
                // v is in units of the vector's length, which is not kept.
                Surface::Extrusion { curve: self.curve(item.reference(1)?)?, direction }
            }
            "SURFACE_OF_REVOLUTION" => self.revolution(item)?,
            "RECTANGULAR_TRIMMED_SURFACE" if depth < MOST_NESTED => {
                self.surface_within(item.reference(1)?, depth + 1)?
            }
            name => return Err(StepError::Unsupported { id, name: name.to_owned() }),
        })
    }

    fn revolution(&self, item: Item) -> Result<Surface, StepError> {
        let axis = self.entities.get(item.reference(2)?, "AXIS1_PLACEMENT")?;
        let z = self.optional_direction(axis.optional(2))?.unwrap_or(self.place.axes[2]);
        let frame = Frame::new(self.point(axis.reference(1)?)?, z, None);
        let frame = frame.ok_or(StepError::Numbers { id: item.id, what: "axis" })?;
        // The curve is read as the frame sees it.
        let place = frame.inverse().then(&self.place);
        let seen = Shapes { entities: self.entities, units: self.units, place };
        Ok(Surface::Revolution { frame, curve: seen.curve(item.reference(1)?)? })
    }
}

#[derive(Clone, Copy, PartialEq)]
enum Shape {
    Curve,
    Surface,
}

/// The records of a B-spline, which stand in one or in several.
struct Spline<'a> {
    id: u64,
    shape: Shape,
    /// The record with degree and points, after how many other attributes.
    base: Item<'a>,
    skip: usize,
    /// How the knots are given.
    kind: &'static str,
}

impl<'a> Spline<'a> {
    fn find(entities: &'a Entities, id: u64, shape: Shape) -> Option<Self> {
        let (base, kinds) = match shape {
            Shape::Curve => (
                "B_SPLINE_CURVE",
                [
                    "B_SPLINE_CURVE_WITH_KNOTS",
                    "UNIFORM_CURVE",
                    "QUASI_UNIFORM_CURVE",
                    "BEZIER_CURVE",
                ],
            ),
            Shape::Surface => (
                "B_SPLINE_SURFACE",
                [
                    "B_SPLINE_SURFACE_WITH_KNOTS",
                    "UNIFORM_SURFACE",
                    "QUASI_UNIFORM_SURFACE",
                    "BEZIER_SURFACE",
                ],
            ),
        };
        let kind = kinds.into_iter().find(|kind| entities.find(id, kind).is_some())?;
        let (base, skip) = match entities.find(id, base) {
            Some(base) => (base, 0),
            // A simple entity has them all in one, after its name.
            None => (entities.find(id, kind)?, 1),
        };
        Some(Self { id, shape, base, skip, kind })
    }

    fn weights(&self, entities: &'a Entities) -> Option<Item<'a>> {
        let name = match self.shape {
            Shape::Curve => "RATIONAL_B_SPLINE_CURVE",
            Shape::Surface => "RATIONAL_B_SPLINE_SURFACE",
        };
        entities.find(self.id, name)
    }

    /// The knots along one parameter: `before` attributes stand before the first
    /// list, and `multiplicities` and `values` are the places of the two.
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
                if times.len() != values.len() || times.iter().sum::<f64>() > most {
                    return Ok(None);
                }
                let repeat = |(t, n): (f64, f64)| std::iter::repeat_n(t, n.max(0.0) as usize);
                values.into_iter().zip(times).flat_map(repeat).collect()
            }
            "UNIFORM_CURVE" | "UNIFORM_SURFACE" => {
                (0..count + degree + 1).map(|k| k as f64 - degree as f64).collect()
            }
            // Quasi-uniform; a Bézier curve is one piece of it, or several.
            kind => {
                let pieces =
                    if kind.starts_with("BEZIER") { (count - 1) / degree } else { count - degree };
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
