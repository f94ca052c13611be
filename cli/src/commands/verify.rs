//! `lamp verify`: checks that stacks are complete and undamaged.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use clap::Args;
use lamp_build::{FieldForm, FieldKind, is_fields, join_fields};
use lamp_stack::{StackTotals, VerifyError, digest_of, open_ending, stacks_in, verify};
use serde::Serialize;

use crate::args::options::Common;
use crate::exit::Exit;
use crate::output::json_report::{print_answer, schemas};
use crate::output::numbers::number_of;
use crate::output::stack_facts::StackFacts;
use crate::streams::{input_name, is_stream, learning_part, open_pages, print};
use crate::terminal::progress::printable;

/// Check that stacks are complete and undamaged: every page, image, text and height
///
/// Each stack is read to its end and gets one line. Every page must decode to the image that was
/// written, in the original order, up to the last page. Each layer must start where the previous
/// layer ends, and all images must have one size and resolution. A stack from an older version or
/// another program has no checks: its line names the facts that cannot be verified.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp verify build.tif
  lamp verify night/ --json > night.json
  lamp verify blade.tif --against blade.stl
  slice blade.stl | fix | lamp verify

Exit status: 0 if no fault was found, 1 otherwise.")]
pub(crate) struct VerifyArgs {
    /// Stacks: TIFF or picture files, folders of pages, folders of stacks, or - for standard input
    #[arg(value_name = "STACK", default_value = "-")]
    stacks: Vec<PathBuf>,

    /// Part that each stack must be made from; repeat it for several parts, in their order
    #[arg(long, value_name = "PART")]
    against: Vec<PathBuf>,

    /// Print a JSON object (docs/json.md)
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &VerifyArgs, common: &Common) -> Result<(), Exit> {
    let digests = args.against.iter().map(|part| digest_of_part(part));
    let digests = digests.collect::<Result<Vec<_>, _>>()?;
    let mut verdicts = Vec::new();
    let stacks = stacks_at(&args.stacks)?;
    // Strips or fields of one build lie beside each other: their folder is checked once.
    let folders: BTreeSet<&Path> = stacks.iter().filter_map(|path| path.parent()).collect();
    let cut = folders.into_iter().filter(|folder| is_fields(folder));
    let of_stacks = stacks.iter().map(|path| Verdict::of(path, &digests));
    for verdict in of_stacks.chain(cut.map(Verdict::of_fields)) {
        if !args.json && (!common.quiet || verdict.result.is_err()) {
            // Each as soon as it is known: a folder may take hours.
            print(&format!("{}\n", printable(&verdict.line())))?;
        }
        verdicts.push(verdict);
    }
    let faulty = verdicts.iter().filter(|verdict| verdict.result.is_err()).count();
    if args.json {
        print_answer("lamp-verify-1", &answer(&verdicts, faulty == 0))?;
    }
    match (faulty, verdicts.len()) {
        (0, _) => Ok(()),
        (1, all) => Err(Exit::Failed(anyhow!("1 of {all} stacks is not proven whole"))),
        (faulty, all) => {
            Err(Exit::Failed(anyhow!("{faulty} of {all} stacks are not proven whole")))
        }
    }
}

fn digest_of_part(part: &Path) -> Result<String, Exit> {
    let digest = || digest_of(open_ending(part)?);
    Ok(digest().with_context(|| part.display().to_string())?)
}

/// Returns the stacks at the paths. A path without a stack stands for itself.
fn stacks_at(paths: &[PathBuf]) -> Result<Vec<PathBuf>, Exit> {
    let mut stacks = Vec::new();
    for path in paths {
        let found = if is_stream(path) { Ok(vec![path.clone()]) } else { stacks_in(path) };
        let found = found.with_context(|| input_name(path))?;
        if found.is_empty() {
            return Err(Exit::Failed(anyhow!("{}: there is no stack in it", input_name(path))));
        }
        stacks.extend(found);
    }
    Ok(stacks)
}

/// The result of checking a stack.
struct Verdict {
    name: String,
    /// For a stack without fault, its facts (a folder of strips or fields has none of its own); otherwise
    /// a sentence that names the stack and the fault.
    result: Result<Option<StackTotals>, String>,
    /// The kind of fields in it, if it is a folder of them.
    cut: Option<FieldKind>,
    /// Whether it was compared with parts.
    compared: bool,
}

impl Verdict {
    fn of(path: &Path, digests: &[String]) -> Self {
        let result = Self::checked(path, digests).map(Some).map_err(|error| error.to_string());
        // The first page has named the part of standard input.
        Self { name: input_name(path), result, cut: None, compared: !digests.is_empty() }
    }

    /// Checks that the strips or fields in a folder belong to one build.
    fn of_fields(folder: &Path) -> Self {
        let name = input_name(folder);
        let joined =
            join_fields(folder).and_then(|mut layers| layers.try_for_each(|layer| layer.map(drop)));
        let named = |error| Exit::from(error).at(name.clone()).to_string();
        let cut = FieldForm::of(folder).ok().map(|form| form.kind());
        Self { result: joined.map(|()| None).map_err(named), name, cut, compared: false }
    }

    fn checked(path: &Path, digests: &[String]) -> Result<StackTotals, Exit> {
        let at = |error: anyhow::Error| Exit::Failed(error).at(input_name(path));
        let totals =
            verify(learning_part(open_pages(path)?, path)).map_err(|error| match error {
                VerifyError::Stack(error) => at(error.into()),
                error => at(error.into()),
            })?;
        compare(&totals, digests).map_err(at)?;
        Ok(totals)
    }

    fn line(&self) -> String {
        let name = &self.name;
        let totals = match &self.result {
            Ok(Some(totals)) => totals,
            Ok(None) => {
                let kind = self.cut.unwrap_or(FieldKind::Strip);
                return format!("{name}: whole, the {kind}s make one build");
            }
            Err(fault) => return fault.clone(),
        };
        let layers = totals.pages;
        let z = totals.first.info.z().zip(totals.top_mm());
        let z = z.map(|(bottom, top)| format!(", z {:.3} to {top:.3} mm", bottom.mm()));
        let compared = if self.compared { ", made from the given part" } else { "" };
        let layers = number_of(layers, "layer");
        let facts = format!("{layers}{}{compared}", z.unwrap_or_default());
        if totals.has_checks() {
            format!("{name}: whole, {facts}")
        } else {
            format!(
                "{name}: no fault in {facts}, but it has no checks: {} would not show",
                unproven(totals)
            )
        }
    }
}

/// Checks that a stack was made from the parts of these digests, if there are any.
fn compare(totals: &StackTotals, digests: &[String]) -> anyhow::Result<()> {
    if digests.is_empty() {
        return Ok(());
    }
    let stack = totals.first.info.stack.as_ref().filter(|stack| !stack.digest.is_empty());
    let stack = stack.context("it does not state what it was made from")?;
    if !stack.is_made_of(digests) {
        let (made_of, given) = (&stack.digest, digests.join(" and "));
        bail!("it was made from {made_of}, not from {given}");
    }
    Ok(())
}

/// The facts that cannot be known of a stack without checks.
fn unproven(totals: &StackTotals) -> &'static str {
    match totals.first.info.stack.as_ref().and_then(|stack| stack.layers) {
        Some(_) => "a changed image or text",
        None => "a changed image or text, or layers missing at the top,",
    }
}

/// Whether stacks are whole, by `lamp verify STACK... --json`.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct VerifyAnswer<'a> {
    /// Whether no stack has a fault.
    whole: bool,
    /// The stacks.
    stacks: Vec<VerifiedStack<'a>>,
}

/// A stack that was checked, with its facts if it is whole.
#[derive(Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
struct VerifiedStack<'a> {
    /// Name of the stack, as given.
    stack: &'a str,
    /// Whether it has no fault; without `checks`, whether no fault was found.
    whole: bool,
    /// The fault, as a sentence.
    fault: Option<&'a str>,
    #[serde(flatten)]
    facts: Option<StackFacts<'a>>,
}

schemas! { "lamp-verify-1": VerifyAnswer<'_>; }

fn answer(verdicts: &[Verdict], whole: bool) -> VerifyAnswer<'_> {
    let stacks = verdicts.iter().map(|verdict| VerifiedStack {
        stack: &verdict.name,
        whole: verdict.result.is_ok(),
        fault: verdict.result.as_ref().err().map(String::as_str),
        facts: verdict.result.as_ref().ok().and_then(Option::as_ref).map(StackFacts::new),
    });
    VerifyAnswer { whole, stacks: stacks.collect() }
}
