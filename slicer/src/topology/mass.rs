//! Computes the volume, center of mass and inertia of a closed mesh.

use lamp_brep::vector::{Vec3, along, cross, dot, scale, sub};

/// The volume that a closed shell encloses, and its distribution, at density 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mass {
    /// The volume in mm³: positive if the facets face outward.
    pub volume_mm3: f64,
    /// The center of mass.
    pub centre_mm: [f64; 3],
    /// The tensor of inertia about the center of mass, in mm⁵. Multiplied by a density in kg/mm³,
    /// it is in kg mm².
    pub inertia_mm5: [[f64; 3]; 3],
}

/// Sums over facets, about a point near them: each facet represents the tetrahedron between it and
/// this point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moments {
    about: Vec3,
    /// Six times the volume, and its first and second moments times 24 and 120.
    zeroth: f64,
    first: Vec3,
    /// The second moments of xx, yy, zz, xy, yz and zx.
    second: [f64; 6],
}

impl Moments {
    pub(crate) fn about(about: Vec3) -> Self {
        Self { about, zeroth: 0.0, first: [0.0; 3], second: [0.0; 6] }
    }

    #[inline]
    pub(crate) fn add(&mut self, facet: [Vec3; 3]) {
        let [a, b, c] = facet.map(|point| sub(point, self.about));
        let six = dot(a, cross(b, c));
        let sum: Vec3 = std::array::from_fn(|k| a[k] + b[k] + c[k]);
        self.zeroth += six;
        self.first = along(self.first, sum, six);
        for (k, second) in self.second.iter_mut().enumerate() {
            // The first three are the squares, the others xy, yz and zx.
            let (i, j) = (k % 3, (k + k / 3) % 3);
            // The integral of x_i x_j over a tetrahedron with a corner at the origin, times 120.
            *second += six * (a[i] * a[j] + b[i] * b[j] + c[i] * c[j] + sum[i] * sum[j]);
        }
    }

    /// Returns the mass, if its numbers are finite.
    pub(crate) fn mass(&self) -> Option<Mass> {
        let volume = self.zeroth / 6.0;
        // Without a volume, the only center is the place of the facets.
        let per = if self.zeroth == 0.0 { 0.0 } else { 1.0 / (4.0 * self.zeroth) };
        let centre = scale(self.first, per);
        let about_centre = |k: usize| {
            let (i, j) = (k % 3, (k + k / 3) % 3);
            // Steiner's theorem leads from this point to the center of mass.
            self.second[k] / 120.0 - volume * centre[i] * centre[j]
        };
        let [xx, yy, zz, xy, yz, zx]: [f64; 6] = std::array::from_fn(about_centre);
        let inertia_mm5 = [[yy + zz, -xy, -zx], [-xy, zz + xx, -yz], [-zx, -yz, xx + yy]];
        let centre_mm = along(self.about, centre, 1.0);
        let mass = Mass { volume_mm3: volume, centre_mm, inertia_mm5 };
        let mut numbers = inertia_mm5.iter().flatten().chain(&centre_mm).chain([&volume]);
        numbers.all(|number| number.is_finite()).then_some(mass)
    }
}

impl Mass {
    /// Returns the mass at another density; -1 for missing material.
    pub(crate) fn times(self, density: f64) -> Self {
        Self {
            volume_mm3: density * self.volume_mm3,
            inertia_mm5: self.inertia_mm5.map(|row| scale(row, density)),
            ..self
        }
    }

    /// Returns the mass of several shells together, such as a solid and its voids; `None` if their
    /// volumes cancel.
    pub fn together(masses: impl IntoIterator<Item = Self> + Clone) -> Option<Self> {
        let volume_mm3: f64 = masses.clone().into_iter().map(|mass| mass.volume_mm3).sum();
        let mut centre_mm = [0.0; 3];
        // If volumes cancel, numbers are not finite here, and dropped at the end.
        for mass in masses.clone() {
            centre_mm = along(centre_mm, mass.centre_mm, mass.volume_mm3 / volume_mm3);
        }
        let mut inertia_mm5 = [[0.0; 3]; 3];
        for mass in masses {
            let off = sub(mass.centre_mm, centre_mm);
            for i in 0..3 {
                for j in 0..3 {
                    let square = if i == j { dot(off, off) } else { 0.0 };
                    let steiner = mass.volume_mm3 * (square - off[i] * off[j]);
                    inertia_mm5[i][j] += mass.inertia_mm5[i][j] + steiner;
                }
            }
        }
        (volume_mm3 != 0.0).then_some(Self { volume_mm3, centre_mm, inertia_mm5 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::facet::Facet;
    use crate::topology::testing::{block, turned};

    fn mass_of(facets: &[Facet], about: Vec3) -> Mass {
        let mut moments = Moments::about(about);
        for facet in facets {
            moments.add(facet.map(|corner| corner.map(f64::from)));
        }
        moments.mass().unwrap()
    }

    #[test]
    fn a_block_has_the_moments_of_the_closed_form() {
        let facets = block([1.0, 2.0, 3.0], [3.0, 5.0, 9.0]);
        for about in [[0.0; 3], [100.0, -50.0, 7.0]] {
            let mass = mass_of(&facets, about);
            assert!((mass.volume_mm3 - 36.0).abs() < 1e-9);
            assert!(sub(mass.centre_mm, [2.0, 3.5, 6.0]).iter().all(|d| d.abs() < 1e-9));
            let [x, y, z] = [4.0, 9.0, 36.0].map(|side_squared: f64| 3.0 * side_squared);
            let expected = [[y + z, 0.0, 0.0], [0.0, z + x, 0.0], [0.0, 0.0, x + y]];
            let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-6;
            assert!(mass.inertia_mm5.iter().flatten().zip(expected.iter().flatten()).all(close));
        }
    }

    #[test]
    fn a_slanted_tetrahedron_has_products_of_inertia() {
        let [o, x, y, z] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0f32]];
        let mass = mass_of(&[[o, y, x], [o, x, z], [o, z, y], [x, y, z]], [0.3; 3]);
        assert!((mass.volume_mm3 - 1.0).abs() < 1e-12);
        // About a corner, the product of a and b is V a b / 20; about the center less V a b / 16.
        for (i, j, product) in [(0, 1, 2.0), (1, 2, 6.0), (0, 2, 3.0)] {
            let expected = -product * (1.0 / 20.0 - 1.0 / 16.0);
            assert!((mass.inertia_mm5[i][j] - expected).abs() < 1e-12);
            assert_eq!(mass.inertia_mm5[i][j], mass.inertia_mm5[j][i]);
        }
    }

    #[test]
    fn a_void_takes_away() {
        let outer = mass_of(&block([0.0; 3], [4.0; 3]), [0.0; 3]);
        let void = mass_of(&turned(&block([0.0; 3], [2.0; 3])), [9.0; 3]);
        let both = Mass::together([outer, void]).unwrap();
        let all: Vec<Facet> =
            [block([0.0; 3], [4.0; 3]), turned(&block([0.0; 3], [2.0; 3]))].concat();
        let expected = mass_of(&all, [1.0; 3]);
        assert!((both.volume_mm3 - 56.0).abs() < 1e-9);
        let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-9;
        assert!(both.centre_mm.iter().zip(&expected.centre_mm).all(close));
        let inertia = both.inertia_mm5.iter().flatten();
        assert!(inertia.zip(expected.inertia_mm5.iter().flatten()).all(close));
        assert_eq!(Mass::together([outer, Mass { volume_mm3: -64.0, ..outer }]), None);
    }
}
