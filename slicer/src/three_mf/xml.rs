//! Reads the XML of a package, element by element.

use std::io::{self, BufRead, Read};
use std::str::FromStr;

use quick_xml::events::{BytesStart, Event};
use quick_xml::name::{NamespaceResolver, QName, ResolveResult};
use quick_xml::{Reader, XmlVersion};

use super::error::ModelFault;

/// The longest tag, comment or text in the XML of a package.
const MAX_XML_BYTES: usize = 4 << 20;

/// A fault and its approximate byte.
pub(crate) type Located = (u64, ModelFault);

/// A piece of XML. Elements come with their namespace; without a declaration, the prefix of their
/// names replaces it.
pub(crate) enum Xml<'a> {
    Start(&'a str, &'a BytesStart<'a>),
    Text(&'a str),
    /// The end of an element of this name, without a prefix.
    End(&'a str, &'a str),
}

/// Calls `each` at the start and the end of every element, and with the text between.
pub(crate) fn for_each_piece(
    text: &mut BoundedText<impl BufRead>,
    mut each: impl FnMut(Xml<'_>) -> Result<(), ModelFault>,
) -> Result<(), Located> {
    let mut reader = Reader::from_reader(text);
    let mut resolver = NamespaceResolver::default();
    // The number of open elements at each element that declares namespaces. Vertices and triangles
    // do not, and examining all of their attributes takes a quarter of the time.
    let mut scopes = Vec::new();
    let declares = |tag: &BytesStart<'_>| tag.contains("xmlns");
    let mut buffer = Vec::new();
    let mut open = 0usize;
    loop {
        buffer.clear();
        reader.get_mut().begin_event();
        let event = reader.read_event_into(&mut buffer);
        let at = reader.buffer_position();
        let failed = |fault| (at, fault);
        match event.map_err(|error| failed(ModelFault::Xml(error)))? {
            Event::Start(tag) => {
                open += 1;
                if declares(&tag) {
                    resolver.push(&tag).map_err(|error| failed(ModelFault::Xml(error.into())))?;
                    scopes.push(open);
                }
                let namespace = resolver.resolve_element(tag.name()).0;
                each(Xml::Start(name_of(&namespace), &tag)).map_err(failed)?;
            }
            Event::Empty(tag) => {
                if declares(&tag) {
                    resolver.push(&tag).map_err(|error| failed(ModelFault::Xml(error.into())))?;
                }
                let (namespace, local) = resolver.resolve_element(tag.name());
                let namespace = name_of(&namespace);
                each(Xml::Start(namespace, &tag)).map_err(failed)?;
                each(Xml::End(namespace, local.as_ref())).map_err(failed)?;
                if declares(&tag) {
                    resolver.pop();
                }
            }
            Event::End(tag) => {
                let (namespace, local) = resolver.resolve_element(tag.name());
                each(Xml::End(name_of(&namespace), local.as_ref())).map_err(failed)?;
                if scopes.pop_if(|scope| *scope == open).is_some() {
                    resolver.pop();
                }
                open = open.saturating_sub(1);
            }
            Event::Text(text) => each(Xml::Text(&text)).map_err(failed)?,
            Event::Eof if open > 0 => return Err(failed(ModelFault::CutOff)),
            Event::Eof => return Ok(()),
            _ => {}
        }
    }
}

fn name_of<'a>(namespace: &'a ResolveResult<'_>) -> &'a str {
    match namespace {
        ResolveResult::Bound(namespace) => namespace.0,
        ResolveResult::Unbound => "",
        ResolveResult::Unknown(prefix) => prefix,
    }
}

/// Returns an attribute without a prefix.
pub(crate) fn attribute(tag: &BytesStart<'_>, name: &str) -> Result<Option<String>, ModelFault> {
    find_attribute(tag, |key| key.as_ref() == name)
}

/// Returns an attribute of an extension, with any prefix.
pub(crate) fn prefixed_attribute(
    tag: &BytesStart<'_>,
    name: &str,
) -> Result<Option<String>, ModelFault> {
    find_attribute(tag, |key| key.prefix().is_some() && key.local_name().as_ref() == name)
}

fn find_attribute(
    tag: &BytesStart<'_>,
    is_it: impl Fn(QName<'_>) -> bool,
) -> Result<Option<String>, ModelFault> {
    for attribute in tag.attributes().with_checks(false) {
        let attribute = attribute.map_err(|error| ModelFault::Xml(error.into()))?;
        if is_it(attribute.key) {
            let value =
                attribute.normalized_value(XmlVersion::Implicit1_0).map_err(ModelFault::Xml)?;
            return Ok(Some(value.into_owned()));
        }
    }
    Ok(None)
}

/// Returns an attribute as a number.
pub(crate) fn number<T: FromStr + Copy>(
    tag: &BytesStart<'_>,
    name: &'static str,
) -> Result<T, ModelFault> {
    numbers(tag, [name]).map(|[number]| number)
}

/// Returns attributes as numbers.
pub(crate) fn numbers<T: FromStr + Copy, const N: usize>(
    tag: &BytesStart<'_>,
    names: [&'static str; N],
) -> Result<[T; N], ModelFault> {
    let mut found = [None; N];
    // Looking for repeated attributes costs time in each of millions of tags.
    for attribute in tag.attributes().with_checks(false) {
        let attribute = attribute.map_err(|error| ModelFault::Xml(error.into()))?;
        if let Some(place) = names.iter().position(|name| *name == attribute.key.as_ref()) {
            // An attribute that is not a number counts as missing, and the error names it.
            found[place] = attribute.value.trim().parse().ok();
        }
    }
    match found.iter().position(Option::is_none) {
        Some(place) => Err(missing(tag, names[place])),
        None => Ok(found.map(|number| number.expect("none is missing"))),
    }
}

pub(crate) fn missing(tag: &BytesStart<'_>, attribute: &'static str) -> ModelFault {
    let element = tag.name().as_ref().chars().take(40).collect();
    ModelFault::Attribute { element, attribute }
}

/// A text reader that limits the memory for each tag, comment or text between tags.
pub(crate) struct BoundedText<R> {
    text: R,
    /// The number of bytes read in all, and since the last event.
    pub(crate) read: u64,
    of_event: usize,
    most: usize,
}

impl<R: BufRead> BoundedText<R> {
    pub(crate) fn new(text: R) -> Self {
        Self::limited(text, MAX_XML_BYTES)
    }

    /// Limits each tag, comment or text to a number of bytes.
    pub(crate) fn limited(text: R, most: usize) -> Self {
        Self { text, read: 0, of_event: 0, most }
    }

    fn begin_event(&mut self) {
        self.of_event = 0;
    }
}

impl<R: BufRead> Read for BoundedText<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        let length = self.fill_buf()?.read(to)?;
        self.consume(length);
        Ok(length)
    }
}

impl<R: BufRead> BufRead for BoundedText<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.of_event > self.most {
            let most = self.most >> 20;
            return Err(io::Error::other(format!("a tag or text is longer than {most} megabytes")));
        }
        self.text.fill_buf()
    }

    fn consume(&mut self, length: usize) {
        self.read += length as u64;
        self.of_event += length;
        self.text.consume(length);
    }
}
