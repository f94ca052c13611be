//! Reads night files, so that every error has its place.

use std::collections::{HashMap, HashSet};
use std::ffi::OsStr;
use std::io;
use std::iter;
use std::path::{Path, PathBuf};

use lamp_stack::{one_line, words};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::{
    Build, Night, NightError, NightFormat, NightOutput, Part, Place, Stage, Walk, WatchedNames,
    did_you_mean, twice,
};

type TomlValue<'a> = Spanned<DeValue<'a>>;
type Read<T> = Result<T, NightError>;

/// The keys of a part; defaults take all except the first two.
const PART_KEYS: [&str; 5] = ["file", "name", "check", "ranges", "stages"];

const TABLES: [&str; 5] = ["defaults", "part", "build", "store", "output"];

/// Files that are parts, too, and the names that such files had earlier.
type Others<'a> = (&'a [PathBuf], &'a mut WatchedNames);

/// Reads a night file. Without `others`, it must name parts itself.
pub(super) fn night(text: &str, path: &Path, others: Option<Others<'_>>) -> Read<Night> {
    let folder = match path.parent() {
        // The parent of a bare file name is the empty path, which is no folder.
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let reader = Reader { text, folder };
    let table = DeTable::parse(text).map_err(|error| {
        let problem = format!("{}: a night file is TOML", one_line(error.message()));
        NightError { place: reader.place(error.span().map_or(0, |span| span.start)), problem }
    })?;
    reader.night(table.get_ref(), path, others)
}

struct Reader<'a> {
    text: &'a str,
    folder: &'a Path,
}

/// The contents of a `[[part]]`, or of `[defaults]`.
#[derive(Clone, Default)]
struct PartTable {
    name: Option<(String, Place)>,
    stages: Option<Vec<Stage>>,
    ranges: Option<u32>,
    check: Option<Stage>,
    /// Options of single stages, which replace those in `stages`.
    options: Vec<(String, Stage)>,
}

/// A part that is being read.
struct Draft {
    file: PathBuf,
    fault: Option<String>,
    place: Place,
    table: PartTable,
}

/// Parts in the order of the file, and where each file is among them.
#[derive(Default)]
struct Drafts {
    list: Vec<Draft>,
    places: HashMap<PathBuf, usize>,
}

impl Drafts {
    fn add(&mut self, real: PathBuf, draft: Draft) {
        self.places.insert(real, self.list.len());
        self.list.push(draft);
    }
}

impl Reader<'_> {
    fn place(&self, offset: usize) -> Place {
        let before = self.text.get(..offset).unwrap_or(self.text);
        let start = before.rfind('\n').map_or(0, |at| at + 1);
        Place {
            line: before.matches('\n').count() + 1,
            // Editors count columns in characters, TOML spans in bytes.
            column: before[start..].chars().count() + 1,
        }
    }

    fn at<T>(&self, spanned: &Spanned<T>, problem: impl Into<String>) -> NightError {
        NightError { place: self.place(spanned.span().start), problem: problem.into() }
    }

    fn night(&self, table: &DeTable<'_>, path: &Path, others: Option<Others<'_>>) -> Read<Night> {
        self.check_keys(table, &TABLES, "a night file has no")?;
        let defaults = match table.get("defaults") {
            Some(value) => self.part_table(self.table(value)?, &PART_KEYS[2..])?,
            None => PartTable::default(),
        };
        let mut drafts = Drafts::default();
        for value in self.tables(table, "part")? {
            self.part(value, &mut drafts)?;
        }
        let start = Place { line: 1, column: 1 };
        if drafts.list.is_empty() && others.is_none() {
            let problem = "there is no part: add [[part]] and below it file = \"parts/*.stl\"";
            return Err(NightError { place: start, problem: problem.to_owned() });
        }
        let is_other = |file: &&PathBuf| !drafts.places.contains_key(&real(file));
        let others = others.map(|(files, names)| {
            let files: Vec<PathBuf> = files.iter().filter(is_other).cloned().collect();
            (files, names)
        });
        // Not before all are read: a later [[part]] may change an earlier one's settings.
        let finished = |draft: Draft| finished(draft, &defaults);
        let mut parts = drafts.list.into_iter().map(finished).collect::<Read<Vec<_>>>()?;
        let others = others.map(|(files, names)| named(files, names, &parts));
        for (file, name) in others.into_iter().flatten() {
            let table = PartTable { name: Some((name, start)), ..PartTable::default() };
            let file = self.below_here(file);
            parts.push(finished(Draft { file, fault: None, place: start, table })?);
        }
        // Results are delivered under these names: one would replace the other.
        if let Some((before, part)) = twice(&parts, |part| &part.name) {
            let problem = format!(
                "two parts are called {}, {} and {}: give one of them a different name",
                part.name,
                before.file.display(),
                part.file.display()
            );
            return Err(NightError { place: part.place, problem });
        }
        let mut builds = Vec::new();
        for value in self.tables(table, "build")? {
            builds.push(self.build(value, &parts)?);
        }
        if let Some((_, build)) = twice(&builds, |build: &Build| &build.name) {
            let problem = format!("two builds are called {}: rename one", build.name);
            return Err(NightError { place: build.tile.place, problem });
        }
        let store = match table.get("store") {
            Some(value) => self.folder_of(self.table(value)?)?,
            None => None,
        };
        let (store, store_place) = store.unzip();
        Ok(Night {
            parts,
            builds,
            store: store.unwrap_or_else(|| self.folder.join("lamp-store")),
            store_place,
            output: self.output(table.get("output"), path)?,
        })
    }

    /// Checks that a table has no other keys.
    fn check_keys(&self, table: &DeTable<'_>, known: &[&str], what: &str) -> Read<()> {
        for key in table.keys() {
            let name = key.get_ref().as_ref();
            if !known.contains(&name) {
                let meant = match did_you_mean(name, known.iter().copied()) {
                    meant if meant.is_empty() => format!(": it has {}", known.join(", ")),
                    meant => meant,
                };
                return Err(self.at(key, format!("{what} {}{meant}", one_line(name))));
            }
        }
        Ok(())
    }

    fn table<'v>(&self, value: &'v TomlValue<'_>) -> Read<&'v DeTable<'v>> {
        match value.get_ref() {
            DeValue::Table(table) => Ok(table),
            _ => Err(self.at(value, "this is a table: write its name in brackets, as [defaults]")),
        }
    }

    /// Returns the tables of a list such as `[[part]]`.
    fn tables<'v>(&self, table: &'v DeTable<'_>, key: &str) -> Read<Vec<&'v TomlValue<'v>>> {
        match table.get(key) {
            None => Ok(Vec::new()),
            Some(value) => match value.get_ref() {
                DeValue::Array(values) => {
                    values.iter().map(|value| self.table(value).map(|_| value)).collect()
                }
                _ => Err(self.at(value, format!("write [[{key}]], because there may be several"))),
            },
        }
    }

    fn text<'v>(&self, value: &'v TomlValue<'_>) -> Read<&'v str> {
        match value.get_ref() {
            DeValue::String(text) if !text.trim().is_empty() => Ok(text.as_ref()),
            DeValue::String(_) => {
                Err(self.at(value, "this is empty: write a text, or leave the key out"))
            }
            _ => Err(self.at(value, "this is not text: write it in quotes")),
        }
    }

    fn list<'v>(&self, value: &'v TomlValue<'_>) -> Read<Vec<&'v TomlValue<'v>>> {
        match value.get_ref() {
            DeValue::Array(values) => Ok(values.iter().collect()),
            DeValue::String(_) => Ok(vec![value]),
            _ => Err(self.at(value, "this is not a list of texts: write [\"a\", \"b\"]")),
        }
    }

    /// Reads the words of a command.
    fn command(&self, value: &TomlValue<'_>, before: &[&str]) -> Read<Stage> {
        let open = |quote: char| self.at(value, format!("the quote {quote} is not closed"));
        let words = words(self.text(value)?).map_err(open)?;
        let before = before.iter().map(|&word| word.to_owned());
        Ok(Stage { words: before.chain(words).collect(), place: self.place(value.span().start) })
    }

    fn part_table(&self, table: &DeTable<'_>, known: &[&str]) -> Read<PartTable> {
        let mut read = PartTable::default();
        for (key, value) in table {
            let name = key.get_ref().as_ref();
            if PART_KEYS.contains(&name) && !known.contains(&name) {
                return Err(self.at(key, format!("{name} is for one part: move it to a [[part]]")));
            }
            match name {
                "name" => read.name = Some((self.name(value)?, self.place(value.span().start))),
                "stages" => {
                    let stages = self.list(value)?;
                    let stages = stages.iter().map(|value| self.command(value, &[]));
                    read.stages = Some(stages.collect::<Read<_>>()?);
                    if read.stages.as_ref().is_some_and(Vec::is_empty) {
                        return Err(self.at(value, "there is no stage: begin with \"slice\""));
                    }
                }
                "check" => read.check = Some(self.command(value, &["check"])?),
                "ranges" => read.ranges = Some(self.count(value)?),
                "file" => {}
                // Stages are not known here, so any other key with a text may be one. `finished`
                // looks for it.
                name => {
                    let place = self.place(key.span().start);
                    let words = match value.get_ref() {
                        DeValue::String(text) if text.trim().is_empty() => vec![name.to_owned()],
                        DeValue::String(_) => self.command(value, &[name])?.words,
                        _ => {
                            let meant = did_you_mean(name, known.iter().copied());
                            let name = one_line(name);
                            return Err(self.at(key, format!("there is no key {name}{meant}")));
                        }
                    };
                    read.options.push((name.to_owned(), Stage { words, place }));
                }
            }
        }
        Ok(read)
    }

    fn count(&self, value: &TomlValue<'_>) -> Read<u32> {
        let number = match value.get_ref() {
            DeValue::Integer(number) => number.to_string().parse().ok(),
            _ => None,
        };
        let number = number.filter(|number| (1..=1000).contains(number));
        number.ok_or_else(|| self.at(value, "write a whole number from 1 to 1000"))
    }

    /// Reads a name of a part or a build.
    fn name(&self, value: &TomlValue<'_>) -> Read<String> {
        let name = self.text(value)?;
        match bad_name(name) {
            Some(problem) => Err(self.at(value, problem)),
            None => Ok(name.to_owned()),
        }
    }

    /// Reads a `[[part]]`: adds its files, or changes their earlier settings.
    fn part(&self, value: &TomlValue<'_>, drafts: &mut Drafts) -> Read<()> {
        let table = self.table(value)?;
        let read = self.part_table(table, &PART_KEYS)?;
        let Some(file) = table.get("file") else {
            return Err(self.at(value, "this part has no file: add file = \"parts/*.stl\""));
        };
        let mut files = Vec::new();
        for value in self.list(file)? {
            let place = self.place(value.span().start);
            let found = self.files(value)?;
            files.extend(found.into_iter().map(|(file, fault)| (file, fault, place)));
        }
        if let (Some((_, place)), true) = (&read.name, files.len() > 1) {
            let problem = format!("there are {} files: name only one", files.len());
            return Err(NightError { place: *place, problem });
        }
        for (file, fault, place) in files {
            // A file may match two patterns, or have links: it is one part, with the settings of
            // both.
            let real = real(&self.folder.join(&file));
            match drafts.places.get(&real) {
                Some(&place) => drafts.list[place].table.change(read.clone()),
                None => drafts.add(real, Draft { file, fault, place, table: read.clone() }),
            }
        }
        Ok(())
    }

    /// Returns the file that a text names, or the files that match a pattern and the folders that
    /// cannot be read, each with the reason.
    fn files(&self, value: &TomlValue<'_>) -> Read<Vec<(PathBuf, Option<String>)>> {
        let name = self.text(value)?;
        let path = self.folder.join(name);
        // Names of files may have these characters, too.
        if path.exists() || !name.contains(['*', '?', '[']) {
            return Ok(vec![(name.into(), None)]);
        }
        let wrong = |error: glob::PatternError| self.at(value, format!("{name}: {}", error.msg));
        let Walk { files, closed } = Walk::new(self.folder, name).map_err(wrong)?;
        // A closed folder may hold files: it becomes a part with a fault, and the others go on.
        if files.is_empty() && closed.is_empty() {
            return Err(
                self.at(value, format!("no file matches {name}: check its folder and its ending"))
            );
        }
        let fault = |(folder, error): (PathBuf, io::Error)| {
            let folder = self.below_here(folder);
            let fault = format!("{}: not all files in it can be found: {error}", folder.display());
            (folder, Some(fault))
        };
        let files = files.into_iter().map(|file| (self.below_here(file), None));
        Ok(files.chain(closed.into_iter().map(fault)).collect())
    }

    /// Returns a path from the folder of the night file, if it is below it.
    fn below_here(&self, path: PathBuf) -> PathBuf {
        path.strip_prefix(self.folder).map(Path::to_owned).unwrap_or(path)
    }

    fn build(&self, value: &TomlValue<'_>, parts: &[Part]) -> Read<Build> {
        let table = self.table(value)?;
        self.check_keys(table, &["name", "parts", "machine", "tile"], "a build has no key")?;
        let name = table
            .get("name")
            .ok_or_else(|| self.at(value, "this build has no name: add name = \"monday\""))?;
        let listed = table
            .get("parts")
            .ok_or_else(|| self.at(value, "this build has no parts: add parts = [\"blade:20\"]"))?;
        let mut copies: Vec<(String, Option<u32>)> = Vec::new();
        for value in self.list(listed)? {
            let copy = self.copies(value, parts)?;
            if copies.iter().any(|(name, _)| *name == copy.0) {
                return Err(
                    self.at(value, format!("{} is in this build twice: add up its copies", copy.0))
                );
            }
            copies.push(copy);
        }
        if copies.is_empty() {
            return Err(self.at(listed, "this build has no parts: name some, such as \"blade:20\""));
        }
        let tile = match table.get("tile") {
            Some(value) => self.command(value, &["tile"])?,
            None => Stage { words: vec!["tile".to_owned()], place: self.place(value.span().start) },
        };
        let machine = table.get("machine").map(|value| {
            let place = self.place(value.span().start);
            let words = ["--machine".to_owned(), self.text(value)?.to_owned()];
            Ok((words, place))
        });
        let tile = match machine.transpose()? {
            Some((words, place)) => {
                let place = if table.contains_key("tile") { tile.place } else { place };
                Stage { words: tile.words.into_iter().chain(words).collect(), place }
            }
            None => tile,
        };
        Ok(Build { name: self.name(name)?, parts: copies, tile })
    }

    /// Reads `blade:20`.
    fn copies(&self, value: &TomlValue<'_>, parts: &[Part]) -> Read<(String, Option<u32>)> {
        let text = self.text(value)?;
        let (name, count) = match text.rsplit_once(':') {
            Some((name, count)) => {
                let count: Option<u32> = count.trim().parse().ok().filter(|&count| count > 0);
                let problem = || format!("{text}: write a whole number of copies, as {name}:20");
                (name, Some(count.ok_or_else(|| self.at(value, problem()))?))
            }
            None => (text, None),
        };
        if !parts.iter().any(|part| part.name == name) {
            let meant = did_you_mean(name, parts.iter().map(|part| part.name.as_str()));
            return Err(self.at(value, format!("there is no part {}{meant}", one_line(name))));
        }
        Ok((name.to_owned(), count))
    }

    /// Reads a table that holds only a folder. Returns it with its place.
    fn folder_of(&self, table: &DeTable<'_>) -> Read<Option<(PathBuf, Place)>> {
        self.check_keys(table, &["folder"], "a store has no key")?;
        let Some(value) = table.get("folder") else { return Ok(None) };
        let folder = self.folder.join(self.text(value)?);
        Ok(Some((folder, self.place(value.span().start))))
    }

    fn output(&self, value: Option<&TomlValue<'_>>, path: &Path) -> Read<NightOutput> {
        let stem = path.file_stem().unwrap_or("night".as_ref());
        let mut output = NightOutput { folder: self.folder.join(stem), format: NightFormat::Lamp };
        // A night file without an ending has the name that its output's folder would get.
        if output.folder == path {
            output.folder.set_extension("out");
        }
        let Some(value) = value else { return Ok(output) };
        let table = self.table(value)?;
        self.check_keys(table, &["folder", "format"], "an output has no key")?;
        if let Some(folder) = table.get("folder") {
            output.folder = self.folder.join(self.text(folder)?);
        }
        if let Some(format) = table.get("format") {
            output.format = match self.text(format)? {
                "lamp" => NightFormat::Lamp,
                "tif" => NightFormat::Tif,
                other => {
                    let problem = format!("{} is not a format: write lamp or tif", one_line(other));
                    return Err(self.at(format, problem));
                }
            };
        }
        Ok(output)
    }
}

impl PartTable {
    /// Lets a later table win.
    fn change(&mut self, later: Self) {
        self.name = later.name.or(self.name.take());
        self.ranges = later.ranges.or(self.ranges);
        self.check = later.check.or(self.check.take());
        if later.stages.is_some() {
            // Options of single stages were for the stages before.
            let (name, check) = (self.name.take(), self.check.take());
            *self = Self { name, check, ranges: self.ranges, ..later };
            return;
        }
        self.options.extend(later.options);
    }
}

/// Combines the keys of a part with the defaults.
fn finished(draft: Draft, defaults: &PartTable) -> Read<Part> {
    let Draft { file, fault, place, table } = draft;
    let stem = file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let (name, name_place) = table.name.unwrap_or((stem, place));
    if let Some(problem) = bad_name(&name) {
        return Err(NightError { place: name_place, problem });
    }
    let (stages, options) = match table.stages {
        // Options in the defaults are for the defaults' stages.
        Some(stages) => (stages, table.options),
        None => {
            let all = defaults.options.iter().cloned().chain(table.options);
            (defaults.stages.clone().unwrap_or_default(), all.collect())
        }
    };
    let mut stages = stages;
    for (name, options) in options {
        let is_it = |stage: &&mut Stage| stage.words.first() == Some(&name);
        if stages.iter_mut().filter(is_it).count() > 1 {
            let problem = format!("{name} is among the stages twice: write all stages again");
            return Err(NightError { place: options.place, problem });
        }
        let Some(stage) = stages.iter_mut().find(is_it) else {
            let first = stages.iter().filter_map(|stage| stage.words.first());
            let names: Vec<&str> = first.map(String::as_str).collect();
            let known = PART_KEYS.into_iter().chain(names.iter().copied());
            let meant = match did_you_mean(&name, known) {
                meant if meant.is_empty() && names.is_empty() => {
                    format!(": a part has {}", PART_KEYS.join(", "))
                }
                meant if meant.is_empty() => {
                    format!(": the stages of {} are {}", stem_of(&file), names.join(", "))
                }
                meant => meant,
            };
            let problem = format!("there is no key or stage {}{meant}", one_line(&name));
            return Err(NightError { place: options.place, problem });
        };
        *stage = options;
    }
    if stages.is_empty() {
        let problem = "this part has no stages: add [defaults] and below it stages = \
                       [\"slice --dpi 1500 --thickness 100um\", \"fix\"]";
        return Err(NightError { place, problem: problem.to_owned() });
    }
    let ranges = table.ranges.or(defaults.ranges);
    let plain = || Stage { words: vec!["check".to_owned()], place };
    let check = table.check.or(defaults.check.clone()).unwrap_or_else(plain);
    Ok(Part { name, file, fault, stages, check, ranges, place })
}

fn stem_of(file: &Path) -> String {
    one_line(&file.file_name().unwrap_or_default().to_string_lossy())
}

/// Returns files with the names of their parts. A file keeps its earlier name, unless the night file
/// gives that to a part of its own; names of new files are added to `names`.
fn named(
    files: Vec<PathBuf>,
    WatchedNames(names): &mut WatchedNames,
    parts: &[Part],
) -> Vec<(PathBuf, String)> {
    let of_parts: HashSet<String> = parts.iter().map(|part| part.name.to_lowercase()).collect();
    names.retain(|_, name| !of_parts.contains(&name.to_lowercase()));
    let is_new = |file: &&PathBuf| !names.contains_key(*file);
    let new: Vec<PathBuf> = files.iter().filter(is_new).cloned().collect();
    let taken = parts.iter().map(|part| &part.name).chain(names.values()).map(String::as_str);
    let given = part_names(&new, taken);
    names.extend(new.into_iter().zip(given));
    let with_name = |file: PathBuf| {
        let name = names[&file].clone();
        (file, name)
    };
    files.into_iter().map(with_name).collect()
}

/// Returns a name for the part of each file that no other has, `taken` ones included: the file's own,
/// with its ending where another has the same.
pub(super) fn part_names<'a>(
    files: &[PathBuf],
    taken: impl IntoIterator<Item = &'a str>,
) -> Vec<String> {
    let cleaned = |name: Option<&OsStr>, most: usize| {
        let name = one_line(&name.unwrap_or_default().to_string_lossy());
        let mut name = name.trim_start_matches('.').replace(is_no_letter, "-");
        while name.len() > most {
            name.pop();
        }
        if name.is_empty() { "part".to_owned() } else { name }
    };
    let stem = |file: &Path| cleaned(file.file_stem(), MOST_BYTES - 30);
    // Some systems do not distinguish capitals in names of files.
    let mut taken: HashSet<String> = taken.into_iter().map(str::to_lowercase).collect();
    let mut counts: HashMap<String, usize> = HashMap::new();
    for file in files {
        *counts.entry(stem(file).to_lowercase()).or_default() += 1;
    }
    let name = |file: &PathBuf| {
        let stem = stem(file);
        let is_alone = counts[&stem.to_lowercase()] == 1 && !taken.contains(&stem.to_lowercase());
        let ending = || cleaned(file.extension(), 10);
        let wanted = if is_alone { stem } else { format!("{stem}-{}", ending()) };
        let numbered = (2..).map(|number| format!("{wanted}-{number}"));
        let mut free = iter::once(wanted.clone()).chain(numbered);
        free.find(|name| taken.insert(name.to_lowercase())).expect("there is always a next number")
    };
    files.iter().map(name).collect()
}

/// The most bytes of a part's name.
const MOST_BYTES: usize = 100;

/// Returns whether names of parts are without a letter: results are files of these names, on any
/// system, and a colon parts a name from its copies.
fn is_no_letter(c: char) -> bool {
    c.is_control() || matches!(c, '/' | '\\' | ':')
}

/// Returns why a text cannot be the name of a file and of a part in a build.
fn bad_name(name: &str) -> Option<String> {
    let name = one_line(name);
    if name.contains(is_no_letter)
        || name.starts_with('.')
        || name.is_empty()
        || name.len() > MOST_BYTES
    {
        return Some(format!(
            "{name} cannot name a part or a build: use letters, digits, - and _, such as name = \
             \"blade-7\""
        ));
    }
    None
}

/// Returns the path that all names of a file share.
fn real(path: &Path) -> PathBuf {
    path.canonicalize().unwrap_or_else(|_| path.to_owned())
}
