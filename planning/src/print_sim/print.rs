//! A print of a job, and the measurements that a person takes of it.

use lamp_grayscale::material::Material;
use lamp_stack::{Layer, Length, Mask, PageInfo, StackInfo, to_nm};
use rayon::prelude::*;

use super::error::PrintSimError;
use super::faces::{FacePlace, random_places};
use super::truth::Truth;
use crate::learn::{AreaRow, HeightRow, Job, PrintMeasurements, height_of};
use crate::light::Light;
use crate::numeric::Random;
use crate::speed::{Simulation, Tally, TimedLayer};

/// Places are chosen by the seed alone, so that each print is measured at the same ones. Prints have the
/// sequences of random numbers from 0 on.
const PLACES: u64 = u64::MAX;

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
    /// changes.
    ///
    /// # Errors
    /// Returns an error if the material has no light for doses, or the truth is impossible.
    ///
    /// # Panics
    /// Panics if the job has no such print.
    pub fn new(
        job: &'a Job,
        number: usize,
        material: &Material,
        truth: &Truth,
        memory: u64,
    ) -> Result<Self, PrintSimError> {
        truth.check_doses()?;
        let of_material = Light::of(material, job.light.at)?;
        let light = truth.light(&of_material, number).map_err(PrintSimError::Truth)?;
        let simulation = Simulation::new(&job.part, &light, memory)?;
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
    use crate::learn::PrintError;
    use crate::speed::Platform;
    use crate::speed::testing::{part, pegda};

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
        SimulatedPrint::new(job, 0, &job.material, &truth, 1 << 30).unwrap()
    }

    #[test]
    fn a_table_of_counts_is_what_learning_reads() {
        let job = job_of(&cavity_staircase(1), 0.25);
        let exact = print(&job, OFF);
        let counts = exact.areas(0.0, 1);
        assert_eq!(PrintMeasurements::parse(&counts.to_csv()).unwrap(), counts);
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
            let print = SimulatedPrint::new(&job, number, &job.material, &truth, 1 << 30).unwrap();
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
            PrintMeasurements::Areas(_) => panic!("these are heights"),
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
        assert_eq!(PrintMeasurements::parse(&table.to_csv()).unwrap(), table);
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
