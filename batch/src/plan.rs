//! From a night to its tasks.

use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use lamp_pipeline::documents::without_digest;
use lamp_pipeline::{Survey, stored_name};

use crate::assignment::{Assignment, Work};
use crate::commands::{Call, Commands, JOIN_CODE, PACK_CODE, Stages, WholeCall};
use crate::error::BatchError;
use crate::key::{Key, Kind, TaskRecipe};
use crate::night::{Build, Night, Part, Place, Stage};
use crate::store::{Digests, Store};
use crate::task::{Cost, Graph, InputFile, Task};

/// A range takes about so many seconds of a processor, unless the night file says how many there
/// are: few enough that a crash costs little, enough that starting it costs nothing.
const RANGE_S: f64 = 30.0;

/// The tasks of a night.
pub struct NightPlan {
    /// The tasks.
    pub graph: Graph,
    /// Parts and then builds, each in the order of the night file.
    pub subjects: Vec<Subject>,
}

/// A part or a build.
pub struct Subject {
    /// The name in the night file.
    pub name: String,
    /// Whether it is a build.
    pub is_build: bool,
    /// The wanted result, or why it cannot be planned.
    pub wanted: Result<WantedResults, String>,
}

/// The results that are wanted of a part or a build.
#[derive(Clone)]
pub struct WantedResults {
    /// The task that makes the stack.
    pub stack: Key,
    /// The task that checks it. Builds have none.
    pub check: Option<Key>,
    /// Stored names of parts in the stack, each with the part's name of today.
    pub names: Vec<(String, String)>,
    /// The bytes of the stack, estimated.
    pub bytes: u64,
    /// The layers of the stack, of a build at least.
    pub layers: u32,
}

impl WantedResults {
    /// Returns the tasks that make the results.
    pub fn goals(&self) -> impl Iterator<Item = Key> {
        [Some(self.stack), self.check].into_iter().flatten()
    }
}

impl NightPlan {
    /// Plans a night. Names of files in it are from `folder`. Parts that cannot be read are planned
    /// as such.
    ///
    /// # Errors
    /// Returns an error if the night file asks for what there is not, with its place, or the store
    /// cannot be written.
    pub fn new(
        night: &Night,
        folder: &Path,
        commands: &impl Commands,
        store: &Store,
    ) -> Result<Self, BatchError> {
        let mut planner = NightPlanner {
            commands,
            store,
            folder: folder.to_owned(),
            digests: Digests::of(store),
            graph: Graph::default(),
            chains: HashMap::new(),
            checks: HashMap::new(),
        };
        // Reports all errors in the file before the work of surveys.
        for part in &night.parts {
            planner.stages(&part.stages)?;
            planner.check_call(part)?;
        }
        let tiles = night.builds.iter().map(|build| planner.tile_call(build));
        let tiles = tiles.collect::<Result<Vec<_>, _>>()?;
        let mut subjects: Vec<Subject> = Vec::new();
        for part in &night.parts {
            let wanted = planner.part(part).map_err(|error| planner.sentence(error));
            subjects.push(Subject { name: part.name.clone(), is_build: false, wanted });
        }
        for (build, tile) in night.builds.iter().zip(tiles) {
            let wanted = planner.build(build, tile, &subjects);
            subjects.push(Subject { name: build.name.clone(), is_build: true, wanted });
        }
        planner.digests.keep()?;
        Ok(Self { graph: planner.graph, subjects })
    }

    /// Returns the parts and builds whose stack is the result of a task.
    pub fn stacks_of(&self, key: Key) -> impl Iterator<Item = usize> {
        let is_it = move |subject: &Subject| {
            subject.wanted.as_ref().is_ok_and(|wanted| wanted.stack == key)
        };
        let all = self.subjects.iter().enumerate();
        all.filter_map(move |(place, subject)| is_it(subject).then_some(place))
    }

    /// Returns the tasks whose results are wanted.
    pub fn goals(&self) -> Vec<Key> {
        let wanted = self.subjects.iter().filter_map(|subject| subject.wanted.as_ref().ok());
        wanted.flat_map(WantedResults::goals).collect()
    }
}

struct NightPlanner<'a, C: Commands> {
    commands: &'a C,
    store: &'a Store,
    folder: PathBuf,
    digests: Digests,
    graph: Graph,
    /// Stages by their words, since most parts have the same.
    chains: HashMap<Vec<Vec<String>>, Rc<Chained<C>>>,
    /// Checks, likewise.
    checks: HashMap<Vec<String>, Rc<Called>>,
}

/// Stages, and what of them decides bytes.
struct Chained<C: Commands> {
    words: Vec<Vec<String>>,
    stages: Stages<C::Whole>,
    options: Vec<String>,
    /// Files that options name, with their digests.
    files: Vec<InputFile>,
    code: Vec<(String, u32)>,
}

/// A command, and what of it decides bytes.
#[derive(Clone)]
struct Called {
    words: Vec<String>,
    options: String,
    files: Vec<InputFile>,
    code: Vec<(String, u32)>,
}

impl<C: Commands> NightPlanner<'_, C> {
    /// Returns an error as people read it.
    fn sentence(&self, error: BatchError) -> String {
        C::Error::from(error).to_string()
    }

    fn at(&self, place: Place, error: BatchError) -> BatchError {
        BatchError::Night { place, why: self.sentence(error) }
    }

    /// Parses stages, once for all parts that have them.
    fn stages(&mut self, stages: &[Stage]) -> Result<Rc<Chained<C>>, BatchError> {
        let words: Vec<_> = stages.iter().map(|stage| stage.words.clone()).collect();
        if let Some(known) = self.chains.get(&words) {
            return Ok(Rc::clone(known));
        }
        let parsed = self.commands.stages(&words, &self.folder);
        let parsed = parsed.map_err(|error| {
            let place = stages.get(error.stage).map_or(Place { line: 1, column: 1 }, |at| at.place);
            BatchError::Night { place, why: error.to_string() }
        })?;
        let files = parsed.chain.input_files();
        let files = files
            .map_err(BatchError::from)
            .and_then(|files| self.inputs(files))
            .map_err(|error| self.at(stages[0].place, error))?;
        let code = coded(parsed.chain.code().into_iter().chain([("join", JOIN_CODE)]));
        let options = parsed.chain.canonical();
        let chained =
            Rc::new(Chained { words: words.clone(), stages: parsed, options, files, code });
        self.chains.insert(words, Rc::clone(&chained));
        Ok(chained)
    }

    /// Returns what decides the bytes of a command that stands in the night file.
    fn called(
        &mut self,
        stage: &Stage,
        call: Result<impl Call, String>,
    ) -> Result<Called, BatchError> {
        let [name, words @ ..] = &stage.words[..] else { unreachable!("stages have a command") };
        let call = call.map_err(|why| BatchError::Night {
            place: stage.place,
            why: format!("{name}: {why}"),
        })?;
        let files = call.input_files().map_err(BatchError::from);
        let files = files.and_then(|files| self.inputs(files));
        let files = files.map_err(|error| self.at(stage.place, error))?;
        let code = coded([call.code()]);
        Ok(Called { words: words.to_vec(), options: call.canonical(), files, code })
    }

    fn tile_call(&mut self, build: &Build) -> Result<Called, BatchError> {
        let copies: Vec<_> = build.parts.iter().map(|(_, copies)| *copies).collect();
        let tile = self.commands.tile(&build.tile.words[1..], &copies, &self.folder);
        self.called(&build.tile, tile)
    }

    fn check_call(&mut self, part: &Part) -> Result<Rc<Called>, BatchError> {
        if let Some(known) = self.checks.get(&part.check.words) {
            return Ok(Rc::clone(known));
        }
        let check = self.commands.check(&part.check.words[1..], &self.folder);
        let called = Rc::new(self.called(&part.check, check)?);
        self.checks.insert(part.check.words.clone(), Rc::clone(&called));
        Ok(called)
    }

    /// Returns files with their digests.
    fn inputs(&mut self, files: Vec<PathBuf>) -> Result<Vec<InputFile>, BatchError> {
        files.into_iter().map(|path| self.input(&path)).collect()
    }

    fn input(&mut self, path: &Path) -> Result<InputFile, BatchError> {
        let (name, _) = without_digest(path);
        let path = self.folder.join(&name);
        let digest = self.digests.digest(&path).map_err(BatchError::file(&name))?;
        Ok(InputFile { path, digest })
    }

    /// Adds the tasks of a part.
    fn part(&mut self, part: &Part) -> Result<WantedResults, BatchError> {
        if let Some(fault) = &part.fault {
            return Err(BatchError::Part(fault.clone()));
        }
        let chained = self.stages(&part.stages)?;
        let input = self.input(&part.file)?;
        let survey = self.survey(&chained, &part.file, &input)?;
        let stored = stored_name(&input.digest);
        let joined = self.layers(part, &chained, &input, &survey);
        let all = 0..survey.layers;
        let (all_s, mut bytes) = (survey.cost_s(&all), survey.bytes(&all));
        let mut stack = joined;
        for (which, after) in chained.stages.after.iter().enumerate() {
            let files = self.inputs(after.input_files()?)?;
            let recipe = TaskRecipe {
                kind: after.kind(),
                options: vec![after.canonical()],
                inputs: inputs_of([stack.to_string()], &files),
                code: coded([after.code()]),
            };
            let (part_file, stages) = (part.file.clone(), chained.words.clone());
            let work = Work::Whole { part: part_file, stages, which };
            let cost = after.cost(&survey, bytes);
            bytes = cost.disk;
            let label = format!("{} of the whole stack", after.code().0);
            stack = self.add(recipe, &part.name, label, vec![stack], files, cost, work);
        }
        let check = Called::clone(&*self.check_call(part)?);
        let recipe = TaskRecipe {
            kind: Kind::Check,
            options: vec![check.options],
            inputs: inputs_of([stack.to_string()], &check.files),
            code: check.code,
        };
        let cost = Cost { cpu_s: all_s * 0.2, memory: survey.memory, disk: 1 << 14 };
        let check = self.add(
            recipe,
            &part.name,
            "check".to_owned(),
            vec![stack],
            check.files,
            cost,
            Work::Check { words: check.words },
        );
        let file = part.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(WantedResults {
            stack,
            check: Some(check),
            names: vec![(stored, file)],
            bytes,
            layers: survey.layers,
        })
    }

    /// Adds the tasks that make the layers of a part: ranges and their join, or one task where one
    /// range has all. The key of the joined stack does not depend on how it was cut.
    fn layers(
        &mut self,
        part: &Part,
        chained: &Chained<C>,
        input: &InputFile,
        survey: &Survey,
    ) -> Key {
        let files: Vec<InputFile> = std::iter::once(input).chain(&chained.files).cloned().collect();
        let recipe = |kind: Kind, cut: Option<&Range<u32>>| TaskRecipe {
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
        let work = |layers: Range<u32>| Work::Range {
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
                work(all),
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
                work(range.clone()),
            )
        };
        let needs: Vec<Key> = ranges.iter().map(add).collect();
        let label = format!("join of {} ranges", needs.len());
        let cost = Cost { cpu_s: survey.cost_s(&all) * 0.05, ..cost(&all) };
        self.add(recipe(Kind::Join, None), &part.name, label, needs, vec![], cost, Work::Join)
    }

    /// Returns what a part takes, from the store if it has been surveyed.
    fn survey(
        &self,
        chained: &Chained<C>,
        file: &Path,
        input: &InputFile,
    ) -> Result<Survey, BatchError> {
        let chain = &chained.stages.chain;
        let files = inputs_of([], std::iter::once(input).chain(&chained.files));
        let note = Key::of_note("survey", &(files, &chained.options, &chained.code));
        if let Some(known) = self.store.note(note) {
            return Ok(known);
        }
        let survey = chain.survey(file)?;
        self.store.keep_note(note, &survey)?;
        Ok(survey)
    }

    /// Adds the task of a build.
    fn build(
        &mut self,
        build: &Build,
        tile: Called,
        parts: &[Subject],
    ) -> Result<WantedResults, String> {
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
        let recipe = TaskRecipe {
            kind: Kind::Tile,
            options: vec![tile.options, told.collect::<Vec<_>>().join(" ")],
            inputs: inputs_of(needs.iter().map(ToString::to_string), &tile.files),
            code: tile.code,
        };
        let bytes = of_parts.iter().map(|(part, n)| part.bytes * u64::from(n.unwrap_or(1))).sum();
        let cost = Cost { cpu_s: bytes as f64 * TILE_S_PER_BYTE, memory: TILE_BYTES, disk: bytes };
        let label = match build.parts.len() {
            1 => "build of 1 part".to_owned(),
            parts => format!("build of {parts} parts"),
        };
        let names = of_parts.iter().flat_map(|(part, _)| part.names.clone()).collect();
        let work = Work::Tile { words: tile.words, copies };
        let stack = self.add(recipe, &build.name, label, needs, tile.files, cost, work);
        let layers = of_parts.iter().map(|(part, _)| part.layers).max().unwrap_or(0);
        Ok(WantedResults { stack, check: None, names, bytes, layers })
    }

    #[expect(clippy::too_many_arguments, reason = "they are the fields of a task")]
    fn add(
        &mut self,
        recipe: TaskRecipe,
        subject: &str,
        label: String,
        needs: Vec<Key>,
        files: Vec<InputFile>,
        cost: Cost,
        work: Work,
    ) -> Key {
        let work = Assignment { folder: self.folder.clone(), what: work };
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
