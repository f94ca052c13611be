//! `lamp support --vent`: proposes holes that drain the pockets of a part.

use lamp_edit::{Edits, edit};
use lamp_stack::{Length, PassingLayer, one_line};
use lamp_supports::{FindingRecord, Findings, Scale, SupportError, Vent, VentPlan, plan_vents};

use super::plan_file::shape;
use super::{SupportArgs, first_page};
use crate::exit::Exit;
use crate::kept_stack::KeptStack;
use crate::streams::{failed_at, input_name, layers_of, write_file};
use crate::terminal::progress::Progress;

/// The share of a pocket's volume that may stay: pixels beside a hole that is round.
const MAY_STAY: f64 = 0.01;

/// Plans holes of a diameter, checks the stack with them, and writes them as a list of edits.
pub(super) fn propose(
    args: &SupportArgs,
    diameter: Length,
    stack: &mut KeptStack,
    progress: &Progress,
) -> Result<(), Exit> {
    let name = input_name(&args.stack);
    let found = args.check(stack, 0, progress)?;
    let layers = layers_of(stack.pages(true)?, &args.stack, None);
    let lengths = [diameter, args.settings.max_length];
    let plans =
        plan_vents(layers, &found, lengths, args.settings.threshold).map_err(|error: Exit| {
            match error.cause::<SupportError>() {
                Some(_) => error.at(name.clone()),
                None => error,
            }
        })?;
    let mut tries: Vec<_> = plans.iter().map(|plan| plan.vents.iter().peekable()).collect();
    // A hole that does not drain its pocket gives way to the next.
    let (vents, islands): (Vec<Option<&Vent>>, _) = loop {
        let vents: Vec<_> = tries.iter_mut().map(|tries| tries.peek().copied()).collect();
        if vents.iter().all(Option::is_none) {
            break (vents, found.islands.count());
        }
        let edits = Edits::from_toml(&text(&plans, &vents, "", &found))?;
        let drained = checked(args, stack, edits)?;
        let mut fail = 0;
        for ((plan, vent), tries) in plans.iter().zip(&vents).zip(&mut tries) {
            if vent.is_some() && plan.share_left(&drained) > MAY_STAY {
                tries.next();
                fail += 1;
            }
        }
        if fail == 0 {
            break (vents, drained.islands.count());
        }
    };
    let part = first_page(stack)?.info.stack.map(|stack| stack.part).unwrap_or_default();
    if let Some(path) = &args.plan {
        let text = text(&plans, &vents, &part, &found);
        write_file(path, |out| out.write_all(text.as_bytes()))?;
    }
    tell(&plans, &vents, diameter, args, &found, progress);
    let mut troubles = Vec::new();
    let left = vents.iter().filter(|vent| vent.is_none()).count();
    if left > 0 {
        troubles.push(format!("{left} of {} pockets have no hole", plans.len()));
    }
    if islands > found.islands.count() {
        troubles.push("the holes cut islands loose: choose a smaller --vent".to_owned());
    }
    if args.strict && !troubles.is_empty() {
        return Err(Exit::Findings(troubles.join("; ")));
    }
    troubles.iter().for_each(|trouble| progress.warn(trouble));
    Ok(())
}

/// Finds what is wrong in the stack after edits.
fn checked(args: &SupportArgs, stack: &mut KeptStack, edits: Edits) -> Result<Findings, Exit> {
    let layers = layers_of(stack.pages(true)?, &args.stack, None);
    let edited = edit(layers, edits, vec![], vec![], |_, _| {});
    let name = input_name(&args.stack);
    let decode =
        |layer: PassingLayer| layer.decode().map_err(|error| failed_at(name.clone(), error));
    lamp_supports::check(edited, decode, &args.settings.check_options())
}

/// Prints a line for each pocket: first of all what is to be done.
fn tell(
    plans: &[VentPlan],
    vents: &[Option<&Vent>],
    diameter: Length,
    args: &SupportArgs,
    found: &Findings,
    progress: &Progress,
) {
    let drained = vents.iter().flatten().count();
    progress.say(&match plans.len() {
        0 => "there are no cups or traps, and the plan is empty".to_owned(),
        pockets => format!(
            "holes drain {drained} of {pockets} pockets; they become features of the casting, so look \
             at each, and draw them with lamp edit"
        ),
    });
    for (plan, vent) in plans.iter().zip(vents) {
        let record = FindingRecord::of_pocket(&plan.pocket, &Scale::new(found));
        let hole = match vent {
            Some(vent) => format!("a hole through {} mm drains it", millimeters(vent.wall)),
            None if plan.is_too_wide => format!("a hole of {diameter} is wider than the pocket"),
            None if plan.vents.is_empty() => {
                format!("the wall is thicker than --max-length {}", args.settings.max_length)
            }
            None => format!("a hole of {diameter} at its floor does not drain it"),
        };
        progress.say(&format!("{}: {record}: {hole}", record.name()));
    }
}

/// Returns the holes as a list of edits.
fn text(plans: &[VentPlan], vents: &[Option<&Vent>], part: &str, found: &Findings) -> String {
    let mut text = format!(
        "\
# Holes that drain {}: lamp edit STACK THIS -o OUT draws them.
# They become features of the casting. Delete the [[edit]] of one that is not wanted.
",
        one_line(part)
    );
    if vents.iter().all(Option::is_none) {
        text += "edit = []\n";
    }
    for (plan, vent) in plans.iter().zip(vents) {
        let record = FindingRecord::of_pocket(&plan.pocket, &Scale::new(found));
        text += &format!("\n# {}: {record}\n", record.name());
        text += &match vent {
            Some(Vent { rod, wall }) => {
                let (hole, wall) = (shape(rod), millimeters(*wall));
                format!("[[edit]]\nop = \"subtract\"\n{hole} # through {wall} mm\n")
            }
            None => "# No hole was found.\n".to_owned(),
        };
    }
    text
}

fn millimeters(length: Length) -> String {
    format!("{:.2}", length.mm())
}
