//! Opens parts from files and streams, STL or STEP, as their content says.

use std::fs::File;
use std::io::{Cursor, Read};
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use lamp_brep::{
    BodyFault, BodyReport, BrepError, Prepared, ReadFn, START_BYTES, is_step, prepare,
};
use lamp_stack::{Length, one_line};

use crate::error::SliceError;
use crate::part::Part;

/// The program that reads STEP files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum KernelName {
    /// LAMP itself.
    #[default]
    Lamp,
    /// OpenCASCADE.
    #[cfg(feature = "occt")]
    Occt,
}

impl KernelName {
    fn read(self) -> ReadFn {
        match self {
            Self::Lamp => lamp_brep::read_step,
            #[cfg(feature = "occt")]
            Self::Occt => lamp_brep_occt::read,
        }
    }
}

/// Options for reading STEP files. STL files take none.
#[derive(Clone, Debug)]
pub struct OpenOptions {
    /// The program that reads them.
    pub kernel: KernelName,
    /// The greatest distance of facets from the exact surfaces.
    pub tolerance: Length,
    /// The time limit.
    pub timeout: Duration,
    /// Whether bodies may have gaps, because something else stands in for the layers
    /// that have them.
    pub allow_gaps: bool,
}

impl Default for OpenOptions {
    /// LAMP's own kernel, 5 um and 300 s; bodies must be closed.
    fn default() -> Self {
        Self {
            kernel: KernelName::Lamp,
            tolerance: Length::from_um(5.0),
            timeout: Duration::from_secs(300),
            allow_gaps: false,
        }
    }
}

impl Part {
    /// Opens an STL or STEP file. Which one it is follows from its content.
    ///
    /// A binary STL must not change while the part is in use.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, is neither, contradicts itself or
    /// holds no facets; or if bodies of a STEP file have faults.
    pub fn open(path: &Path, options: &OpenOptions) -> Result<Self, SliceError> {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut file = File::open(path)?;
        let mut start = Vec::new();
        // `from_stl` refuses folders, which cannot be read.
        let read = (&file).take(START_BYTES).read_to_end(&mut start);
        if read.is_err() || !is_step(&start) {
            return Self::from_stl(name, &file);
        }
        file.read_to_end(&mut start)?;
        Self::from_step(&name, start, options)
    }

    /// Reads an STL or STEP file from a stream, such as standard input; an STL by way
    /// of a temporary file.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn from_stream(
        name: &str,
        mut stream: impl Read,
        options: &OpenOptions,
    ) -> Result<Self, SliceError> {
        let mut start = Vec::new();
        stream.by_ref().take(START_BYTES).read_to_end(&mut start)?;
        if is_step(&start) {
            stream.read_to_end(&mut start)?;
            return Self::from_step(name, start, options);
        }
        let mut file = tempfile::tempfile()?;
        std::io::copy(&mut Cursor::new(start).chain(stream), &mut file)?;
        Self::from_stl(name.to_owned(), &file)
    }

    /// Reads the bytes of a STEP file.
    ///
    /// # Errors
    /// Returns an error if they cannot be read in time, or if bodies have faults.
    pub fn from_step(
        name: &str,
        bytes: impl Into<Arc<[u8]>>,
        options: &OpenOptions,
    ) -> Result<Self, SliceError> {
        let bytes = bytes.into();
        let prepared = read_step(bytes.clone(), options)?;
        refuse_faults(&prepared, options.allow_gaps)?;
        Ok(Self::from_surfaces(name, &bytes, prepared))
    }
}

/// Files nest entities as deep as they like.
const STACK_BYTES: usize = 64 << 20;

/// Reads the bytes of a STEP file for a report. Faults of bodies are in it.
///
/// # Errors
/// Returns an error if they cannot be read in time.
pub fn read_step(bytes: Arc<[u8]>, options: &OpenOptions) -> Result<Prepared, SliceError> {
    let OpenOptions { kernel, tolerance, timeout, .. } = *options;
    let (sender, receiver) = channel();
    // A thread of its own, which is left behind if it hangs.
    thread::Builder::new().stack_size(STACK_BYTES).spawn(move || {
        // Nobody listens any more once time is up.
        let _ = sender.send(prepare(&bytes, kernel.read(), tolerance.mm()));
    })?;
    match receiver.recv_timeout(timeout) {
        Ok(prepared) => Ok(prepared?),
        Err(RecvTimeoutError::Timeout) => Err(SliceError::Timeout { timeout, tolerance }),
        Err(RecvTimeoutError::Disconnected) => {
            Err(BrepError::Panicked { doing: "reading the file", what: String::new() }.into())
        }
    }
}

fn refuse_faults(prepared: &Prepared, allow_gaps: bool) -> Result<(), SliceError> {
    let is_allowed = |fault: &BodyFault| allow_gaps && matches!(fault, BodyFault::Open { .. });
    let bodies = (1..).zip(&prepared.reports);
    let mut faults = bodies.flat_map(|(number, report)| {
        let faults = report.faults.iter().filter(|fault| !is_allowed(fault));
        faults.map(move |fault| (number, report, fault))
    });
    let Some((number, report, fault)) = faults.next() else { return Ok(()) };
    Err(SliceError::Faulty {
        body: body_name(number, report),
        fault: fault.clone(),
        finding: prepared.mesh.findings.first().cloned(),
        more: faults.count(),
    })
}

/// Returns a body's name for messages: its number, from 1, and its name in the file.
pub fn body_name(number: usize, report: &BodyReport) -> String {
    match report.name.trim() {
        "" => format!("body {number}"),
        name => format!("body {number} ({})", one_line(name)),
    }
}
