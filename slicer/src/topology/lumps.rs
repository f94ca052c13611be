//! Combines outer shells with their voids into lumps.

use crate::topology::{Mass, ShellReport};

/// A piece of material: the inside of an outer shell, without its voids.
#[derive(Clone, Debug, PartialEq)]
pub struct Lump {
    /// Its outer shell.
    pub outer: u32,
    /// The shells of its voids, in ascending order.
    pub voids: Vec<u32>,
    /// Its mass: positive, whichever way its shells face; `None` if the voids leave nothing.
    pub mass: Option<Mass>,
}

/// Returns, for each shell, whether it is a void: within an odd number of other shells. Shells that
/// cross may be around each other; such a ring counts as outside.
pub(crate) fn voids(around: &[Option<u32>]) -> Vec<bool> {
    let mut known: Vec<Option<bool>> = vec![None; around.len()];
    let mut way = Vec::new();
    for shell in 0..around.len() {
        let mut at = shell;
        let mut is_void = loop {
            if let Some(is_void) = known[at] {
                break is_void;
            }
            // A walk that returns here, on a ring, finds this value.
            known[at] = Some(true);
            way.push(at);
            match around[at] {
                Some(outer) => at = outer as usize,
                // The loop below turns this over: an outermost shell is not a void.
                None => break true,
            }
        };
        while let Some(inner) = way.pop() {
            is_void = !is_void;
            known[inner] = Some(is_void);
        }
    }
    known.into_iter().map(Option::unwrap_or_default).collect()
}

/// Returns the lumps that shells form.
pub(crate) fn lumps(shells: &[ShellReport]) -> Vec<Lump> {
    let closed = || (0..).zip(shells).filter(|(_, shell)| shell.mass.is_some());
    let outer = closed().filter(|(_, shell)| !shell.is_void);
    let mut lumps: Vec<Lump> =
        outer.map(|(outer, _)| Lump { outer, voids: Vec::new(), mass: None }).collect();
    for (number, void) in closed().filter(|(_, shell)| shell.is_void) {
        // Lumps are in the order of their outer shells.
        if let Some(Ok(at)) =
            void.within.map(|outer| lumps.binary_search_by_key(&outer, |lump| lump.outer))
        {
            lumps[at].voids.push(number);
        }
    }
    // Whichever way its facets face, an outer shell adds and a void removes.
    let signed = |shell: u32, sign: f64| {
        let mass = shells[shell as usize].mass.as_deref().copied()?;
        Some(mass.times(sign * mass.volume_mm3.signum()))
    };
    for lump in &mut lumps {
        let voids = lump.voids.iter().map(|&void| signed(void, -1.0));
        let masses: Vec<Mass> =
            std::iter::once(signed(lump.outer, 1.0)).chain(voids).flatten().collect();
        lump.mass = Mass::together(masses.iter().copied());
    }
    lumps
}
