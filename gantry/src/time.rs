//! How long a build takes on a machine.

use lamp_build::{FieldForm, FieldsError, Seam, Swaths, SwathsError};
use lamp_machine::Machine;
use lamp_stack::{Dpi, Image, PageInfo, Pitch, PrintRecord, PrintStep, StackInfo};

use crate::clock::RowClock;
use crate::error::GantryError;
use crate::job::{GrayBy, JobSeam, JobSums, Planner, rows_with_white};
use crate::mirrors::MirrorArray;
use crate::source::SwathLayout;

/// How long a build takes, as far as that is known.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildTime {
    /// The number of layers.
    pub layers: u64,
    /// The sum of all exposures in seconds, if every layer states one or the machine gives it.
    pub exposure_s: Option<f64>,
    /// The time for recoating in seconds, if the machine's is known.
    pub recoating_s: Option<f64>,
    /// The lifts, retractions and waits of a printer with a panel in seconds, if it states them for
    /// each layer.
    pub lifts_s: Option<f64>,
    /// The swaths of a projector that scans.
    pub swaths: Option<SwathTime>,
    /// The fields of a projector that steps.
    pub fields: Option<FieldTime>,
    /// Why the machine cannot expose the build, as a sentence.
    pub unscanned: Option<String>,
}

/// How long the swaths of a build take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwathTime {
    /// The number of swaths that are scanned, in all layers and passes.
    pub count: u64,
    /// The number of swaths that are left out, as they are black.
    pub black: u64,
    /// The time of these swaths, the moves between them, and waits for the head that recoating does
    /// not cover, in seconds.
    pub seconds: f64,
}

/// How long the fields of a build take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldTime {
    /// The number of fields that hold white, in all layers.
    pub count: u64,
    /// The number of fields that are left out, as they are black.
    pub black: u64,
    /// The exposures of these fields in seconds, if each layer's is known.
    pub exposure_s: Option<f64>,
    /// The steps between fields of a layer in seconds, if the machine's are known.
    pub steps_s: Option<f64>,
}

impl FieldTime {
    /// Returns the time of exposures and steps in seconds, if the exposures are known. Steps count if
    /// they are known.
    pub fn seconds(&self) -> Option<f64> {
        Some(self.exposure_s? + self.steps_s.unwrap_or(0.0))
    }
}

impl BuildTime {
    /// Returns the time of the build's light in seconds, if it is known. Swaths take their own time:
    /// the exposure of a place passes while a swath goes over it.
    fn light_s(&self) -> Option<f64> {
        if self.unscanned.is_some() {
            return None;
        }
        match (self.fields, self.swaths) {
            (Some(fields), _) => fields.seconds(),
            (None, Some(swaths)) => Some(swaths.seconds),
            (None, None) => self.exposure_s,
        }
    }

    /// Returns the time of the build in seconds, if the time of its light is known. Recoating and
    /// lifts count if they are known.
    pub fn sum_s(&self) -> Option<f64> {
        self.light_s().map(|_| self.least_s())
    }

    /// Returns the time that the build takes at least, in seconds: the sum of all that is known.
    pub fn least_s(&self) -> f64 {
        let between_s = self.recoating_s.unwrap_or(0.0) + self.lifts_s.unwrap_or(0.0);
        self.light_s().unwrap_or(0.0) + between_s
    }

    /// Returns whether nothing is missing of the time: light, the way between layers, and between the
    /// fields of a layer.
    pub fn is_whole(&self) -> bool {
        let is_between_known = self.recoating_s.is_some() || self.lifts_s.is_some();
        let has_steps = self.fields.is_none_or(|fields| fields.steps_s.is_some());
        self.light_s().is_some() && is_between_known && has_steps
    }
}

/// Times that are given in place of a machine's and a stack's own.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GivenTimes {
    /// The exposure of each layer in seconds, in place of its own.
    pub expose_s: Option<f64>,
    /// The seconds from the end of a layer's exposure to the start of the next one's.
    pub recoat_s: Option<f64>,
}

/// Adds up the time of a build on a machine, layer by layer.
///
/// A layer is recoated once. A printer with a panel lifts and comes back instead, as its stack's record
/// or the machine states. On a machine with `[scan]`, its swaths take the times that
/// [`Job::plan`](crate::Job::plan) finds, with a comb. On a machine with `[strips]` and a swath speed v,
/// it is exposed in n swaths of the images' height L, which take n L / v and n - 1 steps. Where a
/// layer is cut into fields, its n fields that hold white take n exposures and n - 1 steps.
#[derive(Debug)]
pub struct BuildClock {
    machine: Option<Machine>,
    given: GivenTimes,
    /// How a printer with a panel exposes: the machine, or the stack by its first page.
    print: Option<PrintRecord>,
    lifts_s: Option<f64>,
    mirrors: Option<MirrorArray>,
    layers: u64,
    exposure_ms: Option<f64>,
    /// How the head moves, once a layer has said how large pixels are.
    planner: Option<Planner>,
    sums: JobSums,
    /// Swaths of a machine without `[scan]`.
    steady: Option<SwathTime>,
    /// How layers are cut into fields, and the sums of these.
    form: Option<FieldForm>,
    fields: FieldSums,
    unscanned: Option<String>,
}

/// The sums of the fields of all layers.
#[derive(Debug, Default)]
struct FieldSums {
    count: u64,
    black: u64,
    steps: u64,
    /// None once a layer that holds white states no exposure.
    exposure_ms: Option<f64>,
}

impl BuildClock {
    /// Starts for a machine. `mirrors` are the mirrors of its `[scan]`; without them it does not scan.
    pub fn new(machine: Option<&Machine>, mirrors: Option<MirrorArray>) -> Self {
        Self {
            machine: machine.cloned(),
            given: GivenTimes::default(),
            print: machine.and_then(Machine::print_record),
            lifts_s: Some(0.0),
            mirrors,
            layers: 0,
            exposure_ms: Some(0.0),
            planner: None,
            sums: JobSums::default(),
            steady: None,
            form: machine.and_then(|machine| machine.fields.as_ref()).map(|fields| {
                let ([width, height], overlap) = (fields.pixels, fields.overlap);
                FieldForm { width, height: Some(height), overlap, seam: Seam::default() }
            }),
            fields: FieldSums { exposure_ms: Some(0.0), ..FieldSums::default() },
            unscanned: None,
        }
    }

    /// Counts such fields, in place of the swaths or the fields of the machine.
    #[must_use]
    pub fn with_fields(self, form: FieldForm) -> Self {
        Self { form: Some(form), ..self }
    }

    /// Counts such times, in place of the machine's and the layers' own.
    #[must_use]
    pub fn with_times(self, given: GivenTimes) -> Self {
        Self { given, ..self }
    }

    /// Returns whether the images of layers decide the time, and not their size alone.
    pub fn needs_images(&self) -> bool {
        self.form.is_some() || self.mirrors.is_some()
    }

    /// Adds a layer of so many columns and rows. Its image counts only if images are
    /// [needed](Self::needs_images).
    pub fn add(&mut self, info: &PageInfo, pitch: Option<Pitch>, size: [u32; 2], image: &Image) {
        let times = self.machine.as_ref().and_then(|machine| machine.times.as_ref());
        let usual_s = times.and_then(|times| times.expose_s);
        if self.layers == 0 && self.print.is_none() {
            self.print = info.stack.as_ref().and_then(StackInfo::print_record);
        }
        let layer = u32::try_from(self.layers).unwrap_or(u32::MAX);
        let step = self.print.as_ref().map(|print| print.step_of_page(layer, info));
        let lift_s = step.filter(PrintStep::moves).map(|step| step.time_s() - step.exposure_s);
        self.lifts_s = self.lifts_s.zip(lift_s).map(|(sum, seconds)| sum + seconds);
        let usual_s = usual_s.or(step.map(|step| step.exposure_s));
        let given_ms = self.given.expose_s.map(|seconds| seconds * 1000.0);
        let usual_ms = usual_s.map(|seconds| seconds * 1000.0);
        let exposure_ms = given_ms.or(info.exposure_ms).or(usual_ms);
        self.layers += 1;
        self.exposure_ms = self.exposure_ms.zip(exposure_ms).map(|(sum, ms)| sum + ms);
        if let Some(form) = self.form {
            if self.unscanned.is_none() {
                let added = self.fields.add(&form, info.index, exposure_ms, image);
                self.unscanned = added.err().map(|error| error.to_string());
            }
            return;
        }
        let dpi = match pitch.map(|pitch| pitch.square("scans need")) {
            Some(Ok(dpi)) => dpi,
            Some(Err(why)) => {
                self.unscanned.get_or_insert_with(|| why.to_string());
                return;
            }
            None => return,
        };
        match (&self.machine, self.mirrors.is_some()) {
            (Some(machine), false) => {
                let swaths = steady_swaths(machine, size, dpi);
                let add = |a: SwathTime, b: SwathTime| SwathTime {
                    count: a.count + b.count,
                    black: 0,
                    seconds: a.seconds + b.seconds,
                };
                self.steady = match (self.steady, swaths) {
                    (Some(sum), Some(layer)) => Some(add(sum, layer)),
                    (sum, layer) => sum.or(layer),
                };
            }
            (Some(_), true) if self.unscanned.is_none() => {
                self.unscanned = self.scan(info, exposure_ms, dpi, image).err();
            }
            _ => {}
        }
    }

    /// Adds a layer's scan, or says why the machine cannot scan it.
    fn scan(
        &mut self,
        info: &PageInfo,
        exposure_ms: Option<f64>,
        dpi: Dpi,
        image: &Image,
    ) -> Result<(), String> {
        let (Some(machine), Some(mirrors)) = (&self.machine, &self.mirrors) else { return Ok(()) };
        let Some(scan) = &machine.scan else { return Ok(()) };
        let Some(exposure_ms) = exposure_ms else { return Ok(()) };
        let text = |error: GantryError| error.to_string();
        // Gray takes as long as white, so it is timed as if it were shown; tilted displays refuse it.
        let gray = if scan.tilt.is_some() { GrayBy::Dots } else { GrayBy::Time };
        let layout = SwathLayout::uncut(scan, dpi.pitch(), JobSeam::Comb, gray).map_err(text)?;
        let count = layout.count(image.width()).map_err(text)?;
        let clock = RowClock::new(exposure_ms, layout.full_rows(mirrors), dpi.pitch(), scan)
            .map_err(|limit| format!("{}: {limit}", info.name()))?;
        let images = layout.cut(image, info.index, 0..count).map_err(text)?;
        let white: Vec<_> = images.iter().map(rows_with_white).collect();
        let planner = self
            .planner
            .get_or_insert_with(|| Planner::new(scan, layout, dpi.pitch(), mirrors.size()[1]));
        let mut layer = planner.layer(info, exposure_ms, clock, &white);
        layer.recoat_s = self.given.recoat_s.or(machine.recoat_s());
        self.sums.add(&layer, count.into());
        Ok(())
    }

    /// Returns the time of the layers so far.
    pub fn time(&self) -> BuildTime {
        let recoat_s = self.given.recoat_s.or(self.machine.as_ref().and_then(Machine::recoat_s));
        let recoating_s = recoat_s.map(|seconds| seconds * self.layers as f64);
        let scanned = || {
            let JobSums { layers, swaths, empty_swaths, scan_s, steps_s, between_s, .. } =
                self.sums;
            // The sum has the longer of recoating and the way to the first swath.
            let waits_s = between_s - recoating_s.unwrap_or(0.0);
            let seconds = scan_s + steps_s + waits_s;
            // A layer without an exposure has no scan.
            (layers == self.layers).then_some(SwathTime {
                count: swaths,
                black: empty_swaths,
                seconds,
            })
        };
        BuildTime {
            layers: self.layers,
            exposure_s: self.exposure_ms.map(|ms| ms / 1000.0),
            recoating_s,
            // A given recoating stands in for them.
            lifts_s: self.lifts_s.filter(|_| self.layers > 0 && recoat_s.is_none()),
            swaths: if self.mirrors.is_some() && self.form.is_none() {
                scanned()
            } else {
                self.steady
            },
            fields: self.form.map(|_| self.fields.time(self.machine.as_ref())),
            unscanned: self.unscanned.clone(),
        }
    }
}

impl FieldSums {
    /// Adds a layer's fields.
    fn add(
        &mut self,
        form: &FieldForm,
        layer: u32,
        exposure_ms: Option<f64>,
        image: &Image,
    ) -> Result<(), FieldsError> {
        let fields = form.fields([image.width(), image.height()])?;
        let cut = fields.cut(image, layer, 0..fields.count());
        let white = cut.iter().filter(|field| field.change_count() > 0).count() as u64;
        self.count += white;
        self.black += u64::from(fields.count()) - white;
        // The way to a layer's first field is within its recoating.
        self.steps += white.saturating_sub(1);
        if white > 0 {
            let fields_ms = exposure_ms.map(|ms| ms * white as f64);
            self.exposure_ms = self.exposure_ms.zip(fields_ms).map(|(sum, ms)| sum + ms);
        }
        Ok(())
    }

    fn time(&self, machine: Option<&Machine>) -> FieldTime {
        let step_s = machine.and_then(|machine| machine.fields.as_ref()?.step_s);
        FieldTime {
            count: self.count,
            black: self.black,
            exposure_s: self.exposure_ms.map(|ms| ms / 1000.0),
            steps_s: step_s.map(|seconds| seconds * self.steps as f64),
        }
    }
}

/// Returns the swaths of a layer on a machine with one speed for all, if that is known.
fn steady_swaths(machine: &Machine, [width, height]: [u32; 2], dpi: Dpi) -> Option<SwathTime> {
    let times = machine.times.as_ref()?;
    let (mirrors, overlap) = machine.swaths()?;
    let swaths: Result<Swaths, SwathsError> = Swaths::new(mirrors, overlap, width);
    let count = swaths.ok()?.count();
    let length_mm = f64::from(height) * dpi.pitch().mm();
    // There is at least one swath, also for an image without columns.
    let steps_s = f64::from(count - 1) * times.swath_step_s.unwrap_or(0.0);
    let seconds = f64::from(count) * length_mm / times.swath_speed_mm_per_s? + steps_s;
    Some(SwathTime { count: count.into(), black: 0, seconds })
}

#[cfg(test)]
mod tests {
    use lamp_stack::{Catalogued, MaskBuilder};

    use super::*;

    fn machine(more: &str) -> Result<Machine, String> {
        let text = format!(
            "name = \"mine\"\ndescription = \"\"\n[area]\nvalue = \"100x40mm\"\nsource = \"-\"\n{more}"
        );
        Machine::from_toml(&text).map_err(|error| error.to_string())
    }

    fn time(more: &str, exposures_ms: &[Option<f64>]) -> BuildTime {
        let machine = machine(more).unwrap();
        let mirrors = machine.scan.as_ref().map(|scan| MirrorArray::of(scan, None).unwrap());
        time_by(BuildClock::new(Some(&machine), mirrors), exposures_ms)
    }

    fn time_by(mut clock: BuildClock, exposures_ms: &[Option<f64>]) -> BuildTime {
        // White is a square of 100 pixels on the left, in rows 50 to 149.
        let mut image = MaskBuilder::new(1000);
        image.push_black(50);
        (0..100).for_each(|_| image.push_row(&[0, 100]).unwrap());
        image.push_black(250);
        let image = Image::Mask(image.finish());
        for &exposure_ms in exposures_ms {
            // 10 pixels a millimeter.
            let info = PageInfo { exposure_ms, ..PageInfo::default() };
            clock.add(&info, Pitch::of_dpi(254.0), [1000, 400], &image);
        }
        clock.time()
    }

    #[test]
    fn swaths_take_their_length_by_their_speed_and_the_steps_between() {
        let strips = "[strips]\nmirrors = 400\noverlap = 100\nsource = \"-\"\n";
        let times = "[times]\nrecoat_s = 7\nswath_speed_mm_per_s = 20\nswath_step_s = 0.5\nsource = \"-\"\n";
        let time = time(&format!("{strips}{times}"), &[None, Some(100.0)]);
        // Swaths begin at columns 0, 300 and 600: three of 40 mm at 20 mm/s, two steps.
        let swaths = time.swaths.unwrap();
        assert_eq!(swaths.count, 6);
        assert!((swaths.seconds - 2.0 * (3.0 * 2.0 + 2.0 * 0.5)).abs() < 1e-9);
        assert_eq!((time.exposure_s, time.recoating_s), (None, Some(14.0)));
        assert!((time.sum_s().unwrap() - 28.0).abs() < 1e-9);
    }

    #[test]
    fn the_machine_s_times_stand_in_and_the_blade_s_way_for_recoating() {
        let blade = "[recoating]\nviscosity_cp = [1, 2]\ntravel = \"1cm\"\nseconds = 6\ngap = \"1mm\"\nsource = \"-\"\n";
        let exposures = [Some(250.0), None];
        assert_eq!(time(blade, &exposures).sum_s(), None);
        // The blade goes 10 cm, the longer side of the area, at 1 cm in 6 s.
        assert_eq!(time(blade, &exposures).recoating_s, Some(120.0));
        let times = "[times]\nrecoat_s = 7.5\nexpose_s = 2\nsource = \"-\"\n";
        let both = time(&format!("{blade}{times}"), &exposures);
        assert_eq!((both.exposure_s, both.recoating_s), (Some(2.25), Some(15.0)));
        assert_eq!(both.sum_s(), Some(17.25));
        let none = time_by(BuildClock::new(None, None), &exposures);
        assert_eq!((none.exposure_s, none.recoating_s, none.swaths), (None, None, None));
    }

    #[test]
    fn printers_with_a_panel_lift_and_come_back_in_place_of_recoating() {
        let panel = "[panel]\npixels = [1000, 400]\npitch_um = [50, 50]\nfirst_layers = 1\nsource = \"-\"\n";
        let moves = "lift_mm = [6, 0]\nlift_mm_per_min = [60, 0]\nretract_mm_per_min = [120, 0]\n";
        let step = |name: &str, exposure_s: f64| {
            format!(
                "[panel.{name}]\nexposure_s = {exposure_s}\nwait_before_s = 0.5\n{moves}source = \"-\"\n"
            )
        };
        let text = format!("{panel}{}{}", step("first", 30.0), step("normal", 2.0));
        // Up 6 mm at 1 mm/s, down at 2 mm/s, and the wait. A layer's own exposure goes first.
        let both = time(&text, &[None, None, Some(1500.0)]);
        assert_eq!((both.exposure_s, both.lifts_s), (Some(33.5), Some(3.0 * 9.5)));
        assert_eq!((both.sum_s(), both.is_whole()), (Some(62.0), true));

        let still = text.replace(moves, "");
        let part = time(&still, &[None]);
        assert_eq!((part.lifts_s, part.sum_s(), part.is_whole()), (None, Some(30.0), false));
    }

    #[test]
    fn given_times_stand_in_for_all_others() {
        let times = "[times]\nrecoat_s = 7.5\nexpose_s = 2\nsource = \"-\"\n";
        let given = GivenTimes { expose_s: Some(4.0), recoat_s: Some(1.0) };
        let clock = BuildClock::new(None, None).with_times(given);
        let both = time_by(clock, &[Some(100.0), None]);
        assert_eq!(
            (both.exposure_s, both.recoating_s, both.least_s()),
            (Some(8.0), Some(2.0), 10.0)
        );
        let unlit = time("[times]\nrecoat_s = 7.5\nsource = \"-\"\n", &[None]);
        assert_eq!((unlit.sum_s(), unlit.least_s(), unlit.is_whole()), (None, 7.5, false));
        assert!(time(times, &[None]).is_whole());
    }

    #[test]
    fn fields_that_hold_white_take_an_exposure_each_and_the_steps_between() {
        // White is in columns 0 to 99 and rows 50 to 149: in 2 x 2 fields of 60 x 100 of 17 x 4.
        let fields = "[fields]\npixels = [60, 100]\noverlap = 0\nstep_s = 0.5\nsource = \"-\"\n";
        let blade = "[times]\nrecoat_s = 7\nsource = \"-\"\n";
        let both = time(&format!("{fields}{blade}"), &[Some(100.0), Some(200.0)]);
        let of = both.fields.unwrap();
        assert_eq!((of.count, of.black), (8, 2 * (17 * 4 - 4)));
        assert!((of.exposure_s.unwrap() - 4.0 * 0.3).abs() < 1e-9);
        assert_eq!((of.steps_s, both.swaths), (Some(2.0 * 3.0 * 0.5), None));
        assert!((both.sum_s().unwrap() - (1.2 + 3.0 + 14.0)).abs() < 1e-9);
        let unknown = time(fields, &[Some(100.0), None]);
        assert_eq!((unknown.fields.unwrap().exposure_s, unknown.sum_s()), (None, None));
        let no_step = time(&fields.replace("step_s = 0.5\n", ""), &[Some(100.0)]);
        assert_eq!((no_step.fields.unwrap().steps_s, no_step.sum_s()), (None, Some(0.4)));
        let tiny = time(&fields.replace("[60, 100]", "[1, 1]"), &[Some(100.0)]);
        assert!(tiny.unscanned.as_ref().unwrap().contains("at most 512"), "{tiny:?}");
        assert_eq!(tiny.sum_s(), None);
    }

    #[test]
    fn scans_take_the_swaths_that_hold_white_at_the_speed_of_their_exposure() {
        let scan = "[scan]\nmirrors = [400, 50]\noverlap = 100\nspeed = [\"1mm/s\", \"100mm/s\"]\n\
                    acceleration = \"2000mm/s2\"\nrow_clock_hz = 22000\nboth_ways = true\nsource = \"-\"\n";
        let both = time(scan, &[Some(100.0), Some(200.0)]);
        // 50 rows of 0.1 mm in 0.1 s: 50 mm/s; 149 rows and both ramps of 25 ms. Then 25 mm/s.
        let layer = |speed: f64| 14.9 / speed + 2.0 * speed / 2000.0;
        let swaths = both.swaths.unwrap();
        assert_eq!((swaths.count, swaths.black), (2, 4));
        // The second layer begins near where the first ended: both have their run-up there.
        let way = (50.0 * 50.0 - 25.0 * 25.0) / 4000.0;
        let back = crate::move_s(way, 100.0, 2000.0);
        assert!((swaths.seconds - (layer(50.0) + layer(25.0) + back)).abs() < 1e-9, "{swaths:?}");
        // A blade that takes longer covers the way back.
        let recoated =
            time(&format!("{scan}[times]\nrecoat_s = 9\nsource = \"-\"\n"), &[Some(100.0); 3]);
        assert!((recoated.swaths.unwrap().seconds - 3.0 * layer(50.0)).abs() < 1e-9);
        assert!((recoated.sum_s().unwrap() - 27.0 - 3.0 * layer(50.0)).abs() < 1e-9);
        // Slanted swaths are 400 columns apart, and their ends 6: the one that ends left of column 394
        // holds all white.
        let tilt = "[scan.tilt]\ndegrees = 7\nsource = \"-\"\n";
        let tilted = time(&(scan.replace("overlap = 100", "overlap = 0") + tilt), &[Some(100.0)]);
        assert_eq!((tilted.unscanned, tilted.swaths.unwrap().count), (None, 1));
        let short = time(scan, &[Some(1.0)]);
        assert!(short.unscanned.as_ref().unwrap().contains("at most 100 mm/s"), "{short:?}");
        assert_eq!((short.sum_s(), time(scan, &[None]).sum_s()), (None, None));
    }
}
