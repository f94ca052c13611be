//! The dose wanted at each voxel of a rectangle, and the light allowed at its pixel.

use crate::solver::Role;
use crate::tiled::{PixelRectangle, Tiled};
use crate::voxels::options::{Options, Sources, VoxelObjective};

/// The distance of a boundary voxel from a target, in voxels along each axis.
///
/// 001 shows boundary voxels in a lost drawing (A.19b). With two, all 28 unlit voxels of the layers
/// of its appendix A are among them, and the sums of appendix A are reproduced.
pub(crate) const REACH: usize = 2;

/// A layer's images.
#[derive(Debug)]
pub(crate) struct LayerImages {
    /// 255 where the part is, 0 elsewhere.
    pub(crate) wanted: Tiled<u8>,
    /// 1 where white light cures the part.
    pub(crate) targets: Tiled<u8>,
}

/// The pixels along an outline, and around it, that [`Options`] ask for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RoleRules {
    objective: VoxelObjective,
    sources: Sources,
    keep_wall: usize,
    /// Where pixels can be lit: the image without the voxels around it.
    image: [isize; 4],
}

impl RoleRules {
    /// Creates the rules; `around` voxels lie around images of `width` x `height` pixels.
    pub(crate) fn new(options: &Options, width: usize, height: usize, around: usize) -> Self {
        let Options { objective, sources, .. } = *options;
        let [left, right] = [around, around + width].map(|n| n as isize);
        let [top, bottom] = [around, around + height].map(|n| n as isize);
        let keep_wall = options.keep_wall as usize;
        Self { objective, sources, keep_wall, image: [left, right, top, bottom] }
    }

    /// Returns the distance around a voxel within which images determine its role.
    pub(crate) fn reach(&self) -> usize {
        let boundary = if self.objective == VoxelObjective::Boundary { REACH } else { 0 };
        self.outline().max(boundary)
    }

    fn outline(&self) -> usize {
        let by_sources = match self.sources {
            Sources::Lit => 0,
            Sources::Grow(pixels) | Sources::Shell(pixels) => pixels as usize,
        };
        by_sources.max(self.keep_wall)
    }

    /// Writes the roles of the voxels of a rectangle, in lines of `stride`; voxels outside the
    /// image have no role. `layers` are the layers within reach of `layer`, from the light.
    pub(crate) fn write(
        &self,
        layers: &[&LayerImages],
        layer: usize,
        rect: &PixelRectangle,
        stride: usize,
        roles: &mut [Role],
    ) {
        let grid = layers[layer].wanted.grid;
        let mut wanted = vec![0; stride * rect.height()];
        layers[layer].wanted.copy(rect, 0, stride, &mut wanted);
        let light = self.light_roles(&layers[layer].wanted, rect, stride, &wanted);
        let doses = match self.objective {
            VoxelObjective::Wrong => {
                wanted.iter().map(|&w| either(w, Role::CURED, Role::UNCURED)).collect()
            }
            VoxelObjective::Boundary => boundary_roles(layers, layer, rect, stride, &wanted),
        };
        let inside = rect.within(&grid.image());
        let all = roles.iter_mut().zip(light.iter().zip(&doses)).enumerate();
        for (place, (role, (&light, &dose))) in all {
            let row = rect.rows.start + (place / stride) as isize;
            let column = rect.columns.start + (place % stride) as isize;
            let is_inside = inside.rows.contains(&row) && inside.columns.contains(&column);
            *role = if is_inside { light.and(dose) } else { Role::NONE };
        }
    }

    /// Returns the common role of all voxels of a rectangle in the image, if it is plain that they
    /// have one.
    pub(crate) fn role_of_all(
        &self,
        layers: &[&LayerImages],
        layer: usize,
        rect: &PixelRectangle,
    ) -> Option<Role> {
        self.light_of_all(&layers[layer].wanted, rect)?;
        if self.objective == VoxelObjective::Boundary {
            let near = layer.saturating_sub(REACH)..layers.len().min(layer + REACH + 1);
            for layer in &layers[near] {
                layer.targets.value_in(&rect.grown(REACH), 0)?;
            }
        }
        let mut role = [Role::NONE];
        self.write(layers, layer, &first_pixel(rect), 1, &mut role);
        Some(role[0])
    }

    /// Returns the common light allowed at all pixels of a rectangle in the image, if it is plain
    /// that they have one.
    pub(crate) fn light_of_all(&self, wanted: &Tiled<u8>, rect: &PixelRectangle) -> Option<Role> {
        // Roles depend on pixels up to the reach of outlines: where these pixels are alike, so are
        // the roles.
        wanted.value_in(&rect.grown(self.outline()), 0)?;
        self.light_roles_of(wanted, &first_pixel(rect), 1).first().copied()
    }

    /// Returns the light allowed at the pixels of a rectangle, in lines of `stride`.
    pub(crate) fn light_roles_of(
        &self,
        image: &Tiled<u8>,
        rect: &PixelRectangle,
        stride: usize,
    ) -> Vec<Role> {
        let mut wanted = vec![0; stride * rect.height()];
        image.copy(rect, 0, stride, &mut wanted);
        self.light_roles(image, rect, stride, &wanted)
    }

    fn light_roles(
        &self,
        image: &Tiled<u8>,
        rect: &PixelRectangle,
        stride: usize,
        wanted: &[u8],
    ) -> Vec<Role> {
        let lit = |keep: Role| move |&w: &u8| either(w, keep, Role::NONE);
        let outline = |by: usize| {
            let dark = around(image, rect, stride, by, |w| w == 0);
            wanted.iter().zip(dark).map(|(&w, dark)| w != 0 && dark).collect::<Vec<_>>()
        };
        let mut roles: Vec<Role> = match self.sources {
            Sources::Lit => wanted.iter().map(lit(Role::LIT)).collect(),
            Sources::Grow(by) => {
                let near = around(image, rect, stride, by as usize, |w| w != 0);
                let near = near.into_iter().enumerate();
                near.map(|(n, near)| {
                    let can = near && self.can_be_lit(rect, stride, n);
                    either(u8::from(can), Role::LIT, Role::NONE)
                })
                .collect()
            }
            Sources::Shell(by) => {
                let shell = outline(by as usize);
                let of = |(w, shell): (&u8, bool)| match (*w, shell) {
                    (0, _) => Role::NONE,
                    (_, true) => Role::LIT,
                    (_, false) => Role::WHITE,
                };
                wanted.iter().zip(shell).map(of).collect()
            }
        };
        if self.keep_wall > 0 {
            for (role, wall) in roles.iter_mut().zip(outline(self.keep_wall)) {
                *role = if wall { Role::WHITE } else { *role };
            }
        }
        roles
    }

    fn can_be_lit(&self, rect: &PixelRectangle, stride: usize, place: usize) -> bool {
        let row = rect.rows.start + (place / stride) as isize;
        let column = rect.columns.start + (place % stride) as isize;
        let [left, right, top, bottom] = self.image;
        (left..right).contains(&column) && (top..bottom).contains(&row)
    }
}

fn first_pixel(rect: &PixelRectangle) -> PixelRectangle {
    let first = |range: &std::ops::Range<isize>| range.start..range.start + 1;
    PixelRectangle { columns: first(&rect.columns), rows: first(&rect.rows) }
}

fn either(wanted: u8, yes: Role, no: Role) -> Role {
    if wanted == 0 { no } else { yes }
}

fn boundary_roles(
    layers: &[&LayerImages],
    layer: usize,
    rect: &PixelRectangle,
    stride: usize,
    wanted: &[u8],
) -> Vec<Role> {
    let near = layer.saturating_sub(REACH)..layers.len().min(layer + REACH + 1);
    let mut next_to_targets = vec![false; wanted.len()];
    for layer in &layers[near] {
        let near = around(&layer.targets, rect, stride, REACH, |target| target != 0);
        next_to_targets.iter_mut().zip(near).for_each(|(is, near)| *is |= near);
    }
    let mut targets = vec![0; wanted.len()];
    layers[layer].targets.copy(rect, 0, stride, &mut targets);
    let role = |((&wanted, &target), next)| match (wanted != 0, target != 0, next) {
        // 001 eq. 13: targets get the critical energy; eq. 11: boundary voxels get as little as
        // possible.
        (_, true, _) => Role::CURED,
        (false, _, true) => Role::DARK,
        _ => Role::NONE,
    };
    wanted.iter().zip(&targets).zip(next_to_targets).map(role).collect()
}

/// Returns for each pixel of a rectangle whether a pixel within `by` rows and columns has a value
/// for which `is` returns true. Outside the image, all is black.
fn around(
    image: &Tiled<u8>,
    rect: &PixelRectangle,
    stride: usize,
    by: usize,
    is: impl Fn(u8) -> bool,
) -> Vec<bool> {
    let wide = rect.grown(by);
    let (width, height) = (wide.width(), wide.height());
    let mut values = vec![0; width * height];
    image.copy(&wide, 0, width, &mut values);
    let mut along = vec![false; width * height];
    for (row, out) in values.chunks_exact(width).zip(along.chunks_exact_mut(width)) {
        for (column, _) in row.iter().enumerate().filter(|&(_, &value)| is(value)) {
            out[column.saturating_sub(by)..(column + by + 1).min(width)].fill(true);
        }
    }
    let mut near = vec![false; stride * rect.height()];
    for (row, out) in near.chunks_exact_mut(stride).enumerate() {
        // Along rows first, then across: a square is separable.
        for line in along.chunks_exact(width).skip(row).take(2 * by + 1) {
            out.iter_mut().zip(&line[by..width - by]).for_each(|(out, &is)| *out |= is);
        }
    }
    near
}
