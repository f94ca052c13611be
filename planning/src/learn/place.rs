//! The sizes that a print has at named places, by the doses of pixels.

use std::ops::Range;

use lamp_stack::Length;
use thiserror::Error;

use crate::cure_section::{Place, Shape};
use crate::light::{Light, SampleHeight};
use crate::speed::{TimedLayer, TimedPart};

/// The most columns of pixels of a place that a state is learned from: each has a dose in every layer,
/// for every light that is tried.
const MOST_COLUMNS: usize = 4096;

/// Why a place has no size.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PlaceError {
    /// It lies beside the images.
    #[error("it is outside the stack's images")]
    Outside,
    /// No layer is at its height.
    #[error("no layer is at a height of {0} mm")]
    NoLayer(f64),
    /// A box holds too many pixels.
    #[error("it has {0} columns of pixels, more than {MOST_COLUMNS}: make it smaller")]
    TooMany(usize),
}

/// The pixels of a place, and how their doses make its size.
#[derive(Clone, Debug)]
pub(crate) struct PlacePixels {
    /// In the order along a line.
    pixels: Vec<[u32; 2]>,
    of: SizeOf,
}

#[derive(Clone, Debug)]
enum SizeOf {
    /// The cured height in a range of heights.
    Column(Range<f64>),
    /// The cured length along pixels of this length, at a height, which is in a layer.
    Line { layer: usize, z_um: f64, pixel_um: f64 },
    /// The volume of columns of this area.
    Box { z_um: Range<f64>, pixel_mm2: f64 },
}

impl PlacePixels {
    /// Finds the pixels of a place in a part whose images have this top left corner.
    pub(crate) fn of(
        place: &Place,
        part: &TimedPart,
        corner_mm: [f64; 2],
    ) -> Result<Self, PlaceError> {
        let (size, pitch) = (part.size(), part.pitch().mm());
        // Rows count downward from the largest y.
        let along = |axis: usize, mm: f64| match axis {
            0 => (mm - corner_mm[0]) / pitch[0],
            _ => (corner_mm[1] - mm) / pitch[1],
        };
        let at = |axis: usize, length: &Length| {
            let pixel = along(axis, length.mm()).floor();
            let is_inside = (0.0..f64::from(size[axis])).contains(&pixel);
            is_inside.then_some(pixel as u32).ok_or(PlaceError::Outside)
        };
        // The pixels whose middles are in a range.
        let within = |axis: usize, range: &Range<f64>| {
            let (one, other) = (along(axis, range.start), along(axis, range.end));
            let [from, to] = [one.min(other), one.max(other)].map(|end| (end - 0.5).ceil());
            let pixel = |at: f64| at.clamp(0.0, f64::from(size[axis])) as u32;
            let pixels = pixel(from)..pixel(to);
            if pixels.is_empty() { Err(PlaceError::Outside) } else { Ok(pixels) }
        };
        let um = |range: &Range<f64>| 1000.0 * range.start..1000.0 * range.end;
        let line = |z: &Length, axis: usize| {
            let holds = |layer: &TimedLayer| {
                (layer.z.um()..layer.z.um() + layer.thickness.um()).contains(&z.um())
            };
            let layer = part.layers().iter().position(holds);
            let layer = layer.ok_or(PlaceError::NoLayer(z.mm()))?;
            Ok(SizeOf::Line { layer, z_um: z.um(), pixel_um: 1000.0 * pitch[axis] })
        };
        let (pixels, of): (Vec<[u32; 2]>, _) = match &place.shape {
            Shape::Column { x, y, z } => (vec![[at(0, x)?, at(1, y)?]], SizeOf::Column(um(z))),
            Shape::AlongX { y, z, x } => {
                let row = at(1, y)?;
                (within(0, x)?.map(|column| [column, row]).collect(), line(z, 0)?)
            }
            Shape::AlongY { x, z, y } => {
                let column = at(0, x)?;
                (within(1, y)?.map(|row| [column, row]).collect(), line(z, 1)?)
            }
            Shape::Box { x, y, z } => {
                let (columns, rows) = (within(0, x)?, within(1, y)?);
                let count = columns.len() * rows.len();
                if count > MOST_COLUMNS {
                    return Err(PlaceError::TooMany(count));
                }
                let of_row = |row: u32| columns.clone().map(move |column| [column, row]);
                let of = SizeOf::Box { z_um: um(z), pixel_mm2: pitch[0] * pitch[1] };
                (rows.flat_map(of_row).collect(), of)
            }
        };
        Ok(Self { pixels, of })
    }

    pub(crate) fn pixels(&self) -> &[[u32; 2]] {
        &self.pixels
    }

    /// Returns the size that the part has, in micrometers or mm³.
    pub(crate) fn wanted(&self, part: &TimedPart) -> f64 {
        let solid = |number: usize, at: usize| {
            let layer = &part.layers()[at];
            let is_wanted = part.is_wanted(at, self.pixels[number]);
            if is_wanted { layer.z.um() } else { f64::INFINITY }
        };
        // Twice the critical dose inside: edges are then halfway between pixels.
        let is_solid = |number: usize, layer: usize, _: f64| {
            2.0 * f64::from(u8::from(part.is_wanted(layer, self.pixels[number])))
        };
        self.size_by(part, solid, is_solid)
    }

    /// Returns the size that is cured, in micrometers or mm³, where all doses are larger by a factor with
    /// this logarithm. `doses` are the logarithms of the doses of each pixel in each layer.
    pub(crate) fn size(
        &self,
        part: &TimedPart,
        light: &Light,
        doses: &[Vec<f64>],
        more: f64,
    ) -> f64 {
        let depth_um = light.penetration_depth.um();
        let above = match light.at {
            SampleHeight::Top => 1.0,
            SampleHeight::Middle => 0.5,
            SampleHeight::Bottom => 0.0,
        };
        let sampled_um = |layer: &TimedLayer| layer.z.um() + above * layer.thickness.um();
        let down_to = |number: usize, at: usize| {
            sampled_um(&part.layers()[at]) - depth_um * (doses[number][at] + more)
        };
        let dose = |number: usize, at: usize, z_um: f64| {
            let down_um = sampled_um(&part.layers()[at]) - z_um;
            (doses[number][at] + more - down_um / depth_um).exp()
        };
        self.size_by(part, down_to, dose)
    }

    /// Returns the size, given the height down to which a pixel of a layer is cured, from its top, and the
    /// dose of a pixel of a layer at a height.
    fn size_by(
        &self,
        part: &TimedPart,
        down_to: impl Fn(usize, usize) -> f64,
        dose: impl Fn(usize, usize, f64) -> f64,
    ) -> f64 {
        let cured_um = |number: usize, z_um: &Range<f64>| -> f64 {
            let of_layer = |(at, layer): (usize, &TimedLayer)| {
                let bottom_um = layer.z.um().max(z_um.start);
                let top_um = (layer.z.um() + layer.thickness.um()).min(z_um.end);
                (top_um - down_to(number, at).max(bottom_um)).max(0.0)
            };
            part.layers().iter().enumerate().map(of_layer).sum()
        };
        match &self.of {
            SizeOf::Column(z_um) => cured_um(0, z_um),
            SizeOf::Box { z_um, pixel_mm2 } => {
                let sum_um: f64 = (0..self.pixels.len()).map(|number| cured_um(number, z_um)).sum();
                sum_um / 1000.0 * pixel_mm2
            }
            SizeOf::Line { layer, z_um, pixel_um } => {
                let doses = (0..self.pixels.len()).map(|number| dose(number, *layer, *z_um));
                pixel_um * cured_pixels(&doses.collect::<Vec<_>>())
            }
        }
    }
}

/// Returns the length along a line of pixels, in pixels, where the dose is 1 or more. Between the middles
/// of pixels the dose is interpolated.
fn cured_pixels(doses: &[f64]) -> f64 {
    let is_cured = |dose: &f64| *dose >= 1.0;
    let ends = [doses.first(), doses.last()].into_iter().flatten();
    let outer = ends.filter(|dose| is_cured(dose)).count() as f64 / 2.0;
    let between = |pair: &[f64]| {
        let (low, high) = (pair[0].min(pair[1]), pair[0].max(pair[1]));
        match (is_cured(&low), is_cured(&high)) {
            (true, _) => 1.0,
            (false, true) => (high - 1.0) / (high - low),
            (false, false) => 0.0,
        }
    };
    outer + doses.windows(2).map(between).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::cavity_staircase;
    use lamp_grayscale::material::Material;
    use lamp_grayscale::resin::ExposureTime;
    use lamp_stack::Catalogued;

    use super::*;
    use crate::cure_section::{CureRule, CuredPlaces, Places};
    use crate::speed::Simulation;
    use crate::speed::testing::{part, pegda};

    /// Places on the staircase, whose images begin at (0, 3) mm.
    const PLACES: &str = "
        place = [
            { name = 'step', x = '4.55mm', y = '1.55mm' },
            { name = 'roof', x = '2.05mm', y = '1.55mm', z = ['0mm', '3.333mm'] },
            { name = 'wide', y = '1.55mm', z = '1.03mm' },
            { name = 'half', x = ['2mm', '9mm'], y = '1.55mm', z = '1.03mm' },
            { name = 'deep', x = '2.05mm', z = '5.01mm' },
            { name = 'all' },
            { name = 'corner', x = ['0.2mm', '1mm'], y = ['0.7mm', '1.3mm'], z = ['0.25mm', '2.5mm'] },
        ]";

    /// The sizes that `lamp cure` finds by sections, whose pixels count whole along lines.
    fn sections(light: &Light, seconds: f64) -> Vec<f64> {
        let voxels = cavity_staircase(1);
        let material = Material::builtin("pegda-sudan").unwrap();
        let resin = material.resin().unwrap();
        let places = Places::parse(PLACES).unwrap();
        let mut cured = None;
        for mut layer in voxels.layers() {
            layer.info.origin_mm = Some([0.0, 3.0]);
            layer.info.exposure_ms = Some(ExposureTime::from_ms(1000.0 * seconds).ms());
            let cured = cured.get_or_insert_with(|| {
                CuredPlaces::new(&places, &resin, CureRule::Spread(*light), &layer).unwrap()
            });
            cured.add(&layer).unwrap();
        }
        let sizes = cured.unwrap().sizes();
        sizes.into_iter().map(|(_, sizes)| sizes[0].1.number()).collect()
    }

    #[test]
    fn sizes_are_those_of_sections() {
        let part = part(&cavity_staircase(1));
        let light = pegda(130.0);
        for seconds in [0.1, 0.25, 0.6] {
            let simulation = Simulation::new(&part, &light, 1 << 30).unwrap();
            let times = vec![seconds; part.layers().len()];
            let places = Places::parse(PLACES).unwrap();
            for (place, expected) in places.all().iter().zip(sections(&light, seconds)) {
                let pixels = PlacePixels::of(place, &part, [0.0, 3.0]).unwrap();
                let doses: Vec<_> = pixels
                    .pixels()
                    .iter()
                    .map(|pixel| simulation.doses_at(*pixel, &times))
                    .map(|doses| doses.into_iter().map(f64::ln).collect())
                    .collect();
                let found = pixels.size(&part, &light, &doses, 0.0);
                // Half a pixel at each end of a line.
                let is_line = matches!(pixels.of, SizeOf::Line { .. });
                let close = if is_line { 100.0 } else { 1e-4 * expected + 0.01 };
                let name = &place.name;
                assert!((found - expected).abs() <= close, "{name} {seconds}: {found} {expected}");
                // Twice the times and half the doses are the same.
                let twice: Vec<Vec<f64>> = doses
                    .iter()
                    .map(|doses| doses.iter().map(|dose| dose - 0.7).collect())
                    .collect();
                let same = pixels.size(&part, &light, &twice, 0.7);
                assert!((same - found).abs() < 1e-9 * found.max(1.0), "{name} {same} {found}");
            }
        }
    }

    #[test]
    fn lines_end_between_pixels() {
        // The edge of a wide field: half the light at its edge.
        assert!((cured_pixels(&[3.0, 2.0, 0.0, 0.0]) - 2.0).abs() < 1e-12);
        assert!((cured_pixels(&[0.9, 1.1, 0.7]) - (0.5 + 0.25)).abs() < 1e-12);
        assert_eq!((cured_pixels(&[5.0; 4]), cured_pixels(&[0.5; 4])), (4.0, 0.0));
        assert_eq!((cured_pixels(&[1.0]), cured_pixels(&[])), (1.0, 0.0));
    }

    #[test]
    fn the_part_has_sizes_of_its_own() {
        let part = part(&cavity_staircase(1));
        let places = Places::parse(PLACES).unwrap();
        let wanted = |name: &str| {
            let place = places.all().iter().find(|place| place.name == name).unwrap();
            PlacePixels::of(place, &part, [0.0, 3.0]).unwrap().wanted(&part)
        };
        let voxels = (0..part.layers().len()).map(|layer| part.wanted_px(layer)).sum::<u64>();
        let thickness_mm = part.layers()[0].thickness.mm();
        assert!((wanted("all") / (voxels as f64 * 0.01 * thickness_mm) - 1.0).abs() < 1e-9);
        let column = (0..part.layers().len()).filter(|at| part.is_wanted(*at, [45, 14])).count();
        assert!((wanted("step") - 1000.0 * thickness_mm * column as f64).abs() < 1e-6);
        let row = (20..part.size()[0]).filter(|column| {
            let holds =
                |layer: &TimedLayer| layer.z.mm() <= 1.03 && 1.03 < layer.z.mm() + thickness_mm;
            let at = part.layers().iter().position(holds).unwrap();
            part.is_wanted(at, [*column, 14])
        });
        assert!((wanted("half") - 100.0 * row.count() as f64).abs() < 1e-6);
        for (text, problem) in [
            ("x = '9mm'\ny = '1mm'", PlaceError::Outside),
            ("x = '1mm'\nz = '99mm'", PlaceError::NoLayer(99.0)),
            ("y = ['1.51mm', '1.52mm']", PlaceError::Outside),
        ] {
            let places = Places::parse(&format!("[[place]]\nname = 'p'\n{text}")).unwrap();
            let refused = PlacePixels::of(&places.all()[0], &part, [0.0, 3.0]).unwrap_err();
            assert_eq!(refused, problem, "{text}");
        }
    }
}
