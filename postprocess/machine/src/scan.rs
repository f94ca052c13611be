//! How a display of mirrors scans a layer.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::sync::LazyLock;

use lamp_stack::{Catalogued, Length, nonempty_text, one_line};
use serde::{Deserialize, Deserializer, de};
use thiserror::Error;

use super::file::{nonempty_path, some_length};
use super::{Acceleration, Display, Speed};

/// How a display of mirrors scans a layer in swaths.
///
/// One mirror lights one pixel of the layer. As the head moves, the picture on the mirrors moves
/// against it by a row for every pixel of the way, so each point of the resin sees its own pixel
/// for as many rows as lie along the scan.
///
/// ```text
///             across
///        0  1  2  ...      column
///     0  .  .  .  .  .
///     1  .  .  .  .  .     along the scan
///   row
/// ```
///
/// Row 0 is the row of mirrors that meets a row of the image first.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scan {
    /// The name of a built-in [`Display`].
    pub display: Option<String>,
    /// The mirrors in use across the scan and along it, if they are not the display's. See
    /// [`mirrors`](Self::mirrors).
    #[serde(default, deserialize_with = "crate::file::some_pair")]
    pub mirrors: Option<[u32; 2]>,
    /// The number of pixels that a swath shares with the next.
    pub overlap: u32,
    /// The least and the greatest speed of the head along a swath.
    #[serde(deserialize_with = "crate::file::pair")]
    pub speed: [Speed; 2],
    /// The acceleration of the head at the ends of a swath.
    pub acceleration: Acceleration,
    /// The most rows by which the picture moves in a second, if it is not the display's rate. See
    /// [`row_clock_hz`](Self::row_clock_hz).
    pub row_clock_hz: Option<f64>,
    /// Whether every second swath is exposed on the way back.
    pub both_ways: bool,
    /// The direction of the first swath, and of all swaths unless they go both ways.
    #[serde(default)]
    pub direction: ScanDirection,
    /// The wait before each swath and pass, before the light goes on, in seconds.
    #[serde(default)]
    pub settle_s: f64,
    /// The share of each row's time in which the light is on: above 0, at most 1.
    #[serde(default = "whole")]
    pub strobe: f64,
    /// The most passes over a swath, for exposures that one pass cannot give.
    #[serde(default = "one")]
    pub passes: u32,
    /// The light of full white on the resin, in milliwatts a square centimeter.
    pub irradiance_mw_per_cm2: Option<f64>,
    /// The light across the mirrors; even if absent.
    pub light: Option<ScanLight>,
    /// Mirrors that do not move; none if absent.
    pub faults: Option<MirrorFaults>,
    /// How the display is turned against the scan; upright if absent.
    pub tilt: Option<ScanTilt>,
    /// The section, table or data sheet.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

fn whole() -> f64 {
    1.0
}

fn one() -> u32 {
    1
}

/// The way of a swath over the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ScanDirection {
    /// From the image's first row to its last.
    #[default]
    Down,
    /// From the image's last row to its first.
    Up,
}

lamp_stack::named!(ScanDirection { Down = "down", Up = "up" });

impl<'de> Deserialize<'de> for ScanDirection {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        String::deserialize(from)?.parse().map_err(de::Error::custom)
    }
}

/// A file with the light of each mirror.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScanLight {
    /// A gray picture or a table; its path begins at the folder of the machine's file.
    #[serde(deserialize_with = "nonempty_path")]
    pub file: PathBuf,
    /// The section, table or data sheet, or how it was measured.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// Mirrors that do not move, each by its column across the scan and its row along it, from 0.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MirrorFaults {
    /// Mirrors that are always dark.
    #[serde(default)]
    pub dead: Vec<[u32; 2]>,
    /// Mirrors that are always bright.
    #[serde(default)]
    pub stuck: Vec<[u32; 2]>,
    /// The section, table or data sheet, or how they were found.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// A display that is turned against the scan, so that its mirrors pass between each other and address
/// more finely than they are.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScanTilt {
    /// The angle from the image's rows to the display's rows, in degrees: above zero if the right end
    /// of a row of mirrors is over later rows of the image.
    pub degrees: f64,
    /// The distance of mirrors on the resin, as `16.93um`; the build's pitch if absent.
    #[serde(default, deserialize_with = "some_length")]
    pub mirror_pitch: Option<Length>,
    /// The section, table or data sheet, or how it was measured.
    #[serde(deserialize_with = "nonempty_text")]
    pub source: String,
}

/// Why the numbers of a scan contradict each other.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ScanError {
    /// A display that is not built in.
    #[error(
        "display: `{name}` is not built in: write one of {}, or leave it out and add mirrors and row_clock_hz",
        known.join(", ")
    )]
    UnknownDisplay {
        /// The name as it stands.
        name: String,
        /// The names of the built-in displays.
        known: Vec<&'static str>,
    },
    /// Neither mirrors nor a display.
    #[error("mirrors: add the mirrors across and along the scan, or a built-in display")]
    NoMirrors,
    /// Sides without mirrors, or with too many.
    #[error("mirrors: each must be between 1 and 65535")]
    Mirrors,
    /// More mirrors than the display has.
    #[error(
        "mirrors: {}x{} are more than the {}x{} of the display {display}: write fewer, or leave the display out",
        mirrors[0], mirrors[1], most[0], most[1]
    )]
    MoreThanDisplay {
        /// The mirrors across and along.
        mirrors: [u32; 2],
        /// The display's name.
        display: String,
        /// Its mirrors.
        most: [u32; 2],
    },
    /// Swaths without a pixel of their own.
    #[error(
        "overlap: {overlap} pixels are not under half of the {across} mirrors across: write fewer"
    )]
    Overlap {
        /// The pixels that two swaths share.
        overlap: u32,
        /// The mirrors across.
        across: u32,
    },
    /// Speeds in the wrong order.
    #[error("speed: the least, {least}, is above the greatest, {most}: write the least first")]
    Speed {
        /// The first speed.
        least: Speed,
        /// The second speed.
        most: Speed,
    },
    /// Neither a row clock nor a display of a known rate.
    #[error("row_clock_hz: add the most rows in a second, or a built-in display of a known rate")]
    NoRowClock,
    /// A number that is not above zero.
    #[error("{0}: it must be a number above zero")]
    NotAboveZero(&'static str),
    /// A wait that is negative or never ends.
    #[error("settle_s: it must be between 0 and 1000000")]
    Settle,
    /// A light that is never on, or on for longer than a row.
    #[error("strobe: it must be above 0 and at most 1")]
    Strobe,
    /// No pass, or too many.
    #[error("passes: it must be between 1 and 1000")]
    Passes,
    /// A fault that is on no mirror.
    #[error(
        "faults: {list}: there is no mirror {mirror:?} among {}x{}: count across, then along, from 0",
        mirrors[0], mirrors[1]
    )]
    FaultOutside {
        /// The key of the list.
        list: &'static str,
        /// The column and the row.
        mirror: [u32; 2],
        /// The mirrors across and along.
        mirrors: [u32; 2],
    },
    /// A fault that is listed twice.
    #[error("faults: {list}: the mirror {mirror:?} is listed twice: keep one")]
    FaultTwice {
        /// The key of the list.
        list: &'static str,
        /// The column and the row.
        mirror: [u32; 2],
    },
    /// A mirror that is dark and bright.
    #[error("faults: the mirror {0:?} is both dead and stuck: keep one")]
    DeadAndStuck([u32; 2]),
    /// A display that is turned too far.
    #[error(
        "tilt: degrees: {degrees} is too far for {}x{} mirrors: write a number from -{most:.3} to {most:.3}",
        mirrors[0], mirrors[1]
    )]
    Tilt {
        /// The angle.
        degrees: f64,
        /// The mirrors across and along.
        mirrors: [u32; 2],
        /// The greatest angle.
        most: f64,
    },
    /// Mirrors of no size.
    #[error("tilt: mirror_pitch: it must be above zero")]
    MirrorPitch,
    /// A tilted display whose swaths share columns of their own.
    #[error("overlap: tilted swaths share the columns of their slanted ends: write 0")]
    TiltOverlap,
    /// A tilted display whose mirrors are not all alike.
    #[error("{0}: a tilted display does not make up for uneven mirrors: leave it out")]
    TiltUneven(&'static str),
}

/// The built-in displays. A scan may ask for its mirrors often, and a file takes time to read.
static DISPLAYS: LazyLock<Vec<Display>> = LazyLock::new(|| Display::builtins().collect());

impl Scan {
    /// Returns the mirrors in use across the scan and along it, from the file or else from the
    /// display.
    ///
    /// A scan of a file that was read has one of both, because [`ScanError::NoMirrors`] refuses
    /// others. For a scan that was made by hand without either, a single mirror is returned.
    pub fn mirrors(&self) -> [u32; 2] {
        self.given_mirrors().unwrap_or([1, 1])
    }

    /// Returns the most rows by which the picture moves in a second, from the file or else the
    /// display's rate of black and white pictures.
    ///
    /// A scan of a file that was read has one of both, because [`ScanError::NoRowClock`] refuses
    /// others. For a scan that was made by hand without either, one row a second is returned.
    pub fn row_clock_hz(&self) -> f64 {
        self.given_row_clock_hz().unwrap_or(1.0)
    }

    fn given_mirrors(&self) -> Option<[u32; 2]> {
        self.mirrors.or_else(|| Some(self.known_display()?.mirrors))
    }

    fn given_row_clock_hz(&self) -> Option<f64> {
        self.row_clock_hz.or_else(|| self.known_display()?.binary_rate_hz)
    }

    fn known_display(&self) -> Option<&'static Display> {
        let name = self.display.as_ref()?;
        DISPLAYS.iter().find(|display| display.name == *name)
    }

    pub(super) fn check(&self) -> Result<(), ScanError> {
        let mirrors = self.check_mirrors()?;
        let [least, most] = self.speed;
        if least > most {
            return Err(ScanError::Speed { least, most });
        }
        let row_clock_hz = self.given_row_clock_hz().ok_or(ScanError::NoRowClock)?;
        // NaN is not above zero and lies in no range, so `nan` is refused by all that follow.
        for (key, number) in [
            ("row_clock_hz", Some(row_clock_hz)),
            ("irradiance_mw_per_cm2", self.irradiance_mw_per_cm2),
        ] {
            if number.is_some_and(|number| !(number > 0.0 && number.is_finite())) {
                return Err(ScanError::NotAboveZero(key));
            }
        }
        if !(0.0..=1e6).contains(&self.settle_s) {
            return Err(ScanError::Settle);
        }
        if !(self.strobe > 0.0 && self.strobe <= 1.0) {
            return Err(ScanError::Strobe);
        }
        if !(1..=1000).contains(&self.passes) {
            return Err(ScanError::Passes);
        }
        self.faults.as_ref().map_or(Ok(()), |faults| faults.check(mirrors))?;
        self.tilt.as_ref().map_or(Ok(()), |tilt| self.check_tilt(tilt, mirrors))
    }

    /// Checks that a point is below at most two neighboring swaths, so that their slanted ends add up.
    fn check_tilt(&self, tilt: &ScanTilt, mirrors: [u32; 2]) -> Result<(), ScanError> {
        let [across, along] = mirrors.map(f64::from);
        let most = 45.0_f64.min((across / along).atan().to_degrees());
        // NaN is in no range.
        if !(-most..=most).contains(&tilt.degrees) {
            return Err(ScanError::Tilt { degrees: tilt.degrees, mirrors, most });
        }
        if tilt.mirror_pitch.is_some_and(|pitch| pitch.mm() <= 0.0) {
            return Err(ScanError::MirrorPitch);
        }
        if self.overlap > 0 {
            return Err(ScanError::TiltOverlap);
        }
        let uneven = [("light", self.light.is_some()), ("faults", self.faults.is_some())];
        match uneven.into_iter().find(|(_, is_there)| *is_there) {
            Some((key, _)) => Err(ScanError::TiltUneven(key)),
            None => Ok(()),
        }
    }

    /// Checks the display, the mirrors and the pixels that swaths share, and returns the mirrors.
    fn check_mirrors(&self) -> Result<[u32; 2], ScanError> {
        if let (Some(name), None) = (&self.display, self.known_display()) {
            let known = Display::BUILTINS.iter().map(|builtin| builtin.name).collect();
            return Err(ScanError::UnknownDisplay { name: one_line(name), known });
        }
        let mirrors = self.given_mirrors().ok_or(ScanError::NoMirrors)?;
        if !mirrors.iter().all(|side| (1..=65_535).contains(side)) {
            return Err(ScanError::Mirrors);
        }
        if let Some(Display { name, mirrors: most, .. }) = self.known_display() {
            // The longer side may lie along the scan, too.
            let sorted = |[a, b]: [u32; 2]| [a.max(b), a.min(b)];
            if sorted(mirrors).iter().zip(sorted(*most)).any(|(side, most)| *side > most) {
                let display = name.clone();
                return Err(ScanError::MoreThanDisplay { mirrors, display, most: *most });
            }
        }
        let (overlap, across) = (self.overlap, mirrors[0]);
        // A seam joins two swaths, never three.
        if overlap >= across.div_ceil(2) {
            return Err(ScanError::Overlap { overlap, across });
        }
        Ok(mirrors)
    }
}

impl MirrorFaults {
    fn check(&self, mirrors: [u32; 2]) -> Result<(), ScanError> {
        let dead = distinct("dead", &self.dead, mirrors)?;
        let stuck = distinct("stuck", &self.stuck, mirrors)?;
        dead.intersection(&stuck).next().map_or(Ok(()), |both| Err(ScanError::DeadAndStuck(*both)))
    }
}

/// Returns a list's mirrors, each of which must exist and be listed once.
fn distinct(
    list: &'static str,
    faults: &[[u32; 2]],
    mirrors: [u32; 2],
) -> Result<BTreeSet<[u32; 2]>, ScanError> {
    let mut seen = BTreeSet::new();
    for &mirror in faults {
        if mirror[0] >= mirrors[0] || mirror[1] >= mirrors[1] {
            return Err(ScanError::FaultOutside { list, mirror, mirrors });
        }
        if !seen.insert(mirror) {
            return Err(ScanError::FaultTwice { list, mirror });
        }
    }
    Ok(seen)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Machine;

    const MACHINE: &str =
        "name = \"mine\"\ndescription = \"\"\n[area]\nvalue = \"100x40mm\"\nsource = \"-\"\n";

    const WHOLE: &str = r#"[scan]
mirrors = [1024, 768]
overlap = 32
speed = ["1mm/s", "200mm/s"]
acceleration = "2000mm/s2"
row_clock_hz = 22000
both_ways = true
source = "data sheet"
direction = "up"
settle_s = 0.05
strobe = 0.5
passes = 4
irradiance_mw_per_cm2 = 20.0
[scan.light]
file = "light.png"
source = "camera"
[scan.faults]
dead = [[512, 4]]
stuck = [[7, 700]]
source = "camera"
"#;

    const LEAST: &str = r#"[scan]
mirrors = [3, 1]
overlap = 0
speed = ["5mm/s", "5mm/s"]
acceleration = "1m/s2"
row_clock_hz = 0.5
both_ways = false
source = "-"
"#;

    fn machine(more: &str) -> Result<Machine, String> {
        Machine::from_toml(&format!("{MACHINE}{more}")).map_err(|error| error.to_string())
    }

    fn scan(more: &str) -> Scan {
        machine(more).unwrap().scan.unwrap()
    }

    #[test]
    fn every_key_is_read() {
        let speed = |mm| Speed::new(mm).unwrap();
        let source = "camera".to_owned();
        let whole = Scan {
            display: None,
            mirrors: Some([1024, 768]),
            overlap: 32,
            speed: [speed(1.0), speed(200.0)],
            acceleration: Acceleration::new(2000.0).unwrap(),
            row_clock_hz: Some(22_000.0),
            both_ways: true,
            direction: ScanDirection::Up,
            settle_s: 0.05,
            strobe: 0.5,
            passes: 4,
            irradiance_mw_per_cm2: Some(20.0),
            light: Some(ScanLight { file: "light.png".into(), source: source.clone() }),
            faults: Some(MirrorFaults { dead: vec![[512, 4]], stuck: vec![[7, 700]], source }),
            tilt: None,
            source: "data sheet".to_owned(),
        };
        assert_eq!(scan(WHOLE), whole);
        assert_eq!((whole.mirrors(), whole.row_clock_hz()), ([1024, 768], 22_000.0));
        assert_eq!(machine(WHOLE).unwrap().swaths(), Some((1024, 32)));
    }

    #[test]
    fn keys_that_may_be_left_out_have_their_defaults() {
        let least = scan(LEAST);
        assert_eq!((least.direction, least.settle_s), (ScanDirection::Down, 0.0));
        assert_eq!((least.strobe, least.passes), (1.0, 1));
        assert_eq!(
            (&least.light, &least.faults, least.irradiance_mw_per_cm2),
            (&None, &None, None)
        );
        for key in LEAST.lines().skip(1) {
            let error = machine(&LEAST.replacen(key, "", 1)).unwrap_err();
            let name = key.split(' ').next().unwrap();
            assert!(error.contains(name) && error.contains("add "), "{key}: {error}");
        }
        let faults = scan(&format!("{LEAST}[scan.faults]\nsource = \"-\"\n")).faults.unwrap();
        assert!(faults.dead.is_empty() && faults.stuck.is_empty());
    }

    #[test]
    fn a_display_stands_in_for_mirrors_and_row_clock() {
        let [mirrors, row_clock] = ["mirrors = [3, 1]", "row_clock_hz = 0.5"];
        let with = |text: &str| format!("{text}display = \"dlp7000\"\n");
        let bare = with(&LEAST.replacen(mirrors, "", 1).replacen(row_clock, "", 1));
        assert_eq!((scan(&bare).mirrors(), scan(&bare).row_clock_hz()), ([1024, 768], 32_552.0));
        assert_eq!(machine(&bare).unwrap().swaths(), Some((1024, 0)));
        let own = scan(&with(LEAST));
        assert_eq!((own.mirrors(), own.row_clock_hz()), ([3, 1], 0.5));
        // A display may be turned, but not grow.
        assert_eq!(scan(&with(&LEAST.replacen("[3, 1]", "[768, 1024]", 1))).mirrors(), [768, 1024]);
        for more in ["[1025, 1]", "[769, 1024]"] {
            let error = machine(&with(&LEAST.replacen("[3, 1]", more, 1))).unwrap_err();
            assert!(error.contains("more than the 1024x768 of the display dlp7000"), "{error}");
        }
        let unknown = machine(&bare.replacen("dlp7000", "dlp1", 1)).unwrap_err();
        assert!(unknown.contains("write one of dlp7000, dlp9500, dlp9000x, or"), "{unknown}");
        // The rate of the DLP9000X is not known.
        let no_rate = machine(&bare.replacen("dlp7000", "dlp9000x", 1)).unwrap_err();
        assert!(no_rate.contains("row_clock_hz: add the most rows in a second"), "{no_rate}");
        let stated = with(&LEAST.replacen(mirrors, "", 1)).replacen("dlp7000", "dlp9000x", 1);
        assert_eq!((scan(&stated).mirrors(), scan(&stated).row_clock_hz()), ([2560, 1600], 0.5));
    }

    #[test]
    fn errors_name_the_key_and_what_to_do() {
        let both = "dead = [[512, 4], [7, 700]]";
        for (from, to, words) in [
            ("[1024, 768]", "[0, 768]", &["scan: mirrors", "between 1 and 65535"][..]),
            ("[1024, 768]", "[1024, 65536]", &["scan: mirrors", "between 1 and 65535"]),
            ("[1024, 768]", "[1024]", &["line 7", "scan.mirrors"]),
            ("[1024, 768]", "[-1, 768]", &["line 7", "scan.mirrors"]),
            ("[1024, 768]", "[4294967296, 768]", &["line 7", "scan.mirrors"]),
            ("overlap = 32", "overlap = 512", &["scan: overlap: 512", "half of the 1024"]),
            ("overlap = 32", "overlap = 4294967295", &["scan: overlap: 4294967295"]),
            ("\"1mm/s\"", "\"201mm/s\"", &["scan: speed", "201mm/s", "200mm/s", "least first"]),
            ("\"1mm/s\"", "\"0mm/s\"", &["line 9", "scan.speed", "above zero"]),
            ("\"1mm/s\"", "\"1\"", &["line 9", "scan.speed", "`1` is not a speed"]),
            ("\"1mm/s\"", "1", &["line 9", "scan.speed"]),
            ("\"2000mm/s2\"", "\"2000mm/s\"", &["line 10", "scan.acceleration", "mm/s2"]),
            ("22000", "0", &["scan: row_clock_hz", "above zero"]),
            ("22000", "nan", &["scan: row_clock_hz", "above zero"]),
            ("22000", "inf", &["scan: row_clock_hz", "above zero"]),
            ("\"up\"", "\"left\"", &["scan.direction", "`left`", "down", "up"]),
            ("settle_s = 0.05", "settle_s = -1", &["scan: settle_s", "between 0 and"]),
            ("settle_s = 0.05", "settle_s = nan", &["scan: settle_s", "between 0 and"]),
            ("settle_s = 0.05", "settle_s = inf", &["scan: settle_s", "between 0 and"]),
            ("strobe = 0.5", "strobe = 0", &["scan: strobe", "at most 1"]),
            ("strobe = 0.5", "strobe = 1.01", &["scan: strobe", "at most 1"]),
            ("strobe = 0.5", "strobe = nan", &["scan: strobe", "at most 1"]),
            ("passes = 4", "passes = 0", &["scan: passes", "between 1 and 1000"]),
            ("passes = 4", "passes = 1001", &["scan: passes", "between 1 and 1000"]),
            ("20.0", "0", &["scan: irradiance_mw_per_cm2", "above zero"]),
            ("20.0", "inf", &["scan: irradiance_mw_per_cm2", "above zero"]),
            ("\"light.png\"", "\"\"", &["scan.light.file", "is empty"]),
            ("[[512, 4]]", "[[1024, 4]]", &["faults: dead", "[1024, 4]", "1024x768", "from 0"]),
            ("[[7, 700]]", "[[7, 768]]", &["faults: stuck", "[7, 768]", "1024x768"]),
            ("[[512, 4]]", "[[5, 4], [5, 4]]", &["faults: dead", "[5, 4]", "twice"]),
            ("dead = [[512, 4]]", both, &["faults", "[7, 700]", "both dead and stuck"]),
            (
                "overlap = 32",
                "overlap = 32\ndisplay = \"dlp1\"",
                &["scan: display: `dlp1`", "mirrors"],
            ),
            ("overlap = 32", "overlap = 32\nwidth = 1", &["width", "overlap"]),
        ] {
            assert!(WHOLE.contains(from), "{from}");
            let error = machine(&WHOLE.replacen(from, to, 1)).unwrap_err();
            for word in words {
                assert!(error.contains(word), "no `{word}` in {error:?}");
            }
            assert!(!error.contains('\n'), "{error:?}");
        }
    }

    #[test]
    fn limits_themselves_are_allowed() {
        for (from, to) in [
            ("[1024, 768]", "[65535, 65535]"),
            ("overlap = 32", "overlap = 511"),
            ("strobe = 0.5", "strobe = 1"),
            ("passes = 4", "passes = 1000"),
            ("[[512, 4]]", "[[1023, 767], [0, 0]]"),
            ("settle_s = 0.05", "settle_s = 0"),
        ] {
            scan(&WHOLE.replacen(from, to, 1));
        }
    }

    #[test]
    fn a_tilted_display_is_even_and_shares_no_columns_of_its_own() {
        let tilted =
            |scan: &str, more: &str| machine(&format!("{scan}[scan.tilt]\nsource = \"-\"\n{more}"));
        let found = tilted(LEAST, "degrees = -14\nmirror_pitch = \"16.93um\"\n").unwrap();
        // Strips are cut along the scan, and these swaths are slanted.
        assert_eq!(found.swaths(), None);
        let tilt = found.scan.unwrap().tilt.unwrap();
        assert_eq!((tilt.degrees, tilt.mirror_pitch), (-14.0, Some(Length::from_um(16.93))));
        let whole = WHOLE.replacen("overlap = 32", "overlap = 0", 1);
        let even = whole.split_once("[scan.light]").unwrap().0;
        assert!(tilted(even, "degrees = 45\n").is_ok());
        for (scan, more, words) in [
            (LEAST, "degrees = nan\n", "scan: tilt: degrees: NaN is too far for 3x1"),
            (LEAST, "degrees = 45.1\n", "from -45.000 to 45.000"),
            (&LEAST.replacen("[3, 1]", "[3, 6]", 1), "degrees = 30\n", "from -26.565 to 26.565"),
            (LEAST, "degrees = 1\nmirror_pitch = \"0um\"\n", "tilt: mirror_pitch: it must"),
            (WHOLE, "degrees = 1\n", "scan: overlap: tilted swaths"),
            (&whole, "degrees = 1\n", "scan: light: a tilted display"),
        ] {
            let error = tilted(scan, more).unwrap_err();
            assert!(error.contains(words), "{error}");
        }
    }

    #[test]
    fn a_machine_has_strips_or_a_scan() {
        let strips = "[strips]\nmirrors = 64\noverlap = 8\nsource = \"-\"\n";
        let error = machine(&format!("{strips}{LEAST}")).unwrap_err();
        assert!(error.contains("[strips]") && error.contains("[scan]"), "{error}");
        assert_eq!(machine(strips).unwrap().swaths(), Some((64, 8)));
        assert_eq!(machine("").unwrap().swaths(), None);
    }

    #[test]
    fn a_scan_has_no_speed_among_the_times() {
        let times = |key| format!("{LEAST}[times]\n{key} = 5\nsource = \"-\"\n");
        assert!(machine(&times("recoat_s")).is_ok());
        let error = machine(&times("swath_speed_mm_per_s")).unwrap_err();
        assert!(error.contains("is for [strips]") && error.contains("[scan]"), "{error}");
    }
}
