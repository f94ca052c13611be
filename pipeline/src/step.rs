//! How STEP files are read, and notes on the reading.

use std::io::{self, Read};
use std::mem::discriminant;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use lamp_slicing::brep::{BrepFinding, Prepared};
use lamp_slicing::{KernelName, OpenOptions, SliceError, step_bytes};
use lamp_stack::{Length, Pitch, open_ending};
use serde::{Deserialize, Serialize};

use crate::documents::is_stream;
use crate::error::Error;
use crate::solid::is_default;
use crate::words::optional;

/// How STEP parts become facets.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct StepSettings {
    /// The largest distance of facets from surfaces; `None` is a quarter of a pixel.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<Length>,
    /// The program that reads the file.
    #[serde(flatten)]
    pub reader: ReaderSettings,
}

/// The kernel that reads STEP parts, and its time limit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ReaderSettings {
    /// The kernel.
    #[serde(skip_serializing_if = "is_default")]
    pub kernel: Kernel,
    /// Its time limit. It decides no image.
    #[serde(skip)]
    pub timeout: Duration,
}

/// A program that reads STEP parts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Kernel {
    /// LAMP's own.
    #[default]
    Lamp,
    /// OpenCASCADE.
    Occt,
    /// LAMP's own, if OpenCASCADE agrees with it.
    Both,
}

impl Kernel {
    /// Returns the kernel whose images a stack has. The other one only agrees or refuses.
    pub(crate) fn of_images(self) -> Self {
        // The second kernel changes no image, so it must change no record either.
        if self == Self::Both { Self::Lamp } else { self }
    }

    /// Returns the library's kernel.
    ///
    /// # Errors
    /// Returns an error if OpenCASCADE is requested, and this build is without it.
    pub fn of_library(self) -> Result<KernelName, Error> {
        match self {
            Self::Lamp => Ok(KernelName::Lamp),
            #[cfg(feature = "occt")]
            Self::Occt => Ok(KernelName::Occt),
            #[cfg(feature = "occt")]
            Self::Both => Ok(KernelName::Both),
            #[cfg(not(feature = "occt"))]
            Self::Occt | Self::Both => Err(without_occt("--kernel")),
        }
    }
}

impl Default for ReaderSettings {
    fn default() -> Self {
        Self { kernel: Kernel::default(), timeout: Duration::from_secs(300) }
    }
}

impl StepSettings {
    /// Returns the largest distance of facets from surfaces, for images of a resolution.
    pub fn tolerance(&self, pitch: Pitch) -> Length {
        self.tolerance.unwrap_or_else(|| Length::from_um(pitch.short_side().um() / 4.0))
    }
}

impl ReaderSettings {
    /// Returns the options of the library, for facets within a tolerance of surfaces.
    ///
    /// # Errors
    /// Returns an error if OpenCASCADE is requested, and this build is without it.
    pub fn for_opening(&self, tolerance: Length) -> Result<OpenOptions, Error> {
        let kernel = self.kernel.of_library()?;
        Ok(OpenOptions { kernel, tolerance, timeout: self.timeout, ..OpenOptions::default() })
    }
}

/// Returns the refusal of an option that needs OpenCASCADE.
#[cfg(not(feature = "occt"))]
pub fn without_occt(option: &str) -> Error {
    Error::settings(format!(
        "this build is without OpenCASCADE: build with --features occt, or leave out {option}, which IGES needs"
    ))
}

/// Returns notes about how a file was read, for people.
pub fn notes(prepared: &Prepared) -> Vec<String> {
    let mut notes: Vec<String> =
        prepared.kernel.notices().iter().map(ToString::to_string).collect();
    notes.extend(findings(&prepared.mesh.findings));
    if prepared.heal_mm > 0.0 {
        notes.push(format!("edges within {} of each other were joined", length(prepared.heal_mm)));
    }
    // Rejected tries have the tolerance that was asked for. Only an open body gets coarser facets.
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
fn findings(findings: &[BrepFinding]) -> Vec<String> {
    let mut kinds: Vec<(&BrepFinding, usize)> = Vec::new();
    for finding in findings {
        let same = |(other, _): &&mut (&BrepFinding, usize)| {
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
    let line = |(worst, count): (&BrepFinding, usize)| {
        let more = match count {
            1 => String::new(),
            // Faults without a distance have no worst one.
            count if worst.fault.off_mm() == 0.0 => format!(", as are {} others", count - 1),
            2 => ", the worse of two such faces".to_owned(),
            count => format!(", the worst of {count} such faces"),
        };
        format!("#{}: {}{more}", worst.entity, worst.fault)
    };
    kinds.into_iter().map(line).collect()
}

/// Formats a length for people, to three decimals.
pub fn length(mm: f64) -> String {
    let (number, unit) = if mm < 1.0 { (1000.0 * mm, "um") } else { (mm, "mm") };
    let text = format!("{number:.3}");
    format!("{}{unit}", text.trim_end_matches('0').trim_end_matches('.'))
}

/// Returns the bytes of a STEP file, or of standard input, which gzip may have packed.
pub fn bytes_of(path: &Path) -> Result<Arc<[u8]>, SliceError> {
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
