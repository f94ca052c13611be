//! Images of the size of a printer's panel.

use std::cell::Cell;
use std::rc::Rc;

use lamp_build::{ImageBounds, frame_page};
use lamp_machine::{Machine, MachineLimit, Panel};
use lamp_slicing::{PixelGrid, Slices};
use lamp_stack::{Frame, Layer, PrintRecord, PrintStep};

use crate::build_findings::within_height;
use crate::error::{Error, ErrorKind};
use crate::slice_settings::SliceFrame;

/// Where a panel lies over the images of a part, and how it exposes them.
pub(crate) struct PanelFrame {
    record: PrintRecord,
    /// `None` if the images lie where they are wanted already.
    frame: Option<Frame>,
}

impl PanelFrame {
    /// Centers the part on the machine's panel, if it has one and no other place is given.
    pub(crate) fn new(machine: &Machine, slices: &Slices, frame: &SliceFrame) -> Option<Self> {
        let record = machine.print_record()?;
        let PixelGrid { origin_mm, pitch, .. } = *slices.grid();
        let pitch_mm = pitch.mm();
        let [low, high] = slices.box_mm();
        let [width, height] = record.panel_px;
        // The part's middle in pixels of its images; rows go down, where y goes up.
        let middle = [0, 1].map(|axis| f64::midpoint(low[axis], high[axis]) - origin_mm[axis]);
        let [across, down] = [middle[0] / pitch_mm[0], -middle[1] / pitch_mm[1]];
        let first = |middle: f64, side: u32| (middle - f64::from(side) / 2.0).round() as i64;
        let centered =
            Frame { left: first(across, width), top: first(down, height), width, height };
        let is_given = matches!(frame, SliceFrame::At { .. });
        Some(Self { record, frame: (!is_given).then_some(centered) })
    }

    /// Gives a layer the panel's size, and the stack the record of how it is exposed.
    pub(crate) fn place(&self, layer: &mut Layer) {
        if let Some(stack) = &mut layer.info.stack {
            stack.set_print_record(&self.record);
        }
        if let Some(frame) = self.frame {
            move_to(layer, frame);
        }
    }
}

fn move_to(layer: &mut Layer, frame: Frame) {
    let size = [layer.image.width(), layer.image.height()];
    let mut bounds = ImageBounds::of(&layer.info, layer.pitch, size).framed(frame);
    // Six decimals, as the grid has them.
    bounds.origin_mm = bounds.origin_mm.map(|mm| (mm * 1e6).round() / 1e6);
    frame_page(&mut layer.info, frame, &bounds);
    layer.image = layer.image.framed(frame).into();
}

/// Layers on a panel, and the number of those whose own moves were replaced.
type OnPanel<L> = (L, Rc<Cell<u64>>);

/// A stack that moves to a machine's panel.
struct Moving {
    machine: Machine,
    record: PrintRecord,
    /// The command that the stack records.
    command: String,
    /// The record of the printer that the stack was for.
    before: Option<PrintRecord>,
    /// The first layer's columns and rows.
    size: Option<[u32; 2]>,
}

/// Moves a stack to the panel of a machine: images of another size than the panel's are centered,
/// and exposures and moves become the machine's. A layer keeps an exposure of its own, which the
/// printer that the stack was for does not give. `word` is what the stack records of the machine.
///
/// The number counts layers whose own moves were replaced.
///
/// # Errors
/// Returns an error if the machine has no panel. Layers are errors if the machine does not build
/// them, if their pixels are not the panel's, or if a white pixel is beyond the panel.
pub fn on_panel<E, I>(
    layers: I,
    machine: Machine,
    word: &str,
) -> Result<OnPanel<impl Iterator<Item = Result<Layer, E>> + use<E, I>>, Error>
where
    E: From<Error> + From<MachineLimit>,
    I: Iterator<Item = Result<Layer, E>>,
{
    let Some(record) = machine.print_record() else {
        let name = &machine.name;
        return Err(Error::settings(format!(
            "the machine {name} has no [panel]: name one that has, such as mars3"
        )));
    };
    let command = format!("convert --machine {word}");
    let own_moves = Rc::new(Cell::new(0));
    let replaced = Rc::clone(&own_moves);
    let of_height = machine.clone();
    let mut moving = Moving { machine, record, command, before: None, size: None };
    let layers = layers.map(move |layer| {
        let mut layer = layer?;
        if layer.info.take_record::<PrintStep>().is_some() {
            replaced.set(replaced.get() + 1);
        }
        moving.place(&mut layer)?;
        Ok(layer)
    });
    Ok((within_height(layers, Some(of_height)), own_moves))
}

impl Moving {
    fn place(&mut self, layer: &mut Layer) -> Result<(), Error> {
        if self.size.is_none() {
            // Pictures have no metadata.
            let stack = layer.info.stack.get_or_insert_default();
            self.before = stack.print_record();
            stack.set_print_record(&self.record);
            stack.commands.push(self.command.clone());
        }
        self.expose(layer);
        let size = [layer.image.width(), layer.image.height()];
        self.check_pixels(layer, size)?;
        let [width, height] = self.record.panel_px;
        if size == [width, height] {
            return Ok(());
        }
        // An odd pixel goes to the left and above.
        let first = |axis: usize| {
            (i64::from(size[axis]) - i64::from(self.record.panel_px[axis])).div_euclid(2)
        };
        let frame = Frame { left: first(0), top: first(1), width, height };
        let back = Frame { left: -frame.left, top: -frame.top, width: size[0], height: size[1] };
        let is_cut = size[0] > width || size[1] > height;
        if is_cut && layer.image.framed(frame).framed(back) != *layer.image {
            let (name, machine) = (layer.info.name(), &self.machine.name);
            let [across, down] = size;
            return Err(Error::work(format!(
                "{name} has {across} x {down} pixels, and white ones beyond the middle {width} x \
                 {height}, which are the panel of {machine}: slice the part with --machine, which \
                 centers it"
            )));
        }
        move_to(layer, frame);
        Ok(())
    }

    /// Gives a layer the machine's exposure, if it had the printer's that the stack was for.
    fn expose(&self, layer: &mut Layer) {
        let (Some(before), Some(ms)) = (&self.before, layer.info.exposure_ms) else { return };
        let of = |record: &PrintRecord| record.step(layer.info.index).exposure_s * 1000.0;
        // Pages have times to a microsecond.
        if (of(before) - ms).abs() <= 1e-3 {
            layer.info.exposure_ms = Some((of(&self.record) * 1e3).round() / 1e3);
        }
    }

    /// Checks that a layer has the panel's pixels, and as many as the first.
    fn check_pixels(&mut self, layer: &mut Layer, size: [u32; 2]) -> Result<(), Error> {
        let of_machine = |limit| Error::new(ErrorKind::Work, limit);
        match layer.pitch {
            Some(pitch) => self.machine.check_panel_pitch(pitch).map_err(of_machine)?,
            // An image of the panel was made for it.
            None if size == self.record.panel_px => {
                layer.pitch = self.machine.panel.as_ref().and_then(Panel::pitch);
            }
            None => {
                let (name, machine) = (layer.info.name(), &self.machine.name);
                let [width, height] = size;
                return Err(Error::work(format!(
                    "{name} does not state its resolution, and with {width} x {height} pixels it \
                     is not an image of the panel of {machine}: make images of the panel's size"
                )));
            }
        }
        self.machine.check(layer).map_err(of_machine)?;
        let [width, height] = *self.size.get_or_insert(size);
        if size != [width, height] {
            let name = layer.info.name();
            let [across, down] = size;
            return Err(Error::work(format!(
                "{name} has {across} x {down} pixels, and the first {width} x {height}: they have \
                 no common middle on a panel"
            )));
        }
        Ok(())
    }
}
