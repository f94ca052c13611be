//! A print of a job, and the measurements that a person takes of it.

use lamp_grayscale::material::Material;
use lamp_stack::{Layer, Length, Mask, PageInfo, StackInfo, to_nm};
use rayon::prelude::*;

use super::error::PrintSimError;
use super::faces::{FacePlace, random_places};
use super::field::TrueField;
use super::truth::Truth;
use crate::cure_section::Places;
use crate::learn::{
    AreaRow, HeightRow, Job, PlacePixels, PrintMeasurements, height_of, sd_of_place,
};
use crate::light::Light;
use crate::numeric::Random;
use crate::speed::{Simulation, Tally, TimedLayer};

/// Places are chosen by the seed alone, so that each print is measured at the same ones. Prints have the
/// sequences of random numbers from 0 on.
const PLACES: u64 = u64::MAX;

/// Sizes of places begin at this sequence of random numbers: other measurements have one for each print,
/// from 0 on.
const SIZES: u64 = 1 << 32;

/// A print of a job on a machine whose light and resin are known.
pub struct SimulatedPrint<'a> {
    job: &'a Job,
    number: usize,
    light: Light,
    simulation: Simulation<'a>,
    tally: Tally,
}

/// Heights that were measured.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedHeights {
    /// The heights, as a table has them.
    pub measured: PrintMeasurements,
    /// The number of places where nothing is cured, so that there is nothing to measure.
    pub uncured: usize,
}

/// The body that is printed: its layers, bottom first.
pub type CuredBody = Vec<Layer>;

impl<'a> SimulatedPrint<'a> {
    /// Prints a job with the times of one of its prints. `material` is the material that the truth
    /// changes, `field` the machine's light, if it is not even.
    ///
    /// # Errors
    /// Returns an error if the material has no light for doses, if the truth is impossible, or if the
    /// field cannot be the light of this part.
    ///
    /// # Panics
    /// Panics if the job has no such print.
    pub fn new(
        job: &'a Job,
        number: usize,
        material: &Material,
        truth: &Truth,
        field: Option<&TrueField>,
        memory: u64,
    ) -> Result<Self, PrintSimError> {
        truth.check_doses()?;
        let of_material = Light::of(material, job.light.at)?;
        let light = truth.light(&of_material, number).map_err(PrintSimError::Truth)?;
        let simulation = match field {
            Some(field) => {
                // The numbers are checked before the light of pixels is computed.
                light.check_spread(job.part.pitch()).map_err(PrintSimError::Truth)?;
                let field = field.on(&job.part, &light)?;
                Simulation::in_field(&job.part, &light, field, memory)?
            }
            None => Simulation::new(&job.part, &light, memory)?,
        };
        let [tally] = simulation.tally([&job.prints[number].times]);
        Ok(Self { job, number, light, simulation, tally })
    }

    /// Returns the true light of this print.
    pub fn light(&self) -> &Light {
        &self.light
    }

    /// Returns the exact counts.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    /// Counts the wrong pixels of each layer, bottom first. `noise` is the standard deviation of a
    /// count, as a share of it.
    pub fn areas(&self, noise: f64, seed: u64) -> PrintMeasurements {
        let mut random = Random::sequence(seed, self.number as u64);
        let mut counted = |count: u64| {
            let off = if noise > 0.0 { noise * random.normal() } else { 0.0 };
            (count as f64 * (1.0 + off)).round().max(0.0)
        };
        let layers = self.job.part.layers().iter().zip(&self.tally.layers).zip(&self.tally.wanted);
        let rows = layers.rev().enumerate().map(|(number, ((layer, wrong), wanted))| AreaRow {
            line: number + 2,
            layer: layer.index,
            over: counted(wrong.over),
            // Nobody counts more uncured pixels than the layer has.
            under: counted(wrong.under).min(*wanted as f64),
        });
        PrintMeasurements::Areas(rows.collect())
    }

    /// Measures heights at `count` places on the faces that look down on resin, or at all of their
    /// pixels if these are fewer. A seed has the same places in every print.
    ///
    /// # Errors
    /// Returns an error if the job's stack does not state its position, if `sd` is not above zero,
    /// or if there is nothing to measure.
    pub fn heights(
        &self,
        count: usize,
        sd: Length,
        seed: u64,
    ) -> Result<SimulatedHeights, PrintSimError> {
        let corner = self.job.origin_mm().ok_or(PrintSimError::NoPosition)?;
        if !(sd.um() > 0.0 && sd.um().is_finite()) {
            return Err(PrintSimError::Deviation(sd));
        }
        let part = &self.job.part;
        let places = random_places(part, count, &mut Random::sequence(seed, PLACES));
        if places.is_empty() {
            return Err(PrintSimError::NoFace);
        }
        let times = &self.job.prints[self.number].times;
        let height = |place: &FacePlace| {
            let doses = self.simulation.doses_at(place.pixel, times);
            height_of(part, &doses, &self.light, place.layer)
        };
        let heights: Vec<_> = places.par_iter().map(height).collect();
        let mut random = Random::sequence(seed, self.number as u64);
        let pitch = part.pitch().mm();
        let mut rows = Vec::new();
        for (place, height) in places.iter().zip(heights) {
            // Each place has its own noise, whatever is cured at the others.
            let off_um = sd.um() * random.normal();
            let Some(height) = height else { continue };
            let [x, y] = place.pixel.map(|pixel| f64::from(pixel) + 0.5);
            rows.push(HeightRow {
                line: rows.len() + 2,
                // Images count rows downward from their top left corner.
                place_mm: [corner[0] + x * pitch[0], corner[1] - y * pitch[1]].map(to_nm),
                z_mm: to_nm(part.layers()[place.layer].z.mm()),
                measured_mm: to_nm((height.um() + off_um) / 1000.0),
                sd_um: sd.um(),
            });
        }
        let uncured = places.len() - rows.len();
        if rows.is_empty() {
            return Err(PrintSimError::Uncured { places: uncured });
        }
        Ok(SimulatedHeights { measured: PrintMeasurements::Heights(rows), uncured })
    }

    /// Measures the sizes of places. `sd` is the standard deviation of lengths whose place states none.
    /// Wanted sizes that are not stated are the part's, as it was sliced.
    ///
    /// # Errors
    /// Returns an error if the job's stack does not state its position, if `sd` is not above zero, or if a
    /// place has no size.
    pub fn sizes(
        &self,
        places: &Places,
        sd: Option<Length>,
        seed: u64,
    ) -> Result<PrintMeasurements, PrintSimError> {
        let corner = self.job.origin_mm().ok_or(PrintSimError::NoPosition)?;
        if let Some(sd) = sd.filter(|sd| !(sd.um() > 0.0 && sd.um().is_finite())) {
            return Err(PrintSimError::Deviation(sd));
        }
        if places.all().is_empty() {
            return Err(PrintSimError::NoPlaces);
        }
        let (part, times) = (&self.job.part, &self.job.prints[self.number].times);
        let mut random = Random::sequence(seed, SIZES + self.number as u64);
        let mut measured = Vec::new();
        for place in places.all() {
            let beside = |problem| PrintSimError::Place { name: place.name.clone(), problem };
            let pixels = PlacePixels::of(place, part, corner).map_err(beside)?;
            let doses: Vec<Vec<f64>> = pixels
                .pixels()
                .par_iter()
                .map(|pixel| self.simulation.doses_at(*pixel, times))
                .map(|doses| doses.into_iter().map(f64::ln).collect())
                .collect();
            let size = pixels.size(part, &self.light, &doses, 0.0);
            let mut place = place.clone();
            place.sd = place.sd.or(sd.and_then(|sd| place.length(sd.um())));
            let sd = sd_of_place(&place, size);
            place.sd = Some(place.rounded(sd));
            place.wanted = place.wanted.or(Some(place.rounded(pixels.wanted(part))));
            // Nothing is smaller than nothing.
            place.measured = Some(place.rounded((size + sd * random.normal()).max(0.0)));
            measured.push(place);
        }
        Ok(PrintMeasurements::Places { places: Places::of(measured), table: None })
    }

    /// Returns the body as it is cured: a stack of the part's layers, whose images reach as far
    /// beyond the part's images as light spreads. `command` is recorded as its origin.
    ///
    /// # Errors
    /// Returns an error if the job's stack does not state its position: nothing would say how far
    /// the images reach beyond the part's.
    pub fn body(&self, command: String) -> Result<CuredBody, PrintSimError> {
        let corner = self.job.origin_mm().ok_or(PrintSimError::NoPosition)?;
        let (images, reach) = self.simulation.cured(&self.job.prints[self.number].times);
        let [width, height] = self.job.part.pitch().mm().map(|side| side * reach as f64);
        let origin_mm = Some([corner[0] - width, corner[1] + height].map(to_nm));
        let page = |(layer, image): (&_, Mask)| {
            let TimedLayer { index, z, thickness, .. } = *layer;
            let [z_um, thickness_um] = [z, thickness].map(|it| Some(it.to_whole_nm().um()));
            let info = PageInfo { index, z_um, thickness_um, origin_mm, ..PageInfo::default() };
            Layer { info, pitch: Some(self.job.part.pitch()), image: image.into() }
        };
        let mut layers: Vec<_> =
            self.job.part.layers().iter().zip(images).rev().map(page).collect();
        if let Some(first) = layers.first_mut() {
            first.info.stack = Some(StackInfo {
                part: self.job.part_name().to_owned(),
                commands: vec![command],
                digest: self.job.digest().to_owned(),
                layers: Some(self.job.part.layers().len() as u32),
                ..StackInfo::default()
            });
        }
        Ok(layers)
    }
}

#[cfg(test)]
mod tests {
    use lamp_fixtures::{Voxels, cavity_staircase, square_prism};
    use lamp_stack::Catalogued;

    use super::*;
    use crate::learn::{Lesson, Method, PrintError, learn};
    use crate::print_sim::FieldKind;
    use crate::projector::FieldPicture;
    use crate::speed::Platform;
    use crate::speed::testing::{part, pegda};
    use crate::target::GrayPicture;

    const OFF: &str = "penetration-depth = '+25%'\ncritical-dose = '-15%'\nlight = '+10%'\n";

    fn job_of(voxels: &Voxels, seconds: f64) -> Job {
        let part = part(voxels);
        let platform = Platform { slowest: 5.0, fastest: 2000.0, max_change: None };
        let times = vec![seconds; part.layers().len()];
        let material = Material::builtin("pegda-sudan").unwrap();
        Job::of_part(part, pegda(50.0), material, &platform, times)
    }

    fn print<'a>(job: &'a Job, truth: &str) -> SimulatedPrint<'a> {
        let truth = Truth::parse(truth).unwrap();
        SimulatedPrint::new(job, 0, &job.material, &truth, None, 1 << 30).unwrap()
    }

    fn picture(columns: usize, levels: &[u16]) -> FieldPicture {
        let (rows, levels) = (levels.len() / columns, levels.to_vec());
        FieldPicture::of(&GrayPicture { columns, rows, levels }).unwrap()
    }

    fn print_in(job: &Job, kind: FieldKind, picture: FieldPicture) -> SimulatedPrint<'_> {
        let field = TrueField { kind, picture };
        SimulatedPrint::new(job, 0, &job.material, &Truth::default(), Some(&field), 1 << 30)
            .unwrap()
    }

    /// The cured pixels of a layer, the one nearest to the light first, with a rim of 20 pixels, given the
    /// light of each pixel of each layer before it spreads over `sigma` pixels: sums over all pixels.
    fn cured(job: &Job, lit: &dyn Fn(usize, [i64; 2]) -> f64, sigma: f64) -> Vec<Vec<bool>> {
        let [width, height] = job.part.size().map(i64::from);
        let layers = job.part.layers();
        let field: f64 = (-60_i64..=60).map(|at| (-0.5 * (at as f64 / sigma).powi(2)).exp()).sum();
        let weight = |away: i64| (-0.5 * (away as f64 / sigma).powi(2)).exp() / field;
        let mut doses = vec![0.0; ((width + 40) * (height + 40)) as usize];
        let mut all = Vec::new();
        for at in 0..layers.len() {
            let above_um = if at == 0 { 0.0 } else { layers[at - 1].thickness.um() };
            let passed = (-above_um / job.light.penetration_depth.um()).exp();
            let rate = job.light.intensity.mw_per_cm2() / job.light.critical_dose.mj_per_cm2();
            // Along rows, and then along columns.
            let across: Vec<f64> = (0..height)
                .flat_map(|row| (-20..width + 20).map(move |column| [column, row]))
                .map(|[column, row]| {
                    (0..width).map(|from| weight(from - column) * lit(at, [from, row])).sum()
                })
                .collect();
            let places = (-20..height + 20)
                .flat_map(|row| (-20..width + 20).map(move |column| [column, row]));
            for (dose, [column, row]) in doses.iter_mut().zip(places) {
                let line = |from: i64| across[(from * (width + 40) + column + 20) as usize];
                let light: f64 = (0..height).map(|from| weight(from - row) * line(from)).sum();
                *dose = *dose * passed + rate * job.prints[0].times[at] * light;
            }
            all.push(doses.iter().map(|dose| *dose >= 1.0).collect());
        }
        all
    }

    /// Checks counts, the body and doses of single pixels against cured pixels.
    #[track_caller]
    fn assert_cured(job: &Job, print: &SimulatedPrint<'_>, cured: &[Vec<bool>]) {
        let [width, height] = job.part.size();
        let (mut wrong, mut total) = (0, 0);
        let body = print.body(String::new()).unwrap();
        let reach = (body[0].image.width() - width) / 2;
        for (at, cured) in cured.iter().enumerate() {
            let (mut over, mut under) = (0, 0);
            let image = &body[body.len() - 1 - at].image;
            for (place, is_cured) in cured.iter().enumerate() {
                let [column, row] = [place as u32 % (width + 40), place as u32 / (width + 40)];
                let pixel = [column, row].map(|at| at.wrapping_sub(20));
                let is_wanted = job.part.is_wanted(at, pixel);
                over += u64::from(*is_cured && !is_wanted);
                under += u64::from(!*is_cured && is_wanted);
                let [x, y] = pixel.map(|at| at.wrapping_add(reach));
                let is_inside = x < image.width() && y < image.height();
                let is_body = is_inside && image.level(x, y) == 255;
                wrong += u64::from(is_body != *is_cured);
                if pixel[0] < width && pixel[1] < height && place % 97 == 0 {
                    let dose = print.simulation.doses_at(pixel, &job.prints[0].times)[at];
                    assert_eq!(dose >= 1.0, is_body, "{at} {pixel:?} {dose}");
                }
            }
            total += over + under;
            let counted = print.tally().layers[at];
            assert!(counted.over.abs_diff(over) + counted.under.abs_diff(under) <= 2, "{at}");
        }
        // Doses of the model have 24 bits.
        assert!(wrong <= 5 && total > 500, "{wrong} of {total} differ");
        assert_eq!((height + 40) * (width + 40), cured[0].len() as u32);
    }

    #[test]
    fn a_flat_field_is_the_light_of_pixels_before_it_spreads() {
        let job = job_of(&cavity_staircase(1), 0.25);
        let [width, height] = job.part.size().map(|count| count as usize);
        let levels: Vec<u16> = (0..width * height)
            .map(|at| 20_000 + ((at % width) * 700) as u16 + ((at * 7919) % 9000) as u16)
            .collect();
        let mean = levels.iter().map(|level| f64::from(*level)).sum::<f64>() / levels.len() as f64;
        let shown = print_in(&job, FieldKind::FlatField, picture(width, &levels));
        let share = |[column, row]: [i64; 2]| {
            f64::from(levels[row as usize * width + column as usize]) / mean
        };
        let lit = |at: usize, pixel: [i64; 2]| {
            let [column, row] = pixel.map(|at| at as u32);
            f64::from(u8::from(job.part.is_wanted(at, [column, row]))) * share(pixel)
        };
        assert_cured(&job, &shown, &cured(&job, &lit, 0.5));
        // An even picture of any size and level changes nothing.
        let even = print_in(&job, FieldKind::FlatField, picture(3, &[777; 6]));
        assert_eq!(even.tally(), print(&job, "").tally());
    }

    #[test]
    fn a_picture_of_a_layer_is_the_light_of_all() {
        let job = job_of(&square_prism(0), 0.25);
        let [width, height] = job.part.size().map(|count| count as usize);
        let lit = |at: usize, [column, row]: [i64; 2]| {
            f64::from(u8::from(job.part.is_wanted(at, [column as u32, row as u32])))
        };
        // A camera sees any light: here a hot spot beside a shade.
        let level = |at: usize| {
            let [x, y] = [at % width, at / width].map(|at| at as f64 / width as f64);
            let spot = (-((x - 0.3).powi(2) + (y - 0.4).powi(2)) / 0.02).exp();
            (12_000.0 + 30_000.0 * spot - 9_000.0 * x) as u16
        };
        let levels: Vec<u16> = (0..width * height).map(level).collect();
        let print = print_in(&job, FieldKind::Layer, picture(width, &levels));
        let sum: f64 = levels.iter().map(|level| f64::from(*level)).sum();
        let white: f64 =
            (0..width * height).map(|at| lit(0, [(at % width) as i64, (at / width) as i64])).sum();
        let times = &job.prints[0].times;
        for pixel in [[0, 0], [width / 3, height / 2], [width - 1, height - 1]] {
            // 004 A.1: the mean of the picture is the light that the power meter reads.
            let light = f64::from(levels[pixel[1] * width + pixel[0]]) * white / sum;
            let doses = print.simulation.doses_at(pixel.map(|at| at as u32), times);
            let mut expected = 0.0;
            for (dose, (layer, time)) in doses.iter().zip(job.part.layers().iter().zip(times)) {
                // All layers of the prism are equally thick (004 eq. 2.5).
                expected *= (-layer.thickness.um() / job.light.penetration_depth.um()).exp();
                expected += 7.394 / 7.266 * time * light;
                assert!((dose / expected - 1.0).abs() < 1e-5, "{pixel:?} {dose} {expected}");
            }
        }
        let wanted = print.tally().wanted.iter().sum::<u64>();
        assert_eq!(wanted, white as u64 * job.part.layers().len() as u64);
        let stairs = job_of(&cavity_staircase(1), 0.25);
        let field = TrueField { kind: FieldKind::Layer, picture: picture(1, &[1]) };
        let refused = SimulatedPrint::new(
            &stairs,
            0,
            &stairs.material,
            &Truth::default(),
            Some(&field),
            1 << 30,
        );
        assert_eq!(refused.err(), Some(PrintSimError::LayersDiffer));
    }

    #[test]
    fn a_table_of_counts_is_what_learning_reads() {
        let job = job_of(&cavity_staircase(1), 0.25);
        let exact = print(&job, OFF);
        let counts = exact.areas(0.0, 1);
        assert_eq!(PrintMeasurements::parse(&counts.to_text()).unwrap(), counts);
        assert_eq!(counts.error(), PrintError::Pixels(exact.tally().wrong().sum() as f64));
        let PrintMeasurements::Areas(rows) = &counts else { panic!("these are counts") };
        let lowest = exact.tally().layers.last().unwrap();
        assert_eq!((rows[0].layer, rows[0].over), (0, lowest.over as f64));
    }

    #[test]
    fn noise_is_by_seed_and_print() {
        let mut job = job_of(&cavity_staircase(1), 0.25);
        job.prints.push(job.prints[0].clone());
        let truth = Truth::parse(OFF).unwrap();
        let of = |number, seed| {
            let print =
                SimulatedPrint::new(&job, number, &job.material, &truth, None, 1 << 30).unwrap();
            print.areas(0.02, seed)
        };
        assert_eq!(of(0, 1), of(0, 1));
        assert!(of(0, 1) != of(0, 2) && of(0, 1) != of(1, 1));
        let (exact, noisy) = (print(&job, OFF).areas(0.0, 1), of(0, 1));
        let (PrintMeasurements::Areas(exact), PrintMeasurements::Areas(noisy)) = (&exact, &noisy)
        else {
            panic!("these are counts")
        };
        let off: Vec<_> = exact
            .iter()
            .zip(noisy)
            .filter(|(exact, _)| exact.over > 100.0)
            .map(|(exact, noisy)| noisy.over / exact.over - 1.0)
            .collect();
        assert!(off.len() > 20, "{}", off.len());
        let sd = (off.iter().map(|off| off * off).sum::<f64>() / off.len() as f64).sqrt();
        assert!((0.013..0.027).contains(&sd), "{sd}");
    }

    #[test]
    fn heights_lie_on_faces_within_their_noise() {
        let job = job_of(&cavity_staircase(1), 0.25);
        let print = print(&job, OFF);
        let of = |um: f64| print.heights(200, Length::from_um(um), 1).unwrap();
        let (exact, noisy) = (of(0.001), of(20.0));
        assert_eq!((exact.uncured, exact), (0, of(0.001)));
        let rows = |heights: SimulatedHeights| match heights.measured {
            PrintMeasurements::Heights(rows) => rows,
            _ => panic!("these are heights"),
        };
        let (exact, noisy) = (rows(of(0.001)), rows(noisy));
        assert_eq!(exact.len(), 200);
        let mut squares = 0.0;
        for (exact, noisy) in exact.iter().zip(&noisy) {
            assert_eq!((exact.place_mm, exact.z_mm), (noisy.place_mm, noisy.z_mm));
            squares += (1000.0 * (noisy.measured_mm - exact.measured_mm)).powi(2);
            let [x, y] = exact.place_mm;
            let pixel = [x / 0.1 - 0.5, -y / 0.1 - 0.5].map(|at| at.round() as u32);
            let face = crate::learn::face_at(&job.part, pixel, Length::from_mm(exact.z_mm));
            let doses = print.simulation.doses_at(pixel, &job.prints[0].times);
            let height = height_of(&job.part, &doses, &print.light, face.unwrap()).unwrap();
            assert!((height.mm() - exact.measured_mm).abs() < 6e-6, "{exact:?}");
        }
        let sd = (squares / 200.0).sqrt();
        assert!((17.0..23.0).contains(&sd), "{sd}");
        let table = PrintMeasurements::Heights(noisy);
        assert_eq!(PrintMeasurements::parse(&table.to_text()).unwrap(), table);
    }

    /// Lines and a box on the staircase, whose images begin at (0, 0) mm.
    const PLACES: &str = "
        place = [
            { name = 'roof', x = '2.05mm', y = '-1.55mm', z = ['0mm', '3.333mm'] },
            { name = 'step', x = '4.05mm', y = '-1.55mm' },
            { name = 'end', x = '3.55mm', y = '-1.55mm', sd = '4um' },
            { name = 'wide', y = '-1.55mm', z = '5.03mm' },
            { name = 'deep', x = '2.05mm', z = '5.01mm' },
            { name = 'corner', x = ['0.2mm', '1mm'], y = ['-1.3mm', '-0.2mm'], z = ['0mm', '2.5mm'] },
        ]";

    #[test]
    fn sizes_of_places_have_their_noise() {
        let job = job_of(&cavity_staircase(1), 0.25);
        let print = print(&job, OFF);
        let places = Places::parse(PLACES).unwrap();
        let of = |um: Option<f64>, seed: u64| {
            let sd = um.map(Length::from_um);
            let sizes = print.sizes(&places, sd, seed).unwrap();
            assert_eq!(PrintMeasurements::parse(&sizes.to_text()).unwrap(), sizes);
            let PrintMeasurements::Places { places, .. } = sizes else {
                panic!("these are places")
            };
            places.all().to_vec()
        };
        assert_eq!(of(Some(5.0), 1), of(Some(5.0), 1));
        let exact = of(Some(0.001), 1);
        let trials: Vec<_> = (0..400).map(|seed| of(None, seed)).collect();
        let deviation = |at: usize| {
            let sizes = || trials.iter().map(|places| places[at].measured.unwrap().number());
            let mean = sizes().sum::<f64>() / 400.0;
            (sizes().map(|size| (size - mean).powi(2)).sum::<f64>() / 400.0).sqrt()
        };
        let volume = exact[5].measured.unwrap().number();
        // The usual 20 um, what the file states, and 2 % of a volume.
        for (at, expected) in [(0, 20.0), (2, 4.0), (5, 0.02 * volume)] {
            let ratio = deviation(at) / expected;
            assert!((0.88..1.12).contains(&ratio), "{at}: {ratio}");
        }
        let beside = Places::parse("place = [{ name = 'p', x = '99mm', y = '0mm' }]").unwrap();
        let refused = print.sizes(&beside, None, 1).unwrap_err().to_string();
        assert_eq!(refused, "the place p: it is outside the stack's images");
        let none = Places::parse("place = []").unwrap();
        assert_eq!(print.sizes(&none, None, 1), Err(PrintSimError::NoPlaces));
    }

    #[test]
    fn sizes_of_places_teach_the_state() {
        let job = job_of(&cavity_staircase(1), 0.25);
        let print = print(&job, OFF);
        let places = Places::parse(PLACES).unwrap();
        let truth = [1.25, 1.1 / 0.85, 1.0];
        let learned = |measured: &PrintMeasurements| {
            let learned = learn(&job, 0, measured, Method::State, 1 << 28).unwrap();
            let Lesson::State(lesson) = learned.lesson else { panic!("this is a state") };
            lesson.after.factors()
        };
        let (mut held, trials) = ([0; 3], 4);
        let mut widths = [0.0; 3];
        for seed in 0..trials {
            let measured = print.sizes(&places, Some(Length::from_um(5.0)), seed).unwrap();
            let factors = learned(&measured);
            for (at, (factor, truth)) in factors.into_iter().zip(truth).enumerate() {
                let [low, high] = factor.interval();
                held[at] += usize::from((low..high).contains(&truth));
                widths[at] += factor.sd / trials as f64;
            }
        }
        // Of intervals that hold 95 %, fewer than 3 of 4 hold once in 70 tries.
        assert!(held.iter().all(|held| *held >= 3), "{held:?} {widths:?}");
        assert!(widths[0] < 0.05 && widths[1] < 0.1, "{widths:?}");
        // Sizes make the state that counts show surer. Three sizes that fit by chance look surer
        // alone, as the noise of all measurements is found in common.
        let measured = print.sizes(&places, Some(Length::from_um(5.0)), 1).unwrap();
        let counts = print.areas(0.02, 1);
        let text = PrintMeasurements::joined([&counts.to_text(), &measured.to_text()]).unwrap();
        let joint = PrintMeasurements::parse(&text).unwrap();
        assert_eq!(PrintMeasurements::parse(&joint.to_text()).unwrap(), joint);
        assert_eq!(joint.error(), counts.error());
        let sds = [&measured, &counts, &joint].map(|all| learned(all)[0].sd);
        assert!(sds[2] < sds[1] && sds[2] < 1.5 * sds[0], "{sds:?}");
    }

    #[test]
    fn a_part_without_undersides_has_no_heights() {
        let job = job_of(&square_prism(0), 0.25);
        let sd = Length::from_um(20.0);
        assert_eq!(print(&job, "").heights(9, sd, 1), Err(PrintSimError::NoFace));
        let dark = job_of(&cavity_staircase(1), 0.0001);
        let uncured = print(&dark, "").heights(9, sd, 1);
        assert_eq!(uncured, Err(PrintSimError::Uncured { places: 9 }));
        let none = print(&dark, "").heights(9, Length::default(), 1);
        assert_eq!(none, Err(PrintSimError::Deviation(Length::default())));
    }

    #[test]
    fn the_body_has_the_pixels_that_are_counted() {
        for spread in ["50um", "130um", "0um"] {
            let job = job_of(&cavity_staircase(1), 0.25);
            let print = print(&job, &format!("{OFF}spread = '{spread}'"));
            let body = print.body("lamp print-sim".to_owned()).unwrap();
            let [corner_x, corner_y] = body[0].info.origin_mm.unwrap();
            let reach = (-corner_x / 0.1).round() as u32;
            assert_eq!(((corner_y / 0.1).round() as u32, body.len()), (reach, 60));
            for (at, layer) in body.iter().rev().enumerate() {
                let (mut over, mut under) = (0, 0);
                let image = &layer.image;
                for row in 0..image.height() {
                    for column in 0..image.width() {
                        let pixel = [column, row].map(|at| at.wrapping_sub(reach));
                        let is_cured = image.level(column, row) == 255;
                        match (is_cured, job.part.is_wanted(at, pixel)) {
                            (true, false) => over += 1,
                            (false, true) => under += 1,
                            _ => {}
                        }
                    }
                }
                let counted = print.tally().layers[at];
                assert_eq!((over, under), (counted.over, counted.under), "{spread} {at}");
                assert_eq!(layer.info.index, job.part.layers()[at].index);
            }
        }
    }
}
