//! The dose wanted at each voxel of a block, and the light allowed at its pixel.

use crate::blur::{LANES, Real};
use crate::solver::operator::Operator;

/// The size of a block of voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// The number of layers.
    pub layers: usize,
    /// The number of rows of each layer.
    pub rows: usize,
    /// The number of columns of each row: a multiple of 32.
    pub width: usize,
}

impl Shape {
    /// Returns the smallest shape with at least this many columns.
    pub fn holding(layers: usize, rows: usize, columns: usize) -> Self {
        Self { layers, rows, width: columns.next_multiple_of(LANES) }
    }

    /// Returns the number of voxels of a layer.
    pub fn plane(self) -> usize {
        self.rows * self.width
    }

    /// Returns the number of voxels of all layers.
    pub fn voxels(self) -> usize {
        self.layers * self.plane()
    }
}

/// The dose wanted at a voxel, and the light allowed at its pixel: a set of flags.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Role(u8);

impl Role {
    /// The dose does not matter, and the pixel has no light.
    pub const NONE: Self = Self(0);
    /// A dose below [`Terms::least`] costs [`Terms::short_price`] a unit.
    pub const CURED: Self = Self(1);
    /// A dose above [`Terms::most`] costs 1 a unit.
    pub const UNCURED: Self = Self(2);
    /// Every unit of the dose costs 1.
    pub const DARK: Self = Self(4);
    /// The pixel may have light, up to 1.
    pub const LIT: Self = Self(8);
    /// The pixel has light 1.
    pub const WHITE: Self = Self(16 | 8);
    /// The pixel may not have less light than [`Terms::least_light`].
    pub const NEVER_DIM: Self = Self(32 | 8);

    /// Returns both roles together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Returns the role of a pixel that has no light.
    #[must_use]
    pub fn without_light(self) -> Self {
        Self(self.0 & !(Self::WHITE.0 | Self::NEVER_DIM.0))
    }

    /// Returns the role of a voxel that later light may still cure, without light of its own.
    #[must_use]
    pub fn without_light_yet(self) -> Self {
        Self(self.0 & (Self::UNCURED.0 | Self::DARK.0))
    }

    /// Returns whether a role has all of another's flags.
    pub fn has(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    #[inline(always)]
    fn flag<T: Real>(self, bit: u8) -> T {
        T::of(f64::from(self.0 >> bit & 1))
    }
}

/// The cost of doses, and the least light of a pixel that may not be dim:
///
/// - a voxel that is to be cured costs (least - dose)₊ times the price,
/// - a voxel that is not to be cured costs (dose - most)₊,
/// - a voxel that is to be dark costs its dose (001 eq. 11).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Terms<T> {
    /// The dose that voxels to be cured should have.
    pub least: T,
    /// Their cost for each unit below it.
    pub short_price: T,
    /// The dose that voxels not to be cured may have.
    pub most: T,
    /// The light of a pixel that may not be dim.
    pub least_light: T,
}

/// The light of some layers that costs least.
#[derive(Clone, Debug)]
pub struct Problem<T> {
    /// The doses that light makes.
    pub operator: Operator<T>,
    /// The role of each voxel.
    pub roles: Vec<Role>,
    /// The dose that each voxel gets from other light.
    pub incoming: Vec<T>,
    /// The cost of doses.
    pub terms: Terms<T>,
}

/// The bounds of a number.
#[derive(Clone, Copy)]
pub(crate) struct Bounds<T> {
    pub(crate) low: T,
    pub(crate) high: T,
}

impl<T: Real> Terms<T> {
    /// Returns the bounds of a pixel's light.
    #[inline(always)]
    pub(crate) fn light_bounds(&self, role: Role) -> Bounds<T> {
        let white: T = role.flag(4);
        // White and never dim do not occur together, so the sum is one of them.
        Bounds { low: white + self.least_light * role.flag(5), high: role.flag(3) }
    }

    /// Returns the bounds of the price of a voxel's dose: the slopes of its cost.
    #[inline(always)]
    pub(crate) fn price_bounds(&self, role: Role) -> Bounds<T> {
        // Flags become factors of 0 and 1, so that loops over voxels have no branch and use the
        // widest instructions.
        let dark: T = role.flag(2);
        Bounds { low: dark - self.short_price * role.flag(0), high: dark + role.flag(1) }
    }

    /// Returns the dose at which the slope of a voxel's cost changes.
    #[inline(always)]
    pub(crate) fn aim(&self, role: Role) -> T {
        // A dose that only counts as darkness has its kink at zero, where doses begin.
        self.least * role.flag(0) + self.most * role.flag(1)
    }

    /// Returns the cost of a voxel's dose.
    #[inline(always)]
    pub(crate) fn cost(&self, role: Role, dose: T) -> f64 {
        let (bounds, beyond) = (self.price_bounds(role), (dose - self.aim(role)).f64());
        // A convex cost with one kink is the larger of its two lines through the kink, and their
        // slopes are the bounds of the price.
        (beyond * bounds.low.f64()).max(beyond * bounds.high.f64())
    }
}

impl<T: Real> Problem<T> {
    /// Returns the cost of doses, of all voxels or of the first ones.
    pub fn cost(&self, doses: &[T]) -> f64 {
        let voxels = doses.iter().zip(self.roles.iter().zip(&self.incoming));
        voxels.map(|(&dose, (&role, &from))| self.terms.cost(role, dose + from)).sum()
    }

    /// Returns a lower bound on the cost of any light, from any prices within their bounds and the
    /// cost of light at these prices, at least of the layers that have any.
    pub fn bound(&self, prices: &[T], of_light: &[T]) -> f64 {
        // Weak duality: for any price within the slopes, price (dose - aim) is at most the cost.
        // Summed over all voxels, doses become light times its cost, and each pixel alone takes the
        // end with the least cost.
        let doses = prices.iter().zip(self.roles.iter().zip(&self.incoming));
        let of_doses = |(&price, (&role, &incoming)): (&T, (&Role, &T))| {
            price.f64() * (incoming.f64() - self.terms.aim(role).f64())
        };
        let of_pixel = |(&of_light, &role): (&T, &Role)| {
            let (light, of_light) = (self.terms.light_bounds(role), of_light.f64());
            (of_light * light.low.f64()).min(of_light * light.high.f64())
        };
        let of_light: f64 = of_light.iter().zip(&self.roles).map(of_pixel).sum();
        of_light + doses.map(of_doses).sum::<f64>()
    }

    /// Leaves out the layers below all light whose doses cost nothing, however bright the light
    /// is. `brightest` has the doses of the brightest light.
    pub(crate) fn leave_out_below(&mut self, brightest: &[T]) {
        let costs = |voxel: &usize| {
            let role = self.roles[*voxel];
            // No pixel makes a dose smaller: the brightest light makes the largest doses.
            let dose = brightest[*voxel] + self.incoming[*voxel];
            role.has(Role::CURED) || self.terms.cost(role, dose) > 0.0
        };
        let lit = self.operator.lit_voxels();
        let last = (lit..self.roles.len()).rev().find(costs);
        let voxels = last.map_or(lit, |voxel| voxel + 1);
        self.operator.keep_layers(voxels.div_ceil(self.operator.plane().max(1)));
        self.roles.truncate(self.operator.voxels());
        self.incoming.truncate(self.operator.voxels());
    }

    /// Returns the light of all pixels at their upper bounds.
    pub fn brightest(&self) -> Vec<T> {
        self.roles.iter().map(|&role| self.terms.light_bounds(role).high).collect()
    }
}
