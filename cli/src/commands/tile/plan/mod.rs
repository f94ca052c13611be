//! Plans builds whose copies lie at angles at which the parts are yet to be sliced, as a script.

mod sliced_from;
mod words;

use std::ffi::OsString;

use clap::CommandFactory;
use lamp_build::{FreeTurns, Pack, PackBy, PartStack, PlannedStack, TurnedPlan};
use lamp_stack::{Length, file_word, quoted};

use super::TileArgs;
use super::mesh::template;
use super::stacks::InputStack;
use crate::Lamp;
use crate::args::arguments::words_in_effect;
use crate::exit::Exit;
use crate::streams::{input_name, is_stream, print};
use crate::terminal::progress::Progress;
use sliced_from::SlicedFrom;
use words::kept;

impl TileArgs {
    /// Checks, before the work, what a plan needs.
    pub(super) fn check_plan(&self) -> Result<(), Exit> {
        let Some(turns) = self.settings.free_turns() else { return Ok(()) };
        if self.layout_out.is_none() {
            return Err(Exit::usage(format!(
                "--turns {turns} takes stacks that are yet to be sliced: write their places with \
                 --layout-out"
            )));
        }
        if self.stacks.iter().any(|stack| is_stream(&stack.path)) {
            return Err(Exit::usage(format!(
                "--turns {turns} names the files of stacks, and standard input has none: write it \
                 to a file first"
            )));
        }
        Ok(())
    }

    /// Prints the commands that make a build whose copies lie at any of some angles, and writes the
    /// layout that they need.
    pub(super) fn plan(&self, turns: FreeTurns, progress: &Progress) -> Result<(), Exit> {
        let machine = self.settings.machine()?;
        let mesh = self.settings.mesh.options(template)?;
        let mut stacks = InputStack::open_all(&self.stacks, &self.layers, false, machine.as_ref())?;
        let parts = stacks.iter_mut().map(|stack| stack.part(true));
        let parts = parts.collect::<Result<Vec<PartStack>, _>>()?;
        let from = self.stacks.iter().zip(&stacks).zip(&parts);
        let from = from.map(|((stack, input), part)| SlicedFrom::new(&stack.path, input, part));
        let from = from.collect::<Result<Vec<_>, _>>()?;
        let centres: Vec<[f64; 2]> = from.iter().map(SlicedFrom::centre_mm).collect();
        let (area, gap) =
            (self.settings.area_of(None, machine.as_ref()), self.settings.gap_of(mesh.as_ref()));
        let pack = Pack { by: PackBy::Outlines, ..self.settings.packing() };
        let plan = TurnedPlan::new(&parts, &centres, &self.counts(), area, gap, pack, turns)?;
        self.tell_plan(&plan, turns, progress)?;
        for from in &from {
            self.tell_slicing(from, &plan, progress);
        }
        self.tell(plan.layout())?;
        print(&self.script(&plan, &from, turns, gap))
    }

    /// Reports the gain by turns, and copies that found no place.
    fn tell_plan(
        &self,
        plan: &TurnedPlan,
        turns: FreeTurns,
        progress: &Progress,
    ) -> Result<(), Exit> {
        let placed = |part: usize| {
            let stacks = (0..plan.stacks().len()).filter(|&k| plan.stacks()[k].part == part);
            stacks.map(|stack| plan.layout().copies_of(stack)).sum()
        };
        let names = self.stacks.iter().map(|stack| input_name(&stack.path)).enumerate();
        let placed: Vec<(String, usize)> = names.map(|(part, name)| (name, placed(part))).collect();
        self.tell_left_over(&placed, progress)?;
        progress.say(&gain(plan, turns));
        Ok(())
    }

    /// Warns of what a script cannot do.
    fn tell_slicing(&self, from: &SlicedFrom, plan: &TurnedPlan, progress: &Progress) {
        if plan.new_stacks() == 0 {
            return;
        }
        if let Some(files) = &from.missing {
            progress.warn(&format!(
                "{files}: not found next to its stack as it was sliced: write its path into the \
                 script"
            ));
        }
        if !from.stages.is_empty() {
            let stages = from.stages.join(" and ");
            progress.warn(&format!(
                "pages went through {stages} after they were sliced: add that to the lines of slice \
                 in the script"
            ));
        }
    }

    /// Returns the commands of a plan.
    fn script(
        &self,
        plan: &TurnedPlan,
        from: &[SlicedFrom],
        turns: FreeTurns,
        gap: Length,
    ) -> String {
        let mut script = format!("#!/bin/sh\n# {}\nset -e\n", gain(plan, turns));
        for PlannedStack { name, part, slicing } in plan.stacks() {
            if let Some(slicing) = slicing {
                script += &from[*part].command(slicing, self.layers.is_none(), name);
                script.push('\n');
            }
        }
        let tile = crate::stage(&Lamp::command(), "tile");
        let stacks = plan.stacks().iter().map(|stack| file_word(&stack.name).into_owned().into());
        let layout = self
            .layout_out
            .iter()
            .map(|path| file_word(&path.to_string_lossy()).into_owned().into());
        let settled = ["--fit", "--layout"].map(OsString::from).into_iter().chain(layout);
        let gap = ["--gap".into(), OsString::from(gap.to_string())];
        let words = stacks.chain(settled).chain(gap).chain(kept(words_in_effect(), &tile));
        let words: Vec<String> =
            words.map(|word| quoted(&word.to_string_lossy()).into_owned()).collect();
        script + &format!("tile {}\n", words.join(" "))
    }
}

/// `45 copies with turns of 15deg, 41 with quarters: 2 stacks to slice`.
fn gain(plan: &TurnedPlan, turns: FreeTurns) -> String {
    let plain = plan.plain_copies();
    let copies = match plan.layout().placements().len() {
        1 => "1 copy".to_owned(),
        copies => format!("{copies} copies"),
    };
    match plan.new_stacks() {
        0 => format!("{copies}: no more fit with turns of {turns} than with quarters"),
        1 => format!("{copies} with turns of {turns}, {plain} with quarters: 1 stack to slice"),
        stacks => {
            format!(
                "{copies} with turns of {turns}, {plain} with quarters: {stacks} stacks to slice"
            )
        }
    }
}
