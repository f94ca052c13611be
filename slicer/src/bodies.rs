//! Tells inside from outside of a part that has several bodies.
//!
//! The bodies of a file are one product, so they unite: each is even-odd by itself, and a
//! point is inside the file where it is inside one of them. Files still cut each other
//! out, as a core cuts its mould.

use std::collections::{BTreeMap, HashMap};

use crate::table::Fill;

/// How the bodies of one file join: those of a STEP file, or the items of a 3MF.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bodies {
    /// What lies in one of them is inside.
    #[default]
    Unite,
    /// What lies in two of them cancels out, as it does between files.
    Xor,
}

lamp_stack::named!(Bodies { Unite = "unite", Xor = "xor" });

/// A step of the winding number, +1 or -1, about one of a part's bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Turn(i32);

impl Turn {
    /// Creates a step about a body; `winding` is +1 or -1.
    #[inline]
    pub fn new(body: u32, winding: i32) -> Self {
        let number = body as i32;
        Self(if winding < 0 { !number } else { number })
    }

    /// Returns the body's number.
    #[inline]
    pub fn body(self) -> u32 {
        (if self.0 < 0 { !self.0 } else { self.0 }) as u32
    }

    /// Returns the step, +1 or -1.
    #[inline]
    pub fn winding(self) -> i32 {
        if self.0 < 0 { -1 } else { 1 }
    }
}

/// The rule that tells inside from outside of a whole part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FillRule {
    fill: Fill,
    bodies: Bodies,
    /// For each body, its file if that has several. Empty if no file has, or if winding
    /// numbers unite all bodies anyway.
    file_of: Vec<Option<u32>>,
}

impl From<Fill> for FillRule {
    /// Creates the rule for a single body.
    fn from(fill: Fill) -> Self {
        Self { fill, ..Self::default() }
    }
}

impl FillRule {
    /// Creates the rule for bodies of these files, those of a file one after another.
    pub(crate) fn new(fill: Fill, bodies: Bodies, files: &[usize]) -> Self {
        let of_file = |files: &[usize]| {
            let file = (files.len() > 1).then_some(files[0] as u32);
            vec![file; files.len()]
        };
        let file_of: Vec<_> = files.chunk_by(|a, b| a == b).flat_map(of_file).collect();
        let counts_bodies = fill == Fill::EvenOdd && file_of.iter().any(Option::is_some);
        Self { fill, bodies, file_of: if counts_bodies { file_of } else { Vec::new() } }
    }

    /// Returns the rule for crossings that count alike.
    pub fn fill(&self) -> Fill {
        self.fill
    }

    /// Returns true if crossings must be known by their bodies.
    pub(crate) fn has_bodies(&self) -> bool {
        !self.file_of.is_empty()
    }

    /// Returns true if some bodies unite, each even-odd by itself.
    pub(crate) fn unites(&self) -> bool {
        self.has_bodies() && self.bodies == Bodies::Unite
    }

    /// Returns the number by which a body's crossings are known: 0 if all count alike.
    pub fn name_of(&self, body: u32) -> u32 {
        if self.has_bodies() { body } else { 0 }
    }

    /// Returns the file of a body that is one of several.
    fn file_of(&self, body: u32) -> Option<u32> {
        self.file_of.get(body as usize).copied().flatten()
    }

    /// Returns true if two bodies are of one file.
    pub(crate) fn are_of_one_file(&self, a: u32, b: u32) -> bool {
        self.file_of(a).is_some() && self.file_of(a) == self.file_of(b)
    }

    /// Returns true if the crossings of two bodies count alike, in one winding number.
    #[inline]
    pub(crate) fn counts_alike(&self, a: u32, b: u32) -> bool {
        a == b || (self.united_file(a).is_none() && self.united_file(b).is_none())
    }

    /// Returns the file of a body that unites with others. Such a body has closed contours
    /// of its own.
    #[inline]
    pub(crate) fn united_file(&self, body: u32) -> Option<u32> {
        match self.bodies {
            Bodies::Unite => self.file_of(body),
            Bodies::Xor => None,
        }
    }

    /// Returns a number that differs between bodies whose contours close by themselves, and
    /// is 0 for all others.
    #[inline]
    pub(crate) fn salt(&self, body: u32) -> u64 {
        // Odd, so that no two bodies share one; its bits are those of the golden ratio.
        const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
        self.united_file(body).map_or(0, |_| (u64::from(body) + 1).wrapping_mul(GOLDEN))
    }
}

/// What a point is inside of while it moves through a part, from crossing to crossing.
///
/// ```
/// use lamp_slicer::{FillRule, Position, Turn};
///
/// let rule = FillRule::default();
/// let mut position = Position::outside(&rule);
/// position.cross(Turn::new(0, 1));
/// assert!(position.is_inside() && !position.is_balanced());
/// ```
#[derive(Clone, Debug)]
pub struct Position<'a> {
    rule: &'a FillRule,
    /// About all bodies that count alike.
    winding: i32,
    /// The steps into those bodies that unite with others and hold the point.
    within: Vec<Turn>,
    /// Whether an odd number of files hold it by such bodies.
    is_in_united: bool,
}

impl<'a> Position<'a> {
    /// Starts outside.
    pub fn outside(rule: &'a FillRule) -> Self {
        Self { rule, winding: 0, within: Vec::new(), is_in_united: false }
    }

    /// Moves back outside.
    pub(crate) fn leave_all(&mut self) {
        (self.winding, self.is_in_united) = (0, false);
        self.within.clear();
    }

    /// Moves to where another point is.
    pub(crate) fn move_to(&mut self, other: &Self) {
        (self.winding, self.is_in_united) = (other.winding, other.is_in_united);
        self.within.clone_from(&other.within);
    }

    /// Passes the surface of a body.
    #[inline]
    pub fn cross(&mut self, turn: Turn) {
        match self.rule.united_file(turn.body()) {
            None => self.winding += turn.winding(),
            Some(file) => self.cross_united(turn, file),
        }
    }

    fn cross_united(&mut self, turn: Turn, file: u32) {
        match self.within.iter().position(|entered| entered.body() == turn.body()) {
            Some(at) => drop(self.within.swap_remove(at)),
            None => self.within.push(turn),
        }
        let is_other = |other: &Turn| {
            other.body() != turn.body() && self.rule.united_file(other.body()) == Some(file)
        };
        if !self.within.iter().any(is_other) {
            self.is_in_united = !self.is_in_united;
        }
    }

    /// Passes surfaces of a body whose steps add up to `winding`.
    pub(crate) fn cross_often(&mut self, body: u32, winding: i32) {
        match self.rule.united_file(body) {
            None => self.winding += winding,
            Some(file) if winding % 2 != 0 => self.cross_united(Turn::new(body, winding), file),
            Some(_) => {}
        }
    }

    /// Returns true if the point is inside the part.
    #[inline]
    pub fn is_inside(&self) -> bool {
        self.rule.fill.is_inside(self.winding) != self.is_in_united
    }

    /// Returns true if the point is outside every body, as it must be at a row's end.
    #[inline]
    pub fn is_balanced(&self) -> bool {
        !self.rule.fill.is_inside(self.winding) && self.within.is_empty()
    }

    /// Returns the winding number about a body, or about all that count alike with it.
    pub(crate) fn winding_about(&self, body: u32) -> i32 {
        match self.rule.united_file(body) {
            None => self.winding,
            Some(_) => {
                let entered = self.within.iter().find(|entered| entered.body() == body);
                entered.map_or(0, |entered| entered.winding())
            }
        }
    }
}

/// The numbers of pixels that bodies of a file share in a layer, by rising pairs. A body and
/// itself share all that it has.
pub(crate) type SharedCounts = Vec<([u32; 2], u64)>;

/// Counts the pixels of a layer that bodies of a file share.
pub(crate) struct SharedPixels<'a> {
    rule: &'a FillRule,
    /// The bodies that the row is in, and since which column.
    within: Vec<(u32, u32)>,
    counts: HashMap<[u32; 2], u64>,
}

impl<'a> SharedPixels<'a> {
    pub(crate) fn new(rule: &'a FillRule) -> Self {
        Self { rule, within: Vec::new(), counts: HashMap::new() }
    }

    /// Starts a row.
    pub(crate) fn start_row(&mut self) {
        self.within.clear();
    }

    /// Passes the surface of a body at a column, not left of the one before.
    pub(crate) fn cross(&mut self, body: u32, column: u32) {
        let Some(at) = self.within.iter().position(|(other, _)| *other == body) else {
            return self.within.push((body, column));
        };
        for &(other, since) in &self.within {
            let width = column - since.max(self.within[at].1);
            if width > 0 && self.rule.are_of_one_file(body, other) {
                let pair = [body.min(other), body.max(other)];
                *self.counts.entry(pair).or_default() += u64::from(width);
            }
        }
        self.within.swap_remove(at);
    }

    /// Returns the numbers of pixels.
    pub(crate) fn counts(self) -> SharedCounts {
        let mut counts: Vec<_> = self.counts.into_iter().collect();
        counts.sort_unstable();
        counts
    }
}

/// The volumes that bodies of a file share in the layers made so far.
#[derive(Debug, Default)]
pub(crate) struct SharedVolumes(BTreeMap<[u32; 2], SharedVolume>);

/// The volume that two bodies share, or that of a body.
#[derive(Clone, Copy, Debug, Default)]
struct SharedVolume {
    mm3: f64,
    /// The last layer that has some of it, plus one.
    next_layer: usize,
    /// Whether two layers in a row have some of it.
    lasts: bool,
}

/// Bodies that touch share some pixels by rounding: less than this share of the smaller one.
const LEAST_SHARE: f64 = 1e-4;

impl SharedVolumes {
    /// Adds the pixels of a layer. Layers come in order.
    pub(crate) fn add(&mut self, layer: usize, counts: &[([u32; 2], u64)], pixel_mm3: f64) {
        for &(pair, pixels) in counts {
            let volume = self.0.entry(pair).or_default();
            volume.mm3 += pixels as f64 * pixel_mm3;
            volume.lasts |= volume.next_layer == layer && layer > 0;
            volume.next_layer = layer + 1;
        }
    }

    /// Returns the pairs of bodies that overlap, and their volumes, the largest first.
    ///
    /// Pairs that only touch are left out: bodies on top of each other may share the layer
    /// whose plane they touch in.
    pub(crate) fn overlaps(&self) -> Vec<([u32; 2], f64)> {
        let own_mm3 = |body: u32| self.0.get(&[body, body]).map_or(0.0, |own| own.mm3);
        let is_overlap = |(pair, shared): &(&[u32; 2], &SharedVolume)| {
            let [a, b] = **pair;
            let least_mm3 = LEAST_SHARE * own_mm3(a).min(own_mm3(b));
            a != b && shared.lasts && shared.mm3 > least_mm3
        };
        let overlaps = self.0.iter().filter(is_overlap);
        let mut overlaps: Vec<_> = overlaps.map(|(pair, shared)| (*pair, shared.mm3)).collect();
        overlaps.sort_by(|a, b| b.1.total_cmp(&a.1));
        overlaps
    }
}

/// The volume that two bodies of a file share, in the layers made so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyOverlap {
    /// The file, from 0, among those joined.
    pub file: usize,
    /// The bodies, from 0, among those of the file.
    pub bodies: [usize; 2],
    /// The pixels inside both, times the thickness of their layers.
    pub volume_mm3: f64,
}
