//! Reads lists of edits from TOML, and checks each edit.

use std::collections::BTreeSet;
use std::path::PathBuf;

use lamp_stack::{Length, Op, TomlError, TomlStep, one_line, read_toml};
use serde::Deserialize;
use serde_json::Value;

use super::edit_error::{EditError, EditProblem};
use super::letters::SERIAL;
use super::pattern::{MAX_REPEATS, Repeat};
use super::schema::{CylinderAxis, Edit, Label, OtherStack};
use super::serials::{LabelList, SerialList};

/// A list of edits, made one after the other.
///
/// ```
/// use lamp_edit::Edits;
///
/// let edits = Edits::from_toml("[[edit]]\nrotate = 90\n[[edit]]\nmirror = \"x\"\n")?;
/// assert_eq!(edits.count(), 2);
/// let error = Edits::from_toml("[[edit]]\nrotate = 45\n").unwrap_err();
/// assert_eq!(error.to_string(), "edit 1: images rotate by 90, 180 or 270 degrees");
/// # Ok::<(), lamp_edit::EditError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Edits {
    pub(super) list: Vec<Edit>,
    /// The list as the result's first page has it.
    pub(super) told: Vec<Value>,
    /// The lists that labels name, in order, once they are read.
    pub(super) serials: Vec<SerialList>,
}

impl Edits {
    /// Reads a list of edits.
    ///
    /// # Errors
    /// Returns an error that names the line, the edit and the key if the text is no TOML,
    /// or a key is unknown, missing or wrong.
    pub fn from_toml(text: &str) -> Result<Self, EditError> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct EditFile {
            #[serde(default)]
            edit: Vec<Edit>,
        }
        let named = |TomlError { line, path, problem }| match path {
            None => EditError::Syntax { line, problem },
            Some(path) => EditError::Key { line, key: key_of(&path), problem },
        };
        let file: EditFile = read_toml(text).map_err(named)?;
        // Read again without the schema: the first page has the list as it was written, without
        // defaults.
        let table: toml::Table = read_toml(text).map_err(named)?;
        let told = table.get("edit").and_then(|list| list.as_array()).ok_or(EditError::NoEdits)?;
        // No key takes a date, so the schema has refused dates by now.
        let told =
            told.iter().map(|edit| serde_json::to_value(edit).expect("TOML is JSON, dates apart"));
        let mut edits = Self { told: told.collect(), list: file.edit, serials: Vec::new() };
        for (number, edit) in (1..).zip(&mut edits.list) {
            edit.check(number)?;
            edit.make_loft().map_err(|problem| problem.of_edit(number))?;
        }
        Ok(edits)
    }

    /// Creates the one edit that combines a stack with another.
    pub fn combine(op: Op, file: PathBuf) -> Self {
        let other = OtherStack { file, by: [Length::default(); 3] };
        let edit = Edit { op: Some(op), stack: Some(other), ..Edit::default() };
        Self {
            list: vec![edit],
            told: vec![serde_json::json!({ "op": op.to_string(), "stack": {} })],
            serials: Vec::new(),
        }
    }

    /// Returns the number of edits.
    pub fn count(&self) -> usize {
        self.list.len()
    }

    /// Returns the files of the stacks that the edits name, in order.
    pub fn stacks(&self) -> impl Iterator<Item = &PathBuf> {
        self.list.iter().filter_map(|edit| Some(&edit.stack.as_ref()?.file))
    }

    /// Returns the files of the pictures that the edits name, in order.
    pub fn pictures(&self) -> impl Iterator<Item = &PathBuf> {
        self.list.iter().filter_map(|edit| Some(&edit.picture.as_ref()?.file))
    }

    /// Returns the files of the lists that labels name, in order.
    pub fn lists(&self) -> impl Iterator<Item = &PathBuf> {
        self.labels_with_lists().filter_map(|(_, label)| label.list.as_ref())
    }

    /// Reads the serial numbers of the lists that labels name, in order.
    ///
    /// ```
    /// use lamp_edit::{Edits, LabelList};
    ///
    /// let edits = r#"
    ///     [[edit]]
    ///     copies = true
    ///     label = { text = "{list}", list = "sn.csv", at = ["1mm", "1mm"], height = "2mm" }
    /// "#;
    /// let list = LabelList {
    ///     name: "sn.csv".to_owned(),
    ///     digest: "blake3:00".to_owned(),
    ///     text: "A17\nA17\n".to_owned(),
    /// };
    /// let error = Edits::from_toml(edits)?.with_lists(vec![list]).unwrap_err();
    /// assert_eq!(error.to_string(), "edit 1: sn.csv: line 2: A17 is also on line 1");
    /// # Ok::<(), lamp_edit::EditError>(())
    /// ```
    ///
    /// # Errors
    /// Returns an error that names the line if a list is not a list of serial numbers.
    ///
    /// # Panics
    /// Panics if there are fewer `lists` than the labels name.
    pub fn with_lists(mut self, lists: Vec<LabelList>) -> Result<Self, EditError> {
        let mut lists = lists.into_iter();
        let read = self.labels_with_lists().map(|(number, label)| {
            let file = lists.next().expect("there is a file for each list");
            SerialList::read(&file, label.column.as_deref())
                .map_err(|problem| EditProblem::List { list: file.name, problem }.of_edit(number))
        });
        self.serials = read.collect::<Result<_, _>>()?;
        Ok(self)
    }

    /// Returns the labels that name lists, and the numbers of their edits, from 1.
    fn labels_with_lists(&self) -> impl Iterator<Item = (usize, &Label)> {
        let labels = (1..).zip(&self.list).filter_map(|(k, edit)| Some((k, edit.label.as_ref()?)));
        labels.filter(|(_, label)| label.list.is_some())
    }
}

impl Edit {
    /// Checks that the keys go together.
    fn check(&self, number: usize) -> Result<(), EditError> {
        self.problem().map_or(Ok(()), |problem| Err(problem.of_edit(number)))
    }

    fn problem(&self) -> Option<EditProblem> {
        let shapes = [
            self.block.is_some(),
            self.cylinder.is_some(),
            self.line.is_some(),
            self.polygon.is_some(),
            self.strut.is_some(),
            self.cone.is_some(),
            self.sphere.is_some(),
            self.loft.is_some(),
            self.film_hole.is_some(),
            self.label.is_some(),
            self.picture.is_some(),
        ];
        let of_all =
            [self.crop.is_some(), self.pad.is_some(), self.mirror.is_some(), self.rotate.is_some()];
        let count = |of: &[bool]| of.iter().filter(|is| **is).count();
        let (shapes, of_all) = (count(&shapes), count(&of_all));
        if shapes + of_all + usize::from(self.stack.is_some()) != 1 {
            return Some(EditProblem::NotOneAction);
        }
        if of_all == 1 && (self.op.is_some() || self.z.is_some() || self.layers.is_some()) {
            return Some(EditProblem::WholeStack);
        }
        if self.z.is_some() && self.layers.is_some() {
            return Some(EditProblem::TwoRanges);
        }
        if !self.repeat.is_empty() && shapes == 0 {
            return Some(EditProblem::RepeatWithoutShape);
        }
        if !self.copies.is_none() && shapes == 0 {
            return Some(EditProblem::CopiesWithoutShape);
        }
        if self.copies.numbers().is_some_and(BTreeSet::is_empty) {
            return Some(EditProblem::NoCopyChosen);
        }
        // Outside the copies, an intersection would blacken the build.
        if !self.copies.is_none() && self.op == Some(Op::Intersect) {
            return Some(EditProblem::IntersectInCopies);
        }
        if self.cylinder.is_some_and(|c| (c.along == CylinderAxis::Z) == c.between.is_some()) {
            return Some(EditProblem::CylinderEnds);
        }
        if let Some(problem) = self.pattern_problem() {
            return Some(problem);
        }
        if let Some(problem) = self.label.as_ref().and_then(Label::problem) {
            return Some(problem);
        }
        if self.rotate.is_some_and(|degrees| degrees % 90 != 0) {
            return Some(EditProblem::Angle);
        }
        None
    }
}

impl Edit {
    /// Makes a film-cooling hole the loft that it is, in a row.
    fn make_loft(&mut self) -> Result<(), EditProblem> {
        let Some(hole) = self.film_hole.take() else { return Ok(()) };
        let (loft, row) = hole.loft()?;
        // Other patterns repeat the whole row.
        self.repeat.splice(..0, row);
        self.loft = Some(loft);
        self.pattern_problem().map_or(Ok(()), Err)
    }

    fn pattern_problem(&self) -> Option<EditProblem> {
        let lies = self.cylinder.is_some_and(|cylinder| cylinder.along != CylinderAxis::Z);
        let is_solid = lies
            || self.strut.is_some()
            || self.cone.is_some()
            || self.sphere.is_some()
            || self.loft.is_some()
            || self.film_hole.is_some();
        // Each count is limited, but their product may overflow.
        let count = self.repeat.iter().map(Repeat::count).try_fold(1u64, u64::checked_mul);
        if count.is_none_or(|count| count > MAX_REPEATS) {
            return Some(EditProblem::ManyRepeats);
        }
        // Upright shapes are the same in all layers, so no motion can raise or tilt them.
        if !is_solid && !self.repeat.iter().all(Repeat::is_level) {
            return Some(EditProblem::RepeatUp);
        }
        // Pixels turn by right angles only.
        if self.picture.is_some() && !self.repeat.iter().all(Repeat::is_of_quarters) {
            return Some(EditProblem::RepeatPicture);
        }
        None
    }
}

impl Label {
    fn problem(&self) -> Option<EditProblem> {
        match (&self.list, &self.column, self.text.contains(SERIAL)) {
            (Some(_), _, false) => Some(EditProblem::UnusedList),
            (None, _, true) => Some(EditProblem::NoList),
            (None, Some(_), false) => Some(EditProblem::ColumnWithoutList),
            _ => None,
        }
    }
}

/// Returns a key's path with edits counted from 1: `edit 2, box.x`.
fn key_of(path: &[TomlStep]) -> String {
    let mut key = String::new();
    for step in path {
        match step {
            TomlStep::Index(index) if key == "edit" => key += &format!(" {}", index + 1),
            TomlStep::Index(index) => key += &format!("[{index}]"),
            TomlStep::Key(name) if key.is_empty() => key += &one_line(name),
            TomlStep::Key(name) => {
                key += if key.starts_with("edit ") && !key.contains(',') { ", " } else { "." };
                key += &one_line(name);
            }
        }
    }
    if key.is_empty() { "the file".to_owned() } else { key }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(text: &str) -> String {
        Edits::from_toml(text).unwrap_err().to_string()
    }

    #[test]
    fn what_is_wrong_is_named_with_the_edit_and_the_key() {
        let first = "[[edit]]\nrotate = 90\n[[edit]]\n";
        for (text, words) in [
            (
                "box = { x = [\"1mm\", \"2mm\"], y = [\"1mm\", \"2mm\"], w = 1 }",
                &["line 4", "edit 2, box", "`w`"][..],
            ),
            ("boks = 1", &["edit 2", "`boks`"]),
            ("box = { x = [\"1mm\", \"2mm\"] }", &["edit 2, box", "`y`"]),
            ("box = { x = [\"1mm\", \"2\"], y = [\"1mm\", \"2mm\"] }", &["edit 2, box.x", "2"]),
            (
                "box = { x = [\"2mm\", \"1mm\"], y = [\"1mm\", \"2mm\"] }",
                &["edit 2, box.x", "not below"],
            ),
            ("z = [\"1mm\"]\nmirror = \"x\"", &["edit 2, z", "1 lengths"]),
            ("op = \"plus\"", &["edit 2, op", "`plus`"]),
            ("mirror = \"x\"\nrotate = 90", &["edit 2", "one of"]),
            ("z = [\"0mm\", \"1mm\"]", &["edit 2", "one of"]),
            ("z = [\"0mm\", \"1mm\"]\nmirror = \"x\"", &["edit 2", "all layers"]),
            ("copies = true\nmirror = \"x\"", &["edit 2", "copies"]),
            ("copies = 3\nmirror = \"x\"", &["edit 2, copies", "a part's name", "[1, 5]"]),
            ("copies = [-1]\nmirror = \"x\"", &["edit 2, copies", "[1, 5]"]),
            ("copies = { numbers = [1] }\nmirror = \"x\"", &["edit 2, copies", "part"]),
            (
                "copies = []\nbox = { x = [\"1mm\", \"2mm\"], y = [\"1mm\", \"2mm\"] }",
                &["edit 2", "no copy"],
            ),
            ("rotate = 45", &["edit 2", "90"]),
            (
                "line = { from = [\"0mm\", \"0mm\"], to = [\"1mm\", \"0mm\"], width = \"0mm\" }",
                &["edit 2, line.width", "above zero"],
            ),
            (
                "strut = { from = [\"0mm\", \"0mm\"], to = [\"1mm\", \"0mm\", \"0mm\"], diameter = \"1mm\" }",
                &["edit 2, strut.from", "2 lengths where 3"],
            ),
            (
                "polygon = { points = [[\"0mm\", \"0mm\"], [\"1mm\", \"0mm\"]] }",
                &["edit 2, polygon.points", "2 points where 3"],
            ),
            (
                "cone = { from = [\"0mm\", \"0mm\", \"0mm\"], to = [\"1mm\", \"0mm\", \"0mm\"], diameters = [\"-1mm\", \"2mm\"] }",
                &["edit 2, cone.diameters", "below zero"],
            ),
            (
                "sphere = { at = [\"0mm\", \"0mm\"], diameter = \"1mm\" }",
                &["edit 2, sphere.at", "2 lengths where 3"],
            ),
            ("pad = { left = \"-1mm\" }", &["edit 2, pad.left", "below zero"]),
            ("pad = { left = \"1e9mm\" }", &["edit 2, pad.left", "10 m"]),
            (
                "cylinder = { at = [\"0mm\", \"0mm\"], diameter = \"1mm\", along = \"x\" }",
                &["edit 2", "between"],
            ),
            (
                "picture = { file = \"a.bmp\", at = [\"0mm\", \"0mm\"], width = \"0mm\" }",
                &["edit 2, picture.width", "above zero"],
            ),
            (
                "picture = { file = \"a.bmp\", at = [\"0mm\"] }",
                &["edit 2, picture.at", "[x, y], or a list of places"],
            ),
            (
                "label = { text = \"a\", at = [[\"0mm\", \"0mm\"]], height = \"1mm\", turn = \"45\" }",
                &["edit 2, label.turn", "`45`"],
            ),
            (
                "label = { text = \"{list}\", at = [\"0mm\", \"0mm\"], height = \"1mm\" }",
                &["edit 2", "write list = "],
            ),
            (
                "label = { text = \"{n}\", list = \"a.csv\", at = [\"0mm\", \"0mm\"], height = \"1mm\" }",
                &["edit 2", "{list}"],
            ),
            (
                "label = { text = \"{n}\", column = \"a\", at = [\"0mm\", \"0mm\"], height = \"1mm\" }",
                &["edit 2", "column is"],
            ),
        ] {
            let error = error(&format!("{first}{text}\n"));
            assert!(words.iter().all(|word| error.contains(word)), "{text}: {error}");
        }
        assert!(error("[[edits]]\nrotate = 90").contains("`edits`"));
        assert!(error("edit = 3 =").contains("line 1"));
    }

    #[test]
    fn other_stacks_are_found_in_order() {
        let text = "[[edit]]\nstack = { file = \"b.tif\" }\n[[edit]]\nmirror = \"y\"\n\
                    [[edit]]\nop = \"xor\"\nstack = { file = \"a.tif\", move = [\"1mm\", \"0mm\", \"-2mm\"] }\n";
        let edits = Edits::from_toml(text).unwrap();
        assert_eq!(
            edits.stacks().map(|file| file.to_str().unwrap()).collect::<Vec<_>>(),
            ["b.tif", "a.tif"]
        );
        assert_eq!(edits.list[2].op, Some(Op::Xor));
    }
}
