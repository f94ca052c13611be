//! Compares what two stacks have at each height.

use anyhow::anyhow;
use lamp_offset::beyond_tolerance;
use lamp_stack::{
    Difference, Image, IndexedStack, Mask, MemorySize, Op, Overlaid, Page, Pairing, Section,
    WhiteBox, largest_boxes, map_in_order, shift_between,
};

use crate::exit::Exit;
use crate::streams::failed_at;
use crate::terminal::progress::Progress;

/// The most boxes that are kept of a section.
const MOST_BOXES: usize = 100;

/// A stack and its name.
pub(super) type NamedStack<'a> = (&'a IndexedStack, &'a str);

/// Differences of two stacks at one height.
pub(super) struct SectionDifference {
    pub(super) section: Section,
    /// The number of pixels that are brighter in the second stack, and in the first.
    pub(super) added: u64,
    pub(super) missing: u64,
    /// The number of pixels that differ within the tolerance.
    pub(super) forgiven: u64,
    /// The rectangles around what differs, in pixels of the first stack's layer, or of the second's
    /// if it is alone; largest first.
    pub(super) boxes: Vec<DifferenceBox>,
    /// The number of all boxes.
    pub(super) box_count: u64,
}

/// A rectangle around pixels that differ and touch: first column and the one after the last, first
/// row and the one after the last.
pub(super) struct DifferenceBox {
    pub(super) columns: [i64; 2],
    pub(super) rows: [i64; 2],
    pub(super) pixels: u64,
}

impl SectionDifference {
    pub(super) fn pixels(&self) -> u64 {
        self.added + self.missing
    }

    /// Returns whether the stacks differ there: in pixels, or in that only one has a layer.
    pub(super) fn is_told(&self) -> bool {
        self.pixels() > 0 || self.section.a.is_none() || self.section.b.is_none()
    }
}

/// The two pages of a section, not decoded yet.
struct PagePair {
    section: Section,
    a: Option<Page>,
    b: Option<Page>,
}

impl MemorySize for PagePair {
    fn bytes(&self) -> usize {
        [&self.a, &self.b].into_iter().flatten().map(MemorySize::bytes).sum()
    }
}

/// Compares all sections, and returns sections that differ or in which something was forgiven.
pub(super) fn walk(
    stacks: [NamedStack<'_>; 2],
    pairing: &Pairing,
    tolerance: [f64; 2],
    progress: &Progress,
) -> Result<Vec<SectionDifference>, Exit> {
    let pages = pairing.sections().iter().map(|section| {
        let [a, b] = stacks;
        Ok(PagePair { section: section.clone(), a: page(a, section.a)?, b: page(b, section.b)? })
    });
    let compared = map_in_order(pages, |pages: PagePair| {
        let found = of_pages(stacks, pages, tolerance);
        progress.layer_done();
        found
    });
    let is_kept = |found: &SectionDifference| found.is_told() || found.forgiven > 0;
    compared.filter(|found| found.as_ref().map_or(true, is_kept)).collect()
}

fn page((stack, name): NamedStack<'_>, position: Option<usize>) -> Result<Option<Page>, Exit> {
    let page = position.map(|position| stack.page(position)).transpose();
    page.map_err(|error| failed_at(name.to_owned(), error))
}

/// Compares two pages. Pages of one coded image are decoded once, to see that they are whole.
fn of_pages(
    stacks: [NamedStack<'_>; 2],
    PagePair { section, a, b }: PagePair,
    tolerance: [f64; 2],
) -> Result<SectionDifference, Exit> {
    // Before decoding: images that cannot be compared cost nothing.
    let shift = shift_of(stacks, &section)?;
    let is_one_image =
        shift == [0, 0] && a.as_ref().zip(b.as_ref()).is_some_and(|(a, b)| a.is_coded_as(b));
    let b = if is_one_image { None } else { b };
    let decoded = |page: Option<Page>, (_, name): NamedStack<'_>| {
        let layer = page.map(Page::decode).transpose();
        let layer = layer.map_err(|error| failed_at(name.to_owned(), error))?;
        Ok::<_, Exit>(layer.map(|layer| layer.image.into_image()))
    };
    let [a, b] = [decoded(a, stacks[0])?, decoded(b, stacks[1])?];
    if is_one_image {
        let none = (Vec::new(), 0);
        return Ok(counted(section, 0, [0, 0], none, [0, 0]));
    }
    let too_many = || {
        let layer = section.a.map(|a| stacks[0].0.headers()[a].info.name()).unwrap_or_default();
        Exit::Failed(anyhow!("{layer}: the images differ in more runs than an image may have"))
    };
    let images = Images::new(a, b, shift, tolerance);
    let Compared { overlaid, all, left } = images.compared().ok_or_else(too_many)?;
    let pixels =
        |difference: &Difference| [&difference.added, &difference.missing].map(Mask::white_pixels);
    let told = pixels(&left);
    let forgiven = pixels(&all).iter().sum::<u64>() - told.iter().sum::<u64>();
    let differing = left.added.combined(Op::Union, &left.missing);
    let boxes = largest_boxes(&differing.ok_or_else(too_many)?, MOST_BOXES);
    // Boxes are on the frame of both images. Its corner brings them to the first image's pixels.
    Ok(counted(section, forgiven, told, boxes, [overlaid.frame.left, overlaid.frame.top]))
}

fn counted(
    section: Section,
    forgiven: u64,
    [added, missing]: [u64; 2],
    (boxes, box_count): (Vec<WhiteBox>, u64),
    [left, top]: [i64; 2],
) -> SectionDifference {
    let of_box = |each: WhiteBox| DifferenceBox {
        columns: [each.columns.start, each.columns.end].map(|column| left + i64::from(column)),
        rows: [each.rows.start, each.rows.end].map(|row| top + i64::from(row)),
        pixels: each.pixels,
    };
    let boxes = boxes.into_iter().map(of_box).collect();
    SectionDifference { section, added, missing, forgiven, boxes, box_count }
}

/// Two images to compare.
pub(super) struct Images {
    a: Image,
    b: Image,
    shift: [i64; 2],
    tolerance: [f64; 2],
}

/// Two images on one frame, and where they differ.
pub(super) struct Compared<'a> {
    pub(super) overlaid: Overlaid<'a>,
    pub(super) all: Difference,
    /// The difference that is not forgiven.
    pub(super) left: Difference,
}

impl Images {
    /// Takes a section's images. One that is missing is black, and no edge of it is near.
    pub(super) fn new(
        a: Option<Image>,
        b: Option<Image>,
        shift: [i64; 2],
        tolerance: [f64; 2],
    ) -> Self {
        let black = |other: &Image| Image::Mask(Mask::black(other.width(), other.height()));
        let (a, b, tolerance) = match (a, b) {
            (Some(a), Some(b)) => (a, b, tolerance),
            (Some(a), None) => {
                let b = black(&a);
                (a, b, [0.0; 2])
            }
            (None, Some(b)) => (black(&b), b, [0.0; 2]),
            (None, None) => unreachable!("a section has a layer"),
        };
        Self { a, b, shift, tolerance }
    }

    /// Compares them. `None` if there are too many runs.
    pub(super) fn compared(&self) -> Option<Compared<'_>> {
        let overlaid = Overlaid::new(&self.a, &self.b, self.shift);
        let all = overlaid.difference()?;
        let left = if self.tolerance[0] > 0.0 {
            beyond_tolerance(&overlaid.a, &overlaid.b, &all, self.tolerance)?
        } else {
            all.clone()
        };
        Some(Compared { overlaid, all, left })
    }
}

/// Returns how far the second stack's image begins from the first's.
pub(super) fn shift_of(stacks: [NamedStack<'_>; 2], section: &Section) -> Result<[i64; 2], Exit> {
    let header = |(stack, _): NamedStack<'_>, position: Option<usize>| {
        position.map(|position| stack.headers()[position].clone())
    };
    let pages = header(stacks[0], section.a).zip(header(stacks[1], section.b));
    let shift = pages.map(|(a, b)| shift_between(&a, &b)).transpose();
    let shift = shift.map_err(|error| {
        Exit::Failed(anyhow::Error::new(error)).at(format!("{} and {}", stacks[0].1, stacks[1].1))
    });
    Ok(shift?.unwrap_or_default())
}
