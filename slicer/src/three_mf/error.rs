//! Defines the errors of reading a 3MF file.

use thiserror::Error;
use zip::result::ZipError;

/// The greatest total number of visited objects.
pub(super) const MAX_VISITS: usize = 1 << 14;

/// The reason why a 3MF file cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ThreeMfError {
    /// The package is damaged, or packed in a way that 3MF does not allow.
    #[error("its ZIP package cannot be read")]
    Package(#[from] ZipError),
    /// The file is a ZIP package of another kind.
    #[error("it is a ZIP package without a 3D model: it has no {0}")]
    NoModel(String),
    /// A model is not XML, or breaks off.
    #[error("byte {at} of its {model}: {fault}")]
    Model {
        /// The name of the model in the package.
        model: String,
        /// The approximate byte of the fault.
        at: u64,
        /// The fault there.
        fault: ModelFault,
    },
    /// An item or a component refers to a missing object.
    #[error("it builds object {id} of its {model}, but the object is missing")]
    NoObject {
        /// The name of the model in the package.
        model: String,
        /// The object's number.
        id: u32,
    },
    /// The shape of an object is defined in an unsupported way.
    #[error("object {id} of its {model} uses {feature}, which is not read")]
    Unread {
        /// The name of the model in the package.
        model: String,
        /// The object's number.
        id: u32,
        /// The unsupported feature.
        feature: &'static str,
    },
    /// Slices cannot be read.
    #[error("object {id} of its {model} has {fault}")]
    Slices {
        /// The name of the model in the package.
        model: String,
        /// The object's number.
        id: u32,
        /// The fault of its slices.
        fault: &'static str,
    },
    /// A model cannot be read without its key.
    #[error("its {0} is encrypted, and encrypted models are not read")]
    Encrypted(String),
    /// An object contains itself, or there are very many objects.
    #[error("its objects hold themselves, or more than {MAX_VISITS} objects in all")]
    Endless,
    /// No item is built.
    #[error("it holds nothing to build: {}", why_nothing(*.items))]
    NothingToBuild {
        /// The number of items.
        items: usize,
    },
    /// Items represent far more facets than the package's size explains.
    #[error("its items make more than {0} facets, far too many for a package of its size")]
    Copies(u64),
    /// A package contains far more than any mesh of its size.
    #[error("its model unpacks to more than {0} bytes, far more than a packed mesh does")]
    Inflated(u64),
}

/// Returns the reason why none of `items` items is built.
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
    /// The text is not XML.
    #[error("{}", start_of(.0))]
    Xml(#[source] quick_xml::Error),
    /// An attribute is missing or cannot be read.
    #[error("<{element}> has no readable {attribute}")]
    Attribute {
        /// The element's name.
        element: String,
        /// The attribute's name.
        attribute: &'static str,
    },
    /// A triangle or a segment of a slice refers to a vertex that is not defined before it.
    #[error("a {of} names vertex {vertex} of {count}")]
    NoVertex {
        /// The element.
        of: &'static str,
        /// The vertex, from 0.
        vertex: u32,
        /// The number of vertices.
        count: usize,
    },
    /// Volumes of a project refer to triangles that a mesh does not have.
    #[error("the project's volumes of object {object} overlap, or are not in its mesh")]
    Volumes {
        /// The object's number.
        object: u32,
    },
    /// The digits for a painted triangle contradict themselves.
    #[error("the paint on a triangle for supports cannot be read: its digits are not a tree")]
    Paint,
    /// A required extension is not supported.
    #[error("it needs the extension {0}, which is not read")]
    Extension(String),
    /// The text ends before the model does.
    #[error("the model is cut off")]
    CutOff,
}

/// Returns the start of an error's text, which may quote a long name.
fn start_of(error: &quick_xml::Error) -> String {
    const MAX_CHARACTERS: usize = 150;
    let plain = |c: char| if c.is_control() { '?' } else { c };
    error.to_string().chars().take(MAX_CHARACTERS).map(plain).collect()
}
