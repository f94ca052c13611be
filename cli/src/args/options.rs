//! Options that several commands share, and parsers of their values.

use std::num::NonZeroU32;
use std::ops::Range;
use std::path::PathBuf;
use std::str::FromStr;
use std::thread;

use anyhow::anyhow;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use lamp_gantry::GivenTimes;
use lamp_grayscale::resin::{Intensity, plausible};
use lamp_pipeline::heights::Seconds;
use lamp_pipeline::memory::{in_words, within_limits};
use lamp_stack::{Length, LengthError, Named, StackFormat, skip_sync};

use crate::exit::Exit;

/// The heading of options that every command has.
pub(crate) const GENERAL: &str = "General options";

/// Known times of a build, in place of a machine's and a stack's own.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct TimeArgs {
    /// Count this exposure for each layer, such as 1.5s, in place of its own
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    expose: Option<Seconds>,

    /// Count this time from a layer's exposure to the next one's, such as 9s, in place of the
    /// machine's
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    recoat: Option<Seconds>,
}

impl TimeArgs {
    /// Returns the names of those options that are given.
    pub(crate) fn given(&self) -> impl Iterator<Item = &'static str> {
        [("--expose", self.expose), ("--recoat", self.recoat)]
            .into_iter()
            .filter_map(|(name, time)| time.map(|_| name))
    }
}

impl From<TimeArgs> for GivenTimes {
    fn from(args: TimeArgs) -> Self {
        let seconds = |time: Option<Seconds>| time.map(|Seconds(seconds)| seconds);
        Self { expose_s: seconds(args.expose), recoat_s: seconds(args.recoat) }
    }
}

/// Options of every command.
#[derive(Args, Clone, Debug)]
pub(crate) struct Common {
    /// Print errors only
    #[arg(short, long, global = true, help_heading = GENERAL)]
    pub(crate) quiet: bool,

    /// Print more details
    #[arg(short, long, global = true, help_heading = "General options", conflicts_with = "quiet")]
    pub(crate) verbose: bool,

    /// Use N threads [default: one per processor]
    #[arg(long, short_alias = 'j', value_name = "N", global = true)]
    #[arg(help_heading = GENERAL, hide_short_help = true, value_parser = clap::value_parser!(u16).range(1..=512))]
    threads: Option<u16>,

    /// Do not wait until outputs are on the disk
    ///
    /// By default, commands end once the bytes and names of their outputs are on the disk. With
    /// this option, a power loss or a late disk failure may lose an output that was reported as
    /// written. Use it for files that can be made again
    #[arg(long, global = true, help_heading = GENERAL, hide_short_help = true)]
    no_sync: bool,

    /// Take further options from a TOML file
    ///
    /// Keys are the long options, such as thickness = "50um" or gray = true. A table such as
    /// [slice] applies only to that command. The command line takes precedence
    #[arg(long, value_name = "FILE.toml", global = true, help_heading = GENERAL)]
    options: Option<PathBuf>,

    /// Ignore LAMP_OPTIONS, lamp.toml and your config.toml
    ///
    /// By default, commands take further options from the file that LAMP_OPTIONS names, lamp.toml
    /// in the current folder and config.toml in your settings folder, in this order. lamp config
    /// shows them
    #[arg(long, global = true, help_heading = GENERAL, hide_short_help = true)]
    no_config: bool,
}

/// The memory that a thread takes to start with: its stack, and room to work in.
const THREAD_BYTES: u64 = 8 << 20;

impl Common {
    /// Returns options of a command that reports nothing.
    #[cfg(test)]
    pub(crate) fn quiet() -> Self {
        Self {
            quiet: true,
            verbose: false,
            threads: None,
            no_sync: false,
            options: None,
            no_config: true,
        }
    }

    /// Returns the options file.
    pub(crate) fn file(&self) -> Option<&PathBuf> {
        self.options.as_ref()
    }

    /// Returns whether only named files of options count.
    pub(crate) fn ignores_config(&self) -> bool {
        self.no_config
    }

    /// Sets up the threads. To be called once.
    pub(crate) fn apply(&self) -> Result<(), Exit> {
        if self.no_sync {
            skip_sync();
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(self.threads()?).build_global();
        Ok(pool.map_err(|error| {
            anyhow!("threads cannot be started: {error}: give fewer --threads, or more memory")
        })?)
    }

    /// Returns the number of threads, for which there is room within limits of memory; zero lets
    /// the pool choose.
    fn threads(&self) -> Result<usize, Exit> {
        let asked = self.threads.map_or(0, usize::from);
        let Some(left) = within_limits() else { return Ok(asked) };
        let most = (left / THREAD_BYTES) as usize;
        if most == 0 || asked > most {
            return Err(Exit::Failed(anyhow!(
                "the memory limit leaves {}, too little for {} threads: raise the limit \
                 (ulimit -v), or give fewer --threads",
                in_words(left),
                asked.max(1),
            )));
        }
        let usual = || thread::available_parallelism().map_or(1, usize::from).min(most);
        Ok(if asked == 0 { usual() } else { asked })
    }
}

/// The stack that a stage reads.
#[derive(Args, Clone, Debug)]
pub(crate) struct InputArgs {
    /// The stack to read: a TIFF or picture file, a folder of pages, or - for standard input
    #[arg(value_name = "STACK", default_value = "-")]
    pub(crate) stack: PathBuf,

    /// Use only these layers: A..B is A to B - 1, A-B is A to B; A.. and ..B are open-ended
    #[arg(long, value_name = "A..B", value_parser = parse_layers)]
    pub(crate) layers: Option<Range<u32>>,
}

/// The stack that a stage writes.
#[derive(Args, Clone, Debug)]
pub(crate) struct Output {
    /// Where to write the stack: a file, a folder of pages, or - for standard output
    ///
    /// For a folder, end the name in /, or name an empty folder
    #[arg(short, long, value_name = "OUT", default_value = "-")]
    pub(crate) output: PathBuf,

    /// Format of the file, if the ending of its name does not give it
    #[arg(long, value_name = "FORMAT", value_parser = format_parser())]
    pub(crate) format: Option<StackFormat>,

    /// Write a classic TIFF (at most 4 GiB) instead of a BigTIFF
    #[arg(long)]
    pub(crate) classic: bool,

    /// Compress gray pages with PackBits, for readers without Deflate; files are several times
    /// larger
    #[arg(long)]
    pub(crate) packbits: bool,

    /// Replace a folder that an earlier run wrote, once the new one is complete
    #[arg(long, alias = "overwrite")]
    pub(crate) force: bool,
}

/// Returns a parser of the formats of stacks, which `--help` lists.
pub(crate) fn format_parser() -> impl TypedValueParser<Value = StackFormat> {
    PossibleValuesParser::new(StackFormat::all().map(StackFormat::name))
        .map(|name| StackFormat::named(&name).expect("only names of formats pass"))
}

/// Returns a parser of a library's named values, which `--help` lists.
pub(crate) fn one_of<T: Named>() -> impl TypedValueParser<Value = T> {
    one_of_described(&[])
}

/// Returns a parser of a library's named values; `--help` lists them, each with its line
/// of `help`.
pub(crate) fn one_of_described<T: Named>(
    help: &'static [&'static str],
) -> impl TypedValueParser<Value = T> {
    let value = |(k, names): (usize, &&'static [&'static str])| {
        let value = PossibleValue::new(names[0]).aliases(names[1..].iter());
        if help.is_empty() { value } else { value.help(help[k]) }
    };
    PossibleValuesParser::new(T::NAMES.iter().enumerate().map(value))
        .map(|name| name.parse().expect("only names of the type pass"))
}

/// Parses `A..B`, `A..`, `..B` or a single layer.
pub(crate) fn parse_layers(text: &str) -> Result<Range<u32>, String> {
    parse_range(text, "layer")
}

/// Parses a range of things that are counted from 0, such as `12..40`, which lacks 40, `12-39`, which
/// has 39, or one of them.
pub(crate) fn parse_range(text: &str, thing: &str) -> Result<Range<u32>, String> {
    let wrong = |_| format!("`{text}` is not a range of {thing}s: write A..B, A.., ..B or A-B");
    // People also write what a range ends with.
    let with_end = text.split_once('-').filter(|(start, _)| !start.is_empty());
    let (start, end) = match text.split_once("..").or(with_end) {
        Some((start, end)) if with_end.is_some() => {
            let [start, last]: [u32; 2] =
                [start.parse().map_err(wrong)?, end.parse().map_err(wrong)?];
            (start, last.saturating_add(1))
        }
        Some((start, end)) => {
            let start = if start.is_empty() { 0 } else { start.parse().map_err(wrong)? };
            let end = if end.is_empty() { u32::MAX } else { end.parse().map_err(wrong)? };
            (start, end)
        }
        None => {
            let layer: u32 = text.parse().map_err(wrong)?;
            (layer, layer.saturating_add(1))
        }
    };
    if start >= end {
        return Err(format!("`{text}` contains no {thing}: the end must be above the start"));
    }
    Ok(start..end)
}

/// Some layers of a range: its first and every so many after it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct EveryNth {
    pub(crate) range: Range<u32>,
    pub(crate) step: NonZeroU32,
}

impl EveryNth {
    /// Returns whether a layer is one of them.
    pub(crate) fn holds(&self, layer: u32) -> bool {
        self.range.contains(&layer) && (layer - self.range.start).is_multiple_of(self.step.get())
    }
}

impl FromStr for EveryNth {
    type Err = String;

    /// Parses a range of layers with an optional step: `0..1270/40`.
    fn from_str(text: &str) -> Result<Self, String> {
        let (range, step) = text.split_once('/').unwrap_or((text, "1"));
        let wrong =
            |_| format!("`{text}` is not a range with a step: write A..B/N for every Nth layer");
        Ok(Self { range: parse_layers(range)?, step: step.parse().map_err(wrong)? })
    }
}

/// Parses a length that is not below zero.
pub(crate) fn parse_distance(text: &str) -> Result<Length, String> {
    if text.trim().parse() == Ok(0.0) {
        return Ok(Length::default());
    }
    let length: Length = text.parse().map_err(|error: LengthError| error.to_string())?;
    if length.um() < 0.0 { Err(format!("{length} is below zero")) } else { Ok(length) }
}

/// Parses a length above zero.
pub(crate) fn parse_thickness(text: &str) -> Result<Length, String> {
    let length = parse_distance(text)?;
    if length.um() == 0.0 { Err("the length must be above zero".to_owned()) } else { Ok(length) }
}

/// Parses a time in the range of a machine's file.
pub(crate) fn parse_time(text: &str) -> Result<Seconds, String> {
    let time: Seconds = text.parse()?;
    match time.0 {
        1e-3..=1e6 => Ok(time),
        _ => Err("a time is between 1ms and 1000000s".to_owned()),
    }
}

/// Parses an area that is not below zero, in square millimeters.
pub(crate) fn parse_area(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let number = |text: &str| text.trim_end().parse::<f64>().ok();
    // Zero needs no unit.
    let zero = number(text).filter(|&area| area == 0.0);
    match text.strip_suffix("mm2").and_then(number).or(zero) {
        Some(area) if area < 0.0 => Err(format!("{area}mm2 is below zero")),
        Some(area) if area.is_finite() => Ok(area),
        _ => Err("an area is a number and mm2, such as 1mm2".to_owned()),
    }
}

/// Parses the light of full white, which is some.
pub(crate) fn parse_light(text: &str) -> Result<Intensity, String> {
    match text.parse::<Intensity>() {
        Ok(light) if light.mw_per_cm2() == 0.0 => {
            Err("the intensity must be above zero".to_owned())
        }
        Ok(light) if plausible::INTENSITY.contains(&light) => Ok(light),
        Ok(_) => Err("the intensity must be between 1e-6 and 1e9 mW/cm2".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

/// Parses a count with an optional `k` or `M`: `750k`, `5.5M`.
pub(crate) fn parse_count(text: &str) -> Result<usize, String> {
    let (number, factor) = match text.as_bytes() {
        [.., b'k' | b'K'] => (&text[..text.len() - 1], 1e3),
        [.., b'm' | b'M'] => (&text[..text.len() - 1], 1e6),
        _ => (text, 1.0),
    };
    match number.parse::<f64>() {
        Ok(n) if n >= 0.0 && n * factor < 1e9 => Ok((n * factor).round() as usize),
        _ => Err(format!("`{text}` is not a count: write 20000, 750k or 5.5M")),
    }
}

/// Parses an angle in degrees, from 0 to 180.
pub(crate) fn parse_angle(text: &str) -> Result<f64, String> {
    let number = ["deg", "\u{b0}"].iter().find_map(|unit| text.strip_suffix(unit)).unwrap_or(text);
    match number.trim_end().parse::<f64>() {
        Ok(degrees) if (0.0..=180.0).contains(&degrees) => Ok(degrees),
        _ => Err(format!("`{text}` is not an angle from 0 to 180 degrees: write 45 or 45deg")),
    }
}

/// Parses the memory to work in: at least 16 MB.
pub(crate) fn parse_memory(text: &str) -> Result<u64, String> {
    match parse_bytes(text)? {
        bytes @ 16_000_000.. => Ok(bytes),
        _ => Err(format!("{text} is too little memory: at least 16MB is needed")),
    }
}

/// Parses a number of bytes: `64MB`, `1.5GiB`, `100000`.
fn parse_bytes(text: &str) -> Result<u64, String> {
    let wrong = || format!("`{text}` is not an amount of memory: write 64MB, 2GB or 512MiB");
    let split = text.find(|c: char| c.is_ascii_alphabetic()).unwrap_or(text.len());
    let factor = match text[split..].to_ascii_lowercase().as_str() {
        "" | "b" => 1.0,
        "k" | "kb" => 1e3,
        "m" | "mb" => 1e6,
        "g" | "gb" => 1e9,
        "kib" => 1024.0,
        "mib" => 1024.0 * 1024.0,
        "gib" => 1024.0 * 1024.0 * 1024.0,
        _ => return Err(wrong()),
    };
    match text[..split].trim().parse::<f64>() {
        Ok(n) if n > 0.0 && n * factor < 1e15 => Ok((n * factor) as u64),
        _ => Err(wrong()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_as_long_in_all_units() {
        for zero in ["0", " 0 ", "0.0", "0mm", "0in"] {
            assert_eq!(parse_distance(zero), Ok(Length::default()), "{zero}");
            assert!(parse_thickness(zero).unwrap_err().contains("above zero"), "{zero}");
        }
        for wrong in ["1", "0.5", "", "-1mm", "nan", "0 0"] {
            assert!(parse_distance(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn every_nth_layer_of_a_range() {
        let some: EveryNth = "10..30/8".parse().unwrap();
        let held = |layers: &EveryNth| (0..40).filter(|&k| layers.holds(k)).collect::<Vec<_>>();
        assert_eq!(held(&some), [10, 18, 26]);
        assert_eq!(held(&"..3".parse().unwrap()), [0, 1, 2]);
        assert_eq!(held(&"35../3".parse().unwrap()), [35, 38]);
        for wrong in ["", "1..9/0", "1..9/-1", "1..9/", "/4", "9..1/2"] {
            assert!(wrong.parse::<EveryNth>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn ranges_of_layers() {
        assert_eq!(parse_layers("3..7"), Ok(3..7));
        assert_eq!(parse_layers("..7"), Ok(0..7));
        assert_eq!(parse_layers("3.."), Ok(3..u32::MAX));
        assert_eq!(parse_layers("3"), Ok(3..4));
        for wrong in ["", "7..3", "3..3", "a..b", "-1..2", "1..2..3"] {
            assert!(parse_layers(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn counts_and_bytes() {
        assert_eq!(parse_count("750k"), Ok(750_000));
        assert_eq!(parse_count("5.5M"), Ok(5_500_000));
        assert_eq!(parse_bytes("64MB"), Ok(64_000_000));
        assert_eq!(parse_bytes("1.5GiB"), Ok(1_610_612_736));
        for wrong in ["", "k", "-1", "nan", "1e99", "5x"] {
            assert!(parse_count(wrong).is_err() && parse_bytes(wrong).is_err(), "{wrong}");
        }
    }
}
