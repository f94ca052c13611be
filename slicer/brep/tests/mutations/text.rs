//! Changes single entities of a STEP text.

use lamp_fixtures::SplitMix;

/// The distance of a copy, in the file's units.
const FAR: f64 = 1000.0;

/// A change that leaves a STEP text readable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mutation {
    /// A loop runs the other way.
    Loop,
    /// A face's normal is turned over.
    Face,
    /// An edge runs against its curve, or along it.
    Edge,
    /// A loop follows an edge the other way.
    EdgeUse,
    /// A part of an assembly is placed twice in one place.
    Placement,
    /// A part of an assembly is placed a second time, elsewhere.
    Copy,
    /// All lengths are in units ten times as long.
    Unit,
}

impl Mutation {
    pub(crate) const ALL: [Self; 7] = [
        Self::Loop,
        Self::Face,
        Self::Edge,
        Self::EdgeUse,
        Self::Placement,
        Self::Copy,
        Self::Unit,
    ];

    /// Returns the types of the entities that it changes, except units.
    fn types(self) -> &'static [&'static str] {
        match self {
            Self::Loop => &["FACE_BOUND", "FACE_OUTER_BOUND"],
            Self::Face => &["ADVANCED_FACE", "FACE_SURFACE"],
            Self::Edge => &["EDGE_CURVE"],
            Self::EdgeUse => &["ORIENTED_EDGE"],
            Self::Placement | Self::Copy => &["NEXT_ASSEMBLY_USAGE_OCCURRENCE"],
            Self::Unit => &[],
        }
    }
}

/// A STEP text, cut into entities.
#[derive(Clone)]
pub(crate) struct Text {
    head: String,
    /// The number and the text of each entity.
    entities: Vec<(u64, String)>,
    tail: String,
}

impl Text {
    /// Cuts a text without comments between its entities.
    pub(crate) fn new(text: &str) -> Self {
        let start = text.find("DATA;").expect("a data section") + "DATA;".len();
        let end = text.rfind("ENDSEC;").expect("its end");
        let mut is_string = false;
        let is_end = |letter: char| {
            is_string ^= letter == '\'';
            letter == ';' && !is_string
        };
        let entity = |part: &str| {
            let (number, body) = part.trim().strip_prefix('#')?.split_once('=')?;
            Some((number.trim().parse().ok()?, body.trim().to_owned()))
        };
        Self {
            head: text[..start].to_owned(),
            entities: text[start..end].split(is_end).filter_map(entity).collect(),
            tail: text[end..].to_owned(),
        }
    }

    /// Returns a changed text and the number of the changed entity, if there is one to change.
    pub(crate) fn mutated(&self, mutation: Mutation, random: &mut SplitMix) -> Option<(Self, u64)> {
        let is_meant = |(_, body): &&(u64, String)| match mutation {
            Mutation::Unit => body.contains("SI_UNIT") && body.contains(".METRE."),
            _ => mutation.types().contains(&body.split('(').next().unwrap_or_default().trim_end()),
        };
        let places: Vec<u64> = self.entities.iter().filter(is_meant).map(|(at, _)| *at).collect();
        let at = *places.get(random.below(places.len().max(1)))?;
        let mut text = self.clone();
        match mutation {
            Mutation::Placement => text.place_again(at, 0.0)?,
            Mutation::Copy => text.place_again(at, FAR)?,
            Mutation::Unit => text.lengthen(),
            _ => text.turn(at)?,
        }
        Some((text, at))
    }

    /// Turns the last flag of an entity.
    fn turn(&mut self, at: u64) -> Option<()> {
        let body = self.body_mut(at);
        let is_true = body.rfind(".T.");
        let flag = is_true.max(body.rfind(".F."))?;
        let other = if is_true == Some(flag) { ".F." } else { ".T." };
        body.replace_range(flag..flag + other.len(), other);
        Some(())
    }

    /// Makes all length units ten times as long.
    fn lengthen(&mut self) {
        const LONGER: [(&str, &str); 3] =
            [(".MILLI.", ".CENTI."), (".CENTI.", ".DECI."), ("$", ".DECA.")];
        for (_, body) in self.entities.iter_mut().filter(|(_, body)| body.contains(".METRE.")) {
            let (name, rest) = body.split_once("SI_UNIT").expect("a unit of SI");
            let (old, new) = LONGER.iter().find(|(old, _)| rest.contains(old)).expect("a prefix");
            *body = format!("{name}SI_UNIT{}", rest.replacen(old, new, 1));
        }
    }

    /// Repeats a usage of a part in an assembly, farther along x.
    fn place_again(&mut self, usage: u64, further: f64) -> Option<()> {
        let shape = self.user("PRODUCT_DEFINITION_SHAPE", usage)?;
        let occurrence = self.user("CONTEXT_DEPENDENT_SHAPE_REPRESENTATION", shape)?;
        let relation = references(self.body(occurrence)).find(|number| *number != shape)?;
        let of_relation: Vec<u64> = references(self.body(relation)).collect();
        let is_move = |at: &u64| self.body(*at).starts_with("ITEM_DEFINED_TRANSFORMATION");
        let by = of_relation.into_iter().find(is_move)?;
        let place = references(self.body(by)).last()?;
        let point = references(self.body(place)).next()?;
        let last = self.entities.iter().map(|(number, _)| *number).max()?;
        let old = [usage, shape, relation, occurrence, by, place, point];
        let new = [1, 2, 3, 4, 5, 6, 7].map(|k| last + k);
        for (from, to) in old.into_iter().zip(new) {
            let mut body = self.body(from).to_owned();
            for (old, new) in old.into_iter().zip(new) {
                body = renumbered(&body, old, new);
            }
            self.entities.push((to, body));
        }
        let point = self.body_mut(last + 7);
        let start = point.rfind('(')? + 1;
        let end = start + point[start..].find(',')?;
        let x: f64 = point[start..end].trim().parse().ok()?;
        point.replace_range(start..end, &format!("{:?}", x + further));
        Some(())
    }

    fn body(&self, at: u64) -> &str {
        let found = self.entities.iter().find(|(number, _)| *number == at);
        &found.expect("an entity of this text").1
    }

    fn body_mut(&mut self, at: u64) -> &mut String {
        let found = self.entities.iter_mut().find(|(number, _)| *number == at);
        &mut found.expect("an entity of this text").1
    }

    /// Returns the first entity of a type that refers to a given entity.
    fn user(&self, name: &str, of: u64) -> Option<u64> {
        let is_user =
            |body: &str| body.starts_with(name) && references(body).any(|number| number == of);
        self.entities.iter().find(|(_, body)| is_user(body)).map(|(number, _)| *number)
    }
}

impl std::fmt::Display for Text {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "{}", self.head)?;
        for (number, body) in &self.entities {
            writeln!(f, "#{number}={body};")?;
        }
        f.write_str(&self.tail)
    }
}

/// Returns the numbers of the entities that an entity refers to.
fn references(body: &str) -> impl Iterator<Item = u64> {
    body.split('#')
        .skip(1)
        .filter_map(|rest| rest.split(|letter: char| !letter.is_ascii_digit()).next()?.parse().ok())
}

/// Returns an entity with a reference to a new number in place of the old one.
fn renumbered(body: &str, old: u64, new: u64) -> String {
    let (first, rest) = body.split_once('#').unwrap_or((body, ""));
    let mut text = first.to_owned();
    for part in rest.split('#').filter(|part| !part.is_empty()) {
        let digits = part.find(|letter: char| !letter.is_ascii_digit()).unwrap_or(part.len());
        let is_old = part[..digits].parse() == Ok(old);
        let number = if is_old { new.to_string() } else { part[..digits].to_owned() };
        text += &format!("#{number}{}", &part[digits..]);
    }
    text
}
