//! `lamp edit`: changes a stack at image level.

use std::fs::File;
use std::io::{self, Read, Seek};
use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::{ArgGroup, Args};
use lamp_postprocess::{EditError, Edits, OtherLayers, OtherPicture};
use lamp_stack::{Limits, Op, Pages, digest_of};

use crate::catalogue::read_text;
use crate::exit::Exit;
use crate::options::{Common, Input, Output};
use crate::streams::{
    check_not_input, failed_at, input_name, is_stream, layers_of, progress, read_beside,
    read_layers, write_layers,
};

/// A list of edits is text of a few kilobytes.
const MAX_LIST_BYTES: u64 = 1 << 20;

/// Change a design at image level, without slicing it again
///
/// Adds or subtracts boxes, cylinders, lines, labels, pictures and other stacks in a range of
/// heights; crops, pads, mirrors and rotates all layers. Lengths and positions are in part
/// coordinates. Edits are listed in a TOML file and applied in order; docs/edit.md describes every
/// key. Layers that no edit applies to pass byte for byte.
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

/// The edits, and the files that they name.
struct EditFiles {
    edits: Edits,
    stacks: Vec<PathBuf>,
    pictures: Vec<PathBuf>,
}

impl EditArgs {
    fn edits(&self) -> Result<EditFiles, Exit> {
        let ways = [
            (Op::Union, &self.union),
            (Op::Intersect, &self.intersect),
            (Op::Difference, &self.difference),
            (Op::Xor, &self.xor),
        ];
        if let Some((op, file)) = ways.into_iter().find_map(|(op, file)| Some((op, file.clone()?)))
        {
            let edits = Edits::combine(op, file.clone());
            return Ok(EditFiles { edits, stacks: vec![file], pictures: vec![] });
        }
        let list = self.edits.as_deref().expect("one of the group is given");
        let edits = || -> anyhow::Result<Edits> {
            Ok(Edits::from_toml(&read_text(list, MAX_LIST_BYTES, "a list of edits")?)?)
        };
        let edits = edits().with_context(|| input_name(list))?;
        // Files stand beside the list that names them.
        let folder = list.parent().unwrap_or(Path::new(""));
        let stacks = edits.stacks().map(|file| folder.join(file)).collect();
        let pictures = edits.pictures().map(|file| folder.join(file)).collect();
        Ok(EditFiles { edits, stacks, pictures })
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
    let EditFiles { edits, stacks, pictures } = args.edits()?;
    let files = stacks.iter().chain(&pictures).chain(&args.edits);
    check_not_input(&args.output.output, files)?;
    let progress = progress("edit", common, &args.output);
    let may_reach_beyond = args.input.layers.is_some();
    let other = |file: &PathBuf| {
        let layers = Box::new(read_beside(file)?);
        Ok(OtherLayers { name: input_name(file), layers, may_reach_beyond })
    };
    let others = stacks.iter().map(other).collect::<Result<_, Exit>>()?;
    let pictures = pictures.iter().map(|file| open_picture(file)).collect::<Result<_, Exit>>()?;
    let layers = read_layers(&args.input, &progress)?;
    let mut counts = vec![0; edits.count()];
    let edited = lamp_postprocess::edit(layers, edits, others, pictures, |_, done| {
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

/// Opens a picture. A copy in a temporary file is read, so that the digest is of what is stamped.
fn open_picture(path: &Path) -> Result<OtherPicture<Exit>, Exit> {
    let name = path.display().to_string();
    let max = Limits::default().png_bytes;
    let copied = || -> anyhow::Result<(File, String)> {
        let mut copy = tempfile::tempfile()?;
        let bytes = io::copy(&mut File::open(path)?.take(max + 1), &mut copy)?;
        ensure!(bytes <= max, "more than {} MiB is not a picture", max >> 20);
        copy.rewind()?;
        let digest = digest_of(&copy)?;
        copy.rewind()?;
        Ok((copy, digest))
    };
    let (copy, digest) = copied().with_context(|| name.clone())?;
    let pages = Pages::from_file(copy).map_err(|error| failed_at(name.clone(), error))?;
    Ok(OtherPicture { name, digest, pages: Box::new(layers_of(pages, path, None)) })
}
