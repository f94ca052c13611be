//! Reads 3MF: packed XML with meshes, and the items built from them.
//!
//! An item is placed by its transform. Its object is a mesh, or consists of other objects, each
//! with its own transform. Every mesh that is reached becomes a piece; pieces of one mesh share its
//! facets. Projects of slicers have meshes that are cut out of others, and meshes that are not
//! solids.

mod error;
mod marks;
mod model;
mod package;
mod project;
mod slices;
#[cfg(test)]
mod tests;
pub(crate) mod xml;

use std::collections::{BTreeMap, BTreeSet};
use std::io::BufRead;

use crate::bodies::BodyRole;
use crate::part_file::OpenPartFile;
use crate::piece::{Facets, Piece};
use crate::placement::Placement;
use crate::read_note::ReadNote;
use error::MAX_VISITS;
use model::{Object, ObjectReference, ObjectShape, PackageModel};
use package::{Package, without_root};
use project::{PROJECT_FILES, Project, UNREAD_FILES, VolumeKind};
use slices::SliceSolid;
use xml::BoundedText;

pub use error::{ModelFault, ThreeMfError};
pub(crate) use package::looks_packaged;

/// The greatest nesting of objects. Without a limit, a few lines of text could represent more
/// meshes than there are atoms.
const MAX_DEPTH: usize = 32;
/// A mesh whose volume differs from its slices' volume by a larger share is a stand-in, often their
/// bounding box. Slices are coarse: each has the height of a layer.
const SAME_VOLUME: f64 = 0.05;

/// The contents of a file.
pub(crate) struct Contents {
    pub(crate) pieces: Vec<Piece>,
    pub(crate) notes: Vec<ReadNote>,
    /// The boundaries of the layers that the file states, in millimeters.
    pub(crate) layers_mm: Option<Vec<f64>>,
}

/// Reads a file's items, and the marks of their facets if they are kept.
pub(crate) fn read(file: &OpenPartFile, keep_marks: bool) -> Result<Contents, ThreeMfError> {
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
        keep_marks,
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
    Ok(Contents { pieces: found.pieces, notes, layers_mm: None })
}

/// The pieces of the items read so far.
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
        let solid = self.pieces.iter().filter(|piece| piece.role == BodyRole::Solid);
        let solid: BTreeSet<usize> = solid.map(|piece| piece.object).collect();
        let before = self.pieces.len();
        self.pieces.retain(|piece| solid.contains(&piece.object));
        self.left_out.lone_negatives = before - self.pieces.len();
    }
}

/// The counts of contents that are not built.
#[derive(Default)]
struct LeftOut {
    no_solids: usize,
    not_printable: usize,
    lone_negatives: usize,
    /// The volumes by their kind.
    volumes: BTreeMap<String, usize>,
    /// Objects whose slices are left out, and objects whose mesh is left out.
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

/// The place of an object, and its role there.
#[derive(Default)]
struct Place {
    placement: Placement,
    depth: usize,
    /// The number of the placed object that contains it, and whether its project lists it.
    object: usize,
    is_in_project: bool,
    kind: VolumeKind,
}

/// The models of a package, each read on first use.
struct Models<'a> {
    package: Package<'a>,
    /// The name of the package's main model.
    root: String,
    encrypted: Vec<String>,
    project: Project,
    keep_marks: bool,
    models: BTreeMap<String, PackageModel>,
    /// The solids of objects that have slices; `None` where the mesh is read.
    sliced: BTreeMap<(String, u32), Option<Piece>>,
    /// The number of their facets so far.
    facets: usize,
}

impl Models<'_> {
    fn get(&mut self, path: &str) -> Result<&PackageModel, ThreeMfError> {
        if !self.models.contains_key(path) {
            if self.encrypted.iter().any(|encrypted| encrypted == path) {
                return Err(ThreeMfError::Encrypted(path.to_owned()));
            }
            let none = Project::default();
            let project = if path == self.root { &self.project } else { &none };
            let (facets, marks) = (self.facets, self.keep_marks);
            let read = |text: &mut BoundedText<&mut dyn BufRead>| {
                PackageModel::read(text, facets, project, marks)
            };
            let model = self.package.read(path, read)?;
            let failed = |(at, fault)| ThreeMfError::Model { model: path.to_owned(), at, fault };
            let model = model.map_err(failed)?;
            self.facets = model.facets_end;
            self.models.insert(path.to_owned(), model);
        }
        Ok(&self.models[path])
    }

    /// Returns the name of a model that another model refers to.
    fn path_of(&self, target: &str, from: &str) -> Result<String, ThreeMfError> {
        let found = self.package.find(target, from);
        found.map(str::to_owned).ok_or_else(|| ThreeMfError::NoModel(without_root(target)))
    }

    fn object(&mut self, path: &str, id: u32) -> Result<&Object, ThreeMfError> {
        let object = self.get(path)?.objects.get(&id);
        object.ok_or_else(|| ThreeMfError::NoObject { model: path.to_owned(), id })
    }

    /// Adds the pieces of an object as placed in other objects.
    fn expand(
        &mut self,
        from: &str,
        reference: &ObjectReference,
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
        // Negative volumes cut only the item, or the object of the project, that lists them.
        if outer.depth == 0 || (is_listed && !outer.is_in_project) {
            place.object = found.objects;
            found.objects += 1;
        }
        if let Some(piece) = self.sliced(&path, id, &mut found.left_out)? {
            return self.add(&piece, &VolumeKind::Solid, &place, found);
        }
        let components = match &self.object(&path, id)?.shape {
            ObjectShape::Mesh(volumes) => {
                let volumes = volumes.clone();
                return volumes
                    .iter()
                    .try_for_each(|(kind, piece)| self.add(piece, kind, &place, found));
            }
            ObjectShape::Components(components) => components.clone(),
        };
        let kind = place.kind.clone();
        for (number, component) in components.iter().enumerate() {
            let is_same = |other: &&ObjectReference| other.object == component.object;
            let before = components[..number].iter().filter(is_same).count();
            if is_listed {
                let of_part = self.project.kind_of_component(id, component.object, before);
                place.kind = kind.of_part(&of_part);
            }
            self.expand(&path, component, &place, found)?;
        }
        Ok(())
    }

    /// Adds a piece of a given kind at a place.
    fn add(
        &self,
        piece: &Piece,
        kind: &VolumeKind,
        place: &Place,
        found: &mut Found,
    ) -> Result<(), ThreeMfError> {
        let role = match place.kind.of_part(kind) {
            VolumeKind::Solid => BodyRole::Solid,
            VolumeKind::Negative => BodyRole::Negative,
            VolumeKind::LeftOut(name) => {
                *found.left_out.volumes.entry(name).or_default() += 1;
                return Ok(());
            }
        };
        found.facets += piece.facets.count() as u64;
        // A few bytes may place one mesh thousands of times.
        if found.facets > self.package.most {
            return Err(ThreeMfError::Copies(self.package.most));
        }
        let Place { placement, object, .. } = *place;
        found.pieces.push(Piece { placement, object, role, ..piece.clone() });
        Ok(())
    }

    /// Returns the slices of an object, if they represent it and its mesh does not.
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
                let solid = self.slice_solid(path, stack)?.map_err(failed)?;
                let is_mesh = !is_stand_in && self.has_volume(path, id, solid.volume)?;
                let of_kind = if is_mesh { &mut left_out.slices } else { &mut left_out.stand_ins };
                of_kind.insert(key.clone());
                (!is_mesh).then(|| Piece {
                    first_facet: self.facets,
                    units: Some(self.models[path].units),
                    ..solid.drawing.into_pieces().swap_remove(0)
                })
            }
        };
        self.facets += piece.as_ref().map_or(0, |piece| piece.facets.count());
        self.sliced.insert(key, piece.clone());
        Ok(piece)
    }

    /// Returns the slices of a stack and of the stacks that it refers to, or their fault.
    fn slice_solid(
        &mut self,
        path: &str,
        stack: u32,
    ) -> Result<Result<SliceSolid, &'static str>, ThreeMfError> {
        const LOST: &str = "slices that are not there";
        let most = self.package.most;
        let mut solid = SliceSolid::new();
        let Some(stack) = self.get(path)?.slice_stacks.get(&stack) else { return Ok(Err(LOST)) };
        if let Err(fault) = solid.add(stack, most) {
            return Ok(Err(fault));
        }
        for (target, number) in stack.references.clone() {
            let path = self.path_of(&target, path)?;
            let Some(stack) = self.get(&path)?.slice_stacks.get(&number) else {
                return Ok(Err(LOST));
            };
            if let Err(fault) = solid.add(stack, most) {
                return Ok(Err(fault));
            }
        }
        Ok(if solid.volume > 0.0 { Ok(solid) } else { Err("slices without area") })
    }

    /// Returns true if an object has about this volume, in units of its file, or consists of other
    /// objects, whose volume is not known.
    fn has_volume(&mut self, path: &str, id: u32, volume: f64) -> Result<bool, ThreeMfError> {
        let ObjectShape::Mesh(volumes) = &self.object(path, id)?.shape else { return Ok(true) };
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
