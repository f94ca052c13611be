//! Writes a build, its strips or fields, or both.

use std::path::{Path, PathBuf};

use clap::{ArgGroup, Args};
use lamp_build::{FieldForm, FieldKind, FieldWriter, FieldsError, Seam};
use lamp_machine::{Machine, MachineFields};
use lamp_stack::{Layer, is_stack_name};

use crate::args::options::{Output, one_of_described};
use crate::exit::Exit;
use crate::streams::{counting, format, is_stream, new_folder, write_layers};
use crate::terminal::progress::Progress;

const HEADING: &str = "Strips of a projector that scans, fields of one that steps";

/// Options of strips and fields.
#[derive(Args, Clone, Debug)]
#[command(group = ArgGroup::new("cut").args(["strips", "fields"]))]
pub(super) struct CutArgs {
    /// Cut each layer into the swaths that a scanning projector exposes. This new folder gets one
    /// stack per swath and an index, strips.json. lamp join puts the build together again
    #[arg(long, value_name = "DIR", help_heading = HEADING)]
    strips: Option<PathBuf>,

    /// Number of mirrors across the projector's path, the width of a swath in pixels [default: the
    /// machine's]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    #[arg(requires = "strips", conflicts_with = "fields", help_heading = HEADING)]
    mirrors: Option<u32>,

    /// Cut each layer into fields of this many pixels, for a projector that steps: 2560x1600, or
    /// machine for the machine's. The folder -o gets one stack per field and an index, fields.json.
    /// lamp join puts the build together again
    #[arg(long, value_name = "WxH|machine", value_parser = parse_field, help_heading = HEADING)]
    fields: Option<FieldSize>,

    /// Number of pixels that a swath or a field shares with each neighbor, where their doses blend
    /// [default: the machine's, or 0 with --mirrors or --fields WxH]
    #[arg(long, value_name = "N", requires = "cut", help_heading = HEADING)]
    overlap: Option<u32>,

    /// Exposure of the pixels that neighbors share; the exposures of all always add up to the
    /// build's
    #[arg(long, default_value_t, requires = "cut", help_heading = HEADING)]
    #[arg(value_parser = one_of_described::<Seam>(&[
        "Each pixel belongs to one neighbor: each row changes over at its own column, and each column at \
         its own row, which differ in each layer. Black and white do not change",
        "Levels fall in one neighbor as they rise in the other; gray pages are many times larger",
    ]))]
    seam: Seam,
}

/// The size of fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FieldSize {
    /// As the machine's.
    Machine,
    /// The width and height in pixels.
    Pixels([u32; 2]),
}

fn parse_field(text: &str) -> Result<FieldSize, String> {
    if text == "machine" {
        return Ok(FieldSize::Machine);
    }
    let side = |side: &str| side.parse::<u32>().ok().filter(|&pixels| pixels > 0);
    let sides = text.split_once('x').and_then(|(width, height)| side(width).zip(side(height)));
    match sides {
        Some((width, height)) => Ok(FieldSize::Pixels([width, height])),
        None => Err("write the pixels of a field, such as 2560x1600, or machine".to_owned()),
    }
}

impl CutArgs {
    /// Returns the folder of the strips or fields, if they are written. The output of fields is
    /// their folder.
    pub(super) fn folder<'a>(&'a self, output: Option<&'a PathBuf>) -> Option<&'a PathBuf> {
        self.strips.as_ref().or(output.filter(|_| self.fields.is_some()))
    }

    /// Returns whether fields are wanted.
    pub(super) fn makes_fields(&self) -> bool {
        self.fields.is_some()
    }

    /// Checks that the output can be a folder of fields, if they are wanted. It may be missing if
    /// there is something else to write.
    pub(super) fn check(&self, output: Option<&PathBuf>, may_be_missing: bool) -> Result<(), Exit> {
        match output {
            _ if !self.makes_fields() => Ok(()),
            None if may_be_missing => Ok(()),
            Some(output) if !is_stream(output) && !is_stack_name(output) => Ok(()),
            _ => Err(Exit::usage(
                "--fields writes a folder with a stack of each field: name it with -o, such as -o \
                 fields/ (lamp join makes one stack of it)",
            )),
        }
    }

    /// Returns how the build is cut, if it is.
    pub(super) fn form(&self, machine: Option<&Machine>) -> Result<Option<FieldForm>, Exit> {
        if let Some(size) = self.fields {
            return self.field_form(size, machine).map(Some);
        }
        if self.strips.is_none() {
            return Ok(None);
        }
        let of_machine = machine.and_then(Machine::swaths);
        let mirrors = self.mirrors.or(of_machine.map(|(mirrors, _)| mirrors));
        let Some(width) = mirrors else {
            return Err(Exit::usage(match machine {
                None => "--strips needs --mirrors, or a --machine that has [strips] or [scan]"
                    .to_owned(),
                Some(Machine { name, scan: Some(_), .. }) => format!(
                    "--strips: the machine {name} scans slanted swaths, which no strip fits: give the build \
                     to lamp job"
                ),
                Some(Machine { name, .. }) => format!(
                    "--strips needs --mirrors: the machine {name} has no [strips] or [scan] (docs/tile.md)"
                ),
            }));
        };
        let of_machine = of_machine.filter(|_| self.mirrors.is_none());
        let overlap = self.overlap.or(of_machine.map(|(_, overlap)| overlap)).unwrap_or(0);
        Ok(Some(FieldForm { width, height: None, overlap, seam: self.seam }))
    }

    /// Returns how fields are cut.
    fn field_form(&self, size: FieldSize, machine: Option<&Machine>) -> Result<FieldForm, Exit> {
        let ([width, height], overlap) = match size {
            FieldSize::Pixels(pixels) => (pixels, 0),
            FieldSize::Machine => match machine.and_then(|machine| machine.fields.as_ref()) {
                Some(MachineFields { pixels, overlap, .. }) => (*pixels, *overlap),
                None => {
                    return Err(Exit::usage(match machine {
                        None => "--fields machine needs a --machine that has [fields]".to_owned(),
                        Some(Machine { name, .. }) => format!(
                            "the machine {name} has no [fields] (docs/machines.md): write --fields \
                             WxH"
                        ),
                    }));
                }
            },
        };
        let overlap = self.overlap.unwrap_or(overlap);
        let form = FieldForm { width, height: Some(height), overlap, seam: self.seam };
        // The size of the build is not known yet.
        form.fields([0, 0]).map_err(Exit::wrong_options)?;
        Ok(form)
    }

    /// Returns the writer of the strips or fields, if any are wanted.
    pub(super) fn writer(
        &self,
        form: Option<FieldForm>,
        output: Option<&PathBuf>,
        classic: bool,
        force: bool,
    ) -> Result<Option<CutOutput>, Exit> {
        let Some((form, folder)) = form.zip(self.folder(output)) else { return Ok(None) };
        let new = new_folder(folder, force)?;
        match FieldWriter::new(new, form, format(classic)) {
            Ok(writer) => Ok(Some(CutOutput { folder: folder.to_owned(), writer })),
            Err(error @ (FieldsError::Swaths(_) | FieldsError::Mirrors { .. })) => {
                Err(Exit::wrong_options(error))
            }
            Err(error) => Err(failed(folder, error)),
        }
    }
}

/// Returns the form of fields of rows and columns, of which a build's time is made.
pub(super) fn of_steps(form: Option<FieldForm>) -> Option<FieldForm> {
    form.filter(|form| form.kind() == FieldKind::Field)
}

fn failed(folder: &Path, error: FieldsError) -> Exit {
    Exit::Failed(error.into()).at(folder.display().to_string())
}

/// The strips or fields that are being written.
pub(super) struct CutOutput {
    folder: PathBuf,
    writer: FieldWriter,
}

/// Writes a build, its strips or fields, or both.
pub(super) fn write(
    build: impl Iterator<Item = Result<Layer, Exit>>,
    cut: Option<CutOutput>,
    output: Option<&Output>,
    progress: &Progress,
) -> Result<(), Exit> {
    let mut cut = cut;
    let layers = build.map(|layer| {
        let layer = layer?;
        if let Some(CutOutput { folder, writer }) = &mut cut {
            writer.push(&layer).map_err(|error| failed(folder, error))?;
        }
        Ok(layer)
    });
    match output {
        Some(output) => write_layers(layers, output, progress)?,
        None => drain(layers, progress)?,
    }
    if let Some(CutOutput { folder, writer }) = cut {
        writer.finish().map_err(|error| failed(&folder, error))?;
        progress.wrote_layers(&folder);
    }
    Ok(())
}

/// Takes all layers, counting them in `report`.
fn drain(
    layers: impl Iterator<Item = Result<Layer, Exit>>,
    progress: &Progress,
) -> Result<(), Exit> {
    let mut layers = layers.inspect(counting(progress));
    let done = layers.try_for_each(|layer| layer.map(drop));
    progress.done();
    done
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_field_is_two_numbers_of_pixels() {
        assert_eq!(parse_field("2560x1600"), Ok(FieldSize::Pixels([2560, 1600])));
        assert_eq!(parse_field("1x1"), Ok(FieldSize::Pixels([1, 1])));
        assert_eq!(parse_field("machine"), Ok(FieldSize::Machine));
        for text in
            ["", "x", "9", "0x9", "9x0", "9x", "-9x9", "9x9px", "9x9x9", "9 x 9", "4294967296x1"]
        {
            assert!(parse_field(text).unwrap_err().contains("2560x1600"), "{text}");
        }
    }
}
