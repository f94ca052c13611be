//! Writes a build, its strips, or both.

use std::path::{Path, PathBuf};

use clap::Args;
use lamp_build::{Seam, StripWriter, StripsError};
use lamp_machine::Machine;
use lamp_stack::Layer;

use crate::args::options::{Output, one_of_described};
use crate::exit::Exit;
use crate::streams::{format, new_folder, write_layers};
use crate::terminal::progress::Progress;

const HEADING: &str = "Strips of a projector that scans";

/// Options of the strips.
#[derive(Args, Clone, Debug)]
pub(super) struct StripArgs {
    /// Cut each layer into the swaths that a scanning projector exposes. This new folder gets one
    /// stack per swath and an index, strips.json. lamp join puts the build together again
    #[arg(long, value_name = "DIR", help_heading = HEADING)]
    strips: Option<PathBuf>,

    /// Number of mirrors across the projector's path, the width of a swath in pixels [default: the
    /// machine's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    #[arg(requires = "strips", help_heading = HEADING)]
    mirrors: Option<u32>,

    /// Number of pixels that a swath shares with the next, where their doses blend [default: the
    /// machine's, or 0 with --mirrors]
    #[arg(long, value_name = "N", requires = "strips", help_heading = HEADING)]
    overlap: Option<u32>,

    /// Exposure of the columns that a swath and the next share; the exposures of both always add up
    /// to the build's
    #[arg(long, default_value_t, requires = "strips", help_heading = HEADING)]
    #[arg(value_parser = one_of_described::<Seam>(&[
        "Each pixel belongs to one swath: each row changes over at its own column, which differs in each \
         layer. Black and white do not change",
        "Levels fall in one swath as they rise in the other; gray pages are many times larger",
    ]))]
    seam: Seam,
}

impl StripArgs {
    /// Returns the folder of the strips, if any are wanted.
    pub(super) fn folder(&self) -> Option<&PathBuf> {
        self.strips.as_ref()
    }

    /// Returns the writer of the strips, if any are wanted.
    pub(super) fn writer(
        &self,
        machine: Option<&Machine>,
        classic: bool,
        force: bool,
    ) -> Result<Option<StripOutput>, Exit> {
        let Some(folder) = &self.strips else { return Ok(None) };
        let of_machine = machine.and_then(Machine::swaths);
        let mirrors = self.mirrors.or(of_machine.map(|(mirrors, _)| mirrors));
        let Some(mirrors) = mirrors else {
            return Err(Exit::usage(match machine {
                None => "--strips needs --mirrors, or a --machine that has [strips] or [scan]"
                    .to_owned(),
                Some(Machine { name, .. }) => format!(
                    "--strips needs --mirrors: the machine {name} has no [strips] or [scan] (docs/tile.md)"
                ),
            }));
        };
        let of_machine = of_machine.filter(|_| self.mirrors.is_none());
        let overlap = self.overlap.or(of_machine.map(|(_, overlap)| overlap)).unwrap_or(0);
        let new = new_folder(folder, force)?;
        match StripWriter::new(new, mirrors, overlap, self.seam, format(classic)) {
            Ok(writer) => Ok(Some(StripOutput { folder: folder.to_owned(), writer })),
            Err(error @ (StripsError::Swaths(_) | StripsError::Mirrors { .. })) => {
                Err(Exit::wrong_options(error))
            }
            Err(error) => Err(failed(folder, error)),
        }
    }
}

fn failed(folder: &Path, error: StripsError) -> Exit {
    Exit::Failed(error.into()).at(folder.display().to_string())
}

/// The strips that are being written.
pub(super) struct StripOutput {
    folder: PathBuf,
    writer: StripWriter,
}

/// Writes a build, its strips, or both.
pub(super) fn write(
    build: impl Iterator<Item = Result<Layer, Exit>>,
    strips: Option<StripOutput>,
    output: Option<&Output>,
    progress: &Progress,
) -> Result<(), Exit> {
    let mut strips = strips;
    let cut = build.map(|layer| {
        let layer = layer?;
        if let Some(StripOutput { folder, writer }) = &mut strips {
            writer.push(&layer).map_err(|error| failed(folder, error))?;
        }
        Ok(layer)
    });
    match output {
        Some(output) => write_layers(cut, output, progress)?,
        None => drain(cut, progress)?,
    }
    match strips {
        Some(StripOutput { folder, writer }) => {
            writer.finish().map_err(|error| failed(&folder, error))
        }
        None => Ok(()),
    }
}

/// Takes all layers, counting them in `report`.
fn drain(
    layers: impl Iterator<Item = Result<Layer, Exit>>,
    progress: &Progress,
) -> Result<(), Exit> {
    let mut layers = layers.inspect(|_| progress.layer_done());
    let done = layers.try_for_each(|layer| layer.map(drop));
    progress.done();
    done
}
