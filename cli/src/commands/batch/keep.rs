//! `lamp batch verify` and `gc`: keep a store sound and small.

use anyhow::anyhow;
use lamp_batch::{Damage, check_delivered, collect as collect_garbage};
use lamp_pipeline::memory::in_words;
use serde::Serialize;

use super::night_file::{NightFile, store_of};
use super::plan_text::printable_lines;
use super::{GcArgs, VerifyArgs};
use crate::args::options::Common;
use crate::exit::Exit;
use crate::output::json_report::{print_answer, schemas};
use crate::streams::print;
use crate::terminal::progress::Progress;

/// Whether results and delivered files are whole, by `lamp batch verify NIGHT.toml --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct StoreCheckAnswer {
    /// Whether all results and delivered files are whole.
    whole: bool,
    /// Results that are whole.
    whole_results: usize,
    /// Results that were damaged.
    damaged: Vec<DamagedResult>,
    /// Delivered files that are whole; null without a night file.
    whole_files: Option<usize>,
    /// A sentence for each delivered file that has changed or is gone.
    wrong_files: Vec<String>,
}

/// A result that was damaged.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct DamagedResult {
    /// Its name.
    name: String,
    /// The damage, as a sentence.
    damage: String,
    /// Whether it was removed, so that the next run makes it again.
    removed: bool,
}

schemas! { "lamp-batch-verify-1": StoreCheckAnswer; }

/// Hashes all results anew and removes damaged results. Checks delivered files, too.
pub(super) fn verify(args: &VerifyArgs, common: &Common) -> Result<(), Exit> {
    let (store, file) = store_of(&args.store)?;
    let progress = Progress::new("batch verify", common, true);
    let (mut whole, mut damaged) = (0, Vec::new());
    for key in store.keys().map_err(anyhow::Error::new)? {
        match store.check(key) {
            Ok(_) => whole += 1,
            // A task that was never done, or whose process was ended, has none.
            Err(Damage::NoManifest) if !store.has_manifest(key) => {}
            Err(damage) => {
                let name = store.name_of(key);
                let forgotten = store.forget(key);
                let removed = forgotten.is_ok();
                let then = match forgotten {
                    Ok(()) => "removed: the next run makes it again".to_owned(),
                    Err(error) => Exit::from(anyhow::Error::new(error)).to_string(),
                };
                progress.warn(&format!("{name}: {damage}: {then}"));
                damaged.push(DamagedResult { name, damage: damage.to_string(), removed });
            }
        }
    }
    let (delivered, wrong) = match &file {
        Some(file) => check_delivered(&file.night, &store)?,
        None => (0, Vec::new()),
    };
    wrong.iter().for_each(|problem| progress.warn(problem));
    let mut problems = Vec::new();
    if !damaged.is_empty() {
        let (damaged, all) = (damaged.len(), whole + damaged.len());
        problems.push(format!("{damaged} of {all} results were damaged"));
    }
    if !wrong.is_empty() {
        let all = delivered + wrong.len();
        problems.push(format!("{} of {all} delivered files have changed or are gone", wrong.len()));
    }
    let whole_files = file.as_ref().map(|_| delivered);
    if args.json {
        let answer = StoreCheckAnswer {
            whole: problems.is_empty(),
            whole_results: whole,
            damaged,
            whole_files,
            wrong_files: wrong,
        };
        print_answer("lamp-batch-verify-1", &answer)?;
    }
    if !problems.is_empty() {
        return Err(Exit::Failed(anyhow!(problems.join(", "))));
    }
    if args.json {
        return Ok(());
    }
    let no_parts = file.as_ref().and_then(NightFile::no_parts);
    let files = match (whole_files, &no_parts) {
        (Some(files), None) => format!(", and {files} delivered files"),
        _ => String::new(),
    };
    let no_parts = printable_lines(&no_parts.unwrap_or_default());
    print(&format!("{whole} results are whole{files}\n{no_parts}"))
}

/// Removes what no batch names.
pub(super) fn collect(args: &GcArgs, _: &Common) -> Result<(), Exit> {
    let (store, _) = store_of(&args.store)?;
    let removed = collect_garbage(&store, args.keep).map_err(anyhow::Error::new)?;
    print(&format!(
        "{} results removed, {}; {} stay\n",
        removed.results,
        in_words(removed.bytes),
        removed.kept
    ))
}
