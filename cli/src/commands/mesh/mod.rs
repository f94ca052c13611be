//! `lamp mesh`: checks and repairs the meshes of parts.

mod answer;
mod check;
mod repair;
mod text;

use std::io::{Read, stdin};
use std::path::PathBuf;

use anyhow::anyhow;
use clap::{Args, Subcommand};
use lamp_pipeline::memory::{available, in_words};
use lamp_pipeline::solid::part_notes;
use lamp_pipeline::step::ReaderSettings;
use lamp_slicing::{Part, Units};
use lamp_stack::Length;

use crate::args::options::{Common, one_of, parse_memory};
use crate::args::solid::{ReaderArgs, STEP, parse_tolerance};
use crate::exit::Exit;
use crate::streams::{input_name, is_stream};
use crate::terminal::progress::Severity;

/// Check or repair the mesh of a part
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp mesh check blade.stl
  lamp mesh repair blade.stl -o mended.stl --weld 5um")]
pub(crate) struct MeshArgs {
    #[command(subcommand)]
    what: MeshCommand,
}

#[derive(Subcommand)]
enum MeshCommand {
    Check(check::MeshCheckArgs),
    Repair(repair::RepairArgs),
}

pub(crate) fn run(args: &MeshArgs, common: &Common) -> Result<(), Exit> {
    match &args.what {
        MeshCommand::Check(args) => check::run(args, common),
        MeshCommand::Repair(args) => repair::run(args, common),
    }
}

/// The part whose mesh is meant.
#[derive(Args)]
struct MeshPart {
    /// The part: an STL, OBJ, 3MF or STEP file, or - for standard input
    #[arg(value_name = "PART")]
    part: PathBuf,

    /// Unit of coordinates in STL and OBJ files; STEP and 3MF files state their own
    #[arg(long, value_parser = one_of::<Units>(), default_value_t)]
    units: Units,

    /// How far the facets of a STEP part may lie from its surfaces
    #[arg(long, value_name = "LENGTH", default_value = "5um", value_parser = parse_tolerance)]
    #[arg(help_heading = STEP)]
    chord: Length,

    #[command(flatten)]
    reader: ReaderArgs,

    /// Memory limit for the mesh, which takes about 70 bytes per facet [default: all free memory]
    #[arg(long, value_name = "BYTES", value_parser = parse_memory)]
    memory: Option<u64>,
}

/// The bytes that a mesh takes a facet: half a vertex, its corners, its edges and what finds them.
const FACET_BYTES: u64 = 70;

impl MeshPart {
    /// Returns the name for messages.
    fn name(&self) -> String {
        input_name(&self.part)
    }

    /// Opens the part; returns its bytes, too, if they came from a stream.
    fn open(&self, command: &str, common: &Common) -> Result<(Part, Vec<u8>), Exit> {
        let options = ReaderSettings::from(&self.reader).for_opening(self.chord)?;
        // A stream cannot be read twice, and repair copies a mesh in which it changes nothing.
        let mut bytes = Vec::new();
        let part = match is_stream(&self.part) {
            true => stdin()
                .lock()
                .read_to_end(&mut bytes)
                .map_err(Into::into)
                .and_then(|_| Part::from_stream("stdin", &bytes[..], &options)),
            false => Part::open(&self.part, &options),
        };
        let part = part.map_err(|error| Exit::from(error).at(self.name()))?;
        if self.units != Units::default() && part.states_unit() {
            let why = "a STEP or 3MF file states its own unit: leave out --units";
            return Err(Exit::usage(why).at(self.name()));
        }
        let there_is = available();
        // A limit above the free memory would end in a crash.
        let most = self.memory.unwrap_or(there_is).min(there_is);
        let needed = part.facet_count() as u64 * FACET_BYTES;
        if needed > most {
            let [needed, most] = [needed, most].map(in_words);
            return Err(Exit::Failed(anyhow!(
                "its {} facets take some {needed} of memory, and {most} are allowed",
                part.facet_count()
            ))
            .at(self.name()));
        }
        if !common.quiet {
            part_notes(&part)
                .iter()
                .for_each(|note| Severity::Note.say(&format!("{command}: {note}")));
        }
        Ok((part, bytes))
    }
}
