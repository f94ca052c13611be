//! The differences between the cured shape and the target (000 eq. 4.12 to 4.15).

use super::curve::HeightCurve;

/// Differences of doses and heights of column voxels from the wanted ones.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measures {
    /// The root mean square of the difference of doses, in mJ/cm2 (eq. 4.12).
    pub dose_rms: f64,
    /// The same as a share of the wanted dose, over columns that have a height (eq. 4.13).
    pub relative_rms: f64,
    /// The mean absolute difference of heights, in um (eq. 4.14).
    pub ra_um: f64,
    /// The root mean square of the difference of heights, in um (eq. 4.15).
    pub rms_um: f64,
    /// The height by which the lowest column is too low, as a negative number, in um.
    pub lowest_um: f64,
    /// The height by which the highest column is too high, in um.
    pub highest_um: f64,
    /// Columns that have a height and are not cured.
    pub missing: u64,
    /// Columns that have no height and are cured.
    pub overcured: u64,
}

impl Measures {
    /// Returns the measures of doses in mJ/cm2, for heights in um.
    pub fn of(doses: &[f64], heights_um: &[f64], curve: &HeightCurve) -> Self {
        let mut all = Self::default();
        let mut columns = 0.0;
        for (&dose, &wanted) in doses.iter().zip(heights_um) {
            let wanted_dose = curve.dose(wanted).unwrap_or(f64::INFINITY);
            let height = curve.height_um(dose);
            let left = height - wanted;
            all.dose_rms += (dose - wanted_dose).powi(2);
            all.ra_um += left.abs();
            all.rms_um += left * left;
            all.lowest_um = all.lowest_um.min(left);
            all.highest_um = all.highest_um.max(left);
            if wanted > 0.0 {
                columns += 1.0;
                all.relative_rms += (dose / wanted_dose - 1.0).powi(2);
                all.missing += u64::from(height == 0.0);
            } else {
                all.overcured += u64::from(height > 0.0);
            }
        }
        let count = doses.len() as f64;
        Self {
            dose_rms: (all.dose_rms / count).sqrt(),
            relative_rms: (all.relative_rms / f64::max(columns, 1.0)).sqrt(),
            ra_um: all.ra_um / count,
            rms_um: (all.rms_um / count).sqrt(),
            ..all
        }
    }
}
