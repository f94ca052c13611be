//! Calls that follow the stages of parts: stacks checked, builds laid out. Each does what its
//! command does, with the same bytes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use lamp_batch::{Call, WriteLayers};
use lamp_build::TILE_CODE;
use lamp_pipeline::StackLight;
use lamp_pipeline::build_copies::BuildCopies;
use lamp_pipeline::check::{self, CheckSettings};
use lamp_pipeline::watcher::KeptRemarks;
use lamp_stack::{Page, Pages, StackError};
use lamp_supports::{CheckError, FindingRecord, Severity};
use serde::{Deserialize, Serialize};

use super::parse::{parse_check, parse_tile};
use crate::commands::tile::{Build, TileArgs};
use crate::exit::Exit;
use crate::terminal::progress::Progress;

/// How a build is laid out: the options of `lamp tile`.
#[derive(Clone)]
pub(crate) struct Tiling(TileArgs);

impl Tiling {
    /// Reads options as they stand on a command line, split into words, the stacks left out. Files
    /// stand in `folder`, unless their paths are absolute. `copies` are the copies of each stack.
    ///
    /// # Errors
    /// Returns a sentence about the first option that is refused.
    pub(crate) fn parse(
        options: &[String],
        copies: &[Option<u32>],
        folder: &Path,
    ) -> Result<Self, String> {
        let args = parse_tile(options, folder)?;
        // Now, so that a night is refused before it begins.
        args.check_for(copies).map_err(|error| error.to_string())?;
        Ok(Self(args))
    }

    /// Returns the machine, if one is named.
    pub(crate) fn machine(&self) -> Option<&Path> {
        self.0.settings.machine.as_deref()
    }

    /// Lays out copies of stacks, and gives the layers of the build to `write`. Returns what is to
    /// be said.
    ///
    /// # Errors
    /// Returns the first error of the stacks or of `write`.
    pub(crate) fn run(
        &self,
        stacks: &[(PathBuf, Option<u32>)],
        write: &mut WriteLayers<'_, Exit>,
    ) -> Result<Vec<String>, Exit> {
        let kept = KeptRemarks::default();
        let build = self.0.build_of(stacks, &Progress::keeping("tile", &kept))?;
        let Build { mut layers, stray_rows, no_mesh, .. } = build;
        write(&mut layers)?;
        // Counted while layers pass, so complete only now.
        let found = [stray_rows.borrow().text(), no_mesh.borrow().text()].into_iter().flatten();
        Ok(kept.take().into_iter().chain(found.map(|text| format!("tile: {text}"))).collect())
    }
}

impl Call for Tiling {
    /// Returns the options as one text. The number of copies belongs to the stacks.
    fn canonical(&self) -> String {
        self.0.settings.canonical()
    }

    fn input_files(&self) -> Result<Vec<PathBuf>, lamp_pipeline::Error> {
        Ok(self.0.settings.clone().files_mut().map(|path| path.clone()).collect())
    }

    fn code(&self) -> (&'static str, u32) {
        ("tile", TILE_CODE)
    }
}

/// The findings to look for in a stack: the options of `lamp check`.
pub(crate) struct Checking(CheckSettings);

/// Findings of a check.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct CheckFindings {
    /// The number of features of each kind that need a person.
    pub(crate) kinds: BTreeMap<String, usize>,
    /// A line for each feature, also for notes, the worst first; then for rules that were not checked.
    pub(crate) lines: Vec<String>,
    /// The same as in the report of `lamp check`, without the input's number.
    pub(crate) findings: Vec<FindingRecord>,
}

impl CheckFindings {
    /// Returns how many features need a person.
    pub(crate) fn found(&self) -> usize {
        self.kinds.values().sum()
    }
}

impl Checking {
    /// Reads options as they stand on a command line, split into words, the stack left out. Files
    /// stand in `folder`, unless their paths are absolute.
    ///
    /// # Errors
    /// Returns a sentence about the first option that is refused.
    pub(crate) fn parse(options: &[String], folder: &Path) -> Result<Self, String> {
        parse_check(options, folder).map(Self)
    }

    /// Finds what there is in a stack.
    ///
    /// # Errors
    /// Returns an error if the stack cannot be read.
    pub(crate) fn run(&self, stack: &Path) -> Result<CheckFindings, Exit> {
        let mut found = CheckFindings::default();
        let name = stack.display().to_string();
        let failed = |error: StackError| Exit::Failed(error.into()).at(name.clone());
        let mut pages =
            Pages::open(stack).map_err(failed)?.map(|page| page.map_err(failed)).peekable();
        let first = pages.peek().and_then(|page| page.as_ref().ok());
        let build = BuildCopies::of_page(first, 0);
        let light = StackLight::of_stack(first.map(Page::info), &[]);
        let decode = |page: Page| page.decode().map_err(failed);
        let all = self.0.find(build, light, pages, decode, None).map_err(|error: Exit| {
            // Errors of pages have their place.
            match error.cause::<CheckError>() {
                Some(_) => error.at(name.clone()),
                None => error,
            }
        })?;
        for feature in &all.features {
            let name = all.records[feature.finding].name();
            if feature.severity != Severity::Note {
                *found.kinds.entry(name.to_owned()).or_default() += 1;
            }
            found.lines.push(format!("{name}: {}", all.text(feature)));
        }
        found.lines.extend(all.unchecked_rules().iter().map(|rules| format!("note: {rules}")));
        found.findings = all.records;
        Ok(found)
    }
}

impl Call for Checking {
    fn canonical(&self) -> String {
        self.0.canonical()
    }

    fn input_files(&self) -> Result<Vec<PathBuf>, lamp_pipeline::Error> {
        Ok(self.0.files().cloned().collect())
    }

    fn code(&self) -> (&'static str, u32) {
        ("check", check::CODE)
    }
}
