//! Opens and reads the stacks of a build.

use std::fs::File;
use std::io::{self, Seek};
use std::ops::Range;
use std::path::PathBuf;

use anyhow::Context;
use lamp_build::PartStack;
use lamp_machine::Machine;
use lamp_stack::{
    CompensateRecord, DitherRecord, FixRecord, Layer, PageInfo, PageRecord, Pages, StackError,
};

use crate::exit::Exit;
use crate::streams::{
    failed_at, input_name, is_stream, layers_of, open_pages, piped_part, spool_stdin,
};
use crate::terminal::stack_notes::noting;

/// A stack and the number of its copies: `blade.tif:120`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct StackArg {
    pub(super) path: PathBuf,
    pub(super) copies: Option<u32>,
}

impl StackArg {
    /// Takes a number behind the last colon for a count, unless there is a file
    /// of all of that name.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        let whole = Self { path: PathBuf::from(text), copies: None };
        match text.rsplit_once(':') {
            Some((path, count))
                if !path.is_empty()
                    && !count.is_empty()
                    && count.bytes().all(|c| c.is_ascii_digit())
                    && !whole.path.exists() =>
            {
                match count.parse() {
                    Ok(copies @ 1..) => Ok(Self { path: path.into(), copies: Some(copies) }),
                    _ => Err(format!("`{count}` is not a number of copies: write 1 or more")),
                }
            }
            _ => Ok(whole),
        }
    }
}

type Layers = Box<dyn Iterator<Item = Result<Layer, Exit>>>;

/// Facts about a stack's layers, known when all of them were read.
#[derive(Clone, Debug, Default)]
pub(super) struct ReadLayers {
    /// The stages that changed pages, as these say.
    pub(super) stages: Vec<&'static str>,
    /// From the first layer to the one after the last.
    pub(super) range: Range<u32>,
}

/// The stages that leave a key on pages that they change.
const STAGES: [&str; 3] = [FixRecord::KEY, CompensateRecord::KEY, DitherRecord::KEY];

impl ReadLayers {
    fn add(&mut self, info: &PageInfo) {
        let start = if self.range.is_empty() { info.index } else { self.range.start };
        self.range = start..info.index.saturating_add(1);
        let is_new = |stage: &&str| !self.stages.contains(stage) && info.other.contains_key(*stage);
        let new: Vec<&str> = STAGES.into_iter().filter(is_new).collect();
        self.stages.extend(new);
    }
}

/// A stack of a build.
pub(super) struct InputStack {
    name: String,
    path: PathBuf,
    range: Option<Range<u32>>,
    /// Whether the build needs the layers below the range, too.
    from_bottom: bool,
    machine: Option<Machine>,
    /// Standard input, where it is read twice.
    spool: Option<File>,
    /// Its layers, where they are read once.
    layers: Option<Layers>,
    layer_count: Option<u32>,
    read_layers: ReadLayers,
}

impl InputStack {
    /// Prepares the stacks, to be read from their lowest layers on if `from_bottom`. Refuses one that is given twice, because its counts would be ambiguous.
    pub(super) fn open_all(
        stacks: &[StackArg],
        range: &Option<Range<u32>>,
        from_bottom: bool,
        machine: Option<&Machine>,
    ) -> Result<Vec<Self>, Exit> {
        for (k, stack) in stacks.iter().enumerate() {
            if stacks[..k].iter().any(|before| before.path == stack.path) {
                let name = input_name(&stack.path);
                return Err(Exit::usage(format!(
                    "{name} is given twice: give it once, with the sum of the counts"
                )));
            }
        }
        let stack = |StackArg { path, .. }: &StackArg| Self {
            name: input_name(path),
            path: path.clone(),
            range: range.clone(),
            from_bottom: from_bottom && range.as_ref().is_some_and(|range| range.start > 0),
            machine: machine.cloned(),
            spool: None,
            layers: None,
            layer_count: None,
            read_layers: ReadLayers::default(),
        };
        Ok(stacks.iter().map(stack).collect())
    }

    /// Returns the number of layers, if the stack states it.
    pub(super) fn layer_count(&self) -> Option<u32> {
        self.layer_count
    }

    /// Returns what was seen when the part's outline was read.
    pub(super) fn read_layers(&self) -> &ReadLayers {
        &self.read_layers
    }

    /// Reads what placing the part needs: its first layer, or all layers if it needs the outline.
    pub(super) fn part(&mut self, outline: bool) -> Result<PartStack, Exit> {
        let no_layers = failed_at(self.name.clone(), StackError::NoLayers);
        if (outline || self.from_bottom) && is_stream(&self.path) {
            self.spool = Some(spool_stdin()?);
        }
        if outline {
            let (mut count, mut seen) = (None, ReadLayers::default());
            let mut layers = self.read(self.range.clone())?.inspect(|layer| {
                if let Ok(layer) = layer {
                    count = count.or(count_of(layer));
                    seen.add(&layer.info);
                }
            });
            let first = layers.next();
            self.take_name_of_pipe();
            let layers = first.into_iter().chain(layers);
            let part = PartStack::of_outline::<Exit>(&self.name, layers)?.ok_or(no_layers);
            self.layer_count = count;
            self.read_layers = seen;
            return part;
        }
        let mut layers = self.read(self.range.clone())?;
        let first = layers.next().unwrap_or(Err(no_layers))?;
        self.take_name_of_pipe();
        let part = PartStack::of_image(&self.name, &first)?;
        self.layer_count = count_of(&first);
        if !self.from_bottom {
            self.layers = Some(Box::new(std::iter::once(Ok(first)).chain(layers)));
        }
        Ok(part)
    }

    /// Calls standard input by its part, as the first page does.
    fn take_name_of_pipe(&mut self) {
        if let Some(part) = piped_part().filter(|_| is_stream(&self.path)) {
            self.name = part.to_owned();
        }
    }

    /// Its layers, from the lowest that the build needs.
    pub(super) fn layers(mut self) -> Result<Layers, Exit> {
        match self.layers.take() {
            Some(layers) => Ok(layers),
            None => {
                let range = self.range.clone();
                let from = |range: Range<u32>| if self.from_bottom { 0..range.end } else { range };
                self.read(range.map(from))
            }
        }
    }

    /// Reads it from its start, checking that the machine builds it.
    fn read(&mut self, range: Option<Range<u32>>) -> Result<Layers, Exit> {
        let pages = match &mut self.spool {
            Some(spool) => {
                let again = |spool: &mut File| -> io::Result<File> {
                    spool.rewind()?;
                    spool.try_clone()
                };
                let file = again(spool).with_context(|| self.name.clone())?;
                let pages = Pages::from_file(file);
                noting(pages.map_err(|error| failed_at(self.name.clone(), error))?, &self.path)
            }
            None => open_pages(&self.path)?,
        };
        let layers = layers_of(pages, &self.path, range);
        let Some(machine) = self.machine.clone() else { return Ok(Box::new(layers)) };
        let name = self.name.clone();
        Ok(Box::new(layers.map(move |layer| {
            let layer = layer?;
            machine.check(&layer).map_err(|limit| Exit::from(limit).at(name.clone()))?;
            Ok(layer)
        })))
    }
}

fn count_of(layer: &Layer) -> Option<u32> {
    layer.info.stack.as_ref()?.layers
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_stand_behind_the_last_colon() {
        let parsed = |text: &str| StackArg::parse(text).map(|arg| (arg.path, arg.copies));
        let file = |name: &str, copies| Ok((PathBuf::from(name), copies));
        assert_eq!(parsed("blade.tif:120"), file("blade.tif", Some(120)));
        assert_eq!(parsed("-:3"), file("-", Some(3)));
        for name in ["blade.tif", "c:\\blade.tif", "blade:x", "blade:", ":3", "-"] {
            assert_eq!(parsed(name), file(name, None));
        }
        assert!(parsed("blade.tif:0").is_err());
        assert!(parsed("blade.tif:99999999999").is_err());
    }
}
