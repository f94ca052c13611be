//! The chain in the browser: parts of a folder become stacks and builds by the stages of a night.

use std::collections::HashMap;
use std::fs;
use std::num::NonZeroU32;
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use anyhow::{Context, anyhow};
use lamp_machine::Machine;
use lamp_pipeline::documents::{document, document_and_word, own_names};
use lamp_pipeline::watcher::KeptRemarks;
use lamp_stack::{Catalogued, FileStamp, Layer, StackFormat, quoted};
use lamp_view::{
    BuildOrder, Finding, FormatChoice, InputKind, MachineChoice, Made, Order, ViewedStack,
    WorkFolder, WorkProgress, Workshop,
};

use super::find;
use crate::args::options::Output;
use crate::exit::Exit;
use crate::output::endings::is_model_name;
use crate::stages::calls::Tiling;
use crate::stages::parse::{parse, parse_check};
use crate::streams::{extension, write_layers};
use crate::terminal::progress::Progress;

/// Takes a folder for the page's work, made if it is not there.
pub(super) fn folder(path: &Path) -> Result<WorkFolder, Exit> {
    let name = || path.display().to_string();
    if !path.exists() {
        fs::create_dir(path).with_context(name)?;
    }
    Ok(WorkFolder::new(path, Box::new(Chain::default())).with_context(name)?)
}

/// `slice | fix`, then `tile`, in a folder.
#[derive(Default)]
struct Chain {
    /// The stacks that were sliced, by their names: a build of the same part needs no second one.
    sliced: Mutex<HashMap<String, Sliced>>,
}

/// A stack, what it was made of, and how.
struct Sliced {
    words: Vec<String>,
    /// The machine's name with the digest of its text.
    machine: Option<String>,
    part: FileStamp,
    stack: FileStamp,
    notes: Vec<String>,
}

impl Workshop for Chain {
    fn machines(&self) -> Vec<MachineChoice> {
        let own = own_names::<Machine>().into_iter().filter_map(|name| name.into_string().ok());
        // A file that is wrong is no choice; `lamp machine check` explains it.
        let own = own.filter_map(|name| Some((document::<Machine>(name.as_ref()).ok()?, name)));
        let built_in = Machine::builtins().map(|machine| (machine.clone(), machine.name));
        let choice = |(machine, name): (Machine, String)| MachineChoice {
            name,
            description: machine.description,
            has_panel: machine.panel.is_some(),
        };
        own.chain(built_in).map(choice).collect()
    }

    fn formats(&self) -> Vec<FormatChoice> {
        let read = |format: &StackFormat| !matches!(format, StackFormat::Contours(_));
        let choice = |format: StackFormat| {
            Some(FormatChoice {
                // A format without an ending of its own shares another's file.
                ending: format.endings().first()?,
                name: format.to_string(),
                needs_panel: matches!(format, StackFormat::Printer(_)),
            })
        };
        StackFormat::all().filter(read).filter_map(choice).collect()
    }

    fn kind_of(&self, name: &Path) -> Option<InputKind> {
        let ending = extension(name);
        match StackFormat::of_name(name) {
            // Contours are drawings of layers as output, and parts as input.
            Some(StackFormat::Contours(_)) => Some(InputKind::Part),
            Some(_) => Some(InputKind::Stack),
            None if ending == "png" => Some(InputKind::Stack),
            None if is_model_name(name) || ending == "gz" => Some(InputKind::Part),
            None => None,
        }
    }

    fn products(&self, order: &Order) -> Vec<String> {
        let is_part = self.kind_of(order.file.as_ref()) != Some(InputKind::Stack);
        let layers = is_part.then(|| layers_name(order));
        layers
            .into_iter()
            .chain(order.build.as_ref().map(|build| build_name(order, build)))
            .collect()
    }

    fn make(&self, folder: &Path, order: &Order, progress: &WorkProgress) -> Result<Made, String> {
        self.made(folder, order, progress).map_err(|error| error.to_string())
    }

    fn find(
        &self,
        folder: &Path,
        order: &Order,
        stack: &ViewedStack,
        progress: &WorkProgress,
    ) -> Result<Vec<Finding>, String> {
        let machine = option("machine", order.machine.as_deref());
        let settings = parse_check(&machine.collect::<Vec<_>>(), folder)?;
        find(&settings, stack, progress).map_err(|error| error.to_string())
    }
}

impl Chain {
    fn made(&self, folder: &Path, order: &Order, progress: &WorkProgress) -> Result<Made, Exit> {
        let mut made = self.stack(folder, order, progress)?;
        let Some(build) = &order.build else { return Ok(made) };
        let output = build_name(order, build);
        let (options, copies) = (tile_options(order, build), build.copies.map(NonZeroU32::get));
        let tiling = Tiling::parse(&options, &[copies], folder).map_err(Exit::usage)?;
        progress.begin("laying out the build");
        let (stacks, to) = ([(folder.join(&made.file), copies)], folder.join(&output));
        let notes = tiling.run(&stacks, &mut |layers| write(layers, &to, progress))?;
        let copies = copies.map_or_else(String::new, |copies| format!(":{copies}"));
        let words = ["tile".to_owned(), format!("{}{copies}", made.file)];
        let words = words.into_iter().chain(options).chain(["-o".to_owned(), output.clone()]);
        made.commands.push(typed(&words.collect::<Vec<_>>()));
        made.notes.extend(notes);
        Ok(Made { file: output, ..made })
    }

    /// Returns the stack of an order's file: the file itself, or what its part is sliced into.
    fn stack(&self, folder: &Path, order: &Order, progress: &WorkProgress) -> Result<Made, Exit> {
        let (name, part) = (order.file.clone(), folder.join(&order.file));
        if self.kind_of(name.as_ref()) == Some(InputKind::Stack) {
            let mut given = ["dpi", "thickness", "rotate"].into_iter().zip(slice_values(order));
            if let Some((option, _)) = given.find(|(_, value)| value.is_some()) {
                return Err(Exit::usage(format!(
                    "{name} is a stack, which --{option} cannot change: leave it empty"
                )));
            }
            return Ok(Made { file: name, commands: Vec::new(), notes: Vec::new() });
        }
        let output = layers_name(order);
        let (words, fix) = (slice_words(order), vec!["fix".to_owned()]);
        let mut typed_slice = words.clone();
        typed_slice.insert(1, name.clone());
        let fix_to = [fix.clone(), vec!["-o".to_owned(), output.clone()]].concat();
        let commands = vec![format!("{} | {}", typed(&typed_slice), typed(&fix_to))];
        let stamp = |path: &Path| -> Result<FileStamp, Exit> {
            let facts = fs::metadata(path).with_context(|| path.display().to_string())?;
            Ok(FileStamp::of(&facts))
        };
        let word = |name: &String| document_and_word::<Machine>(name.as_ref()).map(|it| it.1);
        let machine = order.machine.as_ref().map(word).transpose()?;
        let (of_part, stack) = (stamp(&part)?, folder.join(&output));
        let mut sliced = self.sliced.lock().unwrap_or_else(PoisonError::into_inner);
        let known = sliced.get(&output).filter(|known| {
            let is_same = known.words == words && known.machine == machine;
            is_same && known.part == of_part && stamp(&stack).ok() == Some(known.stack)
        });
        if let Some(Sliced { notes, .. }) = known {
            return Ok(Made { file: output, commands, notes: notes.clone() });
        }
        let stages = parse(&[words.clone(), fix], folder)
            .map_err(|error| Exit::usage(format!("{}: {}", error.name, error.why)))?;
        progress.begin("slicing");
        let findings = stages.chain.run(&part, &name, 0..u32::MAX, |layers| {
            let mut layers = layers.map(|layer| layer.map_err(Exit::from));
            write(&mut layers, &stack, progress)
        })?;
        let (stack, notes) = (stamp(&stack)?, findings.notes());
        let made = Sliced { words, machine, part: of_part, stack, notes: notes.clone() };
        sliced.insert(output.clone(), made);
        Ok(Made { file: output, commands, notes })
    }
}

/// Writes layers into a file, until nobody waits for it any more.
fn write(
    layers: &mut dyn Iterator<Item = Result<Layer, Exit>>,
    to: &Path,
    progress: &WorkProgress,
) -> Result<(), Exit> {
    let counted = layers.map(|layer| {
        let layer = layer?;
        if progress.is_stopped() {
            return Err(Exit::Failed(anyhow!("it was stopped")));
        }
        if let Some(count) = layer.info.stack.as_ref().and_then(|stack| stack.layers) {
            progress.expect(u64::from(count));
        }
        progress.one_done();
        Ok(layer)
    });
    let output = Output {
        output: to.to_owned(),
        format: None,
        classic: false,
        packbits: false,
        force: false,
    };
    write_layers(counted, &output, &Progress::keeping("view", &KeptRemarks::default()))
}

/// Returns the name of the stack that an order's part is sliced into.
fn layers_name(order: &Order) -> String {
    format!("{}-layers.tif", stem(&order.file))
}

/// Returns the name of an order's build.
fn build_name(order: &Order, build: &BuildOrder) -> String {
    format!("{}-build.{}", stem(&order.file), build.ending)
}

/// Returns the name of a file without its ending.
fn stem(name: &str) -> &str {
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}

fn slice_values(order: &Order) -> [Option<&str>; 3] {
    [&order.dpi, &order.thickness, &order.rotate].map(|value| value.as_deref())
}

/// Returns an option with its value in one word, so that no value is an option of its own.
fn option(name: &str, value: Option<&str>) -> impl Iterator<Item = String> {
    value.map(|value| format!("--{name}={value}")).into_iter()
}

fn slice_words(order: &Order) -> Vec<String> {
    let [dpi, thickness, rotate] = slice_values(order);
    let named = [("machine", order.machine.as_deref()), ("dpi", dpi)];
    let named = named.into_iter().chain([("thickness", thickness), ("rotate", rotate)]);
    ["slice".to_owned()]
        .into_iter()
        .chain(named.flat_map(|(name, value)| option(name, value)))
        .collect()
}

/// Returns the options of `tile` for a build.
fn tile_options(order: &Order, build: &BuildOrder) -> Vec<String> {
    let machine = order.machine.as_deref();
    // On a panel, images are as large as the build area, so copies are placed by their white.
    let of_panel = |name: &str| {
        document::<Machine>(name.as_ref()).is_ok_and(|machine| machine.panel.is_some())
    };
    let fit = machine.is_some_and(of_panel).then(|| "--fit".to_owned());
    let mesh = (!build.mesh).then(|| "--mesh=none".to_owned());
    option("machine", machine).chain(fit).chain(mesh).collect()
}

/// Returns words as people type them.
fn typed(words: &[String]) -> String {
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}
