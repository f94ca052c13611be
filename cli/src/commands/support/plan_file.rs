//! Plans of supports as lists of edits, which people can change.

use lamp_stack::{Length, one_line};
use lamp_supports::{Findings, IslandPlan, Rod, Scale, Support};

/// Returns the plan as a list of edits: room around the images, the rods of each support, and
/// alternatives as comments. `room` is at the left, right, top and bottom.
pub(super) fn plan_text(
    part: &str,
    plans: &[IslandPlan],
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
        fate(plans),
    );
    let mut places = plans.iter().flat_map(|plan| &plan.places);
    if places.all(|place| place.supports.is_empty()) {
        text += "edit = []\n";
    }
    if room.iter().any(|side| side.um() > 0.0) {
        let [left, right, top, bottom] = room.map(mm);
        text += &format!(
            "\n# Room around the images\n[[edit]]\npad = {{ left = {left}, right = {right}, \
             top = {top}, bottom = {bottom} }}\n"
        );
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
                    text += &edits(support, "");
                    others.iter().for_each(|other| text += &edits(other, "# "));
                }
            }
        }
    }
    text
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
        text += &format!("{mark}{}", shape(rod));
        if number == 0 {
            let what = if support.is_pillar() { "a pillar, " } else { "" };
            text += &format!(" # {what}{length:.3} mm long, tilt {tilt:.1} degrees");
        }
        text += "\n";
    }
    text
}

/// Returns a rod as a shape of an edit.
pub(super) fn shape(rod: &Rod) -> String {
    let [from, to] = rod.ends.map(point);
    let [from_width, to_width] = rod.diameters;
    match rod.is_strut() {
        true => format!("strut = {{ from = {from}, to = {to}, diameter = \"{from_width}\" }}"),
        false => format!(
            "cone = {{ from = {from}, to = {to}, diameters = [\"{from_width}\", \"{to_width}\"] }}"
        ),
    }
}

/// Says what becomes of supports.
fn fate(plans: &[IslandPlan]) -> &'static str {
    let mut supports = plans.iter().flat_map(IslandPlan::supports);
    let has_pillars = supports.any(Support::is_pillar);
    let mut supports = plans.iter().flat_map(IslandPlan::supports);
    let has_struts = supports.any(|support| !support.is_pillar());
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
