//! `lamp batch night.toml --watch FOLDER`: makes the parts of a folder as they come.

use std::collections::BTreeMap;
use std::fs;
use std::path::{self, Path, PathBuf};
use std::thread;
use std::time::Duration;

use anyhow::Context;
use lamp_batch::{SubjectSummary, WatchedNames};
use lamp_stack::FileStamp;

use super::RunArgs;
use super::night_file::NightFile;
use super::part_files::{FolderEntries, why_no_part};
use super::run::make;
use crate::args::options::Common;
use crate::exit::Exit;
use crate::output::numbers::number_of;
use crate::terminal::progress::Progress;

/// The time between two looks. Who writes a file adds to it within that time.
const PAUSE: Duration = Duration::from_secs(2);

/// Makes the night, and then each new or changed part of a folder, until a signal ends the process.
pub(super) fn watch(
    night: &Path,
    folder: &Path,
    args: &RunArgs,
    common: &Common,
) -> Result<(), Exit> {
    let name = folder.display().to_string();
    if !folder.is_dir() {
        let problem = if folder.exists() { "it is no folder" } else { "there is no such folder" };
        return Err(Exit::usage(format!("--watch {name}: {problem}")));
    }
    // This process works in the folder of the night file.
    let absolute = |path: &Path| path::absolute(path).with_context(|| path.display().to_string());
    let (night, folder) = (absolute(night)?, absolute(folder)?);
    // Mistakes are reported before anything is waited for.
    let file = NightFile::open_for_look(&night)?;
    // A part has the name that an earlier run gave it.
    let mut names = WatchedNames::of(&file.store()?, &night, &folder);
    let progress = Progress::new("batch", common, true);
    progress.say(&format!("watches {name} for parts: Ctrl-C ends it"));
    let mut watched = Watched::default();
    let mut last_night = None;
    let mut said: BTreeMap<String, (String, Option<String>)> = BTreeMap::new();
    let mut is_there = true;
    loop {
        // A folder of the network may be gone for a while.
        let is_new = match watched.look(&folder, &progress) {
            Ok(is_new) => is_new,
            Err(error) => {
                if is_there {
                    progress.warn(&format!("{name}: {error}: looks again until it is there"));
                }
                is_there = false;
                thread::sleep(PAUSE);
                continue;
            }
        };
        is_there = true;
        let this_night = stamp(&night);
        if is_new || this_night != last_night {
            last_night = this_night;
            let parts = watched.steady();
            match NightFile::open_with(&night, Some((&parts, &mut names))) {
                Ok(file) if file.night.parts.is_empty() => {}
                Ok(file) => {
                    names.keep(&file.store()?, &night, &folder).map_err(anyhow::Error::new)?;
                    let made = make(&file, args, &progress)?;
                    for line in made.summary.lines() {
                        // A changed part may have the same line, but not the same bytes.
                        let state = (line_of(line), line.digest.clone());
                        if said.get(&line.name) != Some(&state) {
                            progress.say(&state.0);
                            said.insert(line.name.clone(), state);
                        }
                    }
                    if made.is_full {
                        return made.end;
                    }
                }
                // It is read again when it has changed.
                Err(error) => progress.warn(&error.to_string()),
            }
        }
        thread::sleep(PAUSE);
    }
}

/// The parts of a folder that is watched.
#[derive(Default)]
struct Watched {
    /// Files at the last look.
    seen: BTreeMap<PathBuf, FileStamp>,
    /// Parts that did not change between two looks, as they were then.
    made: BTreeMap<PathBuf, FileStamp>,
    /// Files that are no parts.
    others: BTreeMap<PathBuf, FileStamp>,
}

impl Watched {
    /// Looks at all files. Returns whether there is a new part, or another state of one. A file that is
    /// being written has another size or time at the next look.
    fn look(&mut self, folder: &Path, progress: &Progress) -> std::io::Result<bool> {
        let files = FolderEntries::of(folder)?.files;
        let stamped = files.into_iter().filter_map(|file| Some((file.clone(), stamp(&file)?)));
        let now: BTreeMap<PathBuf, FileStamp> = stamped.collect();
        let mut is_new = false;
        for (file, stamp) in &now {
            let is_steady = self.seen.get(file) == Some(stamp);
            let is_known =
                [&self.made, &self.others].iter().any(|map| map.get(file) == Some(stamp));
            if is_known || !is_steady {
                continue;
            }
            match why_no_part(file) {
                None => {
                    self.made.insert(file.clone(), *stamp);
                    is_new = true;
                }
                Some(why) => {
                    let name = file.file_name().unwrap_or_default().to_string_lossy();
                    progress.say(&format!("{name}: left out, {why}"));
                    self.others.insert(file.clone(), *stamp);
                    self.made.remove(file);
                }
            }
        }
        for map in [&mut self.made, &mut self.others] {
            map.retain(|file, _| now.contains_key(file));
        }
        self.seen = now;
        Ok(is_new)
    }

    /// Returns the parts that are as they were, and not being written again.
    fn steady(&self) -> Vec<PathBuf> {
        let is_steady =
            |(file, stamp): &(&PathBuf, &FileStamp)| self.seen.get(*file) == Some(*stamp);
        self.made.iter().filter(is_steady).map(|(file, _)| file.clone()).collect()
    }
}

fn stamp(file: &Path) -> Option<FileStamp> {
    fs::metadata(file).ok().map(|facts| FileStamp::of(&facts))
}

/// Returns the line of a part or a build.
fn line_of(line: &SubjectSummary) -> String {
    let why = line.why.as_ref().map(|why| format!(": {why}")).unwrap_or_default();
    let mut text = format!("{}: {}{why}", line.name, line.state.words());
    if let (Some(file), Some(layers)) = (&line.file, line.layers) {
        text += &format!(", {file}, {}", number_of(layers, "layer"));
    }
    text
}
