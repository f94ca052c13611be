//! Decides what is inside a part, from the winding numbers of its bodies.
//!
//! A body holds a point where its surface winds around the point. The solids of an object unite,
//! minus its negative volumes and what later bodies erase; objects and files unite. Files that cut
//! are subtracted, or only their inside is kept.

use std::collections::{BTreeMap, HashMap};

use crate::fill::Fill;
use crate::placement::Placement;

/// How the bodies of one file join under [`Fill::EvenOdd`]: the bodies of a STEP file, or the items
/// of a 3MF.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Bodies {
    /// A point in any body is inside.
    #[default]
    Unite,
    /// Overlaps of two bodies cancel out, as overlaps of files do.
    Xor,
}

lamp_stack::named!(Bodies { Unite = "unite", Xor = "xor" });

/// How a file joins the other files of a part.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Join {
    /// It unites with the other files.
    #[default]
    Unite,
    /// It is cut out of the files that unite.
    Subtract,
    /// Only its inside is kept.
    Intersect,
}

/// The role of a body in its object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum BodyRole {
    /// It is inside.
    #[default]
    Solid,
    /// It is cut out of the solids of its object, such as a negative volume of a 3MF project.
    Negative,
    /// It is cut out of the solids of its object that come before it, such as clear polarity of a
    /// Gerber file.
    Eraser,
}

/// How a body counts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct BodyRule {
    pub(crate) file: usize,
    /// The number of its object in the file.
    pub(crate) object: usize,
    pub(crate) role: BodyRole,
    pub(crate) join: Join,
    /// Whether its format fills it by even-odd.
    pub(crate) is_even_odd: bool,
}

impl BodyRule {
    /// Returns true if it only removes material.
    pub(crate) fn is_cutter(&self) -> bool {
        self.role != BodyRole::Solid || self.join != Join::Unite
    }
}

/// A step of the winding number, +1 or -1, about one of a part's bodies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Turn(i32);

impl Turn {
    /// Creates a step about a body; `winding` is +1 or -1.
    #[inline]
    pub fn new(body: u32, winding: i32) -> Self {
        // Bodies are far fewer than 2^31, so a bit is left for the sign.
        let number = body as i32;
        // `!number` and not `-number`: body 0 has a sign too.
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

/// The rule that decides what is inside a whole part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FillRule {
    fill: Fill,
    bodies: Bodies,
    /// One rule for each body of a part that has several bodies.
    rules: Vec<BodyRule>,
    /// Whether a point is inside where any body holds it.
    is_union: bool,
    /// The number of files that intersect the others.
    intersections: usize,
    /// Whether the part's placement mirrors it, so that facets that face outward wind in the
    /// opposite direction.
    is_mirrored: bool,
}

impl From<Fill> for FillRule {
    /// Creates the rule for a single body.
    fn from(fill: Fill) -> Self {
        Self { fill, ..Self::default() }
    }
}

impl FillRule {
    /// Creates the rule for the bodies of a part, file by file.
    pub(crate) fn new(fill: Fill, bodies: Bodies, rules: Vec<BodyRule>) -> Self {
        // A single body needs no numbers, so its crossings take half the memory.
        if let [rule] = &rules[..]
            && !rule.is_cutter()
        {
            return if rule.is_even_odd { Fill::EvenOdd } else { fill }.into();
        }
        // Most parts only unite. Then any body decides, without a look at the others.
        let is_union = fill == Fill::Solid && !rules.iter().any(BodyRule::is_cutter);
        // The bodies of an intersecting file unite first, so files count.
        let files = rules.chunk_by(|a, b| a.file == b.file);
        let intersections = files.filter(|bodies| bodies[0].join == Join::Intersect).count();
        Self { fill, bodies, rules, is_union, intersections, is_mirrored: false }
    }

    /// Returns the rule for a part in its place.
    pub(crate) fn placed(self, placement: &Placement) -> Self {
        Self { is_mirrored: placement.is_mirror(), ..self }
    }

    /// Returns the winding number of a point within a body that faces outward.
    #[inline]
    pub(crate) fn outward(&self) -> i32 {
        if self.is_mirrored { -1 } else { 1 }
    }

    /// Returns the rule of each body by itself.
    pub fn fill(&self) -> Fill {
        self.fill
    }

    /// Returns true if the format of a body fills it by even-odd.
    #[inline]
    fn is_even_odd(&self, body: u32) -> bool {
        self.rules.get(body as usize).is_some_and(|rule| rule.is_even_odd)
    }

    /// Returns true if crossings must record their bodies.
    pub(crate) fn has_bodies(&self) -> bool {
        !self.rules.is_empty()
    }

    /// Returns the number that crossings record for a body: 0 if there is only one body.
    pub fn name_of(&self, body: u32) -> u32 {
        if self.has_bodies() { body } else { 0 }
    }

    /// Returns true if a body only removes material.
    pub(crate) fn is_cutter(&self, body: u32) -> bool {
        self.rules[body as usize].is_cutter()
    }

    /// Returns true if two bodies belong to one file, and neither is cut out.
    pub(crate) fn may_share(&self, a: u32, b: u32) -> bool {
        let [a, b] = [a, b].map(|body| &self.rules[body as usize]);
        a.file == b.file && !a.is_cutter() && !b.is_cutter()
    }

    /// Returns a number that differs between bodies, since their contours close by themselves.
    #[inline]
    pub(crate) fn salt(&self, body: u32) -> u64 {
        // Odd, so that no two bodies share a number; its bits are the bits of the golden ratio.
        const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;
        (u64::from(self.name_of(body)) + u64::from(self.has_bodies())).wrapping_mul(GOLDEN)
    }

    /// Returns true if a point that some bodies hold is inside the part.
    fn is_inside(&self, holds: impl Iterator<Item = u32> + Clone) -> bool {
        if self.is_union {
            return holds.clone().next().is_some();
        }
        let rules = holds.map(|body| (body, &self.rules[body as usize]));
        let is_cut = |body: u32, of: &BodyRule| {
            rules.clone().any(|(other, rule)| {
                let cuts = match rule.role {
                    BodyRole::Solid => false,
                    BodyRole::Negative => true,
                    BodyRole::Eraser => other > body,
                };
                cuts && (rule.file, rule.object) == (of.file, of.object)
            })
        };
        let solids = rules
            .clone()
            .filter(|&(body, rule)| rule.role == BodyRole::Solid && !is_cut(body, rule));
        let of = |join: Join| solids.clone().filter(move |(_, rule)| rule.join == join);
        if of(Join::Subtract).next().is_some() {
            return false;
        }
        // The first body of each unit: a file, or a body by itself.
        let is_alike = |(a, rule): (u32, &BodyRule), (b, other): (u32, &BodyRule)| {
            rule.file == other.file && (a == b || self.bodies == Bodies::Unite)
        };
        // Few bodies hold a point, so comparing pairs is cheaper than collecting them.
        let units = |join: Join| {
            let firsts = of(join).enumerate();
            firsts.filter(move |&(k, body)| of(join).take(k).all(|other| !is_alike(body, other)))
        };
        let is_within = match self.fill {
            Fill::Solid => of(Join::Unite).next().is_some(),
            Fill::EvenOdd => units(Join::Unite).count() % 2 == 1,
        };
        let files = of(Join::Intersect).map(|(_, rule)| rule.file);
        let is_first = |&(k, file): &(usize, usize)| {
            of(Join::Intersect).take(k).all(|(_, other)| other.file != file)
        };
        is_within && files.enumerate().filter(is_first).count() == self.intersections
    }
}

/// The bodies that hold a point while it moves through a part, from crossing to crossing.
///
/// ```
/// use lamp_slicing::{FillRule, Position, Turn};
///
/// let rule = FillRule::default();
/// let mut position = Position::outside(&rule);
/// position.cross(Turn::new(0, 1));
/// assert!(position.is_inside() && !position.is_balanced());
/// ```
#[derive(Clone, Debug)]
pub struct Position<'a> {
    rule: &'a FillRule,
    /// The winding number about the only body.
    winding: i32,
    /// The nonzero winding numbers of the bodies, for a part with several bodies.
    windings: Vec<(u32, i32)>,
    /// The bodies whose steps do not add up in this row, so that every crossing toggles.
    unsigned: Vec<u32>,
}

impl<'a> Position<'a> {
    /// Starts outside.
    pub fn outside(rule: &'a FillRule) -> Self {
        Self { rule, winding: 0, windings: Vec::new(), unsigned: Vec::new() }
    }

    /// Moves outside, to the start of a row with these steps. A body whose steps do not add up,
    /// since facets are missing or turned over, is filled by even-odd in this row.
    pub fn start_row(&mut self, turns: impl Iterator<Item = Turn>) {
        self.winding = 0;
        self.windings.clear();
        self.unsigned.clear();
        // Even-odd needs no signs.
        if self.rule.fill == Fill::EvenOdd {
            return;
        }
        turns.for_each(|turn| self.step(turn.body(), turn.winding()));
        if self.winding != 0 {
            self.unsigned.push(0);
        }
        let rule = self.rule;
        let bodies = self.windings.iter().map(|&(body, _)| body);
        self.unsigned.extend(bodies.filter(|&body| !rule.is_even_odd(body)));
        self.winding = 0;
        self.windings.clear();
    }

    /// Moves to the position of another point of the row.
    pub(crate) fn move_to(&mut self, other: &Self) {
        self.winding = other.winding;
        self.windings.clone_from(&other.windings);
        self.unsigned.clone_from(&other.unsigned);
    }

    /// Passes the surface of a body.
    #[inline]
    pub fn cross(&mut self, turn: Turn) {
        self.step(turn.body(), turn.winding());
    }

    /// Passes surfaces of a body whose steps add up to `winding`.
    #[inline]
    pub(crate) fn step(&mut self, body: u32, winding: i32) {
        if !self.rule.has_bodies() {
            self.winding += winding;
            return;
        }
        match self.windings.iter().position(|&(other, _)| other == body) {
            None if winding == 0 => {}
            None => self.windings.push((body, winding)),
            Some(at) => {
                self.windings[at].1 += winding;
                if self.windings[at].1 == 0 {
                    // The list stays as short as the number of bodies around the point. Its order
                    // has no meaning.
                    self.windings.swap_remove(at);
                }
            }
        }
    }

    /// Returns true if a body holds the point, given the winding number about it.
    #[inline]
    fn holds(&self, body: u32, winding: i32) -> bool {
        let is_unsigned = !self.unsigned.is_empty() && self.unsigned.contains(&body);
        let is_even_odd = is_unsigned || self.rule.is_even_odd(body);
        if is_even_odd { Fill::EvenOdd } else { self.rule.fill }.is_inside(winding)
    }

    /// Returns the bodies that hold the point, with the winding numbers about them.
    fn all_that_hold(&self) -> impl Iterator<Item = (u32, i32)> + Clone {
        self.windings.iter().copied().filter(|&(body, winding)| self.holds(body, winding))
    }

    /// Returns true if the point is inside the part.
    #[inline]
    pub fn is_inside(&self) -> bool {
        if !self.rule.has_bodies() {
            return self.holds(0, self.winding);
        }
        self.rule.is_inside(self.all_that_hold().map(|(body, _)| body))
    }

    /// Returns true if no body holds the point, as it must be at a row's end.
    #[inline]
    pub fn is_balanced(&self) -> bool {
        !self.holds(0, self.winding) && self.all_that_hold().next().is_none()
    }

    /// Returns the winding number about a body.
    #[inline]
    pub(crate) fn winding_about(&self, body: u32) -> i32 {
        if !self.rule.has_bodies() {
            return self.winding;
        }
        self.windings.iter().find(|&&(other, _)| other == body).map_or(0, |&(_, winding)| winding)
    }

    /// Returns true if the direction of a body's facets counts: it is not cut out of others, and
    /// neither its format nor this row fills it by even-odd.
    pub(crate) fn has_signs(&self, body: u32) -> bool {
        !self.rule.is_cutter(body) && !self.rule.is_even_odd(body) && !self.unsigned.contains(&body)
    }

    /// Returns the bodies whose winding numbers are not zero.
    pub(crate) fn windings(&self) -> &[(u32, i32)] {
        &self.windings
    }

    /// Returns the bodies that this row fills by even-odd, because their steps do not add up.
    pub(crate) fn unsigned(&self) -> &[u32] {
        &self.unsigned
    }
}

/// The numbers of pixels that pairs of bodies of a file share in a layer, sorted by pair. A body
/// shares all its pixels with itself.
pub(crate) type SharedCounts = Vec<([u32; 2], u64)>;

/// Counts the pixels of a layer that bodies of a file share.
pub(crate) struct SharedPixels<'a> {
    rule: &'a FillRule,
    held: Vec<(u32, i32)>,
    counts: HashMap<[u32; 2], u64>,
}

impl<'a> SharedPixels<'a> {
    pub(crate) fn new(rule: &'a FillRule) -> Self {
        Self { rule, held: Vec::new(), counts: HashMap::new() }
    }

    /// Adds pixels at a position. Bodies share the pixels if both wind around them the same way,
    /// and voids leave more than one winding. A body that cuts shares all pixels that it removes or
    /// keeps.
    pub(crate) fn add(&mut self, position: &Position<'_>, pixels: u32) {
        self.held.clear();
        self.held.extend(position.all_that_hold());
        if self.held.is_empty() || pixels == 0 {
            return;
        }
        let winding: i32 = self.held.iter().map(|(_, winding)| winding.signum()).sum();
        for (k, &(a, of_a)) in self.held.iter().enumerate() {
            *self.counts.entry([a, a]).or_default() += u64::from(pixels);
            for &(b, of_b) in &self.held[k + 1..] {
                let is_shared = of_a.signum() == of_b.signum() && winding.abs() > 1;
                let is_cut = self.rule.is_cutter(a) != self.rule.is_cutter(b);
                if is_cut || (is_shared && self.rule.may_share(a, b)) {
                    *self.counts.entry([a.min(b), a.max(b)]).or_default() += u64::from(pixels);
                }
            }
        }
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

/// The volume that two bodies share, or the volume of a body.
#[derive(Clone, Copy, Debug, Default)]
struct SharedVolume {
    mm3: f64,
    /// The last layer that has part of it, plus one.
    next_layer: usize,
    /// Whether two consecutive layers have part of it.
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
    pub(crate) fn overlaps(&self, rule: &FillRule) -> Vec<([u32; 2], f64)> {
        let own_mm3 = |body: u32| self.0.get(&[body, body]).map_or(0.0, |own| own.mm3);
        let is_overlap = |(pair, shared): &(&[u32; 2], &SharedVolume)| {
            let [a, b] = **pair;
            let least_mm3 = LEAST_SHARE * own_mm3(a).min(own_mm3(b));
            a != b && rule.may_share(a, b) && shared.lasts && shared.mm3 > least_mm3
        };
        let overlaps = self.0.iter().filter(is_overlap);
        let mut overlaps: Vec<_> = overlaps.map(|(pair, shared)| (*pair, shared.mm3)).collect();
        overlaps.sort_by(|a, b| b.1.total_cmp(&a.1));
        overlaps
    }

    /// Returns the files that are meant to cut, but share no pixel with the part.
    pub(crate) fn idle_cutters(&self, rule: &FillRule) -> Vec<usize> {
        let cuts = |file: usize| {
            self.0.keys().any(|&[a, b]| {
                let is_of_file = |body: u32| rule.rules[body as usize].file == file;
                is_of_file(a) != is_of_file(b)
            })
        };
        let cutters = rule.rules.iter().filter(|of| of.join != Join::Unite).map(|of| of.file);
        let mut idle: Vec<_> = cutters.filter(|&file| !cuts(file)).collect();
        // Bodies of one file follow each other.
        idle.dedup();
        idle
    }
}

/// The volume that two bodies of a file share, in the layers made so far.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyOverlap {
    /// The index of the file among the joined files, from 0.
    pub file: usize,
    /// The indices of the bodies in the file, from 0.
    pub bodies: [usize; 2],
    /// The pixels inside both, times the thickness of their layers.
    pub volume_mm3: f64,
}

/// Pixels and rows of a layer where a body's winding numbers are doubtful.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Doubts {
    /// Rows that are filled by even-odd, because their steps do not add up.
    pub(crate) unsigned_rows: u64,
    /// Pixels that the surface winds around more than once.
    pub(crate) repeated_px: u64,
    /// Pixels around which the surface winds like a surface that faces inward.
    pub(crate) inward_px: u64,
}

impl Doubts {
    /// Adds pixels with this winding number, which is above zero in a body that faces outward.
    #[inline]
    pub(crate) fn add(&mut self, winding: i32, pixels: u32) {
        if winding.abs() > 1 {
            self.repeated_px += u64::from(pixels);
        }
        if winding < 0 {
            self.inward_px += u64::from(pixels);
        }
    }

    /// Adds the doubts of another count.
    pub(crate) fn join(&mut self, other: Self) {
        self.unsigned_rows += other.unsigned_rows;
        self.repeated_px += other.repeated_px;
        self.inward_px += other.inward_px;
    }
}

/// The doubts of a layer by body, and its white pixels.
#[derive(Clone, Debug, Default)]
pub(crate) struct LayerDoubts {
    pub(crate) of_bodies: BTreeMap<u32, Doubts>,
    pub(crate) white_px: u64,
}

/// A file whose facets leave doubts about what is inside, in the layers made so far whose contours
/// close. Its surface is filled nevertheless.
///
/// A void is a shell whose facets face inward. A shell inside another shell that also faces outward
/// may be a body in a body, or a void that was written inside out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FillDoubt {
    /// The index of the file among the joined files, from 0.
    pub file: usize,
    /// The rows in which the signs of facets do not add up, because some facets are turned over:
    /// every crossing toggles there, as under [`Fill::EvenOdd`].
    pub unsigned_rows: u64,
    /// The volume that shells enclose more than once, in cubic millimeters.
    pub repeated_mm3: f64,
    /// The volume of shells that face inward though nothing is around them, in cubic millimeters.
    pub inward_mm3: f64,
}

impl FillDoubt {
    pub(crate) fn is_doubtful(&self) -> bool {
        self.unsigned_rows > 0 || self.repeated_mm3 > 0.0 || self.inward_mm3 > 0.0
    }
}

/// Adds up the doubts of layers.
#[derive(Debug, Default)]
pub(crate) struct DoubtSum {
    of_bodies: BTreeMap<u32, FillDoubt>,
    /// The white volume of the layers with doubts.
    white_mm3: f64,
}

impl DoubtSum {
    pub(crate) fn add(&mut self, doubts: &LayerDoubts, pixel_mm3: f64) {
        self.white_mm3 += doubts.white_px as f64 * pixel_mm3;
        for (&body, doubts) in &doubts.of_bodies {
            let sum = self.of_bodies.entry(body).or_default();
            sum.unsigned_rows += doubts.unsigned_rows;
            sum.repeated_mm3 += doubts.repeated_px as f64 * pixel_mm3;
            sum.inward_mm3 += doubts.inward_px as f64 * pixel_mm3;
        }
    }

    /// Returns the doubts of each file that has any. Shells that only touch cause no doubts.
    pub(crate) fn of_files(&self, file_of: impl Fn(u32) -> usize) -> Vec<FillDoubt> {
        let least_mm3 = LEAST_SHARE * self.white_mm3;
        let some = |mm3: f64| if mm3 > least_mm3 { mm3 } else { 0.0 };
        let mut files: BTreeMap<usize, FillDoubt> = BTreeMap::new();
        for (&body, doubt) in &self.of_bodies {
            let file = file_of(body);
            let sum = files.entry(file).or_insert(FillDoubt { file, ..FillDoubt::default() });
            sum.unsigned_rows += doubt.unsigned_rows;
            sum.repeated_mm3 += some(doubt.repeated_mm3);
            sum.inward_mm3 += some(doubt.inward_mm3);
        }
        files.into_values().filter(FillDoubt::is_doubtful).collect()
    }
}
