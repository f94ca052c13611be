//! From a night to its tasks.

use std::collections::HashMap;
use std::env;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use anyhow::{Context, anyhow};
use lamp_batch::{
    Build, Cost, Digests, Graph, InputFile, Key, Kind, Part, Recipe, Stage, Store, Task,
};
use lamp_pipeline::documents::without_digest;
use lamp_pipeline::{Survey, stored_name};

use super::night_file::NightFile;
use super::work::{What, Work};
use crate::exit::Exit;
use crate::stages::Stages;
use crate::stages::calls::{Checking, JOIN_CODE, PACK_CODE, Tiling};

/// A range takes about so many seconds of a processor, unless the night file says how many there
/// are: few enough that a crash costs little, enough that starting it costs nothing.
const RANGE_S: f64 = 30.0;

/// The tasks of a night.
pub(super) struct Plan {
    pub(super) graph: Graph,
    /// Parts and then builds, each in the order of the night file.
    pub(super) subjects: Vec<Subject>,
}

/// A part or a build.
pub(super) struct Subject {
    pub(super) name: String,
    pub(super) is_build: bool,
    /// The wanted result, or why it cannot be planned.
    pub(super) wanted: Result<Wanted, String>,
}

/// The results that are wanted of a part or a build.
#[derive(Clone)]
pub(super) struct Wanted {
    pub(super) stack: Key,
    pub(super) check: Option<Key>,
    /// Stored names of parts in the stack, each with the part's name of today.
    pub(super) names: Vec<(String, String)>,
    /// The bytes of the stack, estimated.
    pub(super) bytes: u64,
}

impl Wanted {
    pub(super) fn goals(&self) -> impl Iterator<Item = Key> {
        [Some(self.stack), self.check].into_iter().flatten()
    }
}

impl Plan {
    /// Plans a night. Parts that cannot be read are planned as such.
    ///
    /// # Errors
    /// Returns an error if the night file asks for what there is not, with its place.
    pub(super) fn new(file: &NightFile, store: &Store) -> Result<Self, Exit> {
        let folder = env::current_dir().context("the folder of the night file")?;
        let digests = Digests::of(store);
        let mut planner = Planner {
            file,
            store,
            folder,
            digests,
            graph: Graph::default(),
            chains: HashMap::new(),
            checks: HashMap::new(),
        };
        let night = &file.night;
        // Reports all errors in the file before the work of surveys.
        for part in &night.parts {
            planner.stages(&part.stages)?;
            planner.check_options(part)?;
        }
        let tiles = night.builds.iter().map(|build| planner.tile_options(build));
        let tiles = tiles.collect::<Result<Vec<_>, _>>()?;
        let mut subjects: Vec<Subject> = Vec::new();
        for part in &night.parts {
            let wanted = planner.part(part).map_err(|error| error.to_string());
            subjects.push(Subject { name: part.name.clone(), is_build: false, wanted });
        }
        for (build, tile) in night.builds.iter().zip(tiles) {
            let wanted = planner.build(build, tile, &subjects);
            subjects.push(Subject { name: build.name.clone(), is_build: true, wanted });
        }
        planner.digests.keep().map_err(anyhow::Error::new)?;
        Ok(Self { graph: planner.graph, subjects })
    }

    /// Returns the parts and builds whose stack is the result of a task.
    pub(super) fn stacks_of(&self, key: Key) -> impl Iterator<Item = usize> {
        let is_it = move |subject: &Subject| {
            subject.wanted.as_ref().is_ok_and(|wanted| wanted.stack == key)
        };
        let all = self.subjects.iter().enumerate();
        all.filter_map(move |(place, subject)| is_it(subject).then_some(place))
    }

    /// Returns the tasks whose results are wanted.
    pub(super) fn goals(&self) -> Vec<Key> {
        let wanted = self.subjects.iter().filter_map(|subject| subject.wanted.as_ref().ok());
        wanted.flat_map(Wanted::goals).collect()
    }
}

struct Planner<'a> {
    file: &'a NightFile,
    store: &'a Store,
    folder: PathBuf,
    digests: Digests,
    graph: Graph,
    /// Stages by their words, since most parts have the same.
    chains: HashMap<Vec<Vec<String>>, Rc<Chained>>,
    /// Options of checks, likewise, in canonical form.
    checks: HashMap<Vec<String>, String>,
}

/// Stages, and what of them decides bytes.
struct Chained {
    words: Vec<Vec<String>>,
    stages: Stages,
    options: Vec<String>,
    /// Files that options name, with their digests.
    files: Vec<InputFile>,
    code: Vec<(String, u32)>,
}

/// Options of a build, and what of them decides bytes.
struct TileOptions {
    words: Vec<String>,
    options: String,
    files: Vec<InputFile>,
}

impl Planner<'_> {
    fn at(&self, place: lamp_batch::Place, error: impl std::fmt::Display) -> Exit {
        Exit::usage(format!("{}: {place}: {error}", self.file.name))
    }

    /// Parses stages, once for all parts that have them.
    fn stages(&mut self, stages: &[Stage]) -> Result<Rc<Chained>, Exit> {
        let words: Vec<_> = stages.iter().map(|stage| stage.words.clone()).collect();
        if let Some(known) = self.chains.get(&words) {
            return Ok(Rc::clone(known));
        }
        let parsed = Stages::parse(&words, &self.folder)
            .map_err(|error| self.at(stages[error.stage].place, &error))?;
        let files = parsed.chain.input_files();
        let files = files
            .map_err(Exit::from)
            .and_then(|files| self.inputs(files))
            .map_err(|error| self.at(stages[0].place, error))?;
        let code = parsed.chain.code().into_iter().chain([("join", JOIN_CODE)]);
        let code = coded(code);
        let options = parsed.chain.canonical();
        let chained =
            Rc::new(Chained { words: words.clone(), stages: parsed, options, files, code });
        self.chains.insert(words, Rc::clone(&chained));
        Ok(chained)
    }

    fn tile_options(&mut self, build: &Build) -> Result<TileOptions, Exit> {
        let words = build.tile.words[1..].to_vec();
        let copies: Vec<_> = build.parts.iter().map(|(_, copies)| *copies).collect();
        let tiling = Tiling::parse(&words, &copies, &self.folder);
        let tiling = tiling.map_err(|why| self.at(build.tile.place, format!("tile: {why}")))?;
        let files = self.inputs(tiling.input_files());
        let files = files.map_err(|error| self.at(build.tile.place, error))?;
        Ok(TileOptions { words, options: tiling.canonical(), files })
    }

    /// Returns the options of a part's check, and their canonical form.
    fn check_options(&mut self, part: &Part) -> Result<(Vec<String>, String), Exit> {
        let words = part.check.words[1..].to_vec();
        if let Some(options) = self.checks.get(&words) {
            return Ok((words, options.clone()));
        }
        let checking = Checking::parse(&words, &self.folder);
        let checking =
            checking.map_err(|why| self.at(part.check.place, format!("check: {why}")))?;
        let options = checking.canonical();
        self.checks.insert(words.clone(), options.clone());
        Ok((words, options))
    }

    /// Returns files with their digests.
    fn inputs(&mut self, files: Vec<PathBuf>) -> Result<Vec<InputFile>, Exit> {
        files.into_iter().map(|path| self.input(&path)).collect()
    }

    fn input(&mut self, path: &Path) -> Result<InputFile, Exit> {
        let (name, _) = without_digest(path);
        let path = self.folder.join(&name);
        let read = self.digests.digest(&path);
        let digest =
            read.map_err(|error| Exit::Failed(error.into()).at(name.display().to_string()))?;
        Ok(InputFile { path, digest })
    }

    /// Adds the tasks of a part.
    fn part(&mut self, part: &Part) -> Result<Wanted, Exit> {
        if let Some(fault) = &part.fault {
            return Err(Exit::Failed(anyhow!("{fault}")));
        }
        let chained = self.stages(&part.stages)?;
        let input = self.input(&part.file)?;
        let survey = self.survey(&chained, &part.file, &input)?;
        let stored = stored_name(&input.digest);
        let joined = self.layers(part, &chained, &input, &survey);
        let all = 0..survey.layers;
        let (all_s, bytes) = (survey.cost_s(&all), survey.bytes(&all));
        let mut stack = joined;
        for (which, after) in chained.stages.after.iter().enumerate() {
            let files = self.inputs(after.input_files()?)?;
            let recipe = Recipe {
                kind: Kind::Whole,
                options: vec![after.canonical()],
                inputs: inputs_of([stack.to_string()], &files),
                code: coded([after.code()]),
            };
            let (part_file, stages) = (part.file.clone(), chained.words.clone());
            let what = What::Whole { part: part_file, stages, which };
            let cost = Cost { cpu_s: all_s * 0.3, memory: survey.memory, disk: bytes };
            let label = format!("{} of the whole stack", after.code().0);
            stack = self.add(recipe, &part.name, label, vec![stack], files, cost, what);
        }
        let (words, options) = self.check_options(part)?;
        let recipe = Recipe {
            kind: Kind::Check,
            options: vec![options],
            inputs: vec![stack.to_string()],
            code: coded([Checking::code()]),
        };
        let cost = Cost { cpu_s: all_s * 0.2, memory: survey.memory, disk: 1 << 14 };
        let check = self.add(
            recipe,
            &part.name,
            "check".to_owned(),
            vec![stack],
            vec![],
            cost,
            What::Check { words },
        );
        let file = part.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Wanted { stack, check: Some(check), names: vec![(stored, file)], bytes })
    }

    /// Adds the tasks that make the layers of a part: ranges and their join, or one task where one
    /// range has all. The key of the joined stack does not depend on how it was cut.
    fn layers(
        &mut self,
        part: &Part,
        chained: &Chained,
        input: &InputFile,
        survey: &Survey,
    ) -> Key {
        let files: Vec<InputFile> = std::iter::once(input).chain(&chained.files).cloned().collect();
        let recipe = |kind: Kind, cut: Option<&Range<u32>>| Recipe {
            kind,
            options: chained
                .options
                .iter()
                .cloned()
                .chain(cut.map(|range| format!("layers {}..{}", range.start, range.end)))
                .collect(),
            inputs: inputs_of([], &files),
            code: chained.code.clone(),
        };
        let what = |layers: Range<u32>| What::Range {
            part: part.file.clone(),
            stored_name: stored_name(&input.digest),
            stages: chained.words.clone(),
            layers,
        };
        let cost = |range: &Range<u32>| Cost {
            cpu_s: survey.cost_s(range),
            memory: survey.memory,
            disk: survey.bytes(range),
        };
        let all = 0..survey.layers;
        let wanted = match part.ranges {
            Some(ranges) => ranges,
            None => (survey.cost_s(&all) / RANGE_S).ceil().clamp(1.0, 1000.0) as u32,
        };
        let ranges = survey.ranges(wanted as usize);
        if ranges.len() < 2 {
            let label = format!("all {} layers", survey.layers);
            return self.add(
                recipe(Kind::Join, None),
                &part.name,
                label,
                vec![],
                files.clone(),
                cost(&all),
                what(all),
            );
        }
        let add = |range: &Range<u32>| {
            let label = format!("layers {}..{}", range.start, range.end);
            let recipe = recipe(Kind::Range, Some(range));
            self.add(
                recipe,
                &part.name,
                label,
                vec![],
                files.clone(),
                cost(range),
                what(range.clone()),
            )
        };
        let needs: Vec<Key> = ranges.iter().map(add).collect();
        let label = format!("join of {} ranges", needs.len());
        let cost = Cost { cpu_s: survey.cost_s(&all) * 0.05, ..cost(&all) };
        self.add(recipe(Kind::Join, None), &part.name, label, needs, vec![], cost, What::Join)
    }

    /// Returns what a part takes, from the store if it has been surveyed.
    fn survey(&self, chained: &Chained, file: &Path, input: &InputFile) -> Result<Survey, Exit> {
        let chain = &chained.stages.chain;
        let files = inputs_of([], std::iter::once(input).chain(&chained.files));
        let note = Key::of_note("survey", &(files, &chained.options, &chained.code));
        if let Some(known) = self.store.note(note) {
            return Ok(known);
        }
        let survey = chain.survey(file)?;
        self.store.keep_note(note, &survey).map_err(anyhow::Error::new)?;
        Ok(survey)
    }

    /// Adds the task of a build.
    fn build(
        &mut self,
        build: &Build,
        tile: TileOptions,
        parts: &[Subject],
    ) -> Result<Wanted, String> {
        let mut of_parts = Vec::new();
        for (name, copies) in &build.parts {
            let part = parts.iter().find(|part| part.name == *name).expect("names are checked");
            match &part.wanted {
                Ok(wanted) => of_parts.push((wanted, *copies)),
                Err(_) => return Err(format!("its part {name} failed")),
            }
        }
        let needs: Vec<Key> = of_parts.iter().map(|(part, _)| part.stack).collect();
        let copies: Vec<Option<u32>> = of_parts.iter().map(|(_, copies)| *copies).collect();
        let told = copies.iter().map(|copies| copies.map_or("-".to_owned(), |n| n.to_string()));
        let recipe = Recipe {
            kind: Kind::Tile,
            options: vec![tile.options, told.collect::<Vec<_>>().join(" ")],
            inputs: inputs_of(needs.iter().map(ToString::to_string), &tile.files),
            code: coded([Tiling::code()]),
        };
        let bytes = of_parts.iter().map(|(part, n)| part.bytes * u64::from(n.unwrap_or(1))).sum();
        let cost = Cost { cpu_s: bytes as f64 * TILE_S_PER_BYTE, memory: TILE_BYTES, disk: bytes };
        let label = format!("build of {} parts", build.parts.len());
        let names = of_parts.iter().flat_map(|(part, _)| part.names.clone()).collect();
        let what = What::Tile { words: tile.words, copies };
        let stack = self.add(recipe, &build.name, label, needs, tile.files, cost, what);
        Ok(Wanted { stack, check: None, names, bytes })
    }

    #[expect(clippy::too_many_arguments, reason = "they are the fields of a task")]
    fn add(
        &mut self,
        recipe: Recipe,
        subject: &str,
        label: String,
        needs: Vec<Key>,
        files: Vec<InputFile>,
        cost: Cost,
        what: What,
    ) -> Key {
        let work = Work { folder: self.folder.clone(), what };
        let work = serde_json::to_value(work).expect("work has text keys");
        let subject = subject.to_owned();
        self.graph.add(Task { recipe, subject, label, needs, files, cost, work })
    }
}

/// The time of a build for each byte of its packed copies, in seconds of a processor.
const TILE_S_PER_BYTE: f64 = 1e-6;
/// The layers that a build holds at once, in bytes.
const TILE_BYTES: u64 = 256 << 20;

/// Returns what a task is made of: keys of results, and digests of files.
fn inputs_of<'a>(
    keys: impl IntoIterator<Item = String>,
    files: impl IntoIterator<Item = &'a InputFile>,
) -> Vec<String> {
    keys.into_iter().chain(files.into_iter().map(|file| file.digest.clone())).collect()
}

fn coded<'a>(code: impl IntoIterator<Item = (&'a str, u32)>) -> Vec<(String, u32)> {
    let all = code.into_iter().chain([("pack", PACK_CODE)]);
    all.map(|(name, number)| (name.to_owned(), number)).collect()
}
