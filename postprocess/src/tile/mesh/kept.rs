//! The mesh from layer to layer: rows around which no moat changes are kept.

use lamp_stack::{Image, Mask, Op, place_row};

use super::super::compose::{PlacedImage, merge_rows};
use super::super::part_stack::white_of;
use super::super::{Layout, PixelSize};
use super::mesh_rows::MeshRows;
use super::pieces::hanging;
use super::{BuildMesh, Moat, cut};

/// The mesh of the layer that was made last.
pub(in crate::tile) struct KeptMesh {
    /// What the moat of each part follows.
    followed: Vec<Mask>,
    /// The moat of each part in each way in which its copies lie, on an image that is larger than
    /// the build by the mesh's reach on every side.
    moats: Vec<Vec<PlacedImage>>,
    /// The walls that moats leave.
    cut: MeshRows,
    /// The pieces of these that hang together with the mesh below; none before the first layer.
    hanging: Option<MeshRows>,
}

impl KeptMesh {
    /// Starts with a mesh around parts that are black.
    pub(in crate::tile) fn new(mesh: &BuildMesh, layout: &Layout) -> Self {
        let black = |part: &super::PartStack| {
            let frame = part.frame();
            Mask::black(frame.width, frame.height)
        };
        let moat = |(part, black): (usize, &Mask)| {
            let PixelSize { width, height } =
                PixelSize { width: black.width(), height: black.height() }.grown(mesh.reach());
            let moat = Image::Mask(Mask::black(width, height));
            layout.placed_images(&[(part, moat)]).expect("black has no runs")
        };
        let followed: Vec<Mask> = layout.parts.iter().map(black).collect();
        let moats = followed.iter().enumerate().map(moat).collect();
        Self { followed, moats, cut: mesh.standing.clone(), hanging: None }
    }

    /// Returns the mesh around the parts' `images` in the next layer, or `None` if a moat has too
    /// many runs.
    pub(in crate::tile) fn next(
        &mut self,
        mesh: &BuildMesh,
        layout: &Layout,
        images: &[(usize, Image)],
    ) -> Option<MeshRows> {
        let mut changed = Vec::new();
        for part in 0..layout.parts.len() {
            let followed = self.followed(mesh, layout, part, images)?;
            if followed == self.followed[part] {
                continue;
            }
            let moat = Image::Mask(mesh.moat(&followed));
            self.followed[part] = followed;
            let moats = layout.placed_images(&[(part, moat)])?;
            changed.resize(layout.pixels.height as usize, false);
            for (before, now) in self.moats[part].iter().zip(&moats) {
                mark_changed(before, now, mesh.reach(), &mut changed);
            }
            self.moats[part] = moats;
        }
        if !changed.is_empty() {
            self.cut_rows(mesh, layout.pixels, &changed);
        }
        if let (true, Some(hanging)) = (changed.is_empty(), &self.hanging) {
            return Some(hanging.clone());
        }
        let hanging = self.hanging_rows(mesh);
        self.hanging = Some(hanging.clone());
        Some(hanging)
    }

    /// Returns the pieces of the walls that hang on the mesh of the layer below, or as the first
    /// stand on the base.
    fn hanging_rows(&self, mesh: &BuildMesh) -> MeshRows {
        // Other moats only grow, so the mesh lies within that below.
        let below = self.hanging.as_ref().filter(|_| mesh.moat == Moat::Layer);
        if below.is_none() && mesh.least_piece <= 1 {
            return self.cut.clone();
        }
        hanging(&self.cut, below, mesh.least_piece)
    }

    /// Returns what the moat of a part follows in the next layer, or `None` if it has too many
    /// runs.
    fn followed(
        &self,
        mesh: &BuildMesh,
        layout: &Layout,
        part: usize,
        images: &[(usize, Image)],
    ) -> Option<Mask> {
        let before = &self.followed[part];
        let image = || images.iter().find(|(of, _)| *of == part).map(|(_, image)| white_of(image));
        Some(match mesh.moat {
            Moat::Rising => match image() {
                Some(white) => white.combined(Op::Union, before)?,
                None => before.clone(),
            },
            Moat::Layer => image().unwrap_or_else(|| Mask::black(before.width(), before.height())),
            Moat::Outline => {
                layout.parts[part].outline().expect("checked where the mesh was made").clone()
            }
        })
    }

    /// Cuts the moats out of the walls, in the rows that changed.
    fn cut_rows(&mut self, mesh: &BuildMesh, build: PixelSize, changed: &[bool]) {
        let reach = mesh.reach();
        let on_build = |row: u32| row.checked_sub(reach).filter(|&row| row < build.height);
        let is_changed = |row| on_build(row).is_some_and(|row| changed[row as usize]);
        let grown = build.grown(reach);
        let (mut moat, mut row) = (Vec::new(), Vec::new());
        let rows = self.cut.rows_mut();
        let moats: Vec<&PlacedImage> = self.moats.iter().flatten().collect();
        merge_rows(&moats, grown, is_changed, |index, transitions| {
            moat.clear();
            place_row(transitions, grown.width, -i64::from(reach), build.width, &mut moat);
            let index = index - reach;
            cut(mesh.standing.row(index), &moat, build.width, &mut row);
            rows[index as usize] = row.as_slice().into();
        });
    }
}

/// Marks the rows of the build in which an image differs from what it was before.
fn mark_changed(before: &PlacedImage, now: &PlacedImage, reach: u32, changed: &mut [bool]) {
    let (Image::Mask(a), Image::Mask(b)) = (&before.image, &now.image) else {
        panic!("moats are masks");
    };
    for (row, _) in (0..).zip(a.rows().zip(b.rows())).filter(|(_, (a, b))| a != b) {
        for (_, top) in &now.at {
            let place = (top + row).checked_sub(reach);
            if let Some(changed) = place.and_then(|place| changed.get_mut(place as usize)) {
                *changed = true;
            }
        }
    }
}
