//! How long the machine builds the stacks of a night.

use std::fmt;
use std::path::{Path, PathBuf};

use lamp_batch::{Build, Commands, Night, NightPlan, Stage, Store, Subject, WantedResults};
use lamp_gantry::BuildTime;
use lamp_machine::Machine;
use lamp_pipeline::documents::document;
use lamp_pipeline::heights::time_text;
use lamp_stack::{Image, IndexedStack, Mask, Page, PageInfo};
use serde::Serialize;

use super::night_file::NightFile;
use super::task::LampCommands;
use crate::args::options::TimeArgs;
use crate::commands::job::build_clock;
use crate::commands::tile::time::missing;
use crate::exit::Exit;
use crate::output::numbers::number_of;
use crate::stages::after::After;

/// The time that the machine takes for a stack of a night.
pub(super) struct MachineTime {
    name: String,
    layers: u64,
    /// The known parts of it.
    time: Option<BuildTime>,
    /// Whether it may have more layers.
    is_open: bool,
    /// Sentences about missing numbers, and how to give them.
    missing: Vec<String>,
}

/// The time that the machine takes for a build or a part.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub(super) struct StackTime<'a> {
    /// Its name.
    name: &'a str,
    /// Number of its layers; of a build that is not made, without its layers of mesh below the parts.
    layers: u64,
    /// Time in seconds; null if a number is missing.
    build_s: Option<f64>,
    /// Sum of all that is known, in seconds.
    least_s: Option<f64>,
    /// Sentences about missing numbers, and how to give them.
    missing: &'a [String],
}

impl MachineTime {
    /// Returns the times of the builds that their machines do not refuse, and of parts that are in no
    /// build.
    pub(super) fn of_night(
        file: &NightFile,
        plan: &NightPlan,
        store: &Store,
        times: TimeArgs,
    ) -> Result<Vec<Self>, Exit> {
        let night = &file.night;
        let in_build = |name: &str| {
            night.builds.iter().any(|build| build.parts.iter().any(|(part, _)| part == name))
        };
        // Both are in the order of the night file.
        let (parts, builds) = plan.subjects.split_at(night.parts.len());
        let mut all = Vec::new();
        for (build, subject) in night.builds.iter().zip(builds) {
            let Ok(wanted) = &subject.wanted else { continue };
            if machine_refuses(night, build)?.is_some() {
                continue;
            }
            let copies: Vec<_> = build.parts.iter().map(|(_, copies)| *copies).collect();
            let tile = LampCommands.tile(&build.tile.words[1..], &copies, Path::new(""));
            let tile = tile.map_err(Exit::usage)?;
            let mut is_exposed = false;
            for (name, _) in &build.parts {
                is_exposed |= night.part(name).is_some_and(|part| slicing(&part.stages).1);
            }
            all.push(Self::of(subject, wanted, store, tile.machine(), is_exposed, times)?);
        }
        for (part, subject) in night.parts.iter().zip(parts) {
            let Ok(wanted) = &subject.wanted else { continue };
            if !in_build(&part.name) {
                let (machine, is_exposed) = slicing(&part.stages);
                all.push(Self::of(subject, wanted, store, machine.as_deref(), is_exposed, times)?);
            }
        }
        Ok(all)
    }

    fn of(
        subject: &Subject,
        wanted: &WantedResults,
        store: &Store,
        path: Option<&Path>,
        is_exposed: bool,
        times: TimeArgs,
    ) -> Result<Self, Exit> {
        let machine = path.map(document::<Machine>).transpose()?;
        let machine = machine.as_ref();
        let mut clock = build_clock(path, machine, times)?;
        let mut found = Self {
            name: subject.name.clone(),
            layers: wanted.layers.into(),
            time: None,
            is_open: false,
            missing: Vec::new(),
        };
        let is_made = store.manifest(wanted.stack).is_some();
        let black = Image::Mask(Mask::black(0, 0));
        if is_made {
            let stack = store.result(wanted.stack);
            let failed = |error: lamp_stack::StackError| Exit::from(error).at(subject.name.clone());
            let stack = IndexedStack::open(&stack).map_err(failed)?;
            for (place, header) in stack.headers().iter().enumerate() {
                let image = match clock.needs_images() {
                    true => stack.page(place).and_then(Page::decode).map_err(failed)?.image,
                    false => black.clone().into(),
                };
                clock.add(&header.info, header.pitch, header.size, &image);
            }
            found.layers = stack.headers().len() as u64;
        } else {
            let swaths = machine.and_then(Machine::swaths);
            let times = machine.and_then(|machine| machine.times.as_ref());
            let speed = times.and_then(|times| times.swath_speed_mm_per_s);
            if clock.needs_images() || swaths.and(speed).is_some() {
                let name = &subject.name;
                found.missing =
                    vec![format!("the images of {name} decide its time: make it first")];
                return Ok(found);
            }
            if subject.is_build {
                found.is_open = true;
                let name = &subject.name;
                found.missing =
                    vec![format!("layers below its parts are known once {name} is made")];
            }
            for index in 0..wanted.layers {
                let info = PageInfo { index, ..PageInfo::default() };
                clock.add(&info, None, [0; 2], &black);
            }
        }
        let mut time = clock.time();
        let is_given = times.given().any(|name| name == "--expose");
        let mut asked = time.clone();
        if !is_made && is_exposed && !is_given {
            // Its pages will have their own, and no machine's.
            (time.exposure_s, asked.exposure_s) = (None, Some(0.0));
            let name = &subject.name;
            let why = format!("exposures of {name} are known once it is made: give --expose");
            found.missing.push(why);
        }
        found.missing.extend(missing(&asked, machine));
        found.time = Some(time);
        Ok(found)
    }

    /// Returns the sum of times in seconds, if all are known, and of all that is known of them.
    pub(super) fn sum(all: &[Self]) -> (Option<f64>, f64) {
        let least = |time: &Self| time.time.as_ref().map_or(0.0, BuildTime::least_s);
        (all.iter().map(Self::whole_s).sum(), all.iter().map(least).sum())
    }

    /// Returns its seconds, if all of them are known.
    fn whole_s(&self) -> Option<f64> {
        let time = self.time.as_ref().filter(|time| time.is_whole() && !self.is_open);
        time.map(BuildTime::least_s)
    }

    /// Returns a line for people. `wait_s` is the longest time until it is made, if that is known.
    fn line(&self, wait_s: Option<f64>) -> String {
        let Self { name, layers, time, .. } = self;
        let layers = number_of(*layers, "layer");
        if let Some(seconds) = self.whole_s() {
            let end = wait_s.and_then(|wait_s| Clock::after(wait_s + seconds));
            let end = end.map_or_else(String::new, |end| format!(", ends by {end}"));
            return format!("  {name}: {}, {layers}{end}\n", time_text(seconds));
        }
        match time {
            _ if self.is_unknown() => format!("  {name}: not known, {layers}\n"),
            Some(time) => format!("  {name}: at least {}, {layers}\n", time_text(time.least_s())),
            None => String::new(),
        }
    }

    fn is_unknown(&self) -> bool {
        self.time.as_ref().is_none_or(|time| time.least_s() == 0.0 || time.unscanned.is_some())
    }

    /// Returns the times for people: a line for each of at most `most` stacks, and a sentence for each
    /// number that is missing.
    pub(super) fn text(all: &[Self], wait_s: Option<f64>, most: usize) -> String {
        let mut text = if all.iter().all(Self::is_unknown) {
            "time on the machine: not known\n".to_owned()
        } else {
            let heading = "time on the machine, each started when the tasks are done:\n";
            let lines = all.iter().take(most).map(|time| time.line(wait_s));
            let more = match all.len().saturating_sub(most) {
                0 => String::new(),
                more => format!("  and {more} more, with --verbose\n"),
            };
            [heading.to_owned()].into_iter().chain(lines).chain([more]).collect()
        };
        let mut said: Vec<&String> = Vec::new();
        for sentence in all.iter().flat_map(|time| &time.missing) {
            if !said.contains(&sentence) {
                said.push(sentence);
                text += &format!("{sentence}\n");
            }
        }
        text
    }

    /// Returns the time as programs read it.
    pub(super) fn answer(&self) -> StackTime<'_> {
        StackTime {
            name: &self.name,
            layers: self.layers,
            build_s: self.whole_s(),
            least_s: self.time.as_ref().map(BuildTime::least_s),
            missing: &self.missing,
        }
    }
}

/// Returns why the machine of a build refuses a part of it, if it does: the resolution or the
/// thickness of its layers.
pub(super) fn machine_refuses(night: &Night, build: &Build) -> Result<Option<String>, Exit> {
    let copies: Vec<_> = build.parts.iter().map(|(_, copies)| *copies).collect();
    let tile = LampCommands.tile(&build.tile.words[1..], &copies, Path::new(""));
    let tile = tile.map_err(Exit::usage)?;
    let Some(machine) = tile.machine().map(document::<Machine>).transpose()? else {
        return Ok(None);
    };
    let refuses = |(name, _): &(String, Option<u32>)| {
        let words = |stage: &Stage| stage.words.clone();
        let words: Vec<_> = night.part(name)?.stages.iter().map(words).collect();
        let slice = LampCommands.stages(&words, Path::new("")).ok()?.chain.slice;
        let why = slice.settings.check_machine(&machine).err()?;
        Some(format!("its part {name}: {why}"))
    };
    Ok(build.parts.iter().find_map(refuses))
}

/// Returns the machine of a part's slicing, and whether stages give exposures. The stages were
/// checked with the night file.
fn slicing(stages: &[Stage]) -> (Option<PathBuf>, bool) {
    let words: Vec<_> = stages.iter().map(|stage| stage.words.clone()).collect();
    let Ok(stages) = LampCommands.stages(&words, Path::new("")) else { return (None, false) };
    let slice = stages.chain.slice;
    let by_slice = !matches!(slice.settings.exposure(), Ok(None));
    let is_exposed = by_slice || stages.after.iter().any(After::gives_exposures);
    (slice.machine, is_exposed)
}

/// A time of day, here.
#[derive(PartialEq)]
pub(super) struct Clock {
    pub(super) time: String,
    pub(super) day: String,
}

impl Clock {
    /// Returns the time of day in so many seconds.
    pub(super) fn after(seconds: f64) -> Option<Self> {
        let now = chrono::Local::now();
        let later = chrono::TimeDelta::try_milliseconds((seconds * 1000.0) as i64)?;
        let then = now.checked_add_signed(later)?;
        let day = match (then.date_naive() - now.date_naive()).num_days() {
            0 => "today".to_owned(),
            1 => "tomorrow".to_owned(),
            _ => then.format("on %A, %-d %B %Y").to_string(),
        };
        Some(Self { time: then.format("%H:%M").to_string(), day })
    }
}

impl fmt::Display for Clock {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.time, self.day)
    }
}
