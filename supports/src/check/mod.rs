//! Finds what would be lost, trapped or bent as a stack is built, in one pass over its layers.
//!
//! Layers are labeled and compared with the layer below many at once; bodies are then joined
//! layer by layer. Only the last layer is kept, and bodies that it has no part of are done.
//!
//! Source: 002 sections 4.1.1, 4.2 and 4.3 (algorithm 16, on images).

mod balance;
mod components;
mod contact;
mod drain;
mod findings;
mod islands;
mod liquid;
mod live;
pub(crate) mod metric;
mod narrow;
mod narrows;
mod overhang;
mod overhangs;
mod pairs;
mod pockets;
mod rules;
mod slender;
mod span;
mod standing;

use std::fmt;
use std::num::{NonZeroU8, NonZeroU32};
use std::ops::Range;
use std::sync::Arc;

use lamp_stack::{
    Layer, Length, Mask, MaskBuilder, MemorySize, Op, PageInfo, Pitch, take_batch, white_runs,
};
use rayon::prelude::*;
use thiserror::Error;

use components::Components;
pub(crate) use contact::Labelled;
use contact::LayerContact;
use drain::Drain;
pub use findings::{
    Findings, HeldAt, Island, IslandEnd, LayerCure, LayerFacts, Listed, NarrowFeature, OffBalance,
    Overhang, Pocket, PocketEffect, PocketKind, Region, SlenderFeature, WeakBond, WeakJoint,
};
use islands::{Growth, Speck};
use liquid::Liquid;
pub(crate) use metric::Metric;
use narrow::narrow;
use narrows::{Breach, Narrows};
use overhang::OverhangLimit;
pub(crate) use overhang::without;
use overhangs::Overhangs;
pub use pairs::{Disagreements, IslandMinimum, LoneMinimum};
use pockets::Hollows;
pub use rules::{AspectRule, BondRule, DesignRules, LeastWidthRule, RuleError};
use slender::{Section, Slenders, sections};
pub(crate) use standing::Standing;

/// Limits from which something counts as a finding.
#[derive(Clone, Debug)]
pub struct CheckOptions {
    /// The level from which a gray pixel is white.
    pub threshold: NonZeroU8,
    /// The side of the square that an island must hold in a layer, or else it is a speck. At least
    /// two pixels, unless it is zero; in stacks without a resolution, [`rounding`](Self::rounding).
    pub speck: Length,
    /// The number of layers for which an island must float to be no speck, however thin it is.
    pub speck_layers: NonZeroU32,
    /// The side in pixels of the square that any other finding must hold, so that rounding to
    /// pixels does not count.
    pub rounding: NonZeroU32,
    /// The share of a component's area that must rest on white.
    pub least_support: f64,
    /// How far white may reach beyond the white below; if `None`, as far as the layer is thick
    /// (45°).
    pub max_overhang: Option<Length>,
    /// The width that a way out must have to drain a pocket; if `None`, a pixel and a layer do.
    pub drain: Option<Length>,
    /// The design rules by which features are too narrow.
    pub widths: Vec<WidthRule>,
    /// The design rules by which layers do not bond.
    pub bonds: Vec<BondRule>,
    /// The design rules by which pins and holes are too long. They need a resolution and heights.
    pub aspects: Vec<AspectRule>,
    /// The light of layers, which rules of bonds and of cure widths need.
    pub light: Option<Arc<dyn LayerLight>>,
    /// Whether to look for islands alone.
    pub islands_only: bool,
}

/// The light of a stack's layers.
pub trait LayerLight: fmt::Debug + Send + Sync {
    /// Returns what full white cures in a layer.
    fn cure(&self, layer: &PageInfo) -> LayerCure;
}

/// A design rule: how wide features must be.
#[derive(Clone, Debug, PartialEq)]
pub struct WidthRule {
    /// Its name.
    pub name: String,
    /// Where it is from.
    pub source: String,
    /// Whether it is about white: walls and pins. Others are about slots and holes.
    pub is_of_white: bool,
    /// The least width.
    pub least: LeastWidth,
}

/// The least width of a feature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LeastWidth {
    /// A length. It needs a stack with a resolution.
    Length(Length),
    /// A number of widths of a pixel.
    Pixels(f64),
    /// A number of cure widths of the layer. It needs a resolution and a resin.
    CureWidths(f64),
}

impl LeastWidth {
    /// Returns the width in widths of a pixel, given the effect of a layer's light; none if it is not known,
    /// or zero.
    fn widths(self, pitch: Option<Pitch>, cure: LayerCure) -> Option<f64> {
        let widths = match self {
            Self::Length(length) => length.pixels(pitch?.x),
            Self::Pixels(pixels) => pixels,
            Self::CureWidths(number) => Length::from_um(number * cure.width_um?).pixels(pitch?.x),
        };
        // Light that moves no edge closes nothing.
        (widths > 0.0).then_some(widths)
    }
}

impl Default for CheckOptions {
    fn default() -> Self {
        Self {
            threshold: NonZeroU8::MIN,
            // Half of the smallest feature (002 section 2.4.1).
            speck: Length::from_um(250.0),
            speck_layers: NonZeroU32::new(10).expect("it is not zero"),
            rounding: NonZeroU32::new(3).expect("it is not zero"),
            least_support: 0.25,
            max_overhang: None,
            drain: None,
            widths: Vec::new(),
            bonds: Vec::new(),
            aspects: Vec::new(),
            light: None,
            islands_only: false,
        }
    }
}

impl CheckOptions {
    /// Returns the columns and rows of the square that an island must hold.
    fn speck_pixels(&self, pitch: Option<Pitch>) -> [u32; 2] {
        // Where slopes begin, rounding makes islands of a pixel at any resolution.
        let least = if self.speck == Length::default() { 1.0 } else { 2.0 };
        // A hair less: a length of whole pixels may be rounded up.
        let whole = |pixels: f64| (pixels - 1e-6).ceil().clamp(least, 1e9) as u32;
        pitch.map_or([self.rounding.get(); 2], |pitch| pitch.pixels(self.speck).map(whole))
    }

    /// Returns the reach in widths of a pixel and the number of layers of which an overhang must have
    /// one. A given limit is taken as it is.
    fn least_overhang(&self, pitch: Option<Pitch>) -> (f64, u32) {
        let pitch = pitch.filter(|_| self.max_overhang.is_none());
        let reach = pitch.map(|pitch| self.speck.pixels(pitch.x));
        (reach.unwrap_or(0.0), self.speck_layers.get())
    }
}

/// A reason that a stack cannot be checked.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CheckError {
    /// There are no layers.
    #[error("there are no layers to check")]
    NoLayers,
    /// The layers cannot be compared pixel by pixel.
    #[error(
        "{layer} is {} x {} pixels, and the first layer {} x {}: layers are compared pixel by pixel",
        size[0], size[1], first[0], first[1]
    )]
    Sizes {
        /// The layer's name.
        layer: String,
        /// Its width and height.
        size: [u32; 2],
        /// The width and height of the first layer.
        first: [u32; 2],
    },
    /// A drain has a width, and pixels or layers have none.
    #[error("the stack does not state how {0}, so narrow drains cannot be found")]
    NoScale(&'static str),
    /// The images stand in different places.
    #[error("{layer} differs from the first layer in origin: layers are compared pixel by pixel")]
    Origins {
        /// The layer's name.
        layer: String,
    },
}

/// Checks a stack, given its layers from the first and how to decode one.
///
/// The first layer stands on the platform. Pixels touch at sides, in a layer and from layer to
/// layer. Memory holds the last layer and the layers in work: two if they are large.
///
/// # Errors
/// Returns the first error of the layers, or one if layers cannot be compared.
pub fn check<T, E>(
    layers: impl Iterator<Item = Result<T, E>>,
    decode: impl Fn(T) -> Result<Layer, E> + Sync,
    options: &CheckOptions,
) -> Result<Findings, E>
where
    T: MemorySize + Send,
    E: From<CheckError> + Send,
{
    let mut pass = Pass::new(options);
    for_batches(layers, decode, |batch| pass.add(batch.into_iter().map(Some).collect()))?;
    Ok(pass.finish().ok_or(CheckError::NoLayers)?)
}

/// Checks a build in one pass as [`check`] does, given its layers and how to decode one: all of it,
/// where only islands are looked for, and its parts, which stand on their own first layer.
///
/// `parts` returns the parts of a layer to judge, alone, pixel by pixel where the layer has them; none
/// below the parts. It is called once all layers before have been decoded. If no layer has parts,
/// only the whole has findings.
///
/// # Errors
/// Returns the first error of the layers, or one if layers cannot be compared.
pub fn check_build<T, E>(
    layers: impl Iterator<Item = Result<T, E>>,
    decode: impl Fn(T) -> Result<Layer, E> + Sync,
    parts: impl Fn(&Layer) -> Option<Layer> + Sync,
    options: &CheckOptions,
) -> Result<(Findings, Option<Findings>), E>
where
    T: MemorySize + Send,
    E: From<CheckError> + Send,
{
    let islands = CheckOptions { islands_only: true, ..options.clone() };
    let (mut whole, mut of_parts) = (Pass::new(&islands), Pass::new(options));
    for_batches(layers, decode, |batch| {
        of_parts.add(batch.par_iter().map(&parts).collect())?;
        whole.add(batch.into_iter().map(Some).collect())
    })?;
    Ok((whole.finish().ok_or(CheckError::NoLayers)?, of_parts.finish()))
}

/// Decodes layers, some at once, and passes them on in their order.
fn for_batches<T, L, E>(
    layers: impl Iterator<Item = Result<T, E>>,
    decode: impl Fn(T) -> Result<L, E> + Sync,
    mut each: impl FnMut(Vec<L>) -> Result<(), CheckError>,
) -> Result<(), E>
where
    T: MemorySize + Send,
    L: Send,
    E: From<CheckError> + Send,
{
    // A batch may end the layers, and the next one asks again.
    let mut layers = layers.fuse();
    // Of large layers two are in work at most, however many threads there are.
    let at_once = rayon::current_num_threads().min(2);
    loop {
        let batch = take_batch(&mut layers, at_once);
        if batch.is_empty() {
            return Ok(());
        }
        let decoded = batch.into_par_iter().map(|item| decode(item?));
        each(decoded.collect::<Result<_, E>>()?)?;
    }
}

/// A check of the layers so far.
struct Pass<'a> {
    options: &'a CheckOptions,
    checker: Option<Checker>,
    last: Option<Arc<LabeledLayer>>,
}

impl<'a> Pass<'a> {
    fn new(options: &'a CheckOptions) -> Self {
        Self { options, checker: None, last: None }
    }

    /// Adds layers that follow each other; a layer that has nothing to check is left out.
    fn add(&mut self, batch: Vec<Option<Layer>>) -> Result<(), CheckError> {
        let options = self.options;
        let labelled = batch
            .into_par_iter()
            .flatten()
            .map(|layer| Arc::new(LabeledLayer::new(layer, options)));
        let batch: Vec<Arc<LabeledLayer>> = labelled.collect();
        let Some(first) = batch.first() else { return Ok(()) };
        let checker = match &mut self.checker {
            Some(checker) => checker,
            none => none.insert(Checker::new(first, options)?),
        };
        // Rows are compared by number and column, so sizes must agree before any comparison.
        for layer in &batch {
            checker.compare(layer)?;
        }
        // The layer below the first of the batch is the last of the batch before, if there was one.
        let below = self.last.iter().chain(&batch[..batch.len() - 1]).map(Some);
        let below: Vec<_> = self.last.is_none().then_some(None).into_iter().chain(below).collect();
        let contacts = batch.par_iter().zip(below).map(|(layer, below)| {
            let limit = checker.limit(&layer.facts);
            let rounding = options.rounding.get();
            below.map(|below| LayerContact::new(&below.labelled, &layer.labelled, limit, rounding))
        });
        let contacts: Vec<_> = contacts.collect();
        // Bodies pass from layer to layer, so this part goes in order.
        for (layer, contact) in batch.iter().zip(&contacts) {
            checker.add(layer, contact.as_ref())?;
        }
        if let Some((drain, _)) = &mut checker.drain {
            drain.advance(false);
        }
        self.last = batch.into_iter().next_back();
        Ok(())
    }

    /// Returns the findings; none without layers.
    fn finish(self) -> Option<Findings> {
        self.checker.map(Checker::finish)
    }
}

/// Returns the runs of the component that holds a pixel, white or black, as rows and columns from
/// the top; none if the pixel is outside the image.
pub fn component_at(mask: &Mask, column: u32, row: u32) -> Vec<(u32, Range<u32>)> {
    if column >= mask.width() || row >= mask.height() {
        return Vec::new();
    }
    let components = Components::of(mask);
    let component = components.at(mask, column, row);
    components.runs(mask, component).collect()
}

/// Returns a mask of the components of a color that do not touch the image's border.
pub fn inner_components(mask: &Mask, white: bool) -> Mask {
    let components = Components::of(mask);
    let [width, height] = [mask.width(), mask.height()];
    let is_inner: Vec<bool> = components
        .all
        .iter()
        .map(|component| {
            let inside = |range: &Range<u32>, size: u32| range.start > 0 && range.end < size;
            component.is_white == white
                && inside(&component.columns, width)
                && inside(&component.rows, height)
        })
        .collect();
    components_where(mask, &components, &is_inner)
}

/// Returns a mask of the white components that are not wholly within the white of `cover`, an image of
/// the same size.
pub fn components_beyond(mask: &Mask, cover: &Mask) -> Mask {
    let mut beyond = Vec::new();
    let components = Components::of(mask);
    let mut is_beyond = vec![false; components.all.len()];
    for row in 0..mask.height() {
        beyond.clear();
        Op::Difference.rows(mask.row(row), cover.row(row), &mut beyond);
        for (start, _) in white_runs(&beyond, mask.width()) {
            is_beyond[components.at(mask, start, row) as usize] = true;
        }
    }
    components_where(mask, &components, &is_beyond)
}

/// Returns a mask of some components.
fn components_where(mask: &Mask, components: &Components, wanted: &[bool]) -> Mask {
    let mut chosen = MaskBuilder::new(mask.width());
    let mut row = Vec::new();
    for (number, transitions) in (0..).zip(mask.rows()) {
        row.clear();
        for (segment, label) in components.of_row(number).iter().enumerate() {
            // Some black has no component.
            if wanted.get(*label as usize).is_some_and(|wanted| *wanted) {
                // The first segment begins at the left border, and the last ends at the right one.
                row.push(if segment == 0 { 0 } else { transitions[segment - 1] });
                row.extend(transitions.get(segment));
            }
        }
        chosen.push_row(&row).expect("segments of one color do not touch");
    }
    chosen.finish()
}

/// A layer, labeled.
struct LabeledLayer {
    facts: LayerFacts,
    /// The layer's name in messages.
    name: String,
    pitch: Option<Pitch>,
    origin_mm: Option<[f64; 2]>,
    labelled: Labelled,
    breaches: Vec<Breach>,
    sections: Vec<Section>,
}

impl LabeledLayer {
    fn new(layer: Layer, options: &CheckOptions) -> Self {
        let Layer { info, pitch, image } = layer;
        let labelled = Labelled::new(image.into_image().into_mask(options.threshold));
        let mut facts = LayerFacts::new(&info);
        facts.has_white = labelled.of_colour(true).next().is_some();
        facts.white_at_border = labelled.of_colour(true).any(|white| labelled.reaches_frame(white));
        facts.cure = options.light.as_ref().map_or_else(LayerCure::default, |it| it.cure(&info));
        let breaches = breaches(&labelled, pitch, facts.cure, options);
        facts.is_texture = breaches.is_none();
        let breaches = breaches.unwrap_or_default();
        let widest = options.aspects.iter().map(|rule| match rule.widest.zip(pitch) {
            Some((widest, pitch)) => widest.pixels(pitch.x),
            None => f64::INFINITY,
        });
        let sections = match widest.reduce(f64::max) {
            Some(widest) if !options.islands_only && pitch.is_some() => {
                sections(&labelled, widest, Metric::of(pitch))
            }
            _ => Vec::new(),
        };
        let (name, origin_mm) = (info.name(), info.origin_mm);
        Self { facts, name, pitch, origin_mm, labelled, breaches, sections }
    }

    fn size(&self) -> [u32; 2] {
        [self.labelled.mask.width(), self.labelled.mask.height()]
    }
}

/// The least difference from a limit in widths of a pixel: pixels that fit in are up to two less than
/// drawn, at an angle and across a pin.
const LESS: f64 = 2.0;

/// Returns the places of a layer that break rules of widths, each with the rule of the least width;
/// `None` of a texture.
fn breaches(
    layer: &Labelled,
    pitch: Option<Pitch>,
    cure: LayerCure,
    options: &CheckOptions,
) -> Option<Vec<Breach>> {
    if options.islands_only {
        return Some(Vec::new());
    }
    let of_rule = |rule: &WidthRule| rule.least.widths(pitch, cure);
    let limits = [true, false].map(|is_white| {
        let rules = options.widths.iter().filter(|rule| rule.is_of_white == is_white);
        rules.filter_map(of_rule).reduce(f64::max)
    });
    let places = narrow(layer, limits, Metric::of(pitch))?;
    let breach = |place: narrow::Narrow| {
        let rules = options.widths.iter().enumerate();
        let (limit, rule) = rules
            .filter(|(_, rule)| rule.is_of_white == place.is_white)
            .filter_map(|(number, rule)| Some((of_rule(rule)?, number)))
            .filter(|(limit, _)| place.width + LESS <= *limit)
            .min_by(|a, b| a.0.total_cmp(&b.0))?;
        Some(Breach { place, rule, limit })
    };
    Some(places.into_iter().filter_map(breach).collect())
}

/// The share of a layer's thickness by which white that just cures it may be off, to rounding.
const JUST: f64 = 1e-3;

/// Returns the layers that cure no deeper than each rule asks for.
fn weak_bonds(layers: &[LayerFacts], rules: &[BondRule]) -> Vec<WeakBond> {
    if layers.iter().any(|layer| layer.cure.needs_others) {
        return Vec::new();
    }
    // How deep a layer with white cures, in layers.
    let cured = |layer: &LayerFacts| {
        let depth = layer.cure.depth_um.filter(|_| layer.has_white)?;
        Some(depth / layer.thickness_um?)
    };
    let bond = |(rule, BondRule { layers: most, .. }): (usize, &BondRule)| {
        let depths = (0..).zip(layers).filter_map(|(at, layer)| Some((at, cured(layer)?)));
        let mut weak = depths.filter(|(_, depth)| *depth < most + JUST);
        let (first, mut least) = weak.next()?;
        let mut bond = WeakBond { rule, layers: [first; 2], count: 1, worst_layer: first };
        for (at, depth) in weak {
            (bond.layers[1], bond.count) = (at, bond.count + 1);
            // Less is rounding, too.
            if depth < least - JUST {
                (least, bond.worst_layer) = (depth, at);
            }
        }
        Some(bond)
    };
    rules.iter().enumerate().filter_map(bond).collect()
}

/// The state of a check after the layers so far.
struct Checker {
    options: CheckOptions,
    layers: Vec<LayerFacts>,
    pitch: Option<Pitch>,
    origin_mm: Option<[f64; 2]>,
    size: [u32; 2],
    growth: Growth,
    liquid: Liquid,
    drain: Option<(Drain, Hollows)>,
    overhangs: Overhangs,
    narrows: Narrows,
    /// Without a resolution, no length over width is known.
    slenders: Option<Slenders>,
    weak_joints: Listed<WeakJoint>,
}

impl Checker {
    fn new(first: &LabeledLayer, options: &CheckOptions) -> Result<Self, CheckError> {
        let rounding = options.rounding.get();
        let pitch = first.pitch;
        let drain = options.drain.filter(|_| !options.islands_only).map(|drain| {
            let pitch = pitch.ok_or(CheckError::NoScale("large a pixel is"))?;
            Ok::<_, CheckError>((Drain::new(drain.um(), pitch, rounding), Hollows::new(rounding)))
        });
        let speck =
            Speck { sides: options.speck_pixels(pitch), layers: options.speck_layers.get() };
        Ok(Self {
            options: options.clone(),
            layers: Vec::new(),
            pitch,
            origin_mm: first.origin_mm,
            size: first.size(),
            growth: Growth::new(speck, Metric::of(pitch)),
            liquid: Liquid::new(rounding),
            drain: drain.transpose()?,
            overhangs: Overhangs::new(options.least_overhang(pitch)),
            narrows: Narrows::new(options.speck_layers.get(), pitch.map(|pitch| pitch.um()[0])),
            slenders: pitch.filter(|_| !options.aspects.is_empty()).map(|pitch| {
                Slenders::new(&options.aspects, pitch.um()[0], Metric::of(Some(pitch)))
            }),
            weak_joints: Listed::default(),
        })
    }

    /// Checks that a layer can be compared with the first.
    fn compare(&self, layer: &LabeledLayer) -> Result<(), CheckError> {
        let name = || layer.name.clone();
        if layer.size() != self.size {
            return Err(CheckError::Sizes { layer: name(), size: layer.size(), first: self.size });
        }
        match (layer.origin_mm, self.origin_mm) {
            (Some(origin), Some(first)) if origin != first => {
                Err(CheckError::Origins { layer: name() })
            }
            _ => Ok(()),
        }
    }

    /// Returns how far white may reach beyond the white below.
    fn limit(&self, layer: &LayerFacts) -> Option<OverhangLimit> {
        if self.options.islands_only {
            return None;
        }
        let of_layer = || layer.thickness_um.map(Length::from_um);
        let widths = self.options.max_overhang.or_else(of_layer)?.pixels(self.pitch?.x);
        Some(OverhangLimit { widths, metric: Metric::of(self.pitch) })
    }

    fn add(
        &mut self,
        layer: &Arc<LabeledLayer>,
        contact: Option<&LayerContact>,
    ) -> Result<(), CheckError> {
        let number = self.layers.len() as u32;
        // Without thicknesses, all layers weigh the same.
        let thickness_um = layer.facts.thickness_um.unwrap_or(1.0);
        self.growth.add(&layer.labelled, contact, number, thickness_um);
        if self.options.islands_only {
            self.layers.push(layer.facts);
            return Ok(());
        }
        self.liquid.add(&layer.labelled, contact, number, thickness_um);
        self.narrows.add(&layer.breaches, number, layer.facts.thickness_um);
        if let (Some(slenders), Some(um)) = (&mut self.slenders, layer.facts.thickness_um)
            && let Some(pitch) = self.pitch
        {
            let thickness = um / pitch.um()[0];
            slenders.add(&layer.labelled, &layer.sections, contact, number, thickness);
        }
        if let Some(contact) = contact {
            self.add_weak_joints(&layer.labelled, contact, number);
            // On a slope, patches of neighboring layers may be a limit and a pixel apart.
            let near = self.limit(&layer.facts).map_or([0; 2], |limit| {
                limit.metric.pixels(limit.widths).map(|side| side.ceil().min(1e9) as u32 + 1)
            });
            self.overhangs.add(&contact.patches, number, near);
        }
        if let Some((drain, hollows)) = &mut self.drain {
            let thickness_um = layer.facts.thickness_um;
            let thickness_um = thickness_um.ok_or(CheckError::NoScale("thick its layers are"))?;
            hollows.add(&layer.labelled, contact, number, thickness_um);
            drain.add(layer.clone(), thickness_um, hollows.numbers());
        }
        self.layers.push(layer.facts);
        Ok(())
    }

    fn add_weak_joints(&mut self, layer: &Labelled, contact: &LayerContact, number: u32) {
        for joints in contact.joints.chunk_by(|a, b| a.component == b.component) {
            let component = &layer.components.all[joints[0].component as usize];
            let support = joints.iter().map(|joint| joint.pixels).sum::<u64>();
            let is_weak = (support as f64) < self.options.least_support * component.area as f64;
            if component.is_white
                && is_weak
                && layer.hold_square(&[joints[0].component], self.options.rounding.get())
            {
                self.weak_joints.push(WeakJoint {
                    layer: number,
                    first: component.first,
                    area: component.area,
                    support,
                    centroid: component.centroid(),
                    region: component.region(),
                });
            }
        }
    }

    fn finish(mut self) -> Findings {
        self.growth.finish();
        self.liquid.finish();
        self.overhangs.finish();
        let slender = self.slenders.map(|mut slenders| {
            slenders.finish();
            slenders.ended
        });
        let weak_bonds = weak_bonds(&self.layers, &self.options.bonds);
        let narrow = self.drain.map(|(drain, hollows)| drain.finish(hollows)).unwrap_or_default();
        let mut pockets = self.liquid.pockets;
        narrow.list.into_iter().for_each(|pocket| pockets.push(pocket));
        pockets.left_out += narrow.left_out;
        let mut findings = Findings {
            layers: self.layers,
            pitch: self.pitch,
            origin_mm: self.origin_mm,
            size: self.size,
            widths: self.options.widths,
            bonds: self.options.bonds,
            aspects: self.options.aspects,
            islands: self.growth.islands,
            specks: self.growth.specks,
            weak_joints: self.weak_joints,
            overhangs: self.overhangs.ended,
            pockets,
            narrow: self.narrows.finish(),
            slender: slender.unwrap_or_default(),
            weak_bonds,
            off_balance: self.growth.off_balance,
        };
        findings.sort();
        findings
    }
}
