//! `lamp batch verify` and `gc`: keep a store sound and small.

use anyhow::anyhow;
use lamp_batch::{Damage, check_delivered, collect as collect_garbage};
use lamp_pipeline::memory::in_words;

use super::night_file::{NightFile, store_of};
use super::plan_text::printable_lines;
use super::{GcArgs, StoreArgs};
use crate::args::options::Common;
use crate::exit::Exit;
use crate::streams::print;
use crate::terminal::progress::Progress;

/// Hashes all results anew and removes damaged results. Checks delivered files, too.
pub(super) fn verify(args: &StoreArgs, common: &Common) -> Result<(), Exit> {
    let (store, file) = store_of(args)?;
    let progress = Progress::new("batch verify", common, true);
    let (mut whole, mut damaged) = (0, 0);
    for key in store.keys().map_err(anyhow::Error::new)? {
        match store.check(key) {
            Ok(_) => whole += 1,
            // A task that was never done, or whose process was ended, has none.
            Err(Damage::NoManifest) if !store.has_manifest(key) => {}
            Err(damage) => {
                damaged += 1;
                let name = store.name_of(key);
                let then = match store.forget(key) {
                    Ok(()) => "removed: the next run makes it again".to_owned(),
                    Err(error) => Exit::from(anyhow::Error::new(error)).to_string(),
                };
                progress.warn(&format!("{name}: {damage}: {then}"));
            }
        }
    }
    let (delivered, wrong) = match &file {
        Some(file) => check_delivered(&file.night, &store)?,
        None => (0, Vec::new()),
    };
    wrong.iter().for_each(|problem| progress.warn(problem));
    let mut problems = Vec::new();
    if damaged > 0 {
        problems.push(format!("{damaged} of {} results were damaged", whole + damaged));
    }
    if !wrong.is_empty() {
        let all = delivered + wrong.len();
        problems.push(format!("{} of {all} delivered files have changed or are gone", wrong.len()));
    }
    if !problems.is_empty() {
        return Err(Exit::Failed(anyhow!(problems.join(", "))));
    }
    let no_parts = file.as_ref().and_then(NightFile::no_parts);
    let files = match (&file, &no_parts) {
        (Some(_), None) => format!(", and {delivered} delivered files"),
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
