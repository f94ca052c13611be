//! Simulates what a stack cures along one line of pixels, where doses add up.

use std::sync::Arc;

use lamp_stack::Length;

use crate::column_dose::{ColumnDose, ResinDepths};
use crate::cured::{LineRun, SolidHeights, add_below};
use crate::resin::{ExposureTime, FadingLight, GrayLevel};

/// The heights that exposures cure along a line, where each adds to the doses of all the resin that
/// it reaches: resin is cured where the shares of [`FadingLight`] sum to 1. Light goes straight
/// down.
///
/// Memory grows with the runs along the line.
///
/// ```
/// use lamp_grayscale::SummedLine;
/// use lamp_grayscale::material::Material;
/// use lamp_stack::{Catalogued, Length};
///
/// let material = Material::builtin("lamp-suspension").unwrap();
/// let thickness = Length::from_um(100.0);
/// let time = material.resin()?.exposure_time(thickness, 1.0)?;
/// let mut cured = SummedLine::new(material.fading()?, 1);
/// for layer in 5..50 {
///     let bottom = Length::from_um(100.0 * f64::from(layer));
///     cured.expose(vec![(0, 1, 255)], bottom, thickness, time);
/// }
/// // White that just cures its layer prints through by -D_p ln(1 - q), q = exp(-100/215.2).
/// let below = 500.0 - cured.cured(0.0)[0][0][0];
/// let q = (-100.0f64 / 215.2).exp();
/// assert!((below + 215.2 * (1.0 - q).ln()).abs() < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct SummedLine {
    fading: FadingLight,
    resin: Arc<ResinDepths>,
    pixels: usize,
    /// The shares of the last exposure time.
    shares: Option<(ExposureTime, Arc<[f64; 256]>)>,
    layers: Vec<LineExposure>,
}

/// A layer along the line.
#[derive(Clone, Debug)]
struct LineExposure {
    bottom_um: f64,
    top_um: f64,
    runs: Vec<LineRun>,
    /// The critical doses that each level brings to the layer's top.
    shares: Arc<[f64; 256]>,
}

impl SummedLine {
    /// Creates a line of this many pixels.
    pub fn new(fading: FadingLight, pixels: u32) -> Self {
        let resin = Arc::new(ResinDepths::new(&fading));
        Self { fading, resin, pixels: pixels as usize, shares: None, layers: Vec::new() }
    }

    /// Exposes a layer, given the runs along the line. Layers must come from the bottom up.
    pub fn expose(
        &mut self,
        runs: Vec<LineRun>,
        bottom: Length,
        thickness: Length,
        time: ExposureTime,
    ) {
        let fading = self.fading;
        let shares = match &self.shares {
            // The shares of a time are made once for all layers in a row that have it.
            Some((of, shares)) if *of == time => shares.clone(),
            _ => {
                let share = |level| fading.share(GrayLevel::from_u8(level as u8), time);
                let shares = Arc::new(std::array::from_fn(share));
                self.shares = Some((time, Arc::clone(&shares)));
                shares
            }
        };
        let (bottom_um, top_um) = (bottom.um(), bottom.um() + thickness.um());
        self.layers.push(LineExposure { bottom_um, top_um, runs, shares });
    }

    /// Returns the heights at which each pixel of the line is cured, above `floor_um`.
    pub fn cured(&self, floor_um: f64) -> Vec<SolidHeights> {
        let mut cured = vec![SolidHeights::new(); self.pixels];
        let mut columns = vec![ColumnDose::dark(&self.resin); self.pixels];
        // 002 eq. 28: light comes from above, so that a height gets all layers at or above it.
        for (number, layer) in self.layers.iter().enumerate().rev() {
            // The resin below the layer gets light through it down to the next top.
            let below = number.checked_sub(1).map(|below| self.layers[below].top_um);
            let end_um = below.unwrap_or_else(|| layer.bottom_um.min(floor_um)).min(layer.top_um);
            let fades = self.resin.fades(layer.top_um - end_um);
            for &(start, end, level) in &layer.runs {
                let share = layer.shares[usize::from(level)];
                for column in &mut columns[start as usize..end as usize] {
                    column.expose(level, share);
                }
            }
            for (column, solid) in columns.iter_mut().zip(&mut cured) {
                let depth_um = column.cured_depth_um(&fades);
                if depth_um > 0.0 {
                    add_below(solid, [layer.top_um - depth_um, layer.top_um]);
                }
                column.go_down(&fades);
            }
        }
        for solid in &mut cured {
            solid.reverse();
            solid.retain(|[_, to]| *to > floor_um);
            if let Some(first) = solid.first_mut() {
                first[0] = first[0].max(floor_um);
            }
        }
        cured
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::Catalogued;

    use super::*;
    use crate::material::Material;

    /// The sum at a height, straight from 002 eq. 39: every exposure at or above it.
    fn dose(fading: &FadingLight, exposures: &[(f64, u8, f64)], z_um: f64) -> f64 {
        let above = exposures.iter().filter(|(top_um, ..)| *top_um >= z_um);
        let share = |&(top_um, level, ms): &(f64, u8, f64)| {
            let gray = GrayLevel::from_u8(level);
            let depth_um = fading.penetration_depth(gray).um();
            let share = fading.share(gray, ExposureTime::from_ms(ms));
            share * ((z_um - top_um) / depth_um).exp()
        };
        above.map(share).sum()
    }

    #[test]
    fn resin_is_cured_where_all_exposures_come_to_the_critical_dose() {
        let fading = Material::builtin("lamp-suspension").unwrap().fading().unwrap();
        let mut random = 1u64;
        let mut next = move |below: u64| {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (random >> 33) % below
        };
        for _ in 0..50 {
            let mut line = SummedLine::new(fading, 1);
            let mut exposures = Vec::new();
            let mut bottom_um = 1000.0;
            for _ in 0..12 {
                let thick_um = [50.0, 100.0, 130.0][next(3) as usize];
                let level = [0, 0, 40, 90, 140, 255][next(6) as usize];
                let ms = [100.0, 131.0][next(2) as usize];
                let runs = if level > 0 { vec![(0, 1, level)] } else { Vec::new() };
                let [bottom, thick] = [bottom_um, thick_um].map(Length::from_um);
                line.expose(runs, bottom, thick, ExposureTime::from_ms(ms));
                bottom_um += thick_um;
                exposures.push((bottom_um, level, ms));
            }
            let cured = &line.cured(200.0)[0];
            for step in 0..8_000 {
                let z_um = 200.0 + 0.3 * f64::from(step) + 0.0137;
                let holds = |at: f64| cured.iter().any(|[from, to]| (*from..*to).contains(&at));
                let is_cured = dose(&fading, &exposures, z_um) >= 1.0;
                let near = holds(z_um - 1e-4) != holds(z_um + 1e-4);
                assert!(near || holds(z_um) == is_cured, "{z_um}: {cured:?} {exposures:?}");
            }
        }
    }
}
