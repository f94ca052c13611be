//! `lamp edit`: changes a stack at image level.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::{ArgGroup, Args};
use lamp_postprocess::{EditError, Edits, OtherLayers};
use lamp_stack::Op;

use crate::catalogue::read_text;
use crate::exit::Exit;
use crate::options::{Common, Input, Output};
use crate::streams::{
    check_not_input, input_name, is_stream, progress, read_beside, read_layers, write_layers,
};

/// A list of edits is text of a few kilobytes.
const MAX_LIST_BYTES: u64 = 1 << 20;

/// Change a design at image level, without slicing it again
///
/// Adds or subtracts boxes, cylinders, lines, labels and other stacks in a range of heights; crops,
/// pads, mirrors and rotates all layers. Lengths and positions are in part coordinates. Edits are
/// listed in a TOML file and applied in order; docs/edit.md describes every key. Layers that no
/// edit applies to pass byte for byte.
#[derive(Args)]
#[command(group = ArgGroup::new("what").required(true).args(["edits", "union", "intersect", "difference", "xor"]))]
#[command(override_usage = "\
lamp edit [OPTIONS] <STACK> <EDITS.toml>
       lamp edit [OPTIONS] <STACK> <--union|--intersect|--difference|--xor> <STACK>")]
#[command(after_help = "\
Examples:
  lamp edit blade.tif edits.toml -o variant.tif
  slice blade.stl | fix | lamp edit - edits.toml | tile > build.tif
  lamp edit shell.tif --difference core.tif -o hollow.tif

An edits.toml:
  [[edit]]
  op = \"subtract\"
  label = { text = \"SN {n:04}\", start = 17, at = [[\"2mm\", \"1mm\"]], height = \"3mm\" }
  z = [\"0mm\", \"0.5mm\"]")]
pub(crate) struct EditArgs {
    #[command(flatten)]
    input: Input,

    /// The edits, a TOML file
    #[arg(value_name = "EDITS.toml")]
    edits: Option<PathBuf>,

    /// Keep what is white in either stack
    #[arg(long, value_name = "STACK")]
    union: Option<PathBuf>,

    /// Keep what is white in both stacks
    #[arg(long, value_name = "STACK")]
    intersect: Option<PathBuf>,

    /// Remove what is white in this stack
    #[arg(long, value_name = "STACK")]
    difference: Option<PathBuf>,

    /// Keep what is white in exactly one of the stacks
    #[arg(long, value_name = "STACK")]
    xor: Option<PathBuf>,

    #[command(flatten)]
    output: Output,
}

impl EditArgs {
    /// The edits, and the files of the stacks that they name.
    fn edits(&self) -> Result<(Edits, Vec<PathBuf>), Exit> {
        let ways = [
            (Op::Union, &self.union),
            (Op::Intersect, &self.intersect),
            (Op::Difference, &self.difference),
            (Op::Xor, &self.xor),
        ];
        if let Some((op, file)) = ways.into_iter().find_map(|(op, file)| Some((op, file.clone()?)))
        {
            return Ok((Edits::combine(op, file.clone()), vec![file]));
        }
        let list = self.edits.as_deref().expect("one of the group is given");
        let edits = || -> anyhow::Result<Edits> {
            Ok(Edits::from_toml(&read_text(list, MAX_LIST_BYTES, "a list of edits")?)?)
        };
        let edits = edits().with_context(|| input_name(list))?;
        // Files stand beside the list that names them.
        let folder = list.parent().unwrap_or(Path::new(""));
        let files = edits.stacks().map(|file| folder.join(file)).collect();
        Ok((edits, files))
    }

    fn check_streams(&self) -> Result<(), Exit> {
        let all = [
            Some(&self.input.stack),
            self.edits.as_ref(),
            self.union.as_ref(),
            self.intersect.as_ref(),
            self.difference.as_ref(),
            self.xor.as_ref(),
        ];
        match all.into_iter().flatten().filter(|path| is_stream(path)).count() {
            0 | 1 => Ok(()),
            _ => Err(Exit::usage(
                "only one input can be standard input (STACK is, unless it is named)",
            )),
        }
    }
}

pub(crate) fn run(args: &EditArgs, common: &Common) -> Result<(), Exit> {
    args.check_streams()?;
    let (edits, files) = args.edits()?;
    check_not_input(&args.output.output, files.iter().chain(&args.edits))?;
    let progress = progress("edit", common, &args.output);
    let may_reach_beyond = args.input.layers.is_some();
    let other = |file: &PathBuf| {
        let layers = Box::new(read_beside(file)?);
        Ok(OtherLayers { name: input_name(file), layers, may_reach_beyond })
    };
    let others = files.iter().map(other).collect::<Result<_, Exit>>()?;
    let layers = read_layers(&args.input, &progress)?;
    let mut counts = vec![0; edits.count()];
    let edited = lamp_postprocess::edit(layers, edits, others, |_, done| {
        done.iter().for_each(|&edit| counts[edit] += 1);
    });
    write_layers(edited, &args.output, &progress).map_err(|error| match error {
        Exit::Failed(error) if error.is::<EditError>() => {
            Exit::Failed(error).at(input_name(&args.input.stack))
        }
        error => error,
    })?;
    for (number, _) in (1..).zip(counts).filter(|(_, count)| *count == 0) {
        progress.say(&format!("edit {number} applies to no layer: check its z or layers"));
    }
    Ok(())
}
