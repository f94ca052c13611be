//! The doses of all layers along one line of pixels: a vertical section.

use lamp_grayscale::{PixelLine, SolidHeights, add_below};
use lamp_stack::{Image, Length, Pitch};

use crate::blur::Blur;
use crate::light::{LayerTime, Light, SampleHeight};

/// The resin that a stack cures along a row or column of pixels, where doses add up and light
/// spreads sideways and down (001 eq. 5).
///
/// Memory grows with the number of places where the light along the line changes.
///
/// ```
/// use lamp_grayscale::PixelLine;
/// use lamp_grayscale::material::Material;
/// use lamp_planning::{DoseSection, LayerTime, Light, SampleHeight};
/// use lamp_stack::{Catalogued, Dpi, Image, Length, Mask};
///
/// let light = Light::of(&Material::builtin("pegda-sudan").unwrap(), SampleHeight::Top)?;
/// let mut section = DoseSection::new(light, PixelLine::Row(200), Dpi::new(2540.0).unwrap());
/// let white = Image::Mask(Mask::black(400, 400).inverted());
/// // 1 s of 7.394 mW/cm² on 7.266 mJ/cm² cures, but not through 120 um.
/// for (z_um, ms) in [(0.0, 0.0), (120.0, 1000.0)] {
///     let layer = LayerTime {
///         thickness: Length::from_um(120.0),
///         time: lamp_grayscale::resin::ExposureTime::from_ms(ms),
///     };
///     section.expose(&white, Length::from_um(z_um), layer, |_| 1.0);
/// }
/// assert_eq!(section.cured()[200], [[120.0, 240.0]]);
/// # Ok::<(), lamp_planning::NoLight>(())
/// ```
#[derive(Clone, Debug)]
pub struct DoseSection {
    light: Light,
    pitch: Pitch,
    line: PixelLine,
    blur: Blur<f64>,
    layers: Vec<ExposedLayer>,
}

/// A layer along the line.
#[derive(Clone, Debug)]
struct ExposedLayer {
    bottom: Length,
    exposed: LayerTime,
    /// The light that has spread to the line: the ends of stretches and their light.
    spread: Vec<(u32, f64)>,
}

impl DoseSection {
    /// Creates the section of a stack whose images have this resolution, along a line.
    pub fn new(light: Light, line: PixelLine, pitch: impl Into<Pitch>) -> Self {
        let pitch = pitch.into();
        let blur = Blur::of_scan(light.spread_pixels(pitch));
        Self { light, pitch, line, blur, layers: Vec::new() }
    }

    /// Exposes a layer on top of the layers before. `light_of` returns the light that a level that
    /// is not black passes: 0 to 1.
    ///
    /// # Panics
    /// Panics if the line does not cross the image.
    pub fn expose(
        &mut self,
        image: &Image,
        bottom: Length,
        exposed: LayerTime,
        light_of: impl Fn(u8) -> f64,
    ) {
        assert!(self.line.crosses(image), "the line crosses the image");
        let across = self.gathered_across(image, light_of);
        let spread = stretches(&self.spread_along(&across));
        self.layers.push(ExposedLayer { bottom, exposed, spread });
    }

    /// Returns the light that spreads to each pixel of the line from the pixels beside the line.
    fn gathered_across(&self, image: &Image, light_of: impl Fn(u8) -> f64) -> Vec<f64> {
        let mut light = vec![0.0; self.line.len(image) as usize];
        let [of_rows, of_columns] = self.blur.taps();
        let taps = match self.line {
            PixelLine::Row(_) => of_columns,
            PixelLine::Column(_) => of_rows,
        };
        let reach = taps.len() as u32 - 1;
        match self.line {
            PixelLine::Row(at) => {
                let last = at.saturating_add(reach).min(image.height() - 1);
                for row in at.saturating_sub(reach)..=last {
                    let tap = taps[row.abs_diff(at) as usize];
                    for (start, end, level) in image.runs(row) {
                        let share = tap * light_of(level);
                        light[start as usize..end as usize].iter_mut().for_each(|to| *to += share);
                    }
                }
            }
            PixelLine::Column(at) => {
                let (first, end_of_band) =
                    (at.saturating_sub(reach), at.saturating_add(reach).saturating_add(1));
                for (row, light) in (0..image.height()).zip(&mut light) {
                    for (start, end, level) in image.runs(row) {
                        let columns = start.max(first)..end.min(end_of_band);
                        // A run has one level: its weights are added before they are multiplied.
                        let taps = columns.map(|column| taps[column.abs_diff(at) as usize]);
                        *light += taps.sum::<f64>() * light_of(level);
                    }
                }
            }
        }
        light
    }

    /// Spreads light along the line.
    fn spread_along(&self, light: &[f64]) -> Vec<f64> {
        if light.iter().all(|&light| light == 0.0) {
            return vec![0.0; light.len()];
        }
        let [of_rows, of_columns] = self.blur.taps();
        let taps = match self.line {
            PixelLine::Row(_) => of_rows,
            PixelLine::Column(_) => of_columns,
        };
        let at = |place: Option<usize>| place.and_then(|place| light.get(place)).unwrap_or(&0.0);
        let pair = |centre: usize, (distance, tap): (usize, &f64)| {
            tap * (at(centre.checked_sub(distance)) + at(Some(centre + distance)))
        };
        let sum = |centre: usize| {
            let sides = taps.iter().enumerate().skip(1).map(|tap| pair(centre, tap)).sum::<f64>();
            taps[0] * light[centre] + sides
        };
        (0..light.len()).map(sum).collect()
    }

    /// Calls `each` with every layer's number and the doses at the pixels of the line, in units of
    /// the critical dose, from the last layer down. The pixels are the pixels of the widest image.
    pub fn for_each_layer(&self, mut each: impl FnMut(usize, &[f64])) {
        let from_top: Vec<_> = self.layers.iter().rev().map(|layer| layer.exposed).collect();
        let ends = self.layers.iter().filter_map(|layer| layer.spread.last());
        let pixels = ends.map(|&(end, _)| end).max().unwrap_or(0);
        let mut doses = vec![0.0; pixels as usize];
        let lights = self.light.layers(self.pitch, &from_top);
        for ((number, layer), light) in self.layers.iter().enumerate().rev().zip(lights) {
            // 001 eq. 5 from the light down: the light passed from all layers above fades together.
            doses.iter_mut().for_each(|dose| *dose *= light.passed);
            let mut start = 0;
            for &(end, spread) in &layer.spread {
                let own = light.own * spread;
                doses[start..end as usize].iter_mut().for_each(|dose| *dose += own);
                start = end as usize;
            }
            each(number, &doses);
        }
    }

    /// Returns the heights at which each pixel of the line is cured: a layer is cured where its
    /// dose is the critical one or more.
    pub fn cured(&self) -> Vec<SolidHeights> {
        let mut cured = Vec::new();
        self.for_each_layer(|number, doses| {
            let ExposedLayer { bottom, exposed, .. } = self.layers[number];
            let [from, to] = [bottom.um(), bottom.um() + exposed.thickness.um()];
            cured.resize(doses.len(), SolidHeights::new());
            for (solid, _) in cured.iter_mut().zip(doses).filter(|(_, dose)| **dose >= 1.0) {
                add_below(solid, [from, to]);
            }
        });
        cured.iter_mut().for_each(|solid| solid.reverse());
        cured
    }

    /// Returns the heights at which each pixel of the line is cured, wherever in a layer the dose
    /// is the critical one or more. Doses must be computed at the layers' tops.
    ///
    /// # Panics
    /// Panics if they are computed elsewhere.
    pub fn cured_by_height(&self) -> Vec<SolidHeights> {
        assert_eq!(self.light.at, SampleHeight::Top, "doses are at the tops");
        let depth_um = self.light.penetration_depth.um();
        let mut cured = Vec::new();
        self.for_each_layer(|number, doses| {
            let ExposedLayer { bottom, exposed, .. } = self.layers[number];
            let thick_um = exposed.thickness.um();
            let top_um = bottom.um() + thick_um;
            cured.resize(doses.len(), SolidHeights::new());
            for (solid, dose) in cured.iter_mut().zip(doses).filter(|(_, dose)| **dose > 1.0) {
                // 002 eq. 30 for the sum of doses, which all fade over one depth; below the layer,
                // the next one continues.
                let from = top_um - (depth_um * dose.ln()).min(thick_um);
                add_below(solid, [from, top_um]);
            }
        });
        cured.iter_mut().for_each(|solid| solid.reverse());
        cured
    }
}

/// Returns the ends of stretches of equal numbers, and the numbers.
fn stretches(numbers: &[f64]) -> Vec<(u32, f64)> {
    let mut end = 0;
    let stretch = |equal: &[f64]| {
        end += equal.len() as u32;
        (end, equal[0])
    };
    numbers.chunk_by(|a, b| a == b).map(stretch).collect()
}

#[cfg(test)]
mod tests {
    use lamp_grayscale::resin::{Dose, ExposureTime, Intensity};
    use lamp_stack::{Dpi, GrayMask, Mask};

    use super::*;
    use crate::light::IntensityOf;

    fn light(spread_um: f64, at: SampleHeight) -> Light {
        Light {
            intensity: Intensity::from_mw_per_cm2(10.0),
            intensity_of: IntensityOf::Field,
            critical_dose: Dose::from_mj_per_cm2(8.0),
            penetration_depth: Length::from_um(300.0),
            spread: [Length::from_um(spread_um); 2],
            gamma: 2.0,
            at,
        }
    }

    fn layer(um: f64, ms: f64) -> LayerTime {
        LayerTime { thickness: Length::from_um(um), time: ExposureTime::from_ms(ms) }
    }

    /// Pixels of 10 um.
    fn dpi() -> Dpi {
        Dpi::new(2540.0).unwrap()
    }

    fn doses(section: &DoseSection) -> Vec<Vec<f64>> {
        let mut doses = Vec::new();
        section.for_each_layer(|_, of_layer| doses.push(of_layer.to_vec()));
        doses.reverse();
        doses
    }

    #[test]
    fn a_wide_prism_gathers_a_geometric_series() {
        let mut section =
            DoseSection::new(light(20.0, SampleHeight::Top), PixelLine::Row(30), dpi());
        let white = Image::Mask(Mask::black(61, 61).inverted());
        for number in 0..20 {
            let bottom = Length::from_um(50.0 * f64::from(number));
            section.expose(&white, bottom, layer(50.0, 100.0), |_| 1.0);
        }
        let q = (-50.0_f64 / 300.0).exp();
        for (number, doses) in doses(&section).iter().enumerate() {
            // 10 mW/cm² for 100 ms of 8 mJ/cm², and the light passed from all layers above.
            let exact = 0.125 * (1.0 - q.powi(20 - number as i32)) / (1.0 - q);
            assert!((doses[30] - exact).abs() < 1e-6, "{number}");
        }
        // In the long run 0.8142: nothing cures.
        assert!(section.cured().iter().all(Vec::is_empty));
    }

    /// The standard normal distribution.
    fn phi(x: f64) -> f64 {
        let mut term = x;
        let mut sum = 0.0;
        for n in 0..200 {
            sum += term / f64::from(2 * n + 1);
            term *= -x * x / 2.0 / f64::from(n + 1);
        }
        0.5 + sum / std::f64::consts::TAU.sqrt()
    }

    #[test]
    fn light_at_a_straight_edge_is_an_error_function() {
        // White from column 100 on, σ of 13 pixels.
        let mask = Mask::new(200, (0..=200).collect(), vec![100; 200]).unwrap();
        for line in [PixelLine::Row(100), PixelLine::Column(90)] {
            let mut section = DoseSection::new(light(130.0, SampleHeight::Top), line, dpi());
            section.expose(
                &Image::Mask(mask.clone()),
                Length::default(),
                layer(10.0, 800.0),
                |_| 1.0,
            );
            let doses = &doses(&section)[0];
            let places: &[usize] =
                if line == PixelLine::Row(100) { &[70, 90, 99, 100, 120] } else { &[100] };
            for &place in places {
                let column = if line == PixelLine::Row(100) { place } else { 90 };
                let exact = phi((column as f64 + 0.5 - 100.0) / 13.0);
                assert!((doses[place] - exact).abs() < 1e-4, "{line:?} {place}: {}", doses[place]);
            }
        }
    }

    const SIZE: [usize; 2] = [13, 9];

    fn level(layer: usize, row: usize, column: usize) -> u8 {
        match (layer * 31 + row * 7 + column * 3) % 5 {
            0 | 1 => 0,
            2 => 255,
            other => (60 * other + layer) as u8,
        }
    }

    fn image(layer: usize) -> Image {
        let mut gray = GrayMask::new(SIZE[0] as u32);
        for row in 0..SIZE[1] {
            gray.push_runs((0..SIZE[0]).map(|column| (1, level(layer, row, column)))).unwrap();
        }
        Image::Gray(gray)
    }

    /// Returns the light that a layer brings to a place in it, without fading over depth.
    fn spread_to([row, column]: [usize; 2], layer: usize, light: &Light) -> f64 {
        let pixels = (0..SIZE[1]).flat_map(|r| (0..SIZE[0]).map(move |c| [r, c]));
        let share = |[r, c]: [usize; 2]| {
            let away = [c.abs_diff(column), r.abs_diff(row)].map(|pixels| 10.0 * pixels as f64);
            let weight =
                |axis: usize| (-0.5 * (away[axis] / light.spread[axis].um()).powi(2)).exp();
            light.of_level(level(layer, r, c)) * weight(0) * weight(1)
        };
        pixels.map(share).sum::<f64>() / Blur::<f64>::of_scan([1.7, 2.6]).sum()
    }

    #[test]
    fn every_dose_is_the_sum_over_all_pixels_of_all_layers() {
        let layers = [layer(30.0, 500.0), layer(50.0, 700.0), layer(20.0, 900.0)];
        let tops = [30.0, 80.0, 100.0];
        for (at, below_top) in SampleHeight::ALL.into_iter().zip([0.0, 0.5, 1.0]) {
            let spread = [17.0, 26.0].map(Length::from_um);
            let light = Light { spread, ..light(17.0, at) };
            for line in [PixelLine::Row(4), PixelLine::Column(12)] {
                let mut section = DoseSection::new(light, line, dpi());
                for (number, exposed) in layers.iter().enumerate() {
                    let bottom = Length::from_um(tops[number] - exposed.thickness.um());
                    section.expose(&image(number), bottom, *exposed, |level| light.of_level(level));
                }
                for (number, doses) in doses(&section).iter().enumerate() {
                    let told_um = tops[number] - below_top * layers[number].thickness.um();
                    for (place, &dose) in doses.iter().enumerate() {
                        let pixel = match line {
                            PixelLine::Row(row) => [row as usize, place],
                            PixelLine::Column(column) => [place, column as usize],
                        };
                        let above =
                            layers.iter().enumerate().skip(number).map(|(above, exposed)| {
                                let faded = ((told_um - tops[above]) / 300.0).exp();
                                let full = 10.0 * exposed.time.ms() / 1000.0 / 8.0;
                                full * faded * spread_to(pixel, above, &light)
                            });
                        let exact: f64 = above.sum();
                        assert!((dose - exact).abs() < 2e-5, "{at} {line:?} {number} {place}");
                    }
                }
            }
        }
    }

    #[test]
    fn cured_layers_grow_together() {
        let mut section = DoseSection::new(light(0.0, SampleHeight::Top), PixelLine::Row(0), dpi());
        let image = |columns: Vec<u32>| {
            Image::Mask(Mask::new(4, vec![0, columns.len() as u32], columns).unwrap())
        };
        // Pixels 1 and 2; then 2; then none; then 0.
        let images = [vec![1, 3], vec![2, 3], vec![], vec![0, 1]];
        for (number, columns) in (0..4).zip(images) {
            let bottom = Length::from_um(100.0 * f64::from(number));
            section.expose(&image(columns), bottom, layer(100.0, 900.0), |_| 1.0);
        }
        // 1.125 critical doses cure a layer, and 0.8061 are left of them in the one below.
        let expected: [&[[f64; 2]]; 4] = [&[[300.0, 400.0]], &[[0.0, 100.0]], &[[0.0, 200.0]], &[]];
        assert_eq!(section.cured(), expected);
    }

    #[test]
    fn heights_are_where_the_dose_is_critical() {
        let light = light(0.0, SampleHeight::Top);
        let mut section = DoseSection::new(light, PixelLine::Row(0), dpi());
        let image = |white: bool| {
            let changes = if white { vec![0] } else { Vec::new() };
            Image::Mask(Mask::new(1, vec![0, changes.len() as u32], changes).unwrap())
        };
        let exposures = [false, true, false, true, true];
        for (number, white) in (0..5).zip(exposures) {
            let bottom = Length::from_um(100.0 * f64::from(number));
            section.expose(&image(white), bottom, layer(100.0, 700.0), |_| 1.0);
        }
        let solid = &section.cured_by_height()[0];
        let dose = |z_um: f64| {
            let tops = (0..5).filter(|&k| exposures[k]).map(|k| 100.0 * (k as f64 + 1.0));
            let above = tops.filter(|top| *top >= z_um);
            above.map(|top| 0.875 * ((z_um - top) / 300.0).exp()).sum::<f64>()
        };
        for step in 0..5000 {
            let z_um = 0.1 * f64::from(step) + 0.05;
            let is_cured = solid.iter().any(|[from, to]| (*from..*to).contains(&z_um));
            assert_eq!(is_cured, dose(z_um) >= 1.0, "{z_um}: {solid:?}");
        }
    }

    #[test]
    fn memory_grows_with_changes_of_the_light() {
        let mut section =
            DoseSection::new(light(20.0, SampleHeight::Top), PixelLine::Row(50), dpi());
        let mask =
            Mask::new(10_000, (0..=100).map(|row| 2 * row).collect(), [2_000, 8_000].repeat(100))
                .unwrap();
        section.expose(&Image::Mask(mask), Length::default(), layer(10.0, 100.0), |_| 1.0);
        let stretches = section.layers[0].spread.len();
        assert!(stretches < 60, "{stretches}");
    }
}
