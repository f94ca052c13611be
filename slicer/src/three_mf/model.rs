//! Reads a model of a 3MF package: its meshes, its other objects and its items.

use std::collections::{BTreeMap, BTreeSet};
use std::io::BufRead;
use std::sync::Arc;

use quick_xml::events::BytesStart;

use super::error::ModelFault;
use super::marks::MarkReader;
use super::project::{Project, Volume, VolumeKind};
use super::slices::{SliceReader, SliceStack};
use super::xml::{
    BoundedText, Located, Xml, attribute, for_each_piece, missing, number, numbers,
    prefixed_attribute,
};
use crate::decimal_mesh::DecimalMesh;
use crate::facet::Units;
use crate::piece::{Facets, Piece};
use crate::placement::Placement;

/// The effect of an extension of 3MF on the objects that use it.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Effect {
    /// It leaves meshes unchanged, or adds objects that the reader supports.
    None,
    /// It has slices, which the reader supports.
    Slices,
    /// Its elements in an object change the object's shape.
    Shape(&'static str),
}

const MATERIALS: &str = "/3dmanufacturing/material/";

/// Words in the namespaces of extensions, whose years differ, and the effects of the extensions.
const EXTENSIONS: [(&str, Effect); 12] = [
    ("/3dmanufacturing/production/alternatives/", Effect::None),
    ("/3dmanufacturing/production/", Effect::None),
    (MATERIALS, Effect::None),
    ("/3dmanufacturing/trianglesets/", Effect::None),
    ("/3dmanufacturing/slice/", Effect::Slices),
    ("/3dmanufacturing/beamlattice/balls/", Effect::Shape("a beam lattice")),
    ("/3dmanufacturing/beamlattice/", Effect::Shape("a beam lattice")),
    ("/3dmanufacturing/booleanoperations/", Effect::Shape("boolean operations")),
    ("/3dmanufacturing/displacement/", Effect::Shape("a displaced surface")),
    ("/3dmanufacturing/volumetric/", Effect::Shape("volumetric data")),
    ("/3dmanufacturing/implicit/", Effect::Shape("implicit functions")),
    ("/3dmanufacturing/securecontent/", Effect::None),
];

/// Returns the effect of a namespace's extension, if it is known.
fn effect_of(namespace: &str) -> Option<Effect> {
    EXTENSIONS.iter().find(|(words, _)| namespace.contains(words)).map(|(_, effect)| *effect)
}

/// A model: a file of a package.
pub(super) struct PackageModel {
    pub(super) units: Units,
    pub(super) objects: BTreeMap<u32, Object>,
    pub(super) slice_stacks: BTreeMap<u32, SliceStack>,
    /// The items to build.
    pub(super) items: Arc<Vec<ObjectReference>>,
    /// The number of facets of the package up to the end of this model.
    pub(super) facets_end: usize,
}

pub(super) struct Object {
    /// Whether it is material to build, rather than a support, a surface or anything else.
    pub(super) is_solid: bool,
    /// Its kind according to the settings of its project.
    pub(super) kind: VolumeKind,
    pub(super) shape: ObjectShape,
    /// The stack of its slices, if it has any.
    pub(super) slices: Option<u32>,
    /// Whether its shape represents a finer one elsewhere.
    pub(super) is_stand_in: bool,
    /// An unsupported extension that changes its shape.
    pub(super) unread: Option<&'static str>,
    /// Names of unknown extensions that have elements in it.
    pub(super) unknown: BTreeSet<String>,
}

pub(super) enum ObjectShape {
    /// The volumes of a mesh.
    Mesh(Vec<(VolumeKind, Piece)>),
    Components(Arc<Vec<ObjectReference>>),
}

/// A reference to an object, from an item or another object.
#[derive(Clone, Debug)]
pub(super) struct ObjectReference {
    /// The file of the object, if it is another file.
    pub(super) model: Option<String>,
    pub(super) object: u32,
    pub(super) placement: Placement,
    /// Whether it is to be built.
    pub(super) is_built: bool,
}

impl PackageModel {
    /// Reads a model whose facets are counted from `first_facet`, and their marks if they are kept.
    /// A project lists the volumes of its objects.
    pub(super) fn read(
        text: &mut BoundedText<impl BufRead>,
        first_facet: usize,
        project: &Project,
        keep_marks: bool,
    ) -> Result<Self, Located> {
        let mut state = ModelReader::new(first_facet, project);
        state.marks = keep_marks.then(MarkReader::default);
        for_each_piece(text, |piece| match piece {
            Xml::Start(namespace, tag) => state.start(namespace, tag),
            Xml::Text(text) => {
                state.text(text);
                Ok(())
            }
            Xml::End(namespace, name) => state.end(namespace, name),
        })?;
        Ok(Self {
            units: state.units,
            objects: state.objects,
            slice_stacks: state.slices.stacks,
            items: Arc::new(state.items),
            facets_end: state.first_facet,
        })
    }
}

/// The part of a model read so far.
struct ModelReader<'a> {
    project: &'a Project,
    units: Units,
    objects: BTreeMap<u32, Object>,
    slices: SliceReader,
    items: Vec<ObjectReference>,
    first_facet: usize,
    /// The namespace of 3MF's own elements.
    own: Option<String>,
    /// The current object and its number.
    object: Option<(u32, Object)>,
    mesh: DecimalMesh,
    marks: Option<MarkReader>,
    /// Volumes that the model lists itself.
    volumes: Vec<Volume>,
    components: Vec<ObjectReference>,
    /// The key of the current setting.
    setting: Option<String>,
}

impl<'a> ModelReader<'a> {
    fn new(first_facet: usize, project: &'a Project) -> Self {
        Self {
            project,
            units: Units::Millimetres,
            objects: BTreeMap::new(),
            slices: SliceReader::default(),
            items: Vec::new(),
            first_facet,
            own: None,
            object: None,
            mesh: DecimalMesh::default(),
            marks: None,
            volumes: Vec::new(),
            components: Vec::new(),
            setting: None,
        }
    }

    fn start(&mut self, namespace: &str, tag: &BytesStart<'_>) -> Result<(), ModelFault> {
        let name = tag.local_name();
        let Some(own) = &self.own else {
            if name.as_ref() == "model" {
                self.own = Some(namespace.to_owned());
                self.begin_model(tag)?;
            }
            return Ok(());
        };
        let is_material = namespace != own && namespace.contains(MATERIALS);
        if let Some(marks) = self.marks.as_mut().filter(|_| namespace == own || is_material) {
            marks.start(tag)?;
        }
        if namespace != own {
            return self.start_of_extension(namespace, tag);
        }
        match name.as_ref() {
            "vertex" => self.mesh.add_vertex(numbers(tag, ["x", "y", "z"])?),
            "triangle" => {
                let corners: [u32; 3] = numbers(tag, ["v1", "v2", "v3"])?;
                let count = self.mesh.vertex_count();
                if let Some(&vertex) = corners.iter().find(|&&corner| corner as usize >= count) {
                    return Err(ModelFault::NoVertex { of: "triangle", vertex, count });
                }
                self.mesh.add_facet(corners);
            }
            "object" => self.begin_object(tag)?,
            "component" => self.components.push(self.reference(tag)?),
            "item" => self.items.push(self.reference(tag)?),
            // Cura also writes the settings of an object as its metadata.
            "metadata" if self.object.is_some() => self.setting = attribute(tag, "name")?,
            _ => {}
        }
        Ok(())
    }

    fn begin_object(&mut self, tag: &BytesStart<'_>) -> Result<(), ModelFault> {
        let kind = attribute(tag, "type")?;
        let slices = prefixed_attribute(tag, "slicestackid")?;
        let mut object = Object {
            is_solid: matches!(kind.as_deref(), None | Some("model" | "solidsupport")),
            kind: VolumeKind::Solid,
            shape: ObjectShape::Mesh(Vec::new()),
            slices: None,
            is_stand_in: prefixed_attribute(tag, "meshresolution")?.as_deref() == Some("lowres"),
            unread: None,
            unknown: BTreeSet::new(),
        };
        if let Some(id) = slices {
            object.slices = Some(id.trim().parse().map_err(|_| missing(tag, "slicestackid"))?);
        }
        let resolution = prefixed_attribute(tag, "modelresolution")?;
        if matches!(resolution.as_deref(), Some("lowres" | "obfuscated")) {
            object.unread = Some("an alternative to a coarse mesh");
        }
        self.object = Some((number(tag, "id")?, object));
        Ok(())
    }

    /// Reads the start of an element that is not 3MF's own.
    fn start_of_extension(
        &mut self,
        namespace: &str,
        tag: &BytesStart<'_>,
    ) -> Result<(), ModelFault> {
        let effect = effect_of(namespace);
        if effect == Some(Effect::Slices) {
            return self.slices.start(tag);
        }
        let Some((_, object)) = &mut self.object else { return Ok(()) };
        match (effect, tag.local_name().as_ref()) {
            (Some(Effect::Shape(what)), _) => object.unread = Some(what),
            (Some(_), _) => {}
            // Slic3r lists the volumes of a mesh after its triangles.
            (None, "volume") if attribute(tag, "ts")?.is_some() => {
                let mut volume = Volume::of_triangles(tag, ["ts", "te"])?;
                volume.set("modifier", &attribute(tag, "modifier")?.unwrap_or_default());
                self.volumes.push(volume);
            }
            // Cura has settings for objects.
            (None, "setting") => self.setting = attribute(tag, "key")?,
            (None, "settings" | "volumes" | "metadata") => {}
            (None, _) => {
                let namespace = namespace.chars().filter(|c| !c.is_control()).take(100);
                object.unknown.insert(namespace.collect());
            }
        }
        Ok(())
    }

    fn begin_model(&mut self, tag: &BytesStart<'_>) -> Result<(), ModelFault> {
        // Millimeters are the default of the 3MF core specification.
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
            // The core specification demands an error: such an extension may change any shape.
            if name.as_deref().and_then(effect_of).is_none() {
                let name: String = name.unwrap_or_else(|| prefix.to_owned());
                return Err(ModelFault::Extension(name.chars().take(100).collect()));
            }
        }
        Ok(())
    }

    fn text(&mut self, text: &str) {
        if let (Some(key), Some((_, object))) = (&self.setting, &mut self.object) {
            object.kind = object.kind.of_part(&VolumeKind::of_cura(key, text));
        }
    }

    fn end(&mut self, namespace: &str, name: &str) -> Result<(), ModelFault> {
        self.setting = None;
        if Some(namespace) != self.own.as_deref() {
            if effect_of(namespace) == Some(Effect::Slices) {
                self.slices.end(name);
            }
            return Ok(());
        }
        if name != "object" {
            return Ok(());
        }
        let components = std::mem::take(&mut self.components);
        let mesh = std::mem::take(&mut self.mesh).into_piece();
        let marks = self.marks.as_mut().map(MarkReader::end_object);
        let own_volumes = std::mem::take(&mut self.volumes);
        let Some((id, mut object)) = self.object.take() else { return Ok(()) };
        object.shape = if components.is_empty() {
            let (first_facet, units) = (self.first_facet, Some(self.units));
            let piece = Piece { first_facet, units, marks, ..mesh };
            self.first_facet += piece.facets.count();
            object.kind = object.kind.of_part(&self.project.kind_of_mesh(id));
            let volumes = self.project.volumes(id).unwrap_or(&own_volumes);
            let volumes = volumes_of(&piece, volumes);
            ObjectShape::Mesh(volumes.ok_or(ModelFault::Volumes { object: id })?)
        } else {
            ObjectShape::Components(Arc::new(components))
        };
        self.objects.insert(id, object);
        Ok(())
    }

    /// Reads an item or a component.
    fn reference(&self, tag: &BytesStart<'_>) -> Result<ObjectReference, ModelFault> {
        let placement = match attribute(tag, "transform")? {
            Some(text) => transform(&text, self.units).ok_or_else(|| missing(tag, "transform"))?,
            None => Placement::default(),
        };
        let printable = attribute(tag, "printable")?;
        Ok(ObjectReference {
            model: prefixed_attribute(tag, "path")?,
            object: number(tag, "objectid")?,
            placement,
            is_built: !matches!(printable.as_deref().map(str::trim), Some("0" | "false")),
        })
    }
}

/// Splits a mesh into volumes; triangles without a volume are a solid. Returns `None` if it has no
/// such volumes.
fn volumes_of(mesh: &Piece, volumes: &[Volume]) -> Option<Vec<(VolumeKind, Piece)>> {
    let count = mesh.facets.count();
    let mut ranges: Vec<_> = volumes
        .iter()
        .filter_map(|volume| Some((volume.triangles.clone()?, &volume.kind)))
        .filter(|(range, _)| range.start != range.end)
        .collect();
    ranges.sort_by_key(|(range, _)| range.start);
    let Facets::Memory(facets) = &mesh.facets else { return None };
    let mut pieces = Vec::new();
    let mut add = |range: std::ops::Range<usize>, kind: &VolumeKind| {
        let first_facet = mesh.first_facet + range.start;
        let (facets, marks) = match range.len() == count {
            // A mesh of one volume needs no copy.
            true => (facets.clone(), mesh.marks.clone()),
            false => {
                let marks = mesh.marks.as_ref().map(|marks| Arc::new(marks.of_range(&range)));
                (Arc::new(facets[range].to_vec()), marks)
            }
        };
        pieces.push((
            kind.clone(),
            Piece { facets: Facets::Memory(facets), first_facet, marks, ..mesh.clone() },
        ));
    };
    let mut end = 0;
    for (range, kind) in ranges {
        if range.start < end || range.end < range.start || range.end > count {
            return None;
        }
        if end < range.start {
            add(end..range.start, &VolumeKind::Solid);
        }
        end = range.end;
        add(range, kind);
    }
    if end < count || count == 0 {
        add(end..count, &VolumeKind::Solid);
    }
    Some(pieces)
}

/// Reads twelve numbers: the images of x, y and z, and a shift.
fn transform(text: &str, units: Units) -> Option<Placement> {
    let numbers = text.split_whitespace().map(|number| number.parse().ok());
    let numbers: Vec<f64> = numbers.collect::<Option<_>>()?;
    let m: [f64; 12] = numbers.try_into().ok()?;
    let is_finite = m.iter().all(|number| number.is_finite());
    // The core specification multiplies row vectors by the matrix, so its columns are rows here.
    let row = |k: usize| [m[k], m[3 + k], m[6 + k], m[9 + k] * units.mm()];
    is_finite.then(|| Placement::of_rows([row(0), row(1), row(2)]))
}
