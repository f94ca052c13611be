//! Reads which volumes of an object are solids, according to projects of slicers.
//!
//! PrusaSlicer, SuperSlicer and old versions of Bambu Studio store the volumes of an object as
//! ranges of the triangles of one mesh; Bambu Studio and OrcaSlicer as components; Slic3r as ranges
//! in the model; Cura as settings of objects.

use std::collections::BTreeMap;
use std::io::BufRead;
use std::ops::Range;

use quick_xml::events::BytesStart;

use super::error::ModelFault;
use super::xml::{BoundedText, Located, Xml, attribute, for_each_piece, number};

/// The ends of the names of files that list the kinds of volumes: `Slic3r_PE_model.config` of
/// PrusaSlicer, `model_settings.config` of Bambu Studio.
pub(super) const PROJECT_FILES: [&str; 2] = ["_model.config", "/model_settings.config"];

/// Files of projects for resin printers, and their contents.
pub(super) const UNREAD_FILES: [(&str, &str); 2] = [
    ("Metadata/Slic3r_PE_sla_support_points.txt", "support points"),
    ("Metadata/Slic3r_PE_sla_drain_holes.txt", "drain holes"),
];

/// The role of a volume in its object.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) enum VolumeKind {
    #[default]
    Solid,
    Negative,
    /// Settings for the region that it covers, or something else of this name.
    LeftOut(String),
}

impl VolumeKind {
    /// Returns the kind of this name in any project.
    fn of_name(name: &str) -> Self {
        let plain: String = name.chars().filter(char::is_ascii_alphanumeric).collect();
        let kind = match plain.to_ascii_lowercase().as_str() {
            "" | "modelpart" | "normalpart" => return Self::Solid,
            "negativevolume" | "negativepart" => return Self::Negative,
            "parametermodifier" | "modifierpart" => "modifier",
            "supportblocker" => "support blocker",
            "supportenforcer" => "support enforcer",
            _ => name,
        };
        Self::left_out(kind)
    }

    fn left_out(kind: &str) -> Self {
        const MAX_CHARACTERS: usize = 40;
        Self::LeftOut(kind.chars().filter(|c| !c.is_control()).take(MAX_CHARACTERS).collect())
    }

    /// Returns the kind that a Cura setting gives an object.
    pub(super) fn of_cura(key: &str, value: &str) -> Self {
        if !value.trim().eq_ignore_ascii_case("true") {
            return Self::Solid;
        }
        match key.strip_prefix("cura:").unwrap_or(key) {
            "infill_mesh" | "cutting_mesh" => Self::left_out("modifier"),
            "anti_overhang_mesh" => Self::left_out("support blocker"),
            "support_mesh" => Self::left_out("support"),
            _ => Self::Solid,
        }
    }

    /// Returns the kind of a part of an object of this kind.
    pub(super) fn of_part(&self, part: &Self) -> Self {
        if *self == Self::Solid { part.clone() } else { self.clone() }
    }
}

/// A volume of an object.
#[derive(Clone, Debug, Default)]
pub(super) struct Volume {
    /// The object of the component that this volume is.
    component: Option<u32>,
    /// Its triangles in the object's mesh.
    pub(super) triangles: Option<Range<usize>>,
    pub(super) kind: VolumeKind,
}

impl Volume {
    /// Reads the attributes of a volume: of all triangles from one to another.
    pub(super) fn of_triangles(
        tag: &BytesStart<'_>,
        names: [&'static str; 2],
    ) -> Result<Self, ModelFault> {
        let [first, last] = [number::<usize>(tag, names[0])?, number::<usize>(tag, names[1])?];
        Ok(Self { triangles: Some(first..last.saturating_add(1)), ..Self::default() })
    }

    /// Applies a setting of its project.
    pub(super) fn set(&mut self, key: &str, value: &str) {
        match key {
            "volume_type" => self.kind = VolumeKind::of_name(value),
            // From versions that had no other kinds.
            "modifier" if matches!(value, "1" | "true") && self.kind == VolumeKind::Solid => {
                self.kind = VolumeKind::left_out("modifier");
            }
            _ => {}
        }
    }
}

/// The volumes of a project's objects.
#[derive(Debug, Default)]
pub(super) struct Project {
    objects: BTreeMap<u32, Vec<Volume>>,
    pub(super) plates: usize,
}

impl Project {
    /// Adds the objects of a project's file that no earlier file had.
    pub(super) fn read(&mut self, text: &mut BoundedText<impl BufRead>) -> Result<(), Located> {
        let known: Vec<u32> = self.objects.keys().copied().collect();
        let mut object = None;
        let mut is_in_volume = false;
        for_each_piece(text, |piece| {
            match piece {
                Xml::Start(_, tag) => match tag.local_name().as_ref() {
                    "object" => {
                        let id = number(tag, "id")?;
                        object = Some(id).filter(|id| !known.contains(id));
                    }
                    "plate" => self.plates += 1,
                    name @ ("volume" | "part") => {
                        let Some(object) = object else { return Ok(()) };
                        let has_triangles = attribute(tag, "firstid")?.is_some();
                        let mut volume = match has_triangles {
                            true => Volume::of_triangles(tag, ["firstid", "lastid"])?,
                            false => Volume::default(),
                        };
                        if name == "part" && !has_triangles {
                            volume.component = Some(number(tag, "id")?);
                        }
                        volume.kind =
                            VolumeKind::of_name(&attribute(tag, "subtype")?.unwrap_or_default());
                        self.objects.entry(object).or_default().push(volume);
                        is_in_volume = true;
                    }
                    "metadata" if is_in_volume => {
                        let [key, value] = ["key", "value"].map(|name| attribute(tag, name));
                        let volumes = object.and_then(|object| self.objects.get_mut(&object));
                        if let (Some(volumes), Some(key), Some(value)) = (volumes, key?, value?)
                            && let Some(volume) = volumes.last_mut()
                        {
                            volume.set(&key, &value);
                        }
                    }
                    _ => {}
                },
                Xml::End(_, "object") => object = None,
                Xml::End(_, "volume" | "part") => is_in_volume = false,
                _ => {}
            }
            Ok(())
        })
    }

    /// Returns the volumes of an object of the package's first model, if the project lists any.
    pub(super) fn volumes(&self, object: u32) -> Option<&[Volume]> {
        self.objects.get(&object).map(Vec::as_slice)
    }

    /// Returns the kind of an object's component that is another object, after `before` components
    /// that are the same object.
    pub(super) fn kind_of_component(
        &self,
        object: u32,
        component: u32,
        before: usize,
    ) -> VolumeKind {
        let volumes = self.volumes(object).unwrap_or_default();
        let mut volumes = volumes.iter().filter(|volume| volume.component == Some(component));
        // An object may be several components, each with a kind. Missing kinds repeat the last one.
        let volume = volumes.clone().nth(before).or_else(|| volumes.next_back());
        volume.map_or(VolumeKind::Solid, |volume| volume.kind.clone())
    }

    /// Returns the kind of an object that is a mesh by itself.
    pub(super) fn kind_of_mesh(&self, object: u32) -> VolumeKind {
        match self.volumes(object) {
            Some([volume]) if volume.triangles.is_none() => volume.kind.clone(),
            _ => self.kind_of_component(object, object, 0),
        }
    }
}
