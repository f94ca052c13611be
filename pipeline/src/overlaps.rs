//! Reports the overlap of the bodies of one file.

use lamp_slicing::brep::Prepared;
use lamp_slicing::{BodyOverlap, Part};
use lamp_stack::one_line;

use crate::part_file::PartFile;
use crate::size::short;

/// Returns a line on the space that bodies share in the layers made so far, if they share any; the
/// largest overlap comes first. `cancels` if space in two of them is outside.
pub(crate) fn overlap_text(
    overlaps: &[BodyOverlap],
    part: &Part,
    files: &[PartFile],
    cancels: bool,
) -> Option<String> {
    let (worst, others) = overlaps.split_first()?;
    let more = match others {
        [] => String::new(),
        [other] => format!(", and another pair by {} mm³", short(other.volume_mm3)),
        others => {
            let volume = others.iter().map(|other| other.volume_mm3).sum();
            format!(", and {} other pairs by {} mm³ in all", others.len(), short(volume))
        }
    };
    let then = match cancels {
        false => "they unite",
        true => "their common volume cancels out, or unites without --bodies xor",
    };
    let pair = pair_name(worst, part.prepared_of(worst.file));
    let place = match files {
        [_] => String::new(),
        files => format!(" of {}", files[worst.file].name()),
    };
    Some(format!("{pair}{place} overlap by {} mm³{more}: {then}", short(worst.volume_mm3)))
}

/// Returns the names of two bodies of a file: `bodies 2 (can) and 3 (foot)`.
fn pair_name(overlap: &BodyOverlap, step: Option<&Prepared>) -> String {
    let kind = if step.is_some() { "bodies" } else { "meshes" };
    let [a, b] = overlap.bodies.map(|body| {
        let name = step.map_or("", |step| step.reports[body].name.trim());
        let number = body + 1;
        if name.is_empty() { number.to_string() } else { format!("{number} ({})", one_line(name)) }
    });
    format!("{kind} {a} and {b}")
}
