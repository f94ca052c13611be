//! Reads 3MF: packed XML with meshes, and the items that are built of them.
//!
//! An item stands where its transform puts it. Its object is a mesh, or is put together
//! of other objects, each with a transform of its own. Every mesh that is reached becomes
//! a piece; pieces of one mesh share its facets.

mod model;

use std::collections::BTreeMap;
use std::io::{self, BufRead, BufReader, Read};

use thiserror::Error;
use zip::ZipArchive;
use zip::result::ZipError;

use crate::part::{Facets, Piece};
use crate::part_file::{FileReader, PartFile};
use crate::placement::Placement;
use crate::read_note::ReadNote;
use crate::unpack::most_unpacked;
use model::{Model, Object, Reference, Shape};

/// Objects within objects, so that a few lines of text may stand for more meshes than
/// there are atoms.
const MAX_DEPTH: usize = 32;
/// Objects that are visited in all.
const MAX_VISITS: usize = 1 << 14;
/// The longest tag, comment or text in XML.
const MAX_XML_BYTES: usize = 4 << 20;

/// The relationship that names the model of a package.
const MODEL_RELATIONSHIP: &str = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel";
/// Where nearly all programs put the model.
const USUAL_MODEL: &str = "3D/3dmodel.model";

/// Why a 3MF file cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ThreeMfError {
    /// The package is damaged, or packed in another way than 3MF allows.
    #[error("its ZIP package cannot be read")]
    Package(#[from] ZipError),
    /// A ZIP package of another kind.
    #[error("it is a ZIP package without a 3D model: it has no {0}")]
    NoModel(String),
    /// A model that is no XML, or breaks off.
    #[error("byte {at} of its {model}: {fault}")]
    Model {
        /// The name of the model in the package.
        model: String,
        /// The byte near which the fault is.
        at: u64,
        /// The fault there.
        fault: ModelFault,
    },
    /// An item or a component of an object that is not there.
    #[error("it builds object {id} of its {model}, which is not there")]
    NoObject {
        /// The name of the model in the package.
        model: String,
        /// The object's number.
        id: u32,
    },
    /// An object that holds itself, or very many objects.
    #[error("its objects hold themselves, or more than {MAX_VISITS} objects in all")]
    Endless,
    /// No item that is built.
    #[error("of its {items} items none is both a solid and to be printed")]
    NothingToBuild {
        /// The number of items.
        items: usize,
    },
    /// Items that stand for far more facets than a package of its size explains.
    #[error("its items stand for more than {0} facets, far more than a package of its size does")]
    Copies(u64),
    /// A package that holds far more than any mesh its size.
    #[error("its model unpacks to more than {0} bytes, which is far more than a packed mesh does")]
    Inflated(u64),
}

/// A fault of a model.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ModelFault {
    /// The text is no XML.
    #[error("{}", start_of(.0))]
    Xml(#[source] quick_xml::Error),
    /// An attribute that is missing or cannot be read.
    #[error("<{element}> has no {attribute} that can be read")]
    Attribute {
        /// The element's name.
        element: String,
        /// The attribute's name.
        attribute: &'static str,
    },
    /// A triangle at a vertex that does not stand before it.
    #[error("a triangle names vertex {vertex} of {count}")]
    NoVertex {
        /// The vertex, from 0.
        vertex: u32,
        /// How many there are.
        count: usize,
    },
    /// An extension that must be understood, and is not.
    #[error("it needs the extension {0}, which is not read")]
    Extension(String),
    /// The text ends before the model does.
    #[error("the model breaks off")]
    CutOff,
}

/// Returns the start of an error's text, which may quote a long name.
fn start_of(error: &quick_xml::Error) -> String {
    const MAX_CHARACTERS: usize = 150;
    let plain = |c: char| if c.is_control() { '?' } else { c };
    error.to_string().chars().take(MAX_CHARACTERS).map(plain).collect()
}

/// What a file holds.
pub(crate) struct Contents {
    pub(crate) pieces: Vec<Piece>,
    pub(crate) notes: Vec<ReadNote>,
}

/// Returns true if a file that starts with these bytes is a ZIP package.
pub(crate) fn looks_packaged(start: &[u8]) -> bool {
    start.starts_with(b"PK\x03\x04")
}

/// Reads a file's items.
pub(crate) fn read(file: &PartFile) -> Result<Contents, ThreeMfError> {
    let mut package = Package::open(file)?;
    let path = package.model_path()?;
    let mut models = Models { package, models: BTreeMap::new(), facets: 0 };
    let items = models.get(&path)?.items.clone();
    let mut found = Found { pieces: Vec::new(), visits: 0, facets: 0 };
    let mut left_out = 0;
    for item in items.iter().filter(|item| item.is_built) {
        let path = item.model.as_ref().unwrap_or(&path).clone();
        if models.object(&path, item.object)?.is_solid {
            models.expand(&path, item, Placement::default(), 0, &mut found)?;
        } else {
            left_out += 1;
        }
    }
    if found.pieces.is_empty() && !items.is_empty() {
        return Err(ThreeMfError::NothingToBuild { items: items.len() });
    }
    let notes = (left_out > 0).then_some(ReadNote::NoSolids { items: left_out });
    Ok(Contents { pieces: found.pieces, notes: notes.into_iter().collect() })
}

struct Found {
    pieces: Vec<Piece>,
    visits: usize,
    /// The facets of all pieces.
    facets: u64,
}

/// The models of a package, each read when it is first asked for.
struct Models<'a> {
    package: Package<'a>,
    models: BTreeMap<String, Model>,
    /// How many facets they have so far.
    facets: usize,
}

impl Models<'_> {
    fn get(&mut self, path: &str) -> Result<&Model, ThreeMfError> {
        if !self.models.contains_key(path) {
            let failed = |at, fault| ThreeMfError::Model { model: path.to_owned(), at, fault };
            let (entry, most) = self.package.entry(path)?;
            let mut text = BoundedText::new(BufReader::new(entry.take(most + 1)));
            let model = Model::read(&mut text, self.facets);
            let read = text.read;
            drop(text);
            if read > most {
                return Err(ThreeMfError::Inflated(most));
            }
            self.package.unpacked += read;
            let model = model.map_err(|(at, fault)| failed(at, fault))?;
            self.facets = model.facets_end;
            self.models.insert(path.to_owned(), model);
        }
        Ok(&self.models[path])
    }

    fn object(&mut self, path: &str, id: u32) -> Result<&Object, ThreeMfError> {
        let object = self.get(path)?.objects.get(&id);
        object.ok_or_else(|| ThreeMfError::NoObject { model: path.to_owned(), id })
    }

    /// Adds the pieces of an object as it stands in others.
    fn expand(
        &mut self,
        path: &str,
        reference: &Reference,
        outer: Placement,
        depth: usize,
        found: &mut Found,
    ) -> Result<(), ThreeMfError> {
        found.visits += 1;
        if depth > MAX_DEPTH || found.visits > MAX_VISITS {
            return Err(ThreeMfError::Endless);
        }
        let placement = reference.placement.then(&outer);
        let (units, most) = (self.get(path)?.units, self.package.most);
        let components = match &self.object(path, reference.object)?.shape {
            Shape::Mesh { facets, first } => {
                found.facets += facets.len() as u64;
                if found.facets > most {
                    return Err(ThreeMfError::Copies(most));
                }
                let facets = Facets::Memory(facets.clone());
                let units = Some(units);
                let piece = Piece { first_facet: *first, units, placement, ..Piece::new(facets) };
                found.pieces.push(piece);
                return Ok(());
            }
            Shape::Components(components) => components.clone(),
        };
        for component in components.iter() {
            let path = component.model.as_deref().unwrap_or(path);
            self.expand(path, component, placement, depth + 1, found)?;
        }
        Ok(())
    }
}

/// A ZIP package.
struct Package<'a> {
    archive: ZipArchive<BufReader<FileReader<'a>>>,
    /// The most bytes that are unpacked in all, and those so far.
    most: u64,
    unpacked: u64,
}

impl<'a> Package<'a> {
    fn open(file: &'a PartFile) -> Result<Self, ThreeMfError> {
        let archive = ZipArchive::new(BufReader::new(file.reader()))?;
        Ok(Self { archive, most: most_unpacked(file.size()), unpacked: 0 })
    }

    /// Opens a file of the package, of which no more bytes are to be read than these.
    fn entry(&mut self, path: &str) -> Result<(impl Read, u64), ThreeMfError> {
        let most = self.most - self.unpacked;
        match self.archive.by_name(path) {
            Ok(entry) => Ok((entry, most)),
            Err(ZipError::FileNotFound) => Err(ThreeMfError::NoModel(path.to_owned())),
            Err(error) => Err(error.into()),
        }
    }

    /// Returns the name of the model that the package is about.
    fn model_path(&mut self) -> Result<String, ThreeMfError> {
        let path = "_rels/.rels";
        let Ok((entry, _)) = self.entry(path) else { return Ok(USUAL_MODEL.to_owned()) };
        let mut text = BoundedText::new(BufReader::new(entry.take(MAX_XML_BYTES as u64)));
        let failed = |(at, fault)| ThreeMfError::Model { model: path.to_owned(), at, fault };
        let target = model::relationship(&mut text, MODEL_RELATIONSHIP).map_err(failed)?;
        Ok(target.unwrap_or_else(|| USUAL_MODEL.to_owned()))
    }
}

/// Text of which no tag, comment or text between tags is read into memory beyond a
/// limit.
struct BoundedText<R> {
    text: R,
    /// The bytes that were read in all, and since the last event.
    read: u64,
    of_event: usize,
}

impl<R: BufRead> BoundedText<R> {
    fn new(text: R) -> Self {
        Self { text, read: 0, of_event: 0 }
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
        if self.of_event > MAX_XML_BYTES {
            return Err(io::Error::other("a tag or text is longer than four megabytes"));
        }
        self.text.fill_buf()
    }

    fn consume(&mut self, length: usize) {
        self.read += length as u64;
        self.of_event += length;
        self.text.consume(length);
    }
}
