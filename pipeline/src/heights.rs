//! Adaptive layer heights: their limits, their bound, and their search.

use std::fmt;
use std::str::FromStr;

use lamp_adaptive::{
    ByHeight, FoundHeights, Goal, HeightsDoubt, HeightsError, LayeredPart, Measure, Roughness,
    Share, SweptLayer, Thicknesses, WantedHeights, Watch, row_pitch,
};
use lamp_grayscale::exposure::Exposure;
use lamp_slicing::{FacetIndex, Fill};
use lamp_stack::format_significant;
use lamp_stack::{Length, Pitch};
use serde::{Deserialize, Serialize};

use crate::error::{Error, ErrorKind};

use crate::watcher::Watcher;
use crate::words::optional;

/// The limits and the bound of adaptive heights.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct HeightSettings {
    /// Thinnest layer that the machine builds; `None` is 25 um.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub min: Option<Length>,
    /// Thickest layer; `None` is 100 um.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub max: Option<Length>,
    /// Step of layer thickness, of which all are multiples; `None` is 1 um.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub step: Option<Length>,
    /// Measure of a layer's error; `None` is volume, or cusps or roughness if one is given.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub criterion: Option<Measure>,
    /// Largest error of a layer, as a share, which may differ by height; `None` is 0.02.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub deviation: Option<ByHeight<Share>>,
    /// Largest height of cusps, which may differ by height.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub cusp: Option<ByHeight<Length>>,
    /// Largest roughness, which may differ by height.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub ra: Option<ByHeight<Length>>,
    /// Roughness of stairs by their cusp height; `None` stands for upright edges.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub ra_line: Option<Roughness>,
    /// Most layers, in place of a bound.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub layers_budget: Option<u32>,
    /// Longest time of all layers, in place of a bound.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub time_budget: Option<Seconds>,
    /// Time of a layer besides its exposure.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub layer_overhead: Option<Seconds>,
    /// Distance between measured rows; `None` is four pixels.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub row_pitch: Option<Length>,
    /// Ends layers at flat faces where the limits allow.
    #[serde(skip_serializing_if = "crate::solid::is_default")]
    pub snap: bool,
}

/// Returns an error of a layer in words: `2.00%`, `10.0um`.
pub fn measured(measure: Measure, number: f64) -> String {
    match measure {
        _ if number.is_infinite() => "none".to_owned(),
        Measure::Cusp | Measure::Ra => format!("{}um", significant(number)),
        Measure::Volume | Measure::Area => format!("{}%", significant(number * 100.0)),
    }
}

/// Returns the bound that heights keep in words: `volume 2.00%`, or `volume 0.500..2.00%` if bounds
/// differ by height.
pub fn bound(found: &FoundHeights) -> String {
    let [least, most] = found.bounds.least_and_most();
    let [from, to] = [least, most].map(|bound| measured(found.measure, bound));
    match least == most {
        true => format!("{} {to}", found.measure),
        false => format!("{} {}..{to}", found.measure, from.trim_end_matches(['%', 'u', 'm'])),
    }
}

/// Returns sentences on rows that could not be measured, and on exposures at which the material was
/// not measured.
pub fn doubts(found: &FoundHeights, exposure: Option<&Exposure>) -> Vec<String> {
    let of_rows = found.doubt().map(|doubt| match doubt {
        HeightsDoubt::OpenRows { rows, layers } => format!(
            "{rows} rows in {layers} layers do not balance: the mesh has gaps; the other rows \
             decide the thickness of these layers"
        ),
        _ => "the part has no volume in any row: it is flat, or too thin for this --row-pitch"
            .to_owned(),
    });
    let of_doses = exposure.map_or_else(Vec::new, |exposure| exposure.doubts(found.thicknesses()));
    of_rows.into_iter().chain(of_doses).collect()
}

impl HeightSettings {
    /// Returns the thickest layer.
    pub fn max(&self) -> Length {
        self.max.unwrap_or(Length::from_um(100.0))
    }

    /// Returns the thinnest layer.
    pub fn min(&self) -> Length {
        self.min.unwrap_or(Length::from_um(25.0))
    }

    /// Returns the part as measured along rows.
    pub fn part(&self, body: FacetIndex, pitch: Pitch, fill: Fill) -> Result<LayeredPart, Error> {
        let row_pitch = self.row_pitch.unwrap_or_else(|| row_pitch(pitch));
        let part = LayeredPart::new(body, row_pitch, fill);
        Ok(part?)
    }

    /// Returns whether a budget decides the bound.
    pub fn has_budget(&self) -> bool {
        self.layers_budget.is_some() || self.time_budget.is_some()
    }

    /// Returns the thicknesses that the machine builds.
    fn thicknesses(&self) -> Result<Thicknesses, Error> {
        let step = self.step.unwrap_or(Length::from_um(1.0));
        Thicknesses::new(self.min(), self.max(), step)
            .map_err(|error| Error::new(ErrorKind::Settings, error))
    }

    /// Checks, before the work, the rules that the parser cannot check.
    pub fn check(&self, exposure: Option<&Exposure>) -> Result<(), Error> {
        self.thicknesses()?;
        self.measure()?;
        if self.time_budget.is_some() {
            // Only its errors count here: the search would find them after minutes.
            let _ = self.seconds_of_layers(exposure)?;
        }
        Ok(())
    }

    fn measure(&self) -> Result<Measure, Error> {
        let default = match (&self.cusp, &self.ra) {
            (Some(_), _) => Measure::Cusp,
            (_, Some(_)) => Measure::Ra,
            _ => Measure::Volume,
        };
        let criterion = self.criterion.unwrap_or(default);
        let least_length = |bound: &ByHeight<Length>| bound.map(|it| it.um()).least_and_most()[0];
        let least_share = |bound: &ByHeight<Share>| bound.map(|it| it.0).least_and_most()[0];
        for (option, least, example) in [
            ("deviation", self.deviation.as_ref().map(least_share), "2%"),
            ("cusp", self.cusp.as_ref().map(least_length), "10um"),
            ("ra", self.ra.as_ref().map(least_length), "6um"),
        ] {
            // No layer of a slanted wall is without an error.
            if least.is_some_and(|least| least <= 0.0) {
                let why = format!("--{option} must be above zero, such as {example}");
                return Err(Error::settings(why));
            }
        }
        for (measure, bound, example) in
            [(Measure::Cusp, &self.cusp, "--cusp 10um"), (Measure::Ra, &self.ra, "--ra 6um")]
        {
            match (criterion == measure, bound.is_some()) {
                (false, true) => {
                    let why = format!("--{measure} needs --criterion {measure}");
                    return Err(Error::settings(why));
                }
                // A deviation is a share, which bounds no length.
                (true, false) if self.deviation.is_some() || !self.has_budget() => {
                    let why = format!("--criterion {measure} needs a bound, such as {example}");
                    return Err(Error::settings(why));
                }
                _ => {}
            }
        }
        if self.ra_line.is_some() && criterion != Measure::Ra {
            let why = "--ra-line needs a bound of roughness, such as --ra 6um, or --criterion ra";
            return Err(Error::settings(why));
        }
        if let (Some(line), Some(bounds)) = (self.ra_line, &self.ra)
            && let [least, _] = bounds.map(|bound| bound.um()).least_and_most()
            && least <= line.upright.um()
        {
            let least = Length::from_um(least);
            let why = format!(
                "--ra {least} is out of reach: by --ra-line, an upright wall has {}",
                line.upright
            );
            return Err(Error::settings(why));
        }
        Ok(criterion)
    }

    /// Searches for the heights.
    ///
    /// # Errors
    /// Returns an error if settings contradict each other, or no heights satisfy them.
    pub fn find(
        &self,
        part: &LayeredPart,
        exposure: Option<&Exposure>,
        watcher: &dyn Watcher,
    ) -> Result<FoundHeights, Error> {
        let found = self.search(part, exposure, watcher);
        // Also after an error, so that no line of progress is left on the terminal.
        watcher.heights_found();
        found
    }

    fn search(
        &self,
        part: &LayeredPart,
        exposure: Option<&Exposure>,
        watcher: &dyn Watcher,
    ) -> Result<FoundHeights, Error> {
        let cost = match &self.time_budget {
            Some(_) => Some(self.seconds_of_layers(exposure)?),
            None => None,
        };
        let goal = match (self.layers_budget, self.time_budget, &cost) {
            (Some(layers), ..) => Goal::Layers(layers),
            (_, Some(Seconds(most)), Some(cost)) => Goal::Cost { of_layer: cost, most },
            _ => Goal::Bounds(match (self.cusp.as_ref().or(self.ra.as_ref()), &self.deviation) {
                (Some(lengths), _) => lengths.map(|length| length.um()),
                (None, Some(shares)) => shares.map(|Share(share)| *share),
                (None, None) => 0.02.into(),
            }),
        };
        let (thicknesses, measure, snap) = (self.thicknesses()?, self.measure()?, self.snap);
        let part_um = part.heights_um();
        let watch = |layer: &SweptLayer| watcher.height_reached(part_um, layer.top_um());
        let roughness = self.ra_line.unwrap_or_default();
        let wanted = WantedHeights { thicknesses, measure, roughness, goal, snap };
        let found = wanted.find(part, Watch(&watch));
        let found = found.map_err(|error| over(error, &wanted.goal))?;
        if let Some(exposure) = exposure {
            // The search may choose a thickness that the material cannot cure or the table does not
            // list.
            found.thicknesses().try_for_each(|thickness| exposure.check(thickness))?;
        }
        Ok(found)
    }

    /// Returns the time in seconds that a layer takes by its thickness.
    fn seconds_of_layers<'a>(
        &self,
        exposure: Option<&'a Exposure>,
    ) -> Result<impl Fn(Length) -> f64 + use<'a>, Error> {
        let exposure = exposure.ok_or_else(|| {
            Error::settings("--time-budget needs exposures: give --material or --exposure-table")
        })?;
        // If both limits have a time, all thicknesses between them do.
        exposure.time(self.min())?;
        exposure.time(self.max())?;
        let overhead = self.overhead();
        Ok(move |thickness: Length| {
            let time = exposure.time(thickness);
            // A thickness without a time is never the cheapest.
            overhead + time.map_or(f64::INFINITY, |time| time.ms() / 1000.0)
        })
    }

    /// Returns the seconds that each layer takes besides its exposure.
    pub fn overhead(&self) -> f64 {
        self.layer_overhead.map_or(0.0, |Seconds(seconds)| seconds)
    }
}

/// Describes a budget that is too small, in its unit.
fn over(error: HeightsError, goal: &Goal<'_>) -> Error {
    let say = |amount| match goal {
        Goal::Layers(_) => format!("{amount} layers"),
        _ => time_text(amount),
    };
    match error {
        HeightsError::Budget { least, budget } => {
            let [least, budget] = [least, budget].map(say);
            Error::work(format!(
                "the cheapest layers take {least}, more than the budget of {budget}: allow more, or \
                 wider limits"
            ))
        }
        error => error.into(),
    }
}

/// Formats a number to three digits.
pub fn significant(number: f64) -> String {
    format_significant(number, 3)
}

/// Formats a time in seconds, minutes or hours.
pub fn time_text(seconds: f64) -> String {
    let (number, unit) = match seconds {
        ..200.0 => (seconds, "s"),
        ..10_000.0 => (seconds / 60.0, "min"),
        _ => (seconds / 3600.0, "h"),
    };
    format!("{}{unit}", significant(number))
}

/// Parses a share: `2%` or `0.02`.
pub fn parse_share(text: &str) -> Result<f64, String> {
    text.parse().map(|Share(share)| share)
}

/// A time in seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seconds(
    /// Zero or more.
    pub f64,
);

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
    fn times_are_parsed() {
        assert_eq!("8h".parse(), Ok(Seconds(28_800.0)));
        assert_eq!("1.5 min".parse(), Ok(Seconds(90.0)));
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
