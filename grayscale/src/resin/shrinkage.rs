//! The shrinkage of a resin as it cures.
//!
//! Each acrylate group that reacts removes the same volume, so the shrinkage is that
//! volume times the number of groups that react in a volume of suspension (002 eq. 47 to
//! 54). Shares are from 0 to 1 where 002 has per cent.

/// The volume by which a mole of acrylate groups shrinks as it reacts, `ΔV_C=C`, in cm³
/// (002 section 3.4.2.2, from its reference 118).
pub const SHRINKAGE_PER_GROUP: f64 = 22.5;

/// An acrylate monomer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Monomer {
    /// Acrylate groups of a molecule, `f`.
    pub functionality: f64,
    /// `M_m`, in g/mol.
    pub molar_mass: f64,
}

/// Returns the volume of a mole of monomer `M_m/ρ_m` in cm³, for a density in
/// g/cm³ (002 eq. 47).
pub fn molar_volume(monomer: Monomer, density: f64) -> f64 {
    monomer.molar_mass / density
}

/// Returns the groups in a volume of suspension, in mol/cm³: `f ρ_m/M_m (1 -
/// FL)` (002 eq. 49 for a volume `V` of one). `filler` is the filler's share of
/// the volume, 0 to 1.
pub fn groups(monomer: Monomer, density: f64, filler: f64) -> f64 {
    groups_of_mixture(&[(monomer, 1.0)], density, filler)
}

/// Returns the groups in a volume of a suspension of several monomers, in
/// mol/cm³: `Σ f_i χ_i/Σ M_i χ_i ρ_mix (1 - FL)` (the factor of 002 eq. 52). Each
/// monomer has its mole fraction `χ_i`; fractions that do not sum to one count
/// by their ratios.
pub fn groups_of_mixture(monomers: &[(Monomer, f64)], density: f64, filler: f64) -> f64 {
    let sum = |of: fn(&Monomer) -> f64| -> f64 {
        monomers.iter().map(|(monomer, moles)| of(monomer) * moles).sum()
    };
    sum(|m| m.functionality) / sum(|m| m.molar_mass) * density * (1.0 - filler)
}

/// Returns the share of its volume by which a suspension shrinks when the share
/// `conversion` (`α`) of its groups has reacted: `ΔV/V = ΔV_C=C α n` with the
/// `groups` `n` of a volume in mol/cm³ (002 eq. 51 to 53).
///
/// 002 prints 10.5 for `ΔV_C=C` in these, and in eq. 51 a volume `V` too much. The
/// 10.5 is the 10.05% of its eq. 48 with a digit lost: that is 22.5/223.76 (10.055%),
/// one group's shrinkage over the volume of a mole of its monomer, which already
/// holds the `ρ_m/M_m` that the equations multiply by once more. A share comes
/// out where moles of groups in a volume are multiplied by what a mole shrinks
/// by, 22.5 cm³.
pub fn volume_shrinkage(conversion: f64, groups: f64) -> f64 {
    SHRINKAGE_PER_GROUP * conversion * groups
}

/// The areas of the peaks of an infrared spectrum, in any unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PeakAreas {
    /// C=C stretching, at 1620 /cm.
    pub stretching: f64,
    /// C=C twisting, at 1410 /cm.
    pub twisting: f64,
    /// C=O stretching, at 1750 /cm, which curing leaves alone.
    pub carbonyl: f64,
}

impl PeakAreas {
    fn double_bonds(self) -> f64 {
        (self.stretching + self.twisting) / self.carbonyl
    }
}

/// Returns the share of double bonds that reacted between two spectra, `α` (002
/// eq. 54, which has it in per cent; eq. 50 to 53 need the share).
pub fn conversion(before: PeakAreas, after: PeakAreas) -> f64 {
    1.0 - after.double_bonds() / before.double_bonds()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The di-functional monomer of 002 eq. 47.
    const HDDA: Monomer = Monomer { functionality: 2.0, molar_mass: 226.0 };
    const DENSITY: f64 = 1.01;

    #[test]
    fn equations_47_and_48() {
        let volume = molar_volume(HDDA, DENSITY);
        assert!((volume - 223.762376).abs() < 1e-6, "{volume}");
        // 10.05% in eq. 48, rounded down.
        let first = 100.0 * SHRINKAGE_PER_GROUP / volume;
        assert!((first - 10.055310).abs() < 1e-6, "{first}");
        // The same as one group's share by eq. 51.
        let one = Monomer { functionality: 1.0, ..HDDA };
        let share = volume_shrinkage(1.0, groups(one, DENSITY, 0.0));
        assert!((100.0 * share - first).abs() < 1e-12);
    }

    #[test]
    fn equation_51() {
        // Two groups a molecule, 55 vol% of filler, worked out with bc:
        // 22.5 * 0.6 * 2 * 1.01/226 * 0.45.
        let share = volume_shrinkage(0.6, groups(HDDA, DENSITY, 0.55));
        assert!((share - 0.0542986726).abs() < 1e-10, "{share}");
        // In proportion to the conversion (002 below eq. 53).
        assert!((volume_shrinkage(0.3, groups(HDDA, DENSITY, 0.55)) - share / 2.0).abs() < 1e-15);
        assert_eq!(volume_shrinkage(0.0, groups(HDDA, DENSITY, 0.55)), 0.0);
        assert_eq!(groups(HDDA, DENSITY, 1.0), 0.0);
    }

    #[test]
    fn equations_52_and_53() {
        // A made-up tetra-functional monomer of 500 g/mol: 002 gives EPETA's mass
        // nowhere. By bc: 22.5 * 0.5 * (2*0.95 + 4*0.05)/(226*0.95 + 500*0.05)
        // * 1.02 * 0.45.
        let four = Monomer { functionality: 4.0, molar_mass: 500.0 };
        let mixture = [(HDDA, 0.95), (four, 0.05)];
        let share = volume_shrinkage(0.5, groups_of_mixture(&mixture, 1.02, 0.55));
        assert!((share - 0.0452393617).abs() < 1e-10, "{share}");
        // One monomer is no mixture, however it is written.
        let [a, b] = [
            groups_of_mixture(&[(HDDA, 0.25), (HDDA, 0.75)], DENSITY, 0.5),
            groups(HDDA, DENSITY, 0.5),
        ];
        assert!((a - b).abs() < 1e-15);
    }

    #[test]
    fn equation_54() {
        let spectrum =
            |stretching, twisting, carbonyl| PeakAreas { stretching, twisting, carbonyl };
        let before = spectrum(3.0, 1.0, 2.0);
        assert_eq!(conversion(before, before), 0.0);
        assert_eq!(conversion(before, spectrum(0.0, 0.0, 2.0)), 1.0);
        // 1 - (1.5/2.5)/(4/2).
        assert!((conversion(before, spectrum(1.0, 0.5, 2.5)) - 0.7).abs() < 1e-12);
        // A thicker sample has larger peaks, all of them.
        assert!((conversion(before, spectrum(2.0, 1.0, 5.0)) - 0.7).abs() < 1e-12);
    }
}
