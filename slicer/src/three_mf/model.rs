//! Reads a model of a 3MF package: its meshes, its other objects and its items.

use std::collections::BTreeMap;
use std::io::BufRead;
use std::sync::Arc;

use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};

use super::{BoundedText, ModelFault};
use crate::facet::{Facet, Units};
use crate::placement::Placement;

/// Extensions whose elements may be passed over: they leave meshes as they are. That
/// for production adds models in other files of the package, which are read.
const KNOWN_EXTENSIONS: [&str; 3] = [
    "http://schemas.microsoft.com/3dmanufacturing/production/2015/06",
    "http://schemas.microsoft.com/3dmanufacturing/material/2015/02",
    "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07",
];

/// A fault and the byte near it.
type Located = (u64, ModelFault);

/// A model: a file of a package.
pub(super) struct Model {
    pub(super) units: Units,
    pub(super) objects: BTreeMap<u32, Object>,
    /// What is built.
    pub(super) items: Arc<Vec<Reference>>,
    /// The number of facets of the package up to its end.
    pub(super) facets_end: usize,
}

pub(super) struct Object {
    /// Whether it is part of what is built, not a support, a surface or anything else.
    pub(super) is_solid: bool,
    pub(super) shape: Shape,
}

pub(super) enum Shape {
    /// A mesh, and the number in the package of its first facet.
    Mesh {
        facets: Arc<Vec<Facet>>,
        first: usize,
    },
    Components(Arc<Vec<Reference>>),
}

/// An object as an item or another object holds it.
#[derive(Clone, Debug)]
pub(super) struct Reference {
    /// The file that it is in, if that is another one.
    pub(super) model: Option<String>,
    pub(super) object: u32,
    pub(super) placement: Placement,
    /// Whether it is to be built.
    pub(super) is_built: bool,
}

impl Model {
    /// Reads a model whose facets are counted from `first_facet`.
    pub(super) fn read(
        text: &mut BoundedText<impl BufRead>,
        first_facet: usize,
    ) -> Result<Self, Located> {
        let mut state = ModelReader::new(first_facet);
        for_each_element(text, |element| match element {
            Element::Start(tag) => state.start(tag),
            Element::End(name) => {
                state.end(name);
                Ok(())
            }
        })?;
        Ok(Self {
            units: state.units,
            objects: state.objects,
            items: Arc::new(state.items),
            facets_end: state.first_facet,
        })
    }
}

/// Returns the target of the first relationship of a kind.
pub(super) fn relationship(
    text: &mut BoundedText<impl BufRead>,
    kind: &str,
) -> Result<Option<String>, Located> {
    let mut target = None;
    for_each_element(text, |element| {
        if let Element::Start(tag) = element
            && tag.local_name().as_ref() == "Relationship"
            && attribute(tag, "Type")?.as_deref() == Some(kind)
            && target.is_none()
        {
            target = attribute(tag, "Target")?.map(|path| in_package(&path));
        }
        Ok(())
    })?;
    Ok(target)
}

/// Returns the name of a file in its package, which paths begin with a slash.
fn in_package(path: &str) -> String {
    path.trim_start_matches('/').to_owned()
}

enum Element<'a> {
    Start(&'a BytesStart<'a>),
    /// The name of the element that ends.
    End(&'a str),
}

/// Calls `each` at the start and the end of every element.
fn for_each_element(
    text: &mut BoundedText<impl BufRead>,
    mut each: impl FnMut(Element<'_>) -> Result<(), ModelFault>,
) -> Result<(), Located> {
    let mut reader = Reader::from_reader(text);
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
                each(Element::Start(&tag)).map_err(failed)?;
            }
            Event::Empty(tag) => {
                each(Element::Start(&tag)).map_err(failed)?;
                each(Element::End(tag.name().as_ref())).map_err(failed)?;
            }
            Event::End(tag) => {
                open = open.saturating_sub(1);
                each(Element::End(tag.name().as_ref())).map_err(failed)?;
            }
            Event::Eof if open > 0 => return Err(failed(ModelFault::CutOff)),
            Event::Eof => return Ok(()),
            _ => {}
        }
    }
}

/// A model as far as it was read.
struct ModelReader {
    units: Units,
    objects: BTreeMap<u32, Object>,
    items: Vec<Reference>,
    first_facet: usize,
    /// What stands before the names of 3MF's own elements; those of extensions have
    /// other prefixes.
    prefix: Option<String>,
    /// The number of the object at hand, and whether it is a solid.
    object: Option<(u32, bool)>,
    vertices: Vec<[f32; 3]>,
    facets: Vec<Facet>,
    components: Vec<Reference>,
}

impl ModelReader {
    fn new(first_facet: usize) -> Self {
        Self {
            units: Units::Millimetres,
            objects: BTreeMap::new(),
            items: Vec::new(),
            first_facet,
            prefix: None,
            object: None,
            vertices: Vec::new(),
            facets: Vec::new(),
            components: Vec::new(),
        }
    }

    /// Returns an element's name, if it is one of 3MF's own.
    fn own_name<'a>(&self, name: &'a str) -> Option<&'a str> {
        let (prefix, local) = split_name(name);
        (Some(prefix) == self.prefix.as_deref()).then_some(local)
    }

    fn start(&mut self, tag: &BytesStart<'_>) -> Result<(), ModelFault> {
        let name = tag.name();
        if self.prefix.is_none() {
            let (prefix, local) = split_name(name.as_ref());
            if local == "model" {
                self.prefix = Some(prefix.to_owned());
                return self.begin_model(tag);
            }
        }
        match self.own_name(name.as_ref()) {
            Some("object") => {
                let kind = attribute(tag, "type")?;
                let is_solid = matches!(kind.as_deref(), None | Some("model" | "solidsupport"));
                self.object = Some((number(tag, "id")?, is_solid));
            }
            Some("vertex") => {
                self.vertices.push([number(tag, "x")?, number(tag, "y")?, number(tag, "z")?]);
            }
            Some("triangle") => {
                let corners = [number(tag, "v1")?, number(tag, "v2")?, number(tag, "v3")?];
                let mut facet = Facet::default();
                for (corner, vertex) in facet.iter_mut().zip(corners) {
                    let count = self.vertices.len();
                    let found = self.vertices.get(vertex as usize);
                    *corner = *found.ok_or(ModelFault::NoVertex { vertex, count })?;
                }
                self.facets.push(facet);
            }
            Some("component") => self.components.push(self.reference(tag)?),
            Some("item") => self.items.push(self.reference(tag)?),
            _ => {}
        }
        Ok(())
    }

    fn begin_model(&mut self, tag: &BytesStart<'_>) -> Result<(), ModelFault> {
        self.units = match attribute(tag, "unit")?.as_deref() {
            None | Some("millimeter") => Units::Millimetres,
            Some("micron") => Units::Micrometres,
            Some("centimeter") => Units::Centimetres,
            Some("inch") => Units::Inches,
            Some("foot") => Units::Feet,
            Some("meter") => Units::Metres,
            Some(_) => return Err(missing(tag, "unit")),
        };
        for prefix in attribute(tag, "requiredextensions")?.unwrap_or_default().split_whitespace() {
            let name = attribute(tag, &format!("xmlns:{prefix}"))?;
            if !name.as_deref().is_some_and(|name| KNOWN_EXTENSIONS.contains(&name)) {
                let name: String = name.unwrap_or_else(|| prefix.to_owned());
                return Err(ModelFault::Extension(name.chars().take(100).collect()));
            }
        }
        Ok(())
    }

    fn end(&mut self, name: &str) {
        if self.own_name(name) != Some("object") {
            return;
        }
        let components = std::mem::take(&mut self.components);
        let facets = std::mem::take(&mut self.facets);
        self.vertices.clear();
        let Some((id, is_solid)) = self.object.take() else { return };
        let first = self.first_facet;
        self.first_facet += facets.len();
        let shape = match components.is_empty() {
            true => Shape::Mesh { facets: Arc::new(facets), first },
            false => Shape::Components(Arc::new(components)),
        };
        self.objects.insert(id, Object { is_solid, shape });
    }

    /// Reads an item or a component.
    fn reference(&self, tag: &BytesStart<'_>) -> Result<Reference, ModelFault> {
        let placement = match attribute(tag, "transform")? {
            Some(text) => transform(&text, self.units).ok_or_else(|| missing(tag, "transform"))?,
            None => Placement::default(),
        };
        Ok(Reference {
            model: prefixed_attribute(tag, "path")?.map(|path| in_package(&path)),
            object: number(tag, "objectid")?,
            placement,
            is_built: attribute(tag, "printable")?.as_deref() != Some("0"),
        })
    }
}

/// Reads twelve numbers: where x, y and z go, and a shift.
fn transform(text: &str, units: Units) -> Option<Placement> {
    let numbers = text.split_whitespace().map(|number| number.parse().ok());
    let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
    let m: [f64; 12] = numbers.try_into().ok()?;
    let is_finite = m.iter().all(|number| number.is_finite());
    let row = |k: usize| [m[k], m[3 + k], m[6 + k], m[9 + k] * units.mm()];
    is_finite.then(|| Placement::of_rows([row(0), row(1), row(2)]))
}

/// Splits a name into its prefix, which may be empty, and the rest.
fn split_name(name: &str) -> (&str, &str) {
    name.split_once(':').unwrap_or(("", name))
}

fn attribute(tag: &BytesStart<'_>, name: &str) -> Result<Option<String>, ModelFault> {
    find_attribute(tag, |key| key == name)
}

/// Returns an attribute of an extension, whatever its prefix.
fn prefixed_attribute(tag: &BytesStart<'_>, name: &str) -> Result<Option<String>, ModelFault> {
    find_attribute(tag, |key| key.split_once(':').is_some_and(|(_, local)| local == name))
}

fn find_attribute(
    tag: &BytesStart<'_>,
    is_it: impl Fn(&str) -> bool,
) -> Result<Option<String>, ModelFault> {
    for attribute in tag.attributes().with_checks(false) {
        let attribute = attribute.map_err(|error| ModelFault::Xml(error.into()))?;
        if is_it(attribute.key.as_ref()) {
            return Ok(Some(attribute.value.into_owned()));
        }
    }
    Ok(None)
}

fn number<T: std::str::FromStr>(tag: &BytesStart<'_>, name: &'static str) -> Result<T, ModelFault> {
    let value = tag.try_get_attribute(name).map_err(|error| ModelFault::Xml(error.into()))?;
    let value = value.and_then(|value| value.value.trim().parse().ok());
    value.ok_or_else(|| missing(tag, name))
}

fn missing(tag: &BytesStart<'_>, attribute: &'static str) -> ModelFault {
    let element = tag.name().as_ref().chars().take(40).collect();
    ModelFault::Attribute { element, attribute }
}
