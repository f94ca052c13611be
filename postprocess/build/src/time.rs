//! How long a build takes on a machine.

use lamp_machine::Machine;
use lamp_stack::Dpi;

use crate::pixel_size::PixelSize;
use crate::strips::Swaths;

/// How long a build takes, as far as that is known.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildTime {
    /// The number of layers.
    pub layers: u64,
    /// The sum of all exposures in seconds, if every layer states one or the machine gives it.
    pub exposure_s: Option<f64>,
    /// The time for recoating in seconds, if the machine's is known.
    pub recoating_s: Option<f64>,
    /// The swaths of a projector that scans.
    pub swaths: Option<SwathTime>,
}

/// How long the swaths of a build take.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwathTime {
    /// The number of swaths of a layer.
    pub count: u32,
    /// The length of a swath, in millimeters.
    pub length_mm: f64,
    /// All swaths of all layers, and the steps between them, in seconds.
    pub seconds: f64,
}

impl BuildTime {
    /// Adds up the time of layers with these exposures in milliseconds, whose images have one size.
    ///
    /// A layer is recoated once. A machine with a swath speed v exposes it in n swaths of the
    /// images' height L, which take n L / v and n - 1 steps.
    pub fn new(
        machine: Option<&Machine>,
        exposures_ms: impl IntoIterator<Item = Option<f64>>,
        image: PixelSize,
        dpi: Option<Dpi>,
    ) -> Self {
        let times = machine.and_then(|machine| machine.times.as_ref());
        let usual_ms = times.and_then(|times| times.expose_s).map(|seconds| seconds * 1000.0);
        let (mut layers, mut exposure_ms) = (0, Some(0.0));
        for of_layer in exposures_ms {
            layers += 1;
            exposure_ms = exposure_ms.zip(of_layer.or(usual_ms)).map(|(sum, ms)| sum + ms);
        }
        let recoat_s = machine.and_then(Machine::recoat_s);
        let swaths = machine.zip(dpi).and_then(|(machine, dpi)| swaths(machine, image, dpi));
        Self {
            layers,
            exposure_s: exposure_ms.map(|ms| ms / 1000.0),
            recoating_s: recoat_s.map(|seconds| seconds * layers as f64),
            swaths: swaths
                .map(|swaths| SwathTime { seconds: swaths.seconds * layers as f64, ..swaths }),
        }
    }

    /// Returns the time of the build in seconds, if the time of its light is known. Swaths take
    /// their own time: the exposure of a place passes while a swath goes over it. Recoating counts
    /// if it is known.
    pub fn sum_s(&self) -> Option<f64> {
        let light_s = self.swaths.map(|swaths| swaths.seconds).or(self.exposure_s);
        Some(light_s? + self.recoating_s.unwrap_or(0.0))
    }
}

/// Returns the swaths of one layer, if the machine's speed is known.
fn swaths(machine: &Machine, image: PixelSize, dpi: Dpi) -> Option<SwathTime> {
    let times = machine.times.as_ref()?;
    let (mirrors, overlap) = machine.swaths()?;
    let count = Swaths::new(mirrors, overlap, image.width).ok()?.count();
    let length_mm = f64::from(image.height) * dpi.pitch().mm();
    // There is at least one swath, also for an image without columns.
    let steps_s = f64::from(count - 1) * times.swath_step_s.unwrap_or(0.0);
    let seconds = f64::from(count) * length_mm / times.swath_speed_mm_per_s? + steps_s;
    Some(SwathTime { count, length_mm, seconds })
}

#[cfg(test)]
mod tests {
    use lamp_stack::Catalogued;

    use super::*;

    const SIZE: PixelSize = PixelSize { width: 1000, height: 400 };

    fn machine(more: &str) -> Result<Machine, String> {
        let text = format!(
            "name = \"mine\"\ndescription = \"\"\n[area]\nvalue = \"100x40mm\"\nsource = \"-\"\n{more}"
        );
        Machine::from_toml(&text).map_err(|error| error.to_string())
    }

    fn time(more: &str, exposures_ms: &[Option<f64>]) -> BuildTime {
        let machine = machine(more).unwrap();
        // 10 pixels a millimeter.
        BuildTime::new(Some(&machine), exposures_ms.iter().copied(), SIZE, Dpi::new(254.0))
    }

    #[test]
    fn swaths_take_their_length_by_their_speed_and_the_steps_between() {
        let strips = "[strips]\nmirrors = 400\noverlap = 100\nsource = \"-\"\n";
        let times = "[times]\nrecoat_s = 7\nswath_speed_mm_per_s = 20\nswath_step_s = 0.5\nsource = \"-\"\n";
        let time = time(&format!("{strips}{times}"), &[None, Some(100.0)]);
        // Swaths begin at columns 0, 300 and 600: three of 40 mm at 20 mm/s, two steps.
        let swaths = time.swaths.unwrap();
        assert_eq!((swaths.count, swaths.seconds), (3, 2.0 * (3.0 * 2.0 + 2.0 * 0.5)));
        assert!((swaths.length_mm - 40.0).abs() < 1e-9);
        assert_eq!((time.exposure_s, time.recoating_s), (None, Some(14.0)));
        assert_eq!(time.sum_s(), Some(28.0));
    }

    #[test]
    fn the_machine_s_times_stand_in_and_the_blade_s_way_for_recoating() {
        let blade = "[recoating]\nviscosity_cp = [1, 2]\ntravel = \"1cm\"\nseconds = 6\ngap = \"1mm\"\nsource = \"-\"\n";
        let exposures = [Some(250.0), None];
        assert_eq!(time(blade, &exposures).sum_s(), None);
        assert_eq!(time(blade, &exposures).recoating_s, Some(12.0));
        let times = "[times]\nrecoat_s = 7.5\nexpose_s = 2\nsource = \"-\"\n";
        let both = time(&format!("{blade}{times}"), &exposures);
        assert_eq!((both.exposure_s, both.recoating_s), (Some(2.25), Some(15.0)));
        assert_eq!(both.sum_s(), Some(17.25));
        let none = BuildTime::new(None, exposures, SIZE, None);
        assert_eq!((none.exposure_s, none.recoating_s, none.swaths), (None, None, None));
    }
}
