//! Parses the entities of a STEP file (ISO 10303-21).

use std::cell::Cell;
use std::collections::HashMap;

use super::error::StepError;
use super::token::{StepToken, Tokens};

/// The greatest nesting of brackets; schemas need less.
const MAX_NESTED: usize = 32;

/// An attribute.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    Reference(u64),
    Number(f64),
    Text(String),
    Enumeration(String),
    List(Vec<Value>),
    /// A typed value, such as `LENGTH_MEASURE(25.4)`.
    Typed(Box<Value>),
    /// Omitted or derived.
    Nothing,
}

/// The attributes of one type.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Record {
    pub(crate) name: String,
    pub(crate) values: Vec<Value>,
}

/// The instances of a file's data sections by number. A simple instance is one record; a
/// complex one has a record per type.
#[derive(Debug, Default)]
pub(crate) struct Entities {
    map: HashMap<u64, Vec<Record>>,
    /// The numbers, in the file's order.
    ids: Vec<u64>,
    /// The number of points, edges and faces read so far.
    spent: Cell<usize>,
}

/// The greatest number of points, edges and faces of all bodies. Few entities may be read
/// many times.
const MAX_SPENT: usize = 10_000_000;
/// Types whose subtypes occur together, from the most general type on. A complex instance of one of
/// them is read as a simple instance.
const COMBINED: [&str; 6] = [
    "REPRESENTATION_ITEM",
    "MANIFOLD_SOLID_BREP",
    "BREP_WITH_VOIDS",
    "PCURVE",
    "SURFACE_CURVE",
    "COMPOSITE_CURVE",
];

impl Entities {
    /// Reads a whole file.
    pub(crate) fn read(bytes: &[u8]) -> Result<Self, StepError> {
        // Some editors put a byte order mark before a text.
        let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes);
        let mut reader = EntityReader { tokens: Tokens::new(bytes) };
        match reader.next() {
            Ok(StepToken::Word(word)) if word.starts_with("ISO-10303-21") => {}
            _ => return Err(StepError::NotStep),
        }
        let mut entities = Self::default();
        let mut in_data = false;
        loop {
            match reader.next()? {
                StepToken::Word(word) if word == "DATA" => {
                    // A section may have a name in brackets (edition 2 of ISO 10303-21).
                    while reader.next()? != StepToken::Sign(b';') {}
                    in_data = true;
                }
                StepToken::Word(word) if word == "ENDSEC" => in_data = false,
                StepToken::Word(word) if word.starts_with("END-ISO-10303-21") => break,
                StepToken::Reference(id) if in_data => {
                    reader.expect(b'=')?;
                    let records = flat(reader.instance()?);
                    if entities.map.insert(id, records).is_some() {
                        return Err(StepError::Twice { id });
                    }
                    entities.ids.push(id);
                    reader.expect(b';')?;
                }
                _ if in_data => {
                    return Err(StepError::Unreadable { offset: reader.tokens.offset() });
                }
                _ => {}
            }
        }
        Ok(entities)
    }

    /// Counts points, edges or faces that are read.
    pub(crate) fn spend(&self, count: usize) -> Result<(), StepError> {
        self.spent.set(self.spent.get().saturating_add(count));
        let is_within = self.spent.get() <= MAX_SPENT;
        is_within.then_some(()).ok_or(StepError::TooMuch { most: MAX_SPENT })
    }

    /// Returns all records of an instance.
    pub(crate) fn records(&self, id: u64) -> Result<&[Record], StepError> {
        self.map.get(&id).map(Vec::as_slice).ok_or(StepError::Missing { id })
    }

    /// Returns the instance's record of a type, if it has one.
    pub(crate) fn find(&self, id: u64, name: &str) -> Option<Item<'_>> {
        let record = self.map.get(&id)?.iter().find(|record| record.name == name)?;
        Some(Item { id, record })
    }

    /// Returns the instance's record of a type.
    pub(crate) fn get(&self, id: u64, name: &'static str) -> Result<Item<'_>, StepError> {
        self.records(id)?;
        self.find(id, name).ok_or(StepError::Unexpected { id, expected: name })
    }

    /// Returns the instance's only record.
    pub(crate) fn simple(&self, id: u64) -> Result<Item<'_>, StepError> {
        match self.records(id)? {
            [record] => Ok(Item { id, record }),
            _ => Err(StepError::Unexpected { id, expected: "a simple entity" }),
        }
    }

    /// Returns the error of an instance whose type is not supported.
    pub(crate) fn unsupported(&self, id: u64) -> StepError {
        let names = |records: &[Record]| {
            records.iter().map(|record| record.name.as_str()).collect::<Vec<_>>().join(" ")
        };
        match self.records(id) {
            Ok(records) => StepError::Unsupported { id, name: names(records) },
            Err(missing) => missing,
        }
    }

    /// Returns all records of a type, in the file's order.
    pub(crate) fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = Item<'a>> {
        self.ids.iter().filter_map(move |&id| self.find(id, name))
    }

    /// Returns all records.
    pub(crate) fn every(&self) -> impl Iterator<Item = Item<'_>> {
        // The numbers are the map's keys.
        self.ids.iter().flat_map(|&id| self.map[&id].iter().map(move |record| Item { id, record }))
    }
}

/// A record and the number of its instance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Item<'a> {
    pub(crate) id: u64,
    pub(crate) record: &'a Record,
}

impl<'a> Item<'a> {
    pub(crate) fn name(&self) -> &'a str {
        &self.record.name
    }

    /// Returns an attribute, counted from 0.
    pub(crate) fn value(&self, k: usize) -> Result<&'a Value, StepError> {
        let value = self.record.values.get(k);
        value.ok_or(StepError::Attribute { id: self.id, attribute: k + 1 })
    }

    fn as_a<T>(&self, k: usize, read: impl Fn(&'a Value) -> Option<T>) -> Result<T, StepError> {
        read(self.value(k)?).ok_or(StepError::Attribute { id: self.id, attribute: k + 1 })
    }

    pub(crate) fn reference(&self, k: usize) -> Result<u64, StepError> {
        self.as_a(k, Value::reference)
    }

    /// Returns a reference, or `None` if it is omitted.
    pub(crate) fn optional(&self, k: usize) -> Option<u64> {
        self.record.values.get(k).and_then(Value::reference)
    }

    /// Returns a number, or `None` if it is omitted.
    pub(crate) fn optional_number(&self, k: usize) -> Option<f64> {
        self.record.values.get(k).and_then(Value::number)
    }

    pub(crate) fn number(&self, k: usize) -> Result<f64, StepError> {
        self.as_a(k, Value::number)
    }

    /// Returns an integer from 0 to a million.
    pub(crate) fn count(&self, k: usize) -> Result<usize, StepError> {
        // A greater count is damage, and lists of that length would take all memory.
        let whole = |x: f64| (0.0..=1e6).contains(&x).then_some(x as usize);
        self.as_a(k, |value| value.number().and_then(whole))
    }

    pub(crate) fn text(&self, k: usize) -> &'a str {
        match self.record.values.get(k) {
            Some(Value::Text(text)) => text,
            _ => "",
        }
    }

    /// Returns the word of an enumeration.
    pub(crate) fn word(&self, k: usize) -> Result<&'a str, StepError> {
        self.as_a(k, |value| match value {
            Value::Enumeration(word) => Some(word.as_str()),
            _ => None,
        })
    }

    pub(crate) fn truth(&self, k: usize) -> Result<bool, StepError> {
        Ok(self.word(k)? != "F")
    }

    pub(crate) fn list(&self, k: usize) -> Result<&'a [Value], StepError> {
        self.as_a(k, Value::list)
    }

    pub(crate) fn references(&self, k: usize) -> Result<Vec<u64>, StepError> {
        self.as_a(k, |value| value.list()?.iter().map(Value::reference).collect())
    }

    pub(crate) fn numbers(&self, k: usize) -> Result<Vec<f64>, StepError> {
        self.as_a(k, |value| value.list()?.iter().map(Value::number).collect())
    }
}

impl Value {
    pub(crate) fn reference(&self) -> Option<u64> {
        match self {
            Self::Reference(id) => Some(*id),
            _ => None,
        }
    }

    pub(crate) fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Typed(value) => value.number(),
            _ => None,
        }
    }

    pub(crate) fn list(&self) -> Option<&[Value]> {
        match self {
            Self::List(list) => Some(list),
            Self::Typed(value) => value.list(),
            _ => None,
        }
    }
}

/// Joins the records of a complex instance whose type adds attributes to its supertypes'.
fn flat(records: Vec<Record>) -> Vec<Record> {
    let of = |name: &&str| records.iter().find(|record| record.name == **name);
    let parts: Vec<&Record> = COMBINED.iter().filter_map(of).collect();
    match parts[..] {
        [Record { .. }, .., Record { name, .. }] => {
            let values = parts.iter().flat_map(|part| part.values.iter().cloned()).collect();
            vec![Record { name: name.clone(), values }]
        }
        _ => records,
    }
}

struct EntityReader<'a> {
    tokens: Tokens<'a>,
}

impl EntityReader<'_> {
    fn next(&mut self) -> Result<StepToken, StepError> {
        self.tokens.next()?.ok_or(StepError::CutOff)
    }

    fn unreadable(&self) -> StepError {
        StepError::Unreadable { offset: self.tokens.offset() }
    }

    fn expect(&mut self, sign: u8) -> Result<(), StepError> {
        if self.next()? == StepToken::Sign(sign) { Ok(()) } else { Err(self.unreadable()) }
    }

    fn instance(&mut self) -> Result<Vec<Record>, StepError> {
        match self.next()? {
            StepToken::Word(name) => {
                self.expect(b'(')?;
                Ok(vec![Record { name, values: self.values(0)? }])
            }
            StepToken::Sign(b'(') => {
                let mut records = Vec::new();
                while let StepToken::Word(name) = self.next()? {
                    self.expect(b'(')?;
                    records.push(Record { name, values: self.values(0)? });
                }
                Ok(records)
            }
            _ => Err(self.unreadable()),
        }
    }

    /// Reads values up to the closing bracket.
    fn values(&mut self, depth: usize) -> Result<Vec<Value>, StepError> {
        let mut values = Vec::new();
        if depth > MAX_NESTED {
            return Err(self.unreadable());
        }
        loop {
            let value = match self.next()? {
                StepToken::Sign(b')') => return Ok(values),
                // An omitted value is written as `$`, so commas only separate.
                StepToken::Sign(b',') => continue,
                StepToken::Sign(b'(') => Value::List(self.values(depth + 1)?),
                StepToken::Word(_) => {
                    self.expect(b'(')?;
                    let within = self.values(depth + 1)?;
                    Value::Typed(Box::new(within.into_iter().next().unwrap_or(Value::Nothing)))
                }
                StepToken::Reference(id) => Value::Reference(id),
                StepToken::Number(number) => Value::Number(number),
                StepToken::Text(text) => Value::Text(text),
                StepToken::Enumeration(word) => Value::Enumeration(word),
                StepToken::Omitted | StepToken::Derived => Value::Nothing,
                StepToken::Sign(_) => return Err(self.unreadable()),
            };
            values.push(value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(data: &str) -> Result<Entities, StepError> {
        let text = format!("ISO-10303-21;HEADER;FILE_NAME('#1=X();');ENDSEC;DATA;{data}");
        Entities::read(text.as_bytes())
    }

    const END: &str = "ENDSEC;END-ISO-10303-21;";

    #[test]
    fn simple_and_complex_instances() {
        let data = "#1=POINT('p',(1.,2.5,-3.E0));#2=(A(#1) B(.F.,LENGTH_MEASURE(25.4),$)C());";
        let entities = read(&(data.to_owned() + END)).unwrap();
        let point = entities.simple(1).unwrap();
        assert_eq!((point.name(), point.text(0)), ("POINT", "p"));
        assert_eq!(point.numbers(1).unwrap(), [1.0, 2.5, -3.0]);
        assert_eq!(entities.get(2, "A").unwrap().reference(0).unwrap(), 1);
        let b = entities.get(2, "B").unwrap();
        assert_eq!((b.truth(0).unwrap(), b.number(1).unwrap(), b.optional(2)), (false, 25.4, None));
        assert!(entities.find(2, "D").is_none());
        assert!(matches!(b.number(2), Err(StepError::Attribute { id: 2, attribute: 3 })));
        assert!(matches!(b.number(3), Err(StepError::Attribute { id: 2, attribute: 4 })));
        assert!(matches!(entities.simple(3), Err(StepError::Missing { id: 3 })));
    }

    #[test]
    fn complex_instances_of_combined_types_are_simple_ones() {
        let data = "#1=(BOUNDED_CURVE()CURVE()REPRESENTATION_ITEM('a')SURFACE_CURVE(#2,(),.X.));\
                    #3=(BREP_WITH_VOIDS((#5))FACETED_BREP()MANIFOLD_SOLID_BREP(#4)\
                    REPRESENTATION_ITEM('b'));#6=(BOUNDED_CURVE()REPRESENTATION_ITEM('c'));";
        let entities = read(&(data.to_owned() + END)).unwrap();
        let curve = entities.simple(1).unwrap();
        assert_eq!(
            (curve.name(), curve.text(0), curve.optional(1)),
            ("SURFACE_CURVE", "a", Some(2))
        );
        let solid = entities.simple(3).unwrap();
        assert_eq!((solid.name(), solid.optional(1)), ("BREP_WITH_VOIDS", Some(4)));
        assert_eq!(solid.references(2).unwrap(), [5]);
        assert_eq!(entities.records(6).unwrap().len(), 2);
    }

    #[test]
    fn broken_files_are_refused() {
        assert!(matches!(Entities::read(b"solid x"), Err(StepError::NotStep)));
        assert!(matches!(read("#1=A(1.);"), Err(StepError::CutOff)));
        assert!(matches!(read("#1=A((1.);"), Err(StepError::Unreadable { .. })));
        assert!(matches!(read("#1=A();#1=A();"), Err(StepError::Twice { id: 1 })));
        let deep = format!("#1=A({}", "(".repeat(100_000));
        assert!(matches!(read(&deep), Err(StepError::Unreadable { .. })));
    }
}
