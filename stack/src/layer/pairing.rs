//! Which layers of two stacks belong together, and how their pixels lie on each other.

use std::ops::Range;

use thiserror::Error;

use crate::codec::tiff::PageHeader;
use crate::pitch::Pitch;

/// Heights this near to each other in micrometers are the same: pages state whole nanometers.
const SAME_HEIGHT_UM: f64 = 0.002;
/// Images this near to whole pixels of each other, in pixels, lie on them: origins are rounded.
const SAME_PIXEL: f64 = 0.01;

/// Which layers of two stacks, `a` and `b`, belong together: by their heights if every page of both
/// states its height and thickness, otherwise by their indices.
///
/// ```
/// use lamp_stack::{IndexedStack, Pairing};
/// # use lamp_stack::{Destination, Format, Layer, Mask, PageInfo, StackError, write_stack};
/// # let folder = tempfile::tempdir()?;
/// # let write = |name: &str, thickness: f64, layers: u32| {
/// #     let path = folder.path().join(name);
/// #     let layer = |index: u32| Layer {
/// #         info: PageInfo { index, z_um: Some(f64::from(index) * thickness), thickness_um: Some(thickness), ..PageInfo::default() },
/// #         pitch: None,
/// #         image: Mask::black(4, 4).into(),
/// #     };
/// #     write_stack((0..layers).map(layer).map(Ok::<_, StackError>), Destination::File(path.clone()), Format::Big)?;
/// #     IndexedStack::open(&path)
/// # };
/// // Layers of 100 um, and the same part in layers of 50 um.
/// let (a, b) = (write("a.tif", 100.0, 2)?, write("b.tif", 50.0, 4)?);
/// let pairing = Pairing::of(a.headers(), b.headers());
/// assert!(pairing.is_by_height());
/// assert_eq!([0, 1].map(|layer| pairing.partner(layer)), [Some(1), Some(3)]);
/// assert_eq!(pairing.sections().len(), 4);
/// # Ok::<(), StackError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Pairing {
    by_height: bool,
    sections: Vec<Section>,
    partners: Vec<Option<usize>>,
}

/// The layers of two stacks at one height, or under one index: a layer of each, or of one of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Section {
    /// The heights of its bottom and top in micrometers, if layers are paired by height.
    pub heights_um: Option<[f64; 2]>,
    /// The position of the first stack's layer, if it has one there.
    pub a: Option<usize>,
    /// The position of the second stack's layer, if it has one there.
    pub b: Option<usize>,
}

/// A reason why the pixels of two layers cannot be compared.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PairingError {
    /// The resolutions differ.
    #[error("{layer} has {a:#}, and the other stack has {b:#} there")]
    Resolutions {
        /// The first stack's layer.
        layer: String,
        /// Its resolution.
        a: Pitch,
        /// The resolution of the other stack's layer.
        b: Pitch,
    },
    /// The images lie parts of pixels apart.
    #[error(
        "{layer}: the other image begins {:.3} columns and {:.3} rows away, so the pixels of the two images do not line up",
        shift[0], shift[1]
    )]
    PartPixels {
        /// The first stack's layer.
        layer: String,
        /// How far the other image begins to the right and below, in pixels.
        shift: [f64; 2],
    },
    /// The images do not meet.
    #[error(
        "{layer}: the other image begins {:.0} columns and {:.0} rows away, so the images do not overlap",
        shift[0], shift[1]
    )]
    Apart {
        /// The first stack's layer.
        layer: String,
        /// How far the other image begins to the right and below, in pixels.
        shift: [f64; 2],
    },
}

impl Pairing {
    /// Pairs the layers of two stacks, given the headers of their pages.
    pub fn of(a: &[PageHeader], b: &[PageHeader]) -> Self {
        match (heights(a), heights(b)) {
            (Some(a), Some(b)) => Self {
                by_height: true,
                sections: sections_by_height(&a, &b),
                partners: a.iter().map(|&layer| layer_at_middle(layer, &b)).collect(),
            },
            _ => {
                let sections = sections_by_index(a, b);
                let of_a = sections.iter().filter(|section| section.a.is_some());
                let partners = of_a.map(|section| section.b).collect();
                Self { by_height: false, sections, partners }
            }
        }
    }

    /// Returns whether layers are paired by their heights, not by their indices.
    pub fn is_by_height(&self) -> bool {
        self.by_height
    }

    /// Returns the position in `b` of the layer that belongs to the one at `position` in `a`, if
    /// there is one: by height, the layer that holds its middle.
    pub fn partner(&self, position: usize) -> Option<usize> {
        self.partners.get(position).copied().flatten()
    }

    /// Returns the sections of both stacks from the bottom up. By height, each range of heights in
    /// which both are constant is a section.
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }
}

/// Returns how many columns to the right and rows below the first pixel of `a` the first pixel of
/// `b` lies. Images of pages that do not state both origin and resolution begin at one place.
///
/// # Errors
/// Returns an error if the resolutions differ, if pixels lie on parts of pixels, or if the images
/// do not meet.
pub fn shift_between(a: &PageHeader, b: &PageHeader) -> Result<[i64; 2], PairingError> {
    let layer = || a.info.name();
    let Some((pitch, other)) = a.pitch.zip(b.pitch) else { return Ok([0, 0]) };
    if pitch != other {
        return Err(PairingError::Resolutions { layer: layer(), a: pitch, b: other });
    }
    let Some(([ax, ay], [bx, by])) = a.info.origin_mm.zip(b.info.origin_mm) else {
        return Ok([0, 0]);
    };
    // Rows count down and y goes up, so the difference along y turns its sign.
    let [pitch_x, pitch_y] = pitch.mm();
    let shift = [(bx - ax) / pitch_x, (ay - by) / pitch_y];
    let sides = |side: usize| [-f64::from(b.size[side]), f64::from(a.size[side])];
    let meets = |side: usize| {
        let [least, most] = sides(side);
        shift[side] >= least - SAME_PIXEL && shift[side] <= most + SAME_PIXEL
    };
    if !(meets(0) && meets(1)) {
        return Err(PairingError::Apart { layer: layer(), shift });
    }
    if shift.iter().any(|shift| (shift - shift.round()).abs() > SAME_PIXEL) {
        return Err(PairingError::PartPixels { layer: layer(), shift });
    }
    Ok(shift.map(|shift| shift.round() as i64))
}

/// Returns the bottoms and tops of all layers in micrometers, if all have them and they go up.
fn heights(pages: &[PageHeader]) -> Option<Vec<[f64; 2]>> {
    let of_page = |page: &PageHeader| {
        let (bottom, thickness) = page.info.z_um.zip(page.info.thickness_um)?;
        let usable =
            // A thinner layer would vanish between heights that count as the same.
            bottom.is_finite() && thickness.is_finite() && thickness > 2.0 * SAME_HEIGHT_UM;
        usable.then_some([bottom, bottom + thickness])
    };
    let heights: Vec<_> = pages.iter().map(of_page).collect::<Option<_>>()?;
    let goes_up = heights.windows(2).all(|two| two[1][0] >= two[0][1] - SAME_HEIGHT_UM);
    goes_up.then_some(heights)
}

/// Returns the layer that holds the middle of another one.
fn layer_at_middle([bottom, top]: [f64; 2], layers: &[[f64; 2]]) -> Option<usize> {
    let middle = f64::midpoint(bottom, top);
    let next = layers.partition_point(|layer| layer[1] <= middle);
    layers.get(next).filter(|layer| layer[0] <= middle).map(|_| next)
}

fn sections_by_height(a: &[[f64; 2]], b: &[[f64; 2]]) -> Vec<Section> {
    let mut sections = Vec::new();
    let mut at = f64::NEG_INFINITY;
    let [mut i, mut j] = [0, 0];
    loop {
        let passed = |layer: Option<&[f64; 2]>| layer.is_some_and(|l| l[1] <= at + SAME_HEIGHT_UM);
        while passed(a.get(i)) {
            i += 1;
        }
        while passed(b.get(j)) {
            j += 1;
        }
        let next = [a.get(i), b.get(j)];
        let bottoms = next.iter().flatten().map(|layer| layer[0].max(at));
        let Some(bottom) = bottoms.reduce(f64::min) else { return sections };
        let holds = |layer: &&[f64; 2]| layer[0] <= bottom + SAME_HEIGHT_UM;
        // A section ends at the top of a layer that holds it, or at the bottom of one above.
        let ends = next.iter().flatten().map(|layer| layer[usize::from(holds(layer))]);
        let top = ends.reduce(f64::min).expect("one of both stacks goes on");
        sections.push(Section {
            heights_um: Some([bottom, top]),
            a: next[0].filter(holds).map(|_| i),
            b: next[1].filter(holds).map(|_| j),
        });
        at = top;
    }
}

/// Pairs layers of one index; indices go up in every stack.
fn sections_by_index(a: &[PageHeader], b: &[PageHeader]) -> Vec<Section> {
    let mut sections = Vec::new();
    let (mut of_a, mut of_b): (Range<usize>, Range<usize>) = (0..a.len(), 0..b.len());
    loop {
        let index_a = a[of_a.clone()].first().map(|page| page.info.index);
        let index_b = b[of_b.clone()].first().map(|page| page.info.index);
        let Some(index) = [index_a, index_b].into_iter().flatten().min() else { return sections };
        sections.push(Section {
            heights_um: None,
            a: if index_a == Some(index) { of_a.next() } else { None },
            b: if index_b == Some(index) { of_b.next() } else { None },
        });
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::codec::compression::Compression;
    use crate::layer::page_info::PageInfo;

    fn page(info: PageInfo, dpi: Option<f64>) -> PageHeader {
        PageHeader {
            info,
            pitch: dpi.and_then(Pitch::of_dpi),
            size: [100, 50],
            gray: false,
            compression: Compression::G4,
            data_bytes: 0,
            exposed_px: None,
            pages: None,
        }
    }

    fn at_heights(heights: &[[f64; 2]]) -> Vec<PageHeader> {
        let page = |(index, &[bottom, top]): (u32, &[f64; 2])| {
            let (z_um, thickness_um) = (Some(bottom), Some(top - bottom));
            page(PageInfo { index, z_um, thickness_um, ..PageInfo::default() }, None)
        };
        (0..).zip(heights).map(page).collect()
    }

    fn with_origin(x: f64, y: f64, dpi: f64) -> PageHeader {
        page(PageInfo { origin_mm: Some([x, y]), ..PageInfo::default() }, Some(dpi))
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn every_height_is_in_one_section_with_the_layers_that_hold_it(
            steps in [prop::collection::vec((0u32..3, 1u32..9), 1..12), prop::collection::vec((0u32..3, 1u32..9), 1..12)],
        ) {
            let [a, b] = steps.map(|steps| {
                let mut at = 0.0;
                let layers = steps.into_iter().map(|(gap, thick)| {
                    let bottom = at + f64::from(gap);
                    at = bottom + f64::from(thick);
                    [bottom, at]
                });
                layers.collect::<Vec<_>>()
            });
            let pairing = Pairing::of(&at_heights(&a), &at_heights(&b));
            prop_assert!(pairing.is_by_height());
            let holding = |layers: &[[f64; 2]], z: f64| layers.iter().position(|l| l[0] < z && z < l[1]);
            for z in (0..120).map(|z| f64::from(z) + 0.5) {
                let mut here = pairing.sections().iter().filter(|section| {
                    section.heights_um.is_some_and(|[bottom, top]| bottom < z && z < top)
                });
                let found = here.next().map_or((None, None), |section| (section.a, section.b));
                prop_assert_eq!(found, (holding(&a, z), holding(&b, z)));
                prop_assert!(here.next().is_none());
            }
        }
    }

    #[test]
    fn heights_that_round_to_one_nanometre_are_the_same() {
        let a = at_heights(&[[0.0, 33.333], [33.333, 66.667]]);
        let b = at_heights(&[[0.0, 33.334], [33.334, 66.666]]);
        let pairing = Pairing::of(&a, &b);
        let paired: Vec<_> = pairing.sections().iter().map(|each| (each.a, each.b)).collect();
        assert_eq!(paired, [(Some(0), Some(0)), (Some(1), Some(1))]);
    }

    #[test]
    fn layers_without_usable_heights_go_by_their_indices() {
        let info = |index| PageInfo { index, ..PageInfo::default() };
        let a: Vec<_> = [0, 1, 4].map(|index| page(info(index), None)).into();
        let b = at_heights(&[[0.0, 1.0], [1.0, 2.0], [2.0, f64::INFINITY]]);
        let pairing = Pairing::of(&a, &b);
        let paired: Vec<_> = pairing.sections().iter().map(|each| (each.a, each.b)).collect();
        let wanted = [(Some(0), Some(0)), (Some(1), Some(1)), (None, Some(2)), (Some(2), None)];
        assert_eq!(paired, wanted);
        assert_eq!([0, 1, 2, 3].map(|a| pairing.partner(a)), [Some(0), Some(1), None, None]);
        // Layers that overlap have no order of heights.
        let b = at_heights(&[[0.0, 3.0], [2.0, 4.0]]);
        assert!(!Pairing::of(&b, &b).is_by_height());
    }

    #[test]
    fn images_lie_on_each_other_by_whole_pixels() {
        let a = with_origin(1.0, 2.0, 254.0);
        assert_eq!(shift_between(&a, &with_origin(1.3, 1.5, 254.0)), Ok([3, 5]));
        assert_eq!(shift_between(&a, &with_origin(0.9, 2.1, 254.0)), Ok([-1, -1]));
        assert_eq!(shift_between(&a, &page(PageInfo::default(), None)), Ok([0, 0]));
        let wrong = |x, y, dpi| shift_between(&a, &with_origin(x, y, dpi)).unwrap_err();
        assert!(matches!(wrong(1.0, 2.0, 255.0), PairingError::Resolutions { .. }));
        assert!(matches!(wrong(1.05, 2.0, 254.0), PairingError::PartPixels { .. }));
        assert!(matches!(wrong(1e9, 2.0, 254.0), PairingError::Apart { .. }));
        assert!(matches!(wrong(f64::NAN, 2.0, 254.0), PairingError::Apart { .. }));
    }
}
