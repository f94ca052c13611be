//! Errors of reading a list of edits and of making them.

use lamp_build::ImageBounds;
use lamp_stack::{OrientationError, Pitch, StackError};
use thiserror::Error;

use super::film_hole::FilmHoleProblem;
use super::loft::LoftProblem;
use super::serials::ListProblem;

/// Why a stack cannot be edited.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EditError {
    /// The list of edits is not TOML.
    #[error("line {line}: {problem}: edits are a TOML file with [[edit]] tables")]
    Syntax {
        /// From 1.
        line: usize,
        /// The TOML reader's message.
        problem: String,
    },
    /// A key of the list is wrong, unknown or missing.
    #[error("line {line}: {key}: {problem}")]
    Key {
        /// From 1.
        line: usize,
        /// The edit's number and the key's path, as `edit 2, box.x`.
        key: String,
        /// The TOML reader's message.
        problem: String,
    },
    /// The list has no edit.
    #[error("there is no edit: add an [[edit]] table, or edit = [] for none")]
    NoEdits,
    /// An edit contradicts itself, or does not suit the stack.
    #[error("edit {number}: {problem}")]
    Edit {
        /// The edit's number, from 1.
        number: usize,
        /// The problem.
        problem: EditProblem,
    },
    /// The pages do not say how large pixels are, so lengths mean nothing.
    #[error("the stack has no resolution, so lengths have no meaning in it")]
    NoResolution,
    /// A layer's size, place or resolution differs from the first layer's.
    #[error("{layer} differs in size, place or resolution from the first layer: a stack has one")]
    Unlike {
        /// The layer's name.
        layer: String,
    },
    /// A page cannot be decoded.
    #[error(transparent)]
    Page(#[from] StackError),
    /// A layer cannot be edited.
    #[error("{layer}: {problem}")]
    Layer {
        /// The layer's name.
        layer: String,
        /// The problem.
        problem: LayerProblem,
    },
}

/// Why an edit of a list cannot be made.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum EditProblem {
    /// It has none or several of the keys that say what to do.
    #[error(
        "write one of box, cylinder, line, polygon, strut, cone, sphere, loft, film_hole, label, \
         picture, stack, crop, pad, mirror and rotate"
    )]
    NotOneAction,
    /// An edit of whole images chooses layers or an operation.
    #[error("it holds for all layers: take op, z and layers out")]
    WholeStack,
    /// Layers are chosen both by height and by number.
    #[error("z and layers both choose layers: write one of them")]
    TwoRanges,
    /// Copies are chosen for something that is not drawn.
    #[error("copies are for shapes, labels and pictures: take it out")]
    CopiesWithoutShape,
    /// A pattern is of something that is not drawn.
    #[error("repeat is for shapes, labels and pictures: take it out")]
    RepeatWithoutShape,
    /// Patterns of patterns have too many shapes.
    #[error("it repeats more than 100000 times")]
    ManyRepeats,
    /// A pattern moves or tilts a shape that has no height of its own.
    #[error(
        "only struts, cones, spheres, lofts and lying cylinders step up and turn about other axes \
         than z: z or layers are for all repeats"
    )]
    RepeatUp,
    /// A pattern turns a picture by other angles than quarters.
    #[error(
        "pictures can be turned only by 90, 180 or 270 degrees, even where a pattern repeats them"
    )]
    RepeatPicture,
    /// The list of copies is empty.
    #[error("copies names no copy: write copy numbers, such as [1, 5], or true for all")]
    NoCopyChosen,
    /// All but the shapes in the copies would go.
    #[error("intersect would take away all of the build but the shapes in these copies")]
    IntersectInCopies,
    /// A lying cylinder has no ends, or an upright one has.
    #[error("a cylinder along x or y needs between = [from, to], and only one along these")]
    CylinderEnds,
    /// The angle is no multiple of 90 degrees.
    #[error("images rotate by 90, 180 or 270 degrees")]
    Angle,
    /// The line, strut or cone has no length.
    #[error("it ends where it begins")]
    NoLength,
    /// A round strut has keys of a streamlined one, or that lacks one of them.
    #[error(
        "thickness_ratio and flow belong to section = \"ellipse\" or \"aerofoil\", which need both"
    )]
    StrutSection,
    /// A streamlined strut points along its flow, or the flow has no direction.
    #[error("flow needs a direction across the strut")]
    StrutFlow,
    /// A loft is no solid.
    #[error(transparent)]
    Loft(#[from] LoftProblem),
    /// A film-cooling hole is no hole.
    #[error(transparent)]
    FilmHole(#[from] FilmHoleProblem),
    /// The shape has more runs than an image can hold.
    #[error("it has more runs than an image can hold")]
    TooManyRuns,
    /// The shape covers no pixel's center.
    #[error("no pixel is in it: the image is {0}")]
    NoPixel(ImageBounds),
    /// The box to keep lies outside the image.
    #[error("nothing is left: the image is {0}")]
    NothingLeft(ImageBounds),
    /// The padded image would be larger than the largest image.
    #[error("the image would be more than 2^26 pixels wide or high")]
    LargeImage,
    /// A letter that the font lacks.
    #[error("labels have no `{0}`, only the letters of ASCII")]
    Letter(char),
    /// A label's text has a single brace.
    #[error("`{0}` has a brace without its other")]
    Brace(String),
    /// Braces in a label's text hold something else than a number's place.
    #[error(
        "`{{{0}}}` is not a place for a number: write {{n}}, {{n:04}} for four digits, or {{list}} \
         for a serial number of a list"
    )]
    NumberField(String),
    /// A label shows serial numbers, but has none.
    #[error("its text has {{list}}: write list = \"FILE.csv\", which has the serial numbers")]
    NoList,
    /// A label has serial numbers, but does not show them.
    #[error(
        "a list of serial numbers is given, but the text has no {{list}} to show where they go"
    )]
    UnusedList,
    /// A label names the column of no list.
    #[error("column is the name of a list's column: write list = \"FILE.csv\", too")]
    ColumnWithoutList,
    /// A list of serial numbers does not suit.
    #[error("{list}: {problem}")]
    List {
        /// The list's file.
        list: String,
        /// The problem.
        problem: ListProblem,
    },
    /// A label is not all on the image.
    #[error("`{text}` reaches outside the image, which is {image}: move it, or pad first")]
    LabelOutside {
        /// The label's text.
        text: String,
        /// The image, or the image of the part whose copy has the label.
        image: ImageBounds,
    },
    /// A picture is not all on the image.
    #[error("{picture} reaches outside the image, which is {image}: move it, or pad first")]
    PictureOutside {
        /// The name of the picture's file.
        picture: String,
        /// The image, or the image of the part whose copies have the picture.
        image: ImageBounds,
    },
    /// A file of a picture has more than one.
    #[error("{picture} has several pages, but a picture must have one")]
    SeveralPages {
        /// The picture's file.
        picture: String,
    },
    /// The other stack is empty.
    #[error("{stack} has no layers")]
    NoLayers {
        /// The other stack.
        stack: String,
    },
    /// The two stacks have different resolutions.
    #[error(
        "{stack} has {}, and the stack that is edited {}",
        resolution(*found), resolution(*edited)
    )]
    OtherResolution {
        /// The other stack.
        stack: String,
        /// Its resolution.
        found: Option<Pitch>,
        /// The edited stack's resolution.
        edited: Option<Pitch>,
    },
    /// Only one of the two stacks says where its images lie.
    #[error("{stack} and the stack that is edited do not both say where they lie")]
    OtherOrigin {
        /// The other stack.
        stack: String,
    },
    /// The other stack is to be moved, but has no resolution.
    #[error("{stack} has no resolution, so lengths have no meaning in it")]
    OtherLengths {
        /// The other stack.
        stack: String,
    },
    /// The other stack is added, but has layers at heights that the edited one lacks.
    #[error(
        "{layer} of {stack} lies {} the stack and would be lost: write z or layers, or edit the larger stack",
        if *is_above { "above" } else { "below" }
    )]
    LayersLost {
        /// The other stack.
        stack: String,
        /// The name of a layer that would be lost.
        layer: String,
        /// Whether it lies above the edited stack's last layer, not below the first.
        is_above: bool,
    },
}

/// Why a layer cannot be edited.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LayerProblem {
    /// A solid meets a layer of unknown height.
    #[error(
        "it does not state its height, so no strut, cone, sphere, loft or lying cylinder can cross it"
    )]
    NoHeightForSolid,
    /// Layers are chosen by height, but this one does not say its own.
    #[error("it does not state its height: write layers = [first, end] instead of z")]
    NoHeightForRange,
    /// The result has more runs than an image can hold.
    #[error("edit {edit} makes more runs than an image can hold")]
    TooManyRuns {
        /// The edit's number, from 1.
        edit: usize,
    },
    /// The other stack is white outside the image.
    #[error("the addition reaches beyond its image: pad it first")]
    BesideImage,
    /// Rotating would make columns of stray rows.
    #[error("its stray rows would become columns, which no stage mends")]
    StrayColumns,
    /// The first page is not a build's.
    #[error("its page does not state where copies are")]
    NoCopies,
    /// The first page describes copies in an unknown way.
    #[error("its page does not state where copies are, as builds do ({0})")]
    CopiesFormat(serde_json::Error),
    /// The first page turns a copy in an unknown way.
    #[error("its page does not state how a copy is turned: {0}")]
    CopyTurn(OrientationError),
    /// The first page does not state where the part was before it was copied.
    #[error("its page does not state where the part was")]
    NoPartOrigin,
    /// The first page has copies beyond any image.
    #[error("its page states that copies are where no image reaches")]
    FarCopies,
    /// The build has several parts and none of them is named.
    #[error("name one of the build's parts, such as copies = \"NAME\": {}", parts.join(", "))]
    WhichPart {
        /// The parts there are.
        parts: Vec<String>,
    },
    /// The build has no copy of that number.
    #[error(
        "there is no copy {number}: the build's copies of {part} have the numbers 1 to {count}"
    )]
    NoSuchCopy {
        /// The number that is wanted.
        number: u32,
        /// The part's name.
        part: String,
        /// How many copies there are.
        count: usize,
    },
    /// A layer of another stack says its height, which the edited stack's do not.
    #[error("states its height, and the edited stack does not")]
    HeightUnlikeEdited,
    /// A layer of another stack does not say its height, which the edited stack's do.
    #[error("does not state its height, and the stack that is edited does")]
    NoHeightUnlikeEdited,
    /// A layer of another stack has no height that could be changed.
    #[error("does not state its height, so it cannot be moved up")]
    NoHeightToMove,
}

impl EditProblem {
    /// Adds the number of the edit, from 1.
    pub(super) fn of_edit(self, number: usize) -> EditError {
        EditError::Edit { number, problem: self }
    }
}

impl LayerProblem {
    /// Adds the layer's name.
    pub(super) fn of_layer(self, layer: &lamp_stack::PageInfo) -> EditError {
        EditError::Layer { layer: layer.name(), problem: self }
    }
}

fn resolution(pitch: Option<Pitch>) -> String {
    pitch.map_or("no resolution".to_owned(), |pitch| format!("{pitch:#}"))
}
