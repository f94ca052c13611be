//! Reads the units of a representation's context (ISO 10303-41).

use super::entities::{Entities, Item};
use super::error::StepError;

/// The units of a representation.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct RepresentationUnits {
    /// The millimeters per unit of length.
    pub(crate) mm: f64,
    /// The radians per unit of angle.
    pub(crate) radians: f64,
    /// The name of the unit of length.
    pub(crate) name: String,
    /// The uncertainty of lengths, in millimeters, if stated.
    pub(crate) uncertainty_mm: Option<f64>,
}

/// The greatest number of chained conversions; more count as a cycle.
const MAX_STEPS: usize = 8;

impl RepresentationUnits {
    /// Returns the units of scaled shapes.
    pub(crate) fn scaled(&self, by: f64) -> Self {
        let uncertainty_mm = self.uncertainty_mm.map(|mm| by * mm);
        Self { mm: by * self.mm, uncertainty_mm, ..self.clone() }
    }

    /// Reads the units of a context, or returns `None` if it has no unit of length.
    pub(crate) fn of_context(entities: &Entities, context: u64) -> Result<Option<Self>, StepError> {
        let Some(assigned) = entities.find(context, "GLOBAL_UNIT_ASSIGNED_CONTEXT") else {
            return Ok(None);
        };
        let (mut length, mut radians) = (None, 1.0);
        for unit in assigned.references(0)? {
            if entities.find(unit, "LENGTH_UNIT").is_some() {
                length = Some((1000.0 * size(entities, unit, 0)?, name(entities, unit)));
            } else if entities.find(unit, "PLANE_ANGLE_UNIT").is_some() {
                radians = size(entities, unit, 0)?;
            }
        }
        let uncertainty_mm = uncertainty_mm(entities, context);
        Ok(length.map(|(mm, name)| Self { mm, radians, name, uncertainty_mm }))
    }
}

/// Returns the greatest length uncertainty of a context, in millimeters.
fn uncertainty_mm(entities: &Entities, context: u64) -> Option<f64> {
    let assigned = entities.find(context, "GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT")?;
    let mm = |measure: u64| {
        let measure = entities.find(measure, "UNCERTAINTY_MEASURE_WITH_UNIT")?;
        let unit = measure.reference(1).ok()?;
        entities.find(unit, "LENGTH_UNIT")?;
        let mm = 1000.0 * measure.number(0).ok()? * size(entities, unit, 0).ok()?;
        (mm > 0.0 && mm.is_finite()).then_some(mm)
    };
    assigned.references(0).ok()?.into_iter().filter_map(mm).reduce(f64::max)
}

/// Returns the size of a unit in SI units (meters, radians).
fn size(entities: &Entities, unit: u64, step: usize) -> Result<f64, StepError> {
    let bad = StepError::Numbers { id: unit, what: "unit" };
    if let Some(si) = entities.find(unit, "SI_UNIT") {
        return prefix(si).ok_or(bad);
    }
    // A conversion has a factor and the unit that it multiplies.
    let converted = entities.get(unit, "CONVERSION_BASED_UNIT")?;
    let measure = converted.reference(1)?;
    let records = entities.records(measure)?;
    // A complex measure has several records; only one has a value and a unit (ISO 10303-41).
    let with_unit = records.iter().find(|record| record.values.len() >= 2);
    let item = Item { id: measure, record: with_unit.ok_or(bad.clone())? };
    if step == MAX_STEPS {
        return Err(bad);
    }
    let size = item.number(0)? * size(entities, item.reference(1)?, step + 1)?;
    if size.is_finite() && size > 0.0 { Ok(size) } else { Err(bad) }
}

fn prefix(si: Item) -> Option<f64> {
    let Ok(prefix) = si.word(0) else { return Some(1.0) };
    Some(match prefix {
        "EXA" => 1e18,
        "PETA" => 1e15,
        "TERA" => 1e12,
        "GIGA" => 1e9,
        "MEGA" => 1e6,
        "KILO" => 1e3,
        "HECTO" => 1e2,
        "DECA" => 1e1,
        "DECI" => 1e-1,
        "CENTI" => 1e-2,
        "MILLI" => 1e-3,
        "MICRO" => 1e-6,
        "NANO" => 1e-9,
        "PICO" => 1e-12,
        "FEMTO" => 1e-15,
        "ATTO" => 1e-18,
        _ => return None,
    })
}

fn name(entities: &Entities, unit: u64) -> String {
    if let Some(converted) = entities.find(unit, "CONVERSION_BASED_UNIT") {
        return converted.text(0).to_ascii_lowercase();
    }
    let si = entities.find(unit, "SI_UNIT");
    let words = si.map(|si| [si.word(0).unwrap_or(""), si.word(1).unwrap_or("")].concat());
    words.unwrap_or_default().to_ascii_lowercase()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn units(data: &str) -> Result<Option<RepresentationUnits>, StepError> {
        let text = format!("ISO-10303-21;DATA;{data}ENDSEC;END-ISO-10303-21;");
        RepresentationUnits::of_context(&Entities::read(text.as_bytes())?, 1)
    }

    #[test]
    fn prefixes_inches_and_degrees() {
        let context = "#1=(GLOBAL_UNIT_ASSIGNED_CONTEXT((#2,#3)));";
        let radian = "#3=(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));";
        let of = |length: &str| units(&format!("{context}{radian}{length}")).unwrap().unwrap();
        let milli = of("#2=(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.));");
        let name = "millimetre".into();
        assert_eq!(
            milli,
            RepresentationUnits { mm: 1.0, radians: 1.0, name, uncertainty_mm: None }
        );
        assert_eq!(of("#2=(LENGTH_UNIT()SI_UNIT($,.METRE.));").mm, 1000.0);
        let inch = "#2=(CONVERSION_BASED_UNIT('INCH',#4)LENGTH_UNIT()NAMED_UNIT(#9));
            #4=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(2.54),#5);
            #5=(LENGTH_UNIT()SI_UNIT(.CENTI.,.METRE.));";
        let inch = of(inch);
        assert!((inch.mm - 25.4).abs() < 1e-12 && inch.name == "inch");
        let degree = "#2=(LENGTH_UNIT()SI_UNIT(.MILLI.,.METRE.));
            #3=(CONVERSION_BASED_UNIT('DEGREE',#4)PLANE_ANGLE_UNIT());
            #4=PLANE_ANGLE_MEASURE_WITH_UNIT(PLANE_ANGLE_MEASURE(0.5),#5);
            #5=(PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.));";
        assert_eq!(units(&format!("{context}{degree}")).unwrap().unwrap().radians, 0.5);
    }

    #[test]
    fn uncertainty_has_a_unit_of_its_own() {
        let context = "#1=(GLOBAL_UNIT_ASSIGNED_CONTEXT((#2))
            GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#3)));
            #2=(LENGTH_UNIT()SI_UNIT($,.METRE.));#4=(LENGTH_UNIT()SI_UNIT(.MICRO.,.METRE.));
            #3=UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(5.),#4,'','');";
        let uncertainty_mm = units(context).unwrap().unwrap().uncertainty_mm.unwrap();
        assert!((uncertainty_mm - 0.005).abs() < 1e-15);
        // An invalid uncertainty is ignored.
        let none = units(&context.replace("(5.)", "(-5.)")).unwrap().unwrap();
        assert_eq!(none.uncertainty_mm, None);
    }

    #[test]
    fn a_unit_that_is_its_own_multiple_is_refused() {
        let circle = "#1=(GLOBAL_UNIT_ASSIGNED_CONTEXT((#2)));
            #2=(CONVERSION_BASED_UNIT('X',#4)LENGTH_UNIT());
            #4=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(2.),#2);";
        assert!(matches!(units(circle), Err(StepError::Numbers { id: 2, .. })));
        assert_eq!(units("#1=(GLOBAL_UNIT_ASSIGNED_CONTEXT(()));"), Ok(None));
        assert_eq!(units("#1=X();"), Ok(None));
    }
}
