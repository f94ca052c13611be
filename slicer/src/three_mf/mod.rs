//! Reads 3MF: packed XML with meshes, and the items that are built of them.
//!
//! An item stands where its transform puts it. Its object is a mesh, or is put together
//! of other objects, each with a transform of its own. Every mesh that is reached becomes
//! a piece; pieces of one mesh share its facets. Projects of slicers have meshes that are cut out
//! of others, and some that are no solids.

mod model;
mod package;
mod project;
mod slices;
#[cfg(test)]
mod tests;
mod xml;

use std::collections::{BTreeMap, BTreeSet};

use thiserror::Error;
use zip::result::ZipError;

use crate::bodies::Role;
use crate::part::{Facets, Piece};
use crate::part_file::PartFile;
use crate::placement::Placement;
use crate::read_note::ReadNote;
use model::{Model, Object, Reference, Shape};
use package::{Package, without_root};
use project::{PROJECT_FILES, Project, UNREAD_FILES, VolumeKind};
use slices::Prisms;

pub(crate) use package::looks_packaged;

/// Objects within objects, so that a few lines of text may stand for more meshes than
/// there are atoms.
const MAX_DEPTH: usize = 32;
/// Objects that are visited in all.
const MAX_VISITS: usize = 1 << 14;
/// A mesh whose volume differs by a larger share from its slices' is a stand-in, often their
/// bounding box. Slices are coarse: each has the height of a layer.
const SAME_VOLUME: f64 = 0.05;

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

/// What a file holds.
pub(crate) struct Contents {
    pub(crate) pieces: Vec<Piece>,
    pub(crate) notes: Vec<ReadNote>,
}

/// Reads a file's items.
pub(crate) fn read(file: &PartFile) -> Result<Contents, ThreeMfError> {
    let mut package = Package::open(file)?;
    let (root, encrypted) = package.model_path()?;
    let mut project = Project::default();
    for name in package.ending(&PROJECT_FILES) {
        let outcome = package.read(&name, |text| project.read(text))?;
        outcome.map_err(|(at, fault)| ThreeMfError::Model { model: name, at, fault })?;
    }
    let mut models = Models {
        package,
        root: root.clone(),
        encrypted,
        project,
        models: BTreeMap::new(),
        sliced: BTreeMap::new(),
        facets: 0,
    };
    let items = models.get(&root)?.items.clone();
    let mut found = Found::default();
    for item in items.iter() {
        if item.is_built {
            models.expand(&root, item, &Place::default(), &mut found)?;
        } else {
            found.left_out.not_printable += 1;
        }
    }
    found.drop_lone_negatives();
    if found.pieces.is_empty() && !items.is_empty() {
        return Err(ThreeMfError::NothingToBuild { items: items.len() });
    }
    let mut notes = found.left_out.notes();
    let unread = UNREAD_FILES.iter().filter(|(name, _)| models.package.find(name, "").is_some());
    notes.extend(unread.map(|(_, what)| ReadNote::ProjectData { what }));
    if models.project.plates > 1 {
        notes.push(ReadNote::Plates { plates: models.project.plates });
    }
    Ok(Contents { pieces: found.pieces, notes })
}

/// The pieces of the items that were read so far.
#[derive(Default)]
struct Found {
    pieces: Vec<Piece>,
    visits: usize,
    /// The facets of all pieces.
    facets: u64,
    /// The placed objects whose solids and negative volumes belong together.
    objects: usize,
    left_out: LeftOut,
}

impl Found {
    /// Leaves out negative volumes whose objects have no solids.
    fn drop_lone_negatives(&mut self) {
        let solid = self.pieces.iter().filter(|piece| piece.role == Role::Solid);
        let solid: BTreeSet<usize> = solid.map(|piece| piece.object).collect();
        let before = self.pieces.len();
        self.pieces.retain(|piece| solid.contains(&piece.object));
        self.left_out.lone_negatives = before - self.pieces.len();
    }
}

/// Counts of the content that is not built.
#[derive(Default)]
struct LeftOut {
    no_solids: usize,
    not_printable: usize,
    lone_negatives: usize,
    /// The volumes by their kind.
    volumes: BTreeMap<String, usize>,
    /// Objects whose slices are left out, and objects whose mesh is.
    slices: BTreeSet<(String, u32)>,
    stand_ins: BTreeSet<(String, u32)>,
    extensions: BTreeSet<String>,
}

impl LeftOut {
    fn notes(self) -> Vec<ReadNote> {
        let counted = [
            (self.no_solids, ReadNote::NoSolids { items: self.no_solids }),
            (self.not_printable, ReadNote::NotPrintable { items: self.not_printable }),
            (self.lone_negatives, ReadNote::LoneNegatives { volumes: self.lone_negatives }),
            (self.slices.len(), ReadNote::Slices { objects: self.slices.len() }),
            (self.stand_ins.len(), ReadNote::StandIns { objects: self.stand_ins.len() }),
        ];
        let counted = counted.into_iter().filter(|(count, _)| *count > 0).map(|(_, note)| note);
        let volumes = self.volumes.into_iter();
        let volumes = volumes.map(|(kind, volumes)| ReadNote::Volumes { kind, volumes });
        let extensions = self.extensions.into_iter().map(|name| ReadNote::Extension { name });
        counted.chain(volumes).chain(extensions).collect()
    }
}

/// Where an object stands and what it is there.
#[derive(Default)]
struct Place {
    placement: Placement,
    depth: usize,
    /// The number of the placed object that it is a part of, and whether its project lists it.
    object: usize,
    is_in_project: bool,
    kind: VolumeKind,
}

/// The models of a package, each read when it is first asked for.
struct Models<'a> {
    package: Package<'a>,
    /// The name of the one that the package is about.
    root: String,
    encrypted: Vec<String>,
    project: Project,
    models: BTreeMap<String, Model>,
    /// The solids of objects that have slices; none where the mesh is read.
    sliced: BTreeMap<(String, u32), Option<Piece>>,
    /// How many facets they have so far.
    facets: usize,
}

impl Models<'_> {
    fn get(&mut self, path: &str) -> Result<&Model, ThreeMfError> {
        if !self.models.contains_key(path) {
            if self.encrypted.iter().any(|encrypted| encrypted == path) {
                return Err(ThreeMfError::Encrypted(path.to_owned()));
            }
            let none = Project::default();
            let project = if path == self.root { &self.project } else { &none };
            let facets = self.facets;
            let model = self.package.read(path, |text| Model::read(text, facets, project))?;
            let failed = |(at, fault)| ThreeMfError::Model { model: path.to_owned(), at, fault };
            let model = model.map_err(failed)?;
            self.facets = model.facets_end;
            self.models.insert(path.to_owned(), model);
        }
        Ok(&self.models[path])
    }

    /// Returns the name of a model that another one names.
    fn path_of(&self, target: &str, from: &str) -> Result<String, ThreeMfError> {
        let found = self.package.find(target, from);
        found.map(str::to_owned).ok_or_else(|| ThreeMfError::NoModel(without_root(target)))
    }

    fn object(&mut self, path: &str, id: u32) -> Result<&Object, ThreeMfError> {
        let object = self.get(path)?.objects.get(&id);
        object.ok_or_else(|| ThreeMfError::NoObject { model: path.to_owned(), id })
    }

    /// Adds the pieces of an object as it stands in others.
    fn expand(
        &mut self,
        from: &str,
        reference: &Reference,
        outer: &Place,
        found: &mut Found,
    ) -> Result<(), ThreeMfError> {
        found.visits += 1;
        if outer.depth > MAX_DEPTH || found.visits > MAX_VISITS {
            return Err(ThreeMfError::Endless);
        }
        let path = match &reference.model {
            Some(target) => self.path_of(target, from)?,
            None => from.to_owned(),
        };
        let id = reference.object;
        let is_listed = path == self.root && self.project.volumes(id).is_some();
        let object = self.object(&path, id)?;
        let kind = outer.kind.of_part(&object.kind);
        if !object.is_solid {
            found.left_out.no_solids += 1;
            return Ok(());
        }
        if let VolumeKind::LeftOut(name) = kind {
            *found.left_out.volumes.entry(name).or_default() += 1;
            return Ok(());
        }
        if let Some(feature) = object.unread {
            return Err(ThreeMfError::Unread { model: path, id, feature });
        }
        found.left_out.extensions.extend(object.unknown.iter().cloned());
        let mut place = Place {
            placement: reference.placement.then(&outer.placement),
            depth: outer.depth + 1,
            object: outer.object,
            is_in_project: outer.is_in_project || is_listed,
            kind,
        };
        if outer.depth == 0 || (is_listed && !outer.is_in_project) {
            place.object = found.objects;
            found.objects += 1;
        }
        if let Some(piece) = self.sliced(&path, id, &mut found.left_out)? {
            return self.add(&piece, &VolumeKind::Solid, &place, found);
        }
        let components = match &self.object(&path, id)?.shape {
            Shape::Mesh(volumes) => {
                let volumes = volumes.clone();
                return volumes
                    .iter()
                    .try_for_each(|(kind, piece)| self.add(piece, kind, &place, found));
            }
            Shape::Components(components) => components.clone(),
        };
        let kind = place.kind.clone();
        for (number, component) in components.iter().enumerate() {
            let is_same = |other: &&Reference| other.object == component.object;
            let before = components[..number].iter().filter(is_same).count();
            if is_listed {
                let of_part = self.project.kind_of_component(id, component.object, before);
                place.kind = kind.of_part(&of_part);
            }
            self.expand(&path, component, &place, found)?;
        }
        Ok(())
    }

    /// Adds a piece of a kind that stands at a place.
    fn add(
        &self,
        piece: &Piece,
        kind: &VolumeKind,
        place: &Place,
        found: &mut Found,
    ) -> Result<(), ThreeMfError> {
        let role = match place.kind.of_part(kind) {
            VolumeKind::Solid => Role::Solid,
            VolumeKind::Negative => Role::Negative,
            VolumeKind::LeftOut(name) => {
                *found.left_out.volumes.entry(name).or_default() += 1;
                return Ok(());
            }
        };
        found.facets += piece.facets.count() as u64;
        if found.facets > self.package.most {
            return Err(ThreeMfError::Copies(self.package.most));
        }
        let Place { placement, object, .. } = *place;
        found.pieces.push(Piece { placement, object, role, ..piece.clone() });
        Ok(())
    }

    /// Returns the slices of an object, if they stand for it and its mesh does not.
    fn sliced(
        &mut self,
        path: &str,
        id: u32,
        left_out: &mut LeftOut,
    ) -> Result<Option<Piece>, ThreeMfError> {
        let key = (path.to_owned(), id);
        if let Some(piece) = self.sliced.get(&key) {
            return Ok(piece.clone());
        }
        let object = self.object(path, id)?;
        let (stack, is_stand_in) = (object.slices, object.is_stand_in);
        let failed = |fault| ThreeMfError::Slices { model: path.to_owned(), id, fault };
        let piece = match stack {
            None if is_stand_in => return Err(failed("a coarse mesh and no slices instead of it")),
            None => None,
            Some(stack) => {
                let prisms = self.prisms(path, stack)?.map_err(failed)?;
                let is_mesh = !is_stand_in && self.has_volume(path, id, prisms.volume)?;
                let of_kind = if is_mesh { &mut left_out.slices } else { &mut left_out.stand_ins };
                of_kind.insert(key.clone());
                (!is_mesh).then(|| Piece {
                    first_facet: self.facets,
                    units: Some(self.models[path].units),
                    ..prisms.mesh.into_piece()
                })
            }
        };
        self.facets += piece.as_ref().map_or(0, |piece| piece.facets.count());
        self.sliced.insert(key, piece.clone());
        Ok(piece)
    }

    /// Returns the slices of a stack and of the stacks that it names, or the fault of these.
    fn prisms(
        &mut self,
        path: &str,
        stack: u32,
    ) -> Result<Result<Prisms, &'static str>, ThreeMfError> {
        const LOST: &str = "slices that are not there";
        let most = self.package.most;
        let mut prisms = Prisms::default();
        let Some(stack) = self.get(path)?.slice_stacks.get(&stack) else { return Ok(Err(LOST)) };
        if let Err(fault) = prisms.add(stack, most) {
            return Ok(Err(fault));
        }
        for (target, number) in stack.references.clone() {
            let path = self.path_of(&target, path)?;
            let Some(stack) = self.get(&path)?.slice_stacks.get(&number) else {
                return Ok(Err(LOST));
            };
            if let Err(fault) = prisms.add(stack, most) {
                return Ok(Err(fault));
            }
        }
        Ok(if prisms.volume > 0.0 { Ok(prisms) } else { Err("slices without area") })
    }

    /// Returns true if an object has about this volume, in units of its file, or is made of others,
    /// whose volume is not known.
    fn has_volume(&mut self, path: &str, id: u32, volume: f64) -> Result<bool, ThreeMfError> {
        let Shape::Mesh(volumes) = &self.object(path, id)?.shape else { return Ok(true) };
        let facets = volumes.iter().flat_map(|(_, piece)| match &piece.facets {
            Facets::Memory(facets) => facets.as_slice(),
            _ => &[],
        });
        let six_times: f64 = facets
            .map(|facet| {
                let [a, b, c] = facet.map(|corner| corner.map(f64::from));
                (0..3)
                    .map(|k| {
                        let [i, j] = [(k + 1) % 3, (k + 2) % 3];
                        a[k] * (b[i] * c[j] - b[j] * c[i])
                    })
                    .sum::<f64>()
            })
            .sum();
        Ok((six_times / 6.0 - volume).abs() <= SAME_VOLUME * volume)
    }
}
