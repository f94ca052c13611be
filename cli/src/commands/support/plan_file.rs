//! Plans of supports as lists of edits, which people can change.

use std::fmt::Write;

use lamp_stack::{Length, one_line};
use lamp_supports::{Findings, IslandPlan, Scale, Support};

/// Returns the plan as a list of edits: a strut for each support, alternatives as comments.
pub(super) fn plan_text(part: &str, plans: &[IslandPlan], found: &Findings) -> String {
    let scale = Scale::new(found);
    let mut text = format!(
        "\
# Supports of {}: lamp edit STACK THIS -o OUT draws them.
# They stay in the mold and become features of the casting. Delete the [[edit]] of one that is
# not wanted, or exchange its strut for one of the alternatives below it. lamp check shows
# whether islands are left.
",
        one_line(part)
    );
    let mut places = plans.iter().flat_map(|plan| &plan.places);
    if places.all(|place| place.supports.is_empty()) {
        text += "edit = []\n";
    }
    for plan in plans {
        let island = &plan.island;
        let layer = scale.layer(island.layer);
        let area = scale.area(island.area);
        let places = match plan.places.len() {
            1 => String::new(),
            places => format!(", in {places} places"),
        };
        text += &format!("\n# Island {}, {layer}, {area}{places}\n", island.number);
        for place in &plan.places {
            match &place.supports[..] {
                [] => text += "# A place without a way for a support\n",
                [support, others @ ..] => {
                    text += &format!("[[edit]]\n{}\n", strut(support));
                    others.iter().for_each(|other| text += &format!("# {}\n", strut(other)));
                }
            }
        }
    }
    text
}

fn strut(support: &Support) -> String {
    let [from, to] = support.ends.map(point);
    let (length, tilt) = (support.length().mm(), support.tilt);
    let diameter = support.diameter;
    format!(
        "strut = {{ from = {from}, to = {to}, diameter = \"{diameter}\" }} \
         # {length:.3} mm long, tilt {tilt:.1} degrees"
    )
}

/// Writes a point to whole nanometers.
fn point(point: [Length; 3]) -> String {
    let mut text = String::new();
    for (k, length) in point.into_iter().enumerate() {
        let mm = format!("{:.6}", length.mm());
        let mm = mm.trim_end_matches('0').trim_end_matches('.');
        let start = if k == 0 { "[" } else { ", " };
        write!(text, "{start}\"{mm}mm\"").expect("text takes all");
    }
    text + "]"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_short_and_read_back() {
        let written = point([-0.0, 1234.567, 20_000.0].map(Length::from_um));
        assert_eq!(written, r#"["-0mm", "1.234567mm", "20mm"]"#);
        assert_eq!("-0mm".parse::<Length>().unwrap().um(), 0.0);
    }
}
