//! Options of adaptive layer heights, and the search that they ask for.

use std::fmt;
use std::str::FromStr;

use clap::Args;
use lamp_adaptive::{
    AreaDeviation, Criterion, CuspHeight, HeightSearch, Heights, HeightsError, LayeredPart,
    SweptLayer, Thicknesses, VolumeDeviation, Watch,
};
use lamp_grayscale::calibrate::format_significant;
use lamp_grayscale::exposure::Exposure;
use lamp_slicer::{FacetIndex, Fill};
use lamp_stack::{Dpi, Length};
use serde::{Deserialize, Serialize};

use crate::exit::Exit;
use crate::options::{one_of, parse_thickness};
use crate::progress::Progress;
use crate::recorded::optional;

pub(crate) const HEADING: &str = "Adaptive layer heights";

/// Pixels between measured rows.
const PIXELS_PER_ROW: f64 = 4.0;

/// Options of adaptive heights.
#[derive(Args, Clone, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub(crate) struct HeightOptions {
    /// Thinnest layer that the machine builds [default: 25um]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEADING)]
    #[serde(with = "optional")]
    min: Option<Length>,

    /// Thickest layer [default: 100um]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEADING)]
    #[serde(with = "optional")]
    max: Option<Length>,

    /// Step of layer thickness: all are multiples of it [default: 1um]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEADING)]
    #[serde(with = "optional")]
    step: Option<Length>,

    /// Measure of a layer's error: the volume it lacks or has in excess, the height of cusps at its
    /// edge, or the change of its section's area [default: volume, or cusp with --cusp]
    #[arg(long, value_parser = one_of::<Measure>(), help_heading = HEADING)]
    #[serde(with = "optional")]
    criterion: Option<Measure>,

    /// Largest error of a layer, as a share of its volume (with --criterion area, of its section's
    /// area): 2% or 0.02 [default: 2%]
    #[arg(long, value_name = "SHARE", value_parser = parse_share, help_heading = HEADING)]
    #[serde(with = "optional")]
    deviation: Option<f64>,

    /// Largest cusp height: how far a layer's edge may be off the surface, along its normal
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEADING)]
    #[arg(conflicts_with = "deviation")]
    #[serde(with = "optional")]
    cusp: Option<Length>,

    /// Use at most N layers, with the smallest error that allows it (found to one percent)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    #[arg(conflicts_with_all = ["deviation", "cusp", "time_budget"], help_heading = HEADING)]
    #[serde(with = "optional")]
    layers_budget: Option<u32>,

    /// Build all layers within this time, for example 8h, 90min or 1200s: exposures, from
    /// --material or --exposure-table, plus --layer-overhead
    #[arg(long, value_name = "TIME", help_heading = HEADING)]
    #[arg(conflicts_with_all = ["deviation", "cusp"])]
    #[serde(with = "optional")]
    time_budget: Option<Seconds>,

    /// Time per layer besides its exposure, mostly for recoating, for example 30s
    #[arg(long, value_name = "TIME", help_heading = HEADING)]
    #[serde(with = "optional")]
    layer_overhead: Option<Seconds>,

    /// End layers at flat faces where the limits allow
    #[arg(long, help_heading = HEADING)]
    snap: bool,

    /// Distance between the rows that measure where parts of a layer lie above each other; features
    /// thinner than that may be missed there [default: four pixels]
    #[arg(long, value_name = "LENGTH", value_parser = parse_thickness, help_heading = HEADING)]
    #[serde(with = "optional")]
    row_pitch: Option<Length>,
}

/// The layers found, and the bound that they keep.
pub(crate) struct FoundHeights {
    pub(crate) measure: Measure,
    pub(crate) bound: f64,
    pub(crate) heights: Heights,
}

/// The measure of a layer's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Measure {
    Volume,
    Cusp,
    Area,
}

lamp_stack::named!(Measure { Volume = "volume", Cusp = "cusp", Area = "area" });

impl Measure {
    pub(crate) fn criterion(self) -> &'static dyn Criterion {
        match self {
            Self::Volume => &VolumeDeviation,
            Self::Cusp => &CuspHeight,
            Self::Area => &AreaDeviation,
        }
    }

    /// `2.00%`, `10.0um`.
    pub(crate) fn text(self, measure: f64) -> String {
        match self {
            _ if measure.is_infinite() => "none".to_owned(),
            Self::Cusp => format!("{}um", significant(measure)),
            Self::Volume | Self::Area => {
                format!("{}%", significant(measure * 100.0))
            }
        }
    }
}

impl FoundHeights {
    /// `volume 2.00%`.
    pub(crate) fn bound(&self) -> String {
        format!("{} {}", self.measure, self.measure.text(self.bound))
    }

    /// Returns how many layers exceed the bound.
    pub(crate) fn past(&self, heights: &Heights) -> usize {
        let is_past = |layer: &&SweptLayer| self.measure.criterion().measure(layer) > self.bound;
        heights.layers.iter().filter(is_past).count()
    }

    /// Warns of rows that could not be measured.
    pub(crate) fn warn(&self, say: &dyn Fn(&str)) {
        let left_out = self.heights.layers.iter().filter(|layer| layer.rows_left_out > 0);
        let (layers, rows) = left_out.fold((0, 0), |(layers, rows), layer| {
            (layers + 1, rows + u64::from(layer.rows_left_out))
        });
        if rows > 0 {
            say(&format!(
                "{rows} rows in {layers} layers do not balance: the mesh has gaps; the other \
                 rows decide the thickness of these layers"
            ));
        } else if self.heights.volumes_mm3()[2] == 0.0 {
            say("the part has no volume in any row: it is flat, or too thin for this --row-pitch");
        }
    }

    /// Returns sentences on exposures that the material was not measured at.
    pub(crate) fn doubts(&self, exposure: Option<&Exposure>) -> Vec<String> {
        let thicknesses = self.heights.layers.iter().map(|it| Length::from_um(it.thickness_um));
        exposure.map_or_else(Vec::new, |exposure| exposure.doubts(thicknesses))
    }
}

impl HeightOptions {
    pub(crate) fn max(&self) -> Length {
        self.max.unwrap_or(Length::from_um(100.0))
    }

    pub(crate) fn min(&self) -> Length {
        self.min.unwrap_or(Length::from_um(25.0))
    }

    /// Returns the part as measured along rows.
    pub(crate) fn part(&self, body: FacetIndex, dpi: Dpi, fill: Fill) -> Result<LayeredPart, Exit> {
        let pitch = Length::from_um(dpi.pitch().um() * PIXELS_PER_ROW);
        let part = LayeredPart::new(body, self.row_pitch.unwrap_or(pitch), fill);
        part.map_err(|error| Exit::Failed(error.into()))
    }

    /// Returns whether a budget decides the bound.
    pub(crate) fn has_budget(&self) -> bool {
        self.layers_budget.is_some() || self.time_budget.is_some()
    }

    /// Returns the thicknesses that the machine builds.
    fn thicknesses(&self) -> Result<Thicknesses, Exit> {
        let step = self.step.unwrap_or(Length::from_um(1.0));
        Thicknesses::new(self.min(), self.max(), step).map_err(Exit::wrong_options)
    }

    /// Checks, before the work, what the parser cannot.
    pub(crate) fn check(&self, exposure: Option<&Exposure>) -> Result<(), Exit> {
        self.thicknesses()?;
        self.measure()?;
        if self.time_budget.is_some() {
            let _ = self.seconds_of_layers(exposure)?;
        }
        Ok(())
    }

    fn measure(&self) -> Result<Measure, Exit> {
        let default = if self.cusp.is_some() { Measure::Cusp } else { Measure::Volume };
        let criterion = self.criterion.unwrap_or(default);
        match (criterion == Measure::Cusp, self.cusp.is_some()) {
            (false, true) => Err(Exit::usage("--cusp needs --criterion cusp")),
            (true, false) if self.deviation.is_some() || !self.has_budget() => {
                Err(Exit::usage("--criterion cusp needs a bound, as --cusp 10um"))
            }
            _ => Ok(criterion),
        }
    }

    /// Searches for the heights.
    pub(crate) fn find(
        &self,
        part: &LayeredPart,
        exposure: Option<&Exposure>,
        progress: &Progress,
    ) -> Result<FoundHeights, Exit> {
        let thicknesses = self.thicknesses()?;
        let measure = self.measure()?;
        let criterion = measure.criterion();
        let bar = progress.height_bar(part);
        let watch = |layer: &SweptLayer| bar.move_to(layer);
        let search = HeightSearch {
            part,
            thicknesses: &thicknesses,
            criterion,
            snap: self.snap,
            watch: Watch(&watch),
        };
        let failed = |error: HeightsError| Exit::Failed(error.into());
        let (bound, heights) = if let Some(layers) = self.layers_budget {
            search
                .within_budget(|_| 1.0, layers.into())
                .map_err(|error| over(error, |layers| format!("{layers} layers")))?
        } else if let Some(Seconds(seconds)) = self.time_budget {
            let cost = self.seconds_of_layers(exposure)?;
            search.within_budget(cost, seconds).map_err(|error| over(error, time_text))?
        } else {
            let bound = self.cusp.map_or(self.deviation.unwrap_or(0.02), Length::um);
            (bound, search.heights(bound).map_err(failed)?)
        };
        if let Some(exposure) = exposure {
            for layer in &heights.layers {
                exposure.check(Length::from_um(layer.thickness_um))?;
            }
        }
        Ok(FoundHeights { measure, bound, heights })
    }

    /// Returns the time in seconds that a layer takes by its thickness.
    fn seconds_of_layers<'a>(
        &self,
        exposure: Option<&'a Exposure>,
    ) -> Result<impl Fn(Length) -> f64 + use<'a>, Exit> {
        let exposure = exposure.ok_or_else(|| {
            Exit::usage("--time-budget needs exposures: give --material or --exposure-table")
        })?;
        // What holds for the limits holds between them.
        exposure.time(self.min())?;
        exposure.time(self.max())?;
        let overhead = self.overhead();
        Ok(move |thickness: Length| {
            let time = exposure.time(thickness);
            overhead + time.map_or(f64::INFINITY, |time| time.ms() / 1000.0)
        })
    }

    /// Returns the seconds that each layer takes besides its exposure.
    pub(crate) fn overhead(&self) -> f64 {
        self.layer_overhead.map_or(0.0, |Seconds(seconds)| seconds)
    }
}

/// Describes a budget that is too small, in its unit.
fn over(error: HeightsError, say: impl Fn(f64) -> String) -> Exit {
    Exit::Failed(match error {
        HeightsError::Budget { least, budget } => {
            let [least, budget] = [least, budget].map(say);
            anyhow::anyhow!(
                "the cheapest layers take {least}, more than the budget of {budget}: allow more, or \
                 wider limits"
            )
        }
        error => error.into(),
    })
}

/// Formats a number to three digits.
pub(crate) fn significant(number: f64) -> String {
    format_significant(number, 3)
}

/// Formats a time in seconds, minutes or hours.
pub(crate) fn time_text(seconds: f64) -> String {
    let (number, unit) = match seconds {
        ..200.0 => (seconds, "s"),
        ..10_000.0 => (seconds / 60.0, "min"),
        _ => (seconds / 3600.0, "h"),
    };
    format!("{}{unit}", significant(number))
}

/// Parses a share: `2%` or `0.02`.
pub(crate) fn parse_share(text: &str) -> Result<f64, String> {
    let (number, factor) = match text.trim().strip_suffix('%') {
        Some(number) => (number.trim_end(), 0.01),
        None => (text.trim(), 1.0),
    };
    match number.parse::<f64>() {
        // 2 is far more often meant to be 2% than 200%.
        Ok(number) if factor == 1.0 && number >= 1.0 => {
            Err(format!("`{text}` is not below 1: write {number}% or {}", number / 100.0))
        }
        Ok(number) if number >= 0.0 && number.is_finite() => Ok(number * factor),
        _ => Err(format!("`{text}` is not a share: write 2% or 0.02")),
    }
}

/// A time in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seconds(f64);

impl fmt::Display for Seconds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}s", self.0)
    }
}

impl FromStr for Seconds {
    type Err = String;

    /// Parses `8h`, `90min` or `30s`.
    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || format!("`{text}` is not a time: write 8h, 90min or 30s");
        let split = text.find(|c: char| c.is_ascii_alphabetic()).ok_or_else(wrong)?;
        let factor = match &text[split..] {
            "h" => 3600.0,
            "min" => 60.0,
            "s" => 1.0,
            "ms" => 0.001,
            _ => return Err(wrong()),
        };
        match text[..split].trim().parse::<f64>() {
            Ok(number) if (0.0..1e12).contains(&number) => Ok(Self(number * factor)),
            _ => Err(wrong()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_and_times() {
        assert_eq!(parse_share("2%"), Ok(0.02));
        assert_eq!(parse_share("0.05"), Ok(0.05));
        assert_eq!("8h".parse(), Ok(Seconds(28_800.0)));
        assert_eq!("1.5 min".parse(), Ok(Seconds(90.0)));
        assert_eq!(parse_share("150%"), Ok(1.5));
        for wrong in ["", "-1%", "nan", "2 percent", "2", "inf%"] {
            assert!(parse_share(wrong).is_err(), "{wrong}");
        }
        for wrong in ["", "8", "h", "-3s", "nans", "infh"] {
            assert!(wrong.parse::<Seconds>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn times_have_their_unit() {
        let times = [12.34, 199.0, 600.0, 9_000.0, 36_000.0].map(time_text);
        assert_eq!(times, ["12.3s", "199s", "10.0min", "150min", "10.0h"]);
    }
}
