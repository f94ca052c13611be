//! Plans of supports as lists of edits, which people can change.

use lamp_stack::{FlowSection, Length, one_line};
use lamp_supports::{Findings, HeldPlace, Rod, Scale, Support, SupportPlan};

/// Returns the plan as a list of edits: room around the images, the rods of each support, and
/// alternatives as comments. `room` is at the left, right, top and bottom.
pub(super) fn plan_text(
    part: &str,
    plan: &SupportPlan,
    room: [Length; 4],
    found: &Findings,
) -> String {
    let scale = Scale::new(found);
    let mut text = format!(
        "\
# Supports of {}: lamp edit STACK THIS -o OUT draws them.
# {}
# Delete each [[edit]] of one that is not wanted, or exchange it for one of the alternatives below
# it. lamp check shows whether islands are left.
",
        one_line(part),
        fate(plan),
    );
    if plan.supports().next().is_none() {
        text += "edit = []\n";
    }
    if room.iter().any(|side| side.um() > 0.0) {
        let [left, right, top, bottom] = room.map(mm);
        text += &format!(
            "\n# Room around the images\n[[edit]]\npad = {{ left = {left}, right = {right}, \
             top = {top}, bottom = {bottom} }}\n"
        );
    }
    for held in &plan.islands {
        let island = &held.island;
        let layer = scale.layer(island.layer);
        let area = scale.area(island.area);
        let places = match held.places.len() {
            1 => String::new(),
            places => format!(", in {places} places"),
        };
        text += &format!("\n# Island {}, {layer}, {area}{places}\n", island.number);
        held.places.iter().for_each(|place| text += &place_edits(place));
    }
    if !plan.overhangs.is_empty() {
        text += "\n# Undersides\n";
        plan.overhangs.iter().for_each(|place| text += &place_edits(place));
    }
    if !plan.braces.rods.is_empty() {
        text += "\n# Braces between pillars\n";
        plan.braces.rods.iter().for_each(|rod| text += &format!("[[edit]]\n{}\n", shape(rod)));
    }
    text
}

/// Returns the edits of a place, its alternatives as comments.
fn place_edits(place: &HeldPlace) -> String {
    match &place.supports[..] {
        [] => "# A place without a way for a support\n".to_owned(),
        [support, others @ ..] => {
            others.iter().fold(edits(support, ""), |text, other| text + &edits(other, "# "))
        }
    }
}

/// Returns the edits of a support, each line behind a mark. The strut of an alternative lacks the
/// line that begins an edit: it takes the place of the one above.
fn edits(support: &Support, mark: &str) -> String {
    let (length, tilt) = (support.length().mm(), support.tilt);
    let mut text = String::new();
    for (number, rod) in support.rods.iter().enumerate() {
        if mark.is_empty() || support.is_pillar() {
            text += &format!("{mark}[[edit]]\n");
        }
        text += mark;
        text += &shape(rod);
        if number == 0 {
            let what = if support.is_pillar() { "a pillar, " } else { "" };
            text += &format!(" # {what}{length:.3} mm long, tilt {tilt:.1} degrees");
        }
        text += "\n";
    }
    text
}

/// Returns the shape of a rod.
pub(super) fn shape(rod: &Rod) -> String {
    let [from, to] = rod.ends.map(point);
    let [wide, other] = rod.diameters;
    let section = rod.section.map_or_else(String::new, |of_flow| {
        let FlowSection { section, thickness_ratio, flow } = of_flow;
        let section = section.name();
        format!(", section = \"{section}\", thickness_ratio = {thickness_ratio}, flow = {flow:?}")
    });
    match rod.is_strut() {
        true => format!("strut = {{ from = {from}, to = {to}, diameter = \"{wide}\"{section} }}"),
        false => {
            format!("cone = {{ from = {from}, to = {to}, diameters = [\"{wide}\", \"{other}\"] }}")
        }
    }
}

/// Says what becomes of supports.
fn fate(plan: &SupportPlan) -> &'static str {
    let has_pillars = plan.supports().any(Support::is_pillar);
    let has_struts = plan.supports().any(|support| !support.is_pillar());
    match (has_pillars, has_struts) {
        (true, false) => "Cut them off after the build.",
        (true, true) => "Cut the pillars off after the build; the others stay in the mold.",
        (false, _) => "They stay in the mold and become features of the casting.",
    }
}

/// Writes a length to whole nanometers.
fn mm(length: Length) -> String {
    let mm = format!("{:.6}", length.mm());
    format!("\"{}mm\"", mm.trim_end_matches('0').trim_end_matches('.'))
}

/// Writes a point to whole nanometers.
fn point(point: [Length; 3]) -> String {
    format!("[{}]", point.map(mm).join(", "))
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
