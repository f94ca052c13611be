//! Why a 3MF file cannot be read.

use thiserror::Error;
use zip::result::ZipError;

/// Objects that are visited in all.
pub(super) const MAX_VISITS: usize = 1 << 14;

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
    /// An object whose shape is made in a way that is not read.
    #[error("object {id} of its {model} is made by {feature}, which is not read")]
    Unread {
        /// The name of the model in the package.
        model: String,
        /// The object's number.
        id: u32,
        /// The way in which it is made.
        feature: &'static str,
    },
    /// Slices that cannot be read.
    #[error("object {id} of its {model} has {fault}")]
    Slices {
        /// The name of the model in the package.
        model: String,
        /// The object's number.
        id: u32,
        /// The fault of its slices.
        fault: &'static str,
    },
    /// A model that cannot be read without its key.
    #[error("its {0} is encrypted, and encrypted models are not read")]
    Encrypted(String),
    /// An object that holds itself, or very many objects.
    #[error("its objects hold themselves, or more than {MAX_VISITS} objects in all")]
    Endless,
    /// No item that is built.
    #[error("it holds nothing to build: {}", why_nothing(*.items))]
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

/// Returns why none of so many items is built.
fn why_nothing(items: usize) -> String {
    let items = match items {
        0 => return "it has no items".to_owned(),
        1 => "its only item is".to_owned(),
        items => format!("each of its {items} items is"),
    };
    format!("{items} a support, a modifier, a negative volume or marked as not printed")
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
    /// A triangle at a vertex that does not stand before it, or a segment of a slice.
    #[error("a {of} names vertex {vertex} of {count}")]
    NoVertex {
        /// The element.
        of: &'static str,
        /// The vertex, from 0.
        vertex: u32,
        /// How many there are.
        count: usize,
    },
    /// Volumes of a project that a mesh does not have.
    #[error("the project's volumes of object {object} overlap, or are not in its mesh")]
    Volumes {
        /// The object's number.
        object: u32,
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
