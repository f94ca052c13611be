//! Options for reading STEP files, and notes about what was read.

use std::io::{self, Read};
use std::mem::discriminant;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use clap::{Args, ValueEnum};
use lamp_slicer::brep::{Finding, Prepared};
use lamp_slicer::{KernelName, OpenOptions, SliceError, step_bytes};
use lamp_stack::{Dpi, Length, open_ending};
use serde::{Deserialize, Serialize};

use crate::exit::Exit;
use crate::options::parse_distance;
use crate::recorded::optional;
use crate::streams::is_stream;

pub(crate) const HEADING: &str = "STEP parts";

/// Options for reading STEP parts.
#[derive(Args, Clone, Default, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub(crate) struct BrepOptions {
    /// How far the facets of a STEP part may lie from its surfaces [default: a quarter of a
    /// pixel]
    #[arg(long, value_name = "LENGTH", value_parser = parse_tolerance, help_heading = HEADING)]
    #[serde(with = "optional")]
    tolerance: Option<Length>,

    #[command(flatten)]
    #[serde(flatten)]
    pub(crate) reader: ReaderOptions,
}

/// The program that reads STEP parts, and its time limit.
#[derive(Args, Clone, Serialize, Deserialize)]
#[serde(default)]
pub(crate) struct ReaderOptions {
    /// Kernel that reads STEP parts: LAMP's own, OpenCASCADE, or LAMP's own if OpenCASCADE agrees
    /// with it (the last two in builds with --features occt)
    #[arg(long, value_enum, default_value_t, help_heading = HEADING)]
    kernel: KernelArg,

    /// Time limit for reading a STEP part, in seconds
    #[arg(long, value_name = "SECONDS", default_value = "300", value_parser = parse_seconds)]
    #[arg(help_heading = HEADING)]
    #[serde(skip)]
    timeout: Duration,
}

#[derive(Clone, Copy, Default, PartialEq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum KernelArg {
    #[default]
    Lamp,
    Occt,
    Both,
}

impl Default for ReaderOptions {
    fn default() -> Self {
        Self { kernel: KernelArg::default(), timeout: Duration::from_secs(300) }
    }
}

impl BrepOptions {
    /// Returns how far facets may lie from surfaces, for images of a resolution.
    pub(crate) fn tolerance(&self, dpi: Dpi) -> Length {
        self.tolerance.unwrap_or_else(|| Length::from_um(dpi.pitch().um() / 4.0))
    }
}

impl ReaderOptions {
    /// Returns whether images are those of the default kernel.
    pub(crate) fn is_usual(&self) -> bool {
        self.kernel != KernelArg::Occt
    }

    /// Returns whether both kernels are asked.
    pub(crate) fn asks_both(&self) -> bool {
        self.kernel == KernelArg::Both
    }

    /// Returns the options of the library, for facets within a tolerance of surfaces.
    ///
    /// # Errors
    /// Returns an error if OpenCASCADE is asked for, and this build is without it.
    pub(crate) fn for_opening(&self, tolerance: Length) -> Result<OpenOptions, Exit> {
        let kernel = match self.kernel {
            KernelArg::Lamp => KernelName::Lamp,
            #[cfg(feature = "occt")]
            KernelArg::Occt => KernelName::Occt,
            #[cfg(feature = "occt")]
            KernelArg::Both => KernelName::Both,
            #[cfg(not(feature = "occt"))]
            KernelArg::Occt | KernelArg::Both => return Err(without_occt("--kernel")),
        };
        Ok(OpenOptions { kernel, tolerance, timeout: self.timeout, ..OpenOptions::default() })
    }
}

/// Returns the refusal of an option that needs OpenCASCADE.
#[cfg(not(feature = "occt"))]
pub(crate) fn without_occt(option: &str) -> Exit {
    Exit::usage(format!(
        "this build is without OpenCASCADE: leave out {option}, or build with --features occt"
    ))
}

pub(crate) fn parse_tolerance(text: &str) -> Result<Length, String> {
    let length = parse_distance(text)?;
    let has_some = length.um() > 0.0;
    if has_some { Ok(length) } else { Err("the length must be above zero".to_owned()) }
}

fn parse_seconds(text: &str) -> Result<Duration, String> {
    let seconds = text.trim_end_matches('s').parse().ok();
    let seconds = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    seconds
        .filter(|seconds| !seconds.is_zero())
        .ok_or_else(|| format!("`{text}` is not a time: write seconds, as 60"))
}

/// Returns notes about how a file was read, for people.
pub(crate) fn notes(prepared: &Prepared) -> Vec<String> {
    let mut notes: Vec<String> =
        prepared.kernel.notices().iter().map(ToString::to_string).collect();
    notes.extend(findings(&prepared.mesh.findings));
    if prepared.heal_mm > 0.0 {
        notes.push(format!("edges within {} of each other were joined", length(prepared.heal_mm)));
    }
    let wanted_mm = prepared.tries.first().map_or(prepared.chord_mm, |first| first.chord_mm);
    if prepared.chord_mm > wanted_mm {
        notes.push(format!(
            "its facets lie up to {} from the surfaces, because it is open",
            length(prepared.chord_mm)
        ));
    }
    notes
}

/// Returns a line for each kind of finding, about the worst of that kind.
fn findings(findings: &[Finding]) -> Vec<String> {
    let mut kinds: Vec<(&Finding, usize)> = Vec::new();
    for finding in findings {
        let same = |(other, _): &&mut (&Finding, usize)| {
            discriminant(&other.fault) == discriminant(&finding.fault)
        };
        match kinds.iter_mut().find(same) {
            Some((worst, count)) => {
                *count += 1;
                if finding.fault.off_mm() > worst.fault.off_mm() {
                    *worst = finding;
                }
            }
            None => kinds.push((finding, 1)),
        }
    }
    let line = |(worst, count): (&Finding, usize)| {
        let more = match count {
            1 => String::new(),
            count if worst.fault.off_mm() == 0.0 => format!(", as are {} others", count - 1),
            2 => ", the worse of two such faces".to_owned(),
            count => format!(", the worst of {count} such faces"),
        };
        format!("#{}: {}{more}", worst.entity, worst.fault)
    };
    kinds.into_iter().map(line).collect()
}

/// Formats a length for people, to three decimals.
pub(crate) fn length(mm: f64) -> String {
    let (number, unit) = if mm < 1.0 { (1000.0 * mm, "um") } else { (mm, "mm") };
    let text = format!("{number:.3}");
    format!("{}{unit}", text.trim_end_matches('0').trim_end_matches('.'))
}

/// Returns the bytes of a STEP file, or of standard input, which gzip may have packed.
pub(crate) fn bytes_of(path: &Path) -> Result<Arc<[u8]>, SliceError> {
    let mut bytes = Vec::new();
    if is_stream(path) {
        io::stdin().lock().read_to_end(&mut bytes)?;
    } else if path.is_dir() {
        return Err(SliceError::Folder);
    } else {
        open_ending(path)?.read_to_end(&mut bytes)?;
    }
    step_bytes(bytes)
}
