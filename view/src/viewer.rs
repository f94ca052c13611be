//! The server's answers, without the server.

use std::num::NonZeroU8;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use lamp_stack::{FixRecord, Frame, Image, Mask, Pitch};
use serde_json::{Value, json};

use crate::background::{Background, WorkProgress};
use crate::cache::{Cache, ImageKey, image_bytes};
use crate::drawing::DrawingSource;
use crate::edge::nearest_edge;
use crate::error::ViewError;
use crate::findings::Finding;
use crate::overlay::{Overlay, bands, fixed_bands};
use crate::pairs::{Partner, Partners, framed};
use crate::stack::{ViewedStack, place_mm};
use crate::surface_work::surface_of;
use crate::tile::{Inks, TILE_SIDE, TileAt, tile};

/// Stacks that are viewed together, and the images of them that are kept.
pub struct Viewer {
    stacks: Vec<ViewedStack>,
    partners: Partners,
    cache: Cache<ImageKind>,
    findings: Background<Vec<Finding>>,
    surface: Background<Vec<u8>>,
    version: &'static str,
    /// Bytes for decoded images.
    images: usize,
    /// Which viewer of the process this is, from 0: pages of an earlier one show other stacks.
    number: u64,
}

/// Which image of a layer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum ImageKind {
    /// As it is.
    Layer,
    /// White where a gray image has at least this level.
    Cured(NonZeroU8),
    /// Laid over it.
    Over(Overlay),
}

/// Whether nobody waits for an answer any more.
#[derive(Clone, Debug, Default)]
pub(crate) struct GivenUp(Arc<AtomicBool>);

impl GivenUp {
    pub(crate) fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn check(&self) -> Result<(), ViewError> {
        if self.0.load(Ordering::Relaxed) { Err(ViewError::GivenUp) } else { Ok(()) }
    }
}

/// The memory of a viewer besides its images: the page, the text of pages, answers.
const OTHER_MEMORY: u64 = 32 << 20;
/// The memory of a thread besides the images that it makes.
const MEMORY_A_THREAD: u64 = 48 << 20;

/// Returns how much of the memory decoded images may take: at least half of it.
fn for_images(memory: u64, threads: usize) -> u64 {
    // One more thread decodes ahead.
    let others = OTHER_MEMORY + (threads as u64 + 1) * MEMORY_A_THREAD;
    memory - others.min(memory / 2)
}

impl Viewer {
    /// Views stacks; the second is compared with the first. `memory` is in bytes, and as many
    /// `threads` will ask.
    pub fn new(
        stacks: Vec<ViewedStack>,
        memory: u64,
        threads: usize,
        version: &'static str,
    ) -> Self {
        let images = for_images(memory, threads).try_into().unwrap_or(usize::MAX);
        Self::numbered(0, stacks, images, version)
    }

    fn numbered(
        number: u64,
        stacks: Vec<ViewedStack>,
        images: usize,
        version: &'static str,
    ) -> Self {
        Self {
            partners: Partners::of(&stacks),
            stacks,
            cache: Cache::new(images),
            findings: Background::default(),
            surface: Background::default(),
            version,
            images,
            number,
        }
    }

    /// Returns the maker of the viewer that follows this one, with the same limits.
    pub(crate) fn next(&self) -> impl FnOnce(Vec<ViewedStack>) -> Self + use<> {
        let &Self { images, number, version, .. } = self;
        move |stacks| Self::numbered(number + 1, stacks, images, version)
    }

    pub(crate) fn number(&self) -> u64 {
        self.number
    }

    /// The stacks, in the order in which they were given.
    pub fn stacks(&self) -> &[ViewedStack] {
        &self.stacks
    }

    /// Shows findings of the first stack.
    pub fn set_findings(&self, findings: Vec<Finding>) {
        self.findings.run(|_| Ok(findings));
    }

    /// Looks for findings of the first stack on a thread of their own.
    pub fn find(
        self: &Arc<Self>,
        find: impl FnOnce(&ViewedStack, &WorkProgress) -> Result<Vec<Finding>, String> + Send + 'static,
    ) {
        let viewer = Arc::clone(self);
        // Before the thread runs: the page asks at once whether there will be findings.
        self.findings.start();
        std::thread::spawn(move || {
            viewer.findings.run(|progress| find(&viewer.stacks[0], progress));
        });
    }

    /// Makes the surface of the first stack on a thread of its own, unless that was begun before.
    pub(crate) fn want_surface(self: &Arc<Self>) {
        if !self.stacks.is_empty() && self.surface.start_once() {
            let viewer = Arc::clone(self);
            std::thread::spawn(move || {
                viewer.surface.run(|progress| surface_of(&viewer.stacks[0], progress));
            });
        }
    }

    /// Returns what is viewed.
    pub(crate) fn session(&self) -> Value {
        let overlays: Vec<Value> = Overlay::ALL
            .into_iter()
            .filter(|overlay| self.has(*overlay))
            .map(|overlay| {
                let colours = overlay.colours().iter();
                let colours: Vec<String> = colours
                    .map(|[red, green, blue]| format!("#{red:02x}{green:02x}{blue:02x}"))
                    .collect();
                // Who asks for findings wants to see at once where they are.
                let faults = matches!(overlay, Overlay::Stray | Overlay::Findings);
                let on = faults && self.findings.is_wanted();
                json!({"id": overlay.name(), "label": overlay.label(), "colors": colours, "on": on})
            })
            .collect();
        json!({
            "version": self.version,
            "number": self.number,
            "tile": TILE_SIDE,
            "stacks": self.stacks.iter().map(ViewedStack::summary).collect::<Vec<_>>(),
            "overlays": overlays,
            "comparable": self.partners.are_comparable(),
            "findings": self.findings.is_wanted(),
        })
    }

    fn has(&self, overlay: Overlay) -> bool {
        let any = |has: &dyn Fn(&lamp_stack::PageHeader) -> bool| {
            self.stacks.iter().flat_map(ViewedStack::headers).any(has)
        };
        match overlay {
            Overlay::Below | Overlay::New => true,
            Overlay::Added | Overlay::Missing => self.partners.are_comparable(),
            Overlay::Fixed => any(&|header| header.info.has_record::<FixRecord>()),
            Overlay::Stray => any(&|header| !header.info.stray_rows.is_empty()),
            Overlay::Copies => self.stacks.iter().any(|stack| !stack.copies.all().is_empty()),
            Overlay::Findings => self.findings.is_wanted(),
        }
    }

    pub(crate) fn stack(&self, stack: usize) -> Result<&ViewedStack, ViewError> {
        self.stacks.get(stack).ok_or(ViewError::NoSuch("stack"))
    }

    /// Returns what is known of a layer without its image.
    pub(crate) fn layer(&self, stack: usize, layer: usize) -> Result<Value, ViewError> {
        self.stack(stack)?.layer(layer)
    }

    /// Returns the facts of all layers of a stack, as columns.
    pub(crate) fn layers(&self, stack: usize) -> Result<Value, ViewError> {
        let of = self.stack(stack)?;
        let partner = |layer: usize| self.partners.middle(&self.stacks, stack, layer);
        let partners: Vec<_> = (0..of.headers().len()).map(partner).collect();
        let mut columns = of.layers();
        columns["partner"] =
            partners.iter().map(|partner| partner.as_ref().map(|partner| partner.layer)).collect();
        columns["shift"] =
            partners.iter().map(|partner| partner.as_ref().map(|partner| partner.shift)).collect();
        Ok(columns)
    }

    /// Draws a tile.
    pub(crate) fn tile(
        &self,
        stack: usize,
        layer: usize,
        kind: ImageKind,
        at: TileAt,
        given_up: &GivenUp,
    ) -> Result<Vec<u8>, ViewError> {
        // A tile that there is not costs nothing.
        let size = self.stack(stack)?.header(layer)?.size;
        at.on(size).ok_or(ViewError::NoSuch("tile"))?;
        let image = self.image(stack, layer, kind, given_up)?;
        given_up.check()?;
        let inks = match kind {
            ImageKind::Over(Overlay::Copies) => Inks::Each(&self.stacks[stack].copies),
            ImageKind::Over(overlay) => Inks::One(overlay.colours()[0]),
            ImageKind::Layer | ImageKind::Cured(_) => Inks::Gray,
        };
        tile(&image, at, inks).ok_or(ViewError::NoSuch("tile"))
    }

    /// Returns an image of a layer.
    pub(crate) fn image(
        &self,
        stack: usize,
        layer: usize,
        kind: ImageKind,
        given_up: &GivenUp,
    ) -> Result<Arc<Image>, ViewError> {
        let of = self.stack(stack)?;
        of.header(layer)?;
        given_up.check()?;
        let key = ImageKey { stack, layer, kind };
        match kind {
            ImageKind::Layer => self.cache.get(key, of.expected_bytes(layer), || of.image(layer)),
            ImageKind::Cured(level) => {
                let image = self.image(stack, layer, ImageKind::Layer, given_up)?;
                // Any level keeps the white of a mask, so the same image serves, and is kept once.
                if matches!(*image, Image::Mask(_)) {
                    return Ok(image);
                }
                let cured = || Ok(Image::Mask(Image::clone(&image).into_mask(level)));
                self.cache.get(key, image_bytes(&image), cured)
            }
            ImageKind::Over(Overlay::Findings) if self.findings.get(|_| ()).is_none() => {
                // They may come yet, so this is not kept.
                let [width, height] = of.header(layer)?.size;
                Ok(Arc::new(Image::Mask(Mask::black(width, height))))
            }
            ImageKind::Over(overlay) => {
                let drawing = self.drawing(stack, layer, overlay, given_up)?;
                self.cache.get(key, drawing.most_bytes(), || Ok(Image::Mask(drawing.draw())))
            }
        }
    }

    /// Gathers what an overlay is drawn from.
    fn drawing(
        &self,
        stack: usize,
        layer: usize,
        overlay: Overlay,
        given_up: &GivenUp,
    ) -> Result<DrawingSource, ViewError> {
        let image = |stack, layer| self.image(stack, layer, ImageKind::Layer, given_up);
        let below = || layer.checked_sub(1).map(|below| image(stack, below)).transpose();
        let header = self.stack(stack)?.header(layer)?;
        Ok(match overlay {
            Overlay::Below | Overlay::New => {
                let [width, height] = header.size;
                let frame = Frame { left: 0, top: 0, width, height };
                let others = vec![below()?.map(|below| framed(below, frame))];
                let in_layer = overlay == Overlay::New;
                DrawingSource::Differs { layer: image(stack, layer)?, others, in_layer }
            }
            Overlay::Added | Overlay::Missing => {
                let others = self.partners.of_layer(&self.stacks, stack, layer);
                let framed = |other: Option<Partner>| {
                    other
                        .map(|at| Ok(at.framed(image(at.stack, at.layer)?, header.size)))
                        .transpose()
                };
                let others = others.into_iter().map(framed).collect::<Result<_, ViewError>>()?;
                // Added pixels are white in the second stack alone, also where it is the one looked
                // at.
                let in_layer = (overlay == Overlay::Added) == (stack == 1);
                DrawingSource::Differs { layer: image(stack, layer)?, others, in_layer }
            }
            Overlay::Fixed => {
                DrawingSource::Rows { bands: fixed_bands(&header.info), size: header.size }
            }
            Overlay::Stray => {
                DrawingSource::Rows { bands: bands(&header.info.stray_rows), size: header.size }
            }
            // All white of the layer: the tile has the colors.
            Overlay::Copies => DrawingSource::Differs {
                layer: image(stack, layer)?,
                others: vec![None],
                in_layer: true,
            },
            Overlay::Findings => {
                let of_layer = |found: &Vec<Finding>| {
                    found.iter().filter(|found| stack == 0 && found.is_in(layer)).cloned().collect()
                };
                let found: Vec<Finding> = self.findings.get(of_layer).unwrap_or_default();
                DrawingSource::Findings { found, layer: image(stack, layer)?, below: below()? }
            }
        })
    }

    /// Returns what is known of a pixel.
    pub(crate) fn pixel(
        &self,
        stack: usize,
        layer: usize,
        [x, y]: [u32; 2],
        threshold: Option<NonZeroU8>,
        given_up: &GivenUp,
    ) -> Result<Value, ViewError> {
        let of = self.stack(stack)?;
        let header = of.header(layer)?;
        if x >= header.size[0] || y >= header.size[1] {
            return Err(ViewError::NoSuch("pixel"));
        }
        let image = self.image(stack, layer, ImageKind::Layer, given_up)?;
        let level = image.level(x, y);
        let white = level >= threshold.map_or(1, NonZeroU8::get);
        let place = place_mm(header, x, y);
        let here = |found: &Vec<Finding>| {
            let all =
                found.iter().enumerate().filter(|(_, found)| stack == 0 && found.is_in(layer));
            let holds = |found: &Finding| {
                found.bounds.is_some_and(|[left, top, right, bottom]| {
                    (left..right).contains(&x) && (top..bottom).contains(&y)
                })
            };
            all.filter(|(_, found)| holds(found)).map(|(id, _)| id).collect()
        };
        let found: Vec<usize> = self.findings.get(here).unwrap_or_default();
        Ok(json!({
            "level": level,
            "white": white,
            "x_mm": place.map(|[x, _]| x),
            "y_mm": place.map(|[_, y]| y),
            "copy": of.copies.at(x, y),
            "component": self.component(&image, [x, y], threshold),
            "findings": found,
        }))
    }

    /// Returns the area and the rectangle of the component that holds a pixel, unless the layer
    /// has so many edges that one would wait for it.
    fn component(&self, image: &Image, [x, y]: [u32; 2], threshold: Option<NonZeroU8>) -> Value {
        const MOST_CHANGES: usize = 20_000_000;
        if image.change_count() > MOST_CHANGES {
            return Value::Null;
        }
        let mask = image.clone().into_mask(threshold.unwrap_or(NonZeroU8::MIN));
        let runs = lamp_supports::component_at(&mask, x, y);
        let area: u64 = runs.iter().map(|(_, columns)| columns.len() as u64).sum();
        let columns = || runs.iter().map(|(_, columns)| columns);
        let left = columns().map(|columns| columns.start).min();
        let right = columns().map(|columns| columns.end).max();
        let rows = runs.first().map(|run| run.0)..runs.last().map(|run| run.0 + 1);
        json!({"area_px": area, "box": [left, rows.start, right, rows.end]})
    }

    /// Returns the point nearest to a point on an edge between black and white.
    pub(crate) fn edge(
        &self,
        stack: usize,
        layer: usize,
        at: [f64; 2],
        radius: f64,
        given_up: &GivenUp,
    ) -> Result<Value, ViewError> {
        if !(radius >= 0.0 && at.iter().all(|at| at.is_finite())) {
            return Err(ViewError::Malformed("x, y and radius must be numbers"));
        }
        let image = self.image(stack, layer, ImageKind::Layer, given_up)?;
        let pitch = self.stacks[stack].header(layer)?.pitch;
        let aspect = pitch.map_or(1.0, Pitch::aspect);
        let point = nearest_edge(&image.exposed(), at, radius, aspect);
        Ok(json!({"x": point.map(|point| point[0]), "y": point.map(|point| point[1])}))
    }

    /// Returns how far the search for findings is, and what it found.
    pub(crate) fn findings(&self) -> Value {
        let mut state = self.findings.state();
        let list = self.findings.get(|found| {
            let numbered = found.iter().enumerate().map(|(id, found)| {
                let mut json = serde_json::to_value(found).expect("findings are plain");
                json["id"] = id.into();
                json
            });
            numbered.collect::<Vec<Value>>()
        });
        state["list"] = list.unwrap_or_default().into();
        state
    }

    /// Returns how far the surface is.
    pub(crate) fn surface_state(&self) -> Value {
        self.surface.state()
    }

    /// Returns the surface, if it is ready.
    pub(crate) fn surface(&self) -> Result<Vec<u8>, ViewError> {
        self.surface.get(Vec::clone).ok_or(ViewError::NoSuch("surface yet"))
    }
}

#[cfg(test)]
#[path = "viewer_tests.rs"]
mod tests;
