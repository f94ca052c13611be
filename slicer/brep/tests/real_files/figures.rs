//! Reads OpenCASCADE's figures of the files of a folder.

use std::path::{Path, PathBuf};

use serde_json::Value;

/// Files with a volume that differs from the reference's, each with the reason in `docs/brep.md`.
const VOLUMES: &[(&str, f64)] =
    &[("axom_boxed_sphere.step", 733.601), ("occt-import-_HEAD_BACK.stp", 23_630.7)];
/// Files, numbers of their sections, and areas that differ from the reference's, as above.
const SECTIONS: &[(&str, usize, f64)] = &[
    ("nist_ctc_02_asme1_ap242.stp", 2, 103_560.4),
    ("gmsh_wing_fuselage.step", 2, 26_974.5),
    ("gmsh_917_fusee.stp", 3, 4336.6),
    ("occt-import-_HEAD_BACK.stp", 0, 186.925),
    ("occt-import-_HEAD_BACK.stp", 1, 186.925),
    ("occt-import-_HEAD_BACK.stp", 2, 212.143),
    ("occt-import-_HEAD_BACK.stp", 3, 186.925),
    ("occt-import-_HEAD_BACK.stp", 4, 186.925),
];
/// Files, numbers of their boxes' sides (the least x, y and z, the greatest x, y and z), and places
/// that differ from the reference's, as above.
const SIDES: &[(&str, usize, f64)] =
    &[("s1_tu_203_tailturbine.stp", 0, 1.483), ("occt-import-_HEAD_BACK.stp", 3, 250.0)];

/// Files with only faces that close when OpenCASCADE sews them, the volume of its facets and their
/// box, as above.
const SEWN: &[(&str, f64, [f64; 6])] =
    &[("gmsh_mesh_T106_V3.step", 2_059_078.5, [-170.109, -264.794, 0.0, 510.243, 96.899, 19.781])];

/// The reference figures of a file.
pub(crate) struct Figures {
    pub(crate) name: String,
    pub(crate) path: PathBuf,
    pub(crate) bodies: u64,
    /// Whether the reference finds a solid in the file; a rejection is right if it does not.
    pub(crate) has_solid: bool,
    /// The least and the greatest corner, if there is a body.
    pub(crate) box_mm: Option<[[f64; 3]; 2]>,
    /// The volume, if there is a body.
    pub(crate) volume_mm3: Option<f64>,
    pub(crate) heights_mm: Vec<f64>,
    /// The areas of the sections at these heights.
    pub(crate) areas_mm2: Vec<f64>,
}

impl Figures {
    fn new(folder: &Path, name: &str, of_file: &Value) -> Self {
        let list = |key: &str| -> Vec<f64> {
            of_file[key].as_array().into_iter().flatten().filter_map(Value::as_f64).collect()
        };
        let mut areas_mm2 = list("section_area_mm2");
        for &(_, section, area) in SECTIONS.iter().filter(|(file, ..)| *file == name) {
            areas_mm2[section] = area;
        }
        let sewn = SEWN.iter().find(|(file, ..)| *file == name);
        let volume_mm3 = match (sewn, VOLUMES.iter().find(|(file, _)| *file == name)) {
            (Some((_, volume, _)), _) | (_, Some((_, volume))) => Some(*volume),
            _ => of_file["volume_mm3"].as_f64(),
        };
        let mut sides = sewn.map_or_else(|| list("box_mm"), |(_, _, sides)| sides.to_vec());
        for &(_, side, place) in SIDES.iter().filter(|(file, ..)| *file == name) {
            sides[side] = place;
        }
        let corners: Option<[f64; 6]> = sides.try_into().ok();
        let solids = of_file["solids"].as_u64().unwrap_or(0);
        Self {
            name: name.to_owned(),
            path: folder.join(name),
            bodies: if sewn.is_some() { 1 } else { solids },
            has_solid: solids > 0,
            box_mm: corners.map(|[a, b, c, d, e, f]| [[a, b, c], [d, e, f]]),
            volume_mm3,
            heights_mm: list("section_z_mm"),
            areas_mm2,
        }
    }

    /// Returns the longest side of the box, or 0 if there is no body.
    pub(crate) fn size_mm(&self) -> f64 {
        let side = |[low, high]: [[f64; 3]; 2]| (0..3).map(move |k| high[k] - low[k]);
        self.box_mm.map_or(0.0, |corners| side(corners).fold(0.0, f64::max))
    }
}

/// Returns the figures of a folder's files; empty if the folder does not exist.
pub(crate) fn of_folder(folder: &Path) -> Vec<Figures> {
    let mut beside = folder.as_os_str().to_owned();
    beside.push("_oracle.json");
    let Ok(text) = std::fs::read(&beside) else { return Vec::new() };
    let all: Value = serde_json::from_slice(&text).expect("figures as JSON");
    let files = all.as_object().expect("figures by file");
    files.iter().map(|(name, of_file)| Figures::new(folder, name, of_file)).collect()
}
