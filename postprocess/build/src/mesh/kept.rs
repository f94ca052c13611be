//! The mesh from layer to layer: rows around which no moat changes are kept.

use std::sync::{Arc, OnceLock};

use lamp_stack::{Image, Mask, Op, place_row};

use super::super::compose::{PlacedImage, merge_rows};
use super::super::part_stack::white_of;
use super::super::{Layout, PartStack, PixelSize};
use super::mesh_rows::{MeshRows, cut};
use super::pieces::{Hanging, Holds, hanging};
use super::{BuildMesh, Moat};

/// The mesh of the layer that was made last.
pub(crate) struct KeptMesh {
    /// The pixels that the moat of each part follows.
    followed: Vec<Mask>,
    /// The moat of each part in each way in which its copies lie, on an image that is larger than
    /// the build by the mesh's reach on every side.
    moats: Vec<Vec<PlacedImage>>,
    /// The walls that moats leave.
    cut: MeshRows,
    /// The pieces of these that hang together with the mesh below; none before the first layer.
    hanging: Option<Arc<LayerMesh>>,
    /// The starts of pieces that are not small, but hang on nothing.
    loose: Vec<[u32; 2]>,
}

/// The mesh of a layer.
///
/// Where the mesh of each layer is inside the mesh of the layer below, no other layer needs its
/// pieces. They are found when they are first asked for, so that each thread finds its own.
pub(crate) struct LayerMesh {
    /// The walls that moats leave, and the least number of pixels that a piece of them has.
    cut: MeshRows,
    least: u64,
    hanging: OnceLock<Hanging>,
    pixels: OnceLock<u64>,
}

impl LayerMesh {
    /// Returns the rows of the pieces that hang on something and are not small.
    pub(crate) fn rows(&self) -> &MeshRows {
        &self.hanging().kept
    }

    /// Returns the number of pixels of these pieces.
    pub(crate) fn pixels(&self) -> u64 {
        let Hanging { kept, pixels, .. } = self.hanging();
        *self.pixels.get_or_init(|| pixels.unwrap_or_else(|| kept.white_pixels()))
    }

    fn hanging(&self) -> &Hanging {
        self.hanging.get_or_init(|| hanging_pieces(&self.cut, Holds::All, self.least))
    }
}

impl KeptMesh {
    /// Starts with a mesh around parts that are black.
    pub(crate) fn new(mesh: &BuildMesh, layout: &Layout) -> Self {
        let black = |part: &PartStack| {
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
        Self { followed, moats, cut: mesh.standing.clone(), hanging: None, loose: Vec::new() }
    }

    /// Returns the mesh around the parts' `images` in the next layer, or `None` if a moat has too
    /// many runs.
    pub(crate) fn next(
        &mut self,
        mesh: &BuildMesh,
        layout: &Layout,
        images: &[(usize, Image)],
    ) -> Option<Arc<LayerMesh>> {
        let followed = |part| self.followed(mesh, layout, part, images);
        let followed = (0..layout.parts.len()).map(followed).collect::<Option<Vec<_>>>()?;
        let changed = self.cut_moats(mesh, layout, followed)?;
        // The same walls give the same pieces: the hanging ones lie on themselves, and loose ones
        // touch none of these.
        if !changed && let Some(hanging) = &self.hanging {
            return Some(hanging.clone());
        }
        let below = self.hanging.as_ref().filter(|_| mesh.moat == Moat::Layer);
        // Other moats only grow, so the mesh is inside the mesh of the layer below.
        let holds = below.map(|below| Holds::Below(below.rows()));
        let found = holds.map(|holds| hanging_pieces(&self.cut, holds, mesh.least_piece));
        Some(self.keep(mesh, found))
    }

    /// Returns the mesh of any layer, given the pixels that each part's moat follows in it, and the
    /// starts of pieces that are not small but hang on nothing. Returns `None` if a moat has too
    /// many runs.
    pub(crate) fn at(
        &mut self,
        mesh: &BuildMesh,
        layout: &Layout,
        followed: Vec<Mask>,
        loose: &[[u32; 2]],
    ) -> Option<Arc<LayerMesh>> {
        let changed = self.cut_moats(mesh, layout, followed)?;
        if !changed && let Some(hanging) = self.hanging.as_ref().filter(|_| self.loose == loose) {
            return Some(hanging.clone());
        }
        let found = hanging_pieces(&self.cut, Holds::AllBut(loose), mesh.least_piece);
        Some(self.keep(mesh, Some(found)))
    }

    /// Returns the starts of pieces of the layer's mesh that are not small, but hang on nothing.
    pub(crate) fn loose(&self) -> &[[u32; 2]] {
        &self.loose
    }

    /// Keeps the mesh of a layer, whose pieces may be found already.
    fn keep(&mut self, mesh: &BuildMesh, found: Option<Hanging>) -> Arc<LayerMesh> {
        self.loose = found.as_ref().map_or_else(Vec::new, |found| found.loose.clone());
        let made = Arc::new(LayerMesh {
            cut: self.cut.clone(),
            least: mesh.least_piece,
            hanging: found.map_or_else(OnceLock::new, OnceLock::from),
            pixels: OnceLock::new(),
        });
        self.hanging = Some(made.clone());
        made
    }

    /// Makes moats around the pixels that they follow now. Returns whether any has changed, or
    /// `None` if one has too many runs.
    fn cut_moats(
        &mut self,
        mesh: &BuildMesh,
        layout: &Layout,
        followed: Vec<Mask>,
    ) -> Option<bool> {
        let mut changed = Vec::new();
        for (part, followed) in followed.into_iter().enumerate() {
            if followed == self.followed[part] {
                continue;
            }
            let moat = Image::Mask(mesh.moat(&followed));
            self.followed[part] = followed;
            let moats = layout.placed_images(&[(part, moat)])?;
            // Stays empty while no moat changes, so such layers cost nothing.
            changed.resize(layout.pixels.height as usize, false);
            for (before, now) in self.moats[part].iter().zip(&moats) {
                mark_changed(before, now, mesh.reach(), &mut changed);
            }
            self.moats[part] = moats;
        }
        if !changed.is_empty() {
            self.cut_rows(mesh, layout.pixels, &changed);
        }
        Some(!changed.is_empty())
    }

    /// Returns the pixels that the moat of a part follows in the next layer, or `None` if they have
    /// too many runs.
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
                // Where a part ends, its moat stays: no mesh stands on faces that look up.
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
            // Only rows on the build are wanted, so `index` is `reach` and more.
            let index = index - reach;
            cut(mesh.standing.row(index), &moat, build.width, &mut row);
            rows[index as usize] = row.as_slice().into();
        });
    }
}

/// Returns the pieces of walls that are not small and hang on something.
fn hanging_pieces(cut: &MeshRows, holds: Holds<'_>, least: u64) -> Hanging {
    match holds {
        // Every piece has a pixel, so none would be left out.
        Holds::All | Holds::AllBut([]) if least <= 1 => {
            Hanging { kept: cut.clone(), pixels: None, loose: Vec::new() }
        }
        _ => hanging(cut, holds, least),
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
