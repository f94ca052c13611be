//! The stage that turns gray layers into dots.

use lamp_grayscale::{
    CoarseScreen, DitherError, DitherMethod, EVEN_DOTS, Homogeneity, UNEVEN_DOTS, homogeneity,
};
use lamp_stack::{
    CellsRecord, DitherRecord, Length, PassingLayer, Pitch, StackError, map_in_order,
};
use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::inside::{Unplaced, surrounded};
use crate::watcher::{Remark, Watcher};
use crate::words::{optional, text, words_of};

/// Changes when the same settings and layers give other bytes.
pub const CODE: u32 = 4;

/// How dots are made.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct DitherSettings {
    /// The method.
    #[serde(with = "text")]
    pub method: DitherMethod,
    /// The side of the cells inside parts.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub cell: Option<Length>,
    /// The share of white cells.
    #[serde(with = "text", skip_serializing_if = "is_half")]
    pub cell_level: f64,
    /// The least distance between cells and surfaces.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub cell_clearance: Option<Length>,
}

fn is_half(share: &f64) -> bool {
    *share == 0.5
}

impl Default for DitherSettings {
    fn default() -> Self {
        Self { method: DitherMethod::default(), cell: None, cell_level: 0.5, cell_clearance: None }
    }
}

impl DitherSettings {
    /// Returns the settings as one text, defaults filled in.
    pub fn canonical(&self) -> String {
        format!("dither{}", words_of(self))
    }

    /// Returns the layers as dots, and warns once if they may cure unevenly. Masks are not decoded, unless
    /// parts get cells inside.
    ///
    /// # Errors
    /// Returns an error if the settings of cells contradict each other. Layers fail that cannot be
    /// read or dithered, and layers with cells that do not state their place.
    pub fn layers<'a, E: From<DitherError> + From<StackError> + From<Error> + Send + 'a>(
        &self,
        layers: impl Iterator<Item = Result<PassingLayer, E>> + 'a,
        watcher: &'a dyn Watcher,
    ) -> Result<impl Iterator<Item = Result<PassingLayer, E>> + 'a, Error> {
        // A threshold makes no dots that could cure unevenly.
        let mut has_warned = self.method == DitherMethod::Threshold;
        let layers = layers.inspect(move |layer| {
            if let Ok(layer) = layer
                && let Some(pitch) = layer.pitch().filter(|_| !has_warned && layer.is_gray())
                && let Some(line) = unevenness(pitch)
            {
                has_warned = true;
                watcher.remark(Remark::note(line));
            }
        });
        let layers: Box<dyn Iterator<Item = Result<PassingLayer, E>> + 'a> = match self.screen()? {
            Some((screen, clearance)) => {
                if homogeneity(screen.cell) == Homogeneity::Unknown {
                    watcher.remark(Remark::note(format!(
                        "dots of {} um cured evenly, dots of {} um did not; whether cells of {} um do is \
                         untested",
                        short(EVEN_DOTS), short(UNEVEN_DOTS), short(screen.cell)
                    )));
                }
                Box::new(with_cells(layers, screen, clearance))
            }
            None => Box::new(layers),
        };
        Ok(lamp_grayscale::dither(layers, self.method))
    }

    /// Returns the screen inside parts, and its distance to surfaces.
    fn screen(&self) -> Result<Option<(CoarseScreen, Length)>, Error> {
        let (cell, clearance) = match (self.cell, self.cell_clearance) {
            (Some(cell), Some(clearance)) => (cell, clearance),
            (None, None) if is_half(&self.cell_level) => return Ok(None),
            _ => {
                let sentence =
                    "--cell needs --cell-clearance, the least distance between cells and surfaces";
                return Err(Error::settings(sentence));
            }
        };
        if homogeneity(cell) == Homogeneity::Even {
            return Err(Error::settings(format!(
                "--cell {cell}: cells of {} um or less cure evenly, so no resin between them stays \
                 liquid: give a wider cell, such as {UNEVEN_DOTS}",
                short(EVEN_DOTS)
            )));
        }
        if clearance.um() <= 0.0 {
            return Err(Error::settings("--cell-clearance must be above zero"));
        }
        let level = (self.cell_level * 255.0).round() as u8;
        Ok(Some((CoarseScreen { cell, level }, clearance)))
    }
}

/// Gives the white inside of parts the cells of a screen.
fn with_cells<E: From<StackError> + From<Error> + Send>(
    layers: impl Iterator<Item = Result<PassingLayer, E>>,
    screen: CoarseScreen,
    clearance: Length,
) -> impl Iterator<Item = Result<PassingLayer, E>> {
    let decoded = map_in_order(layers, |layer: PassingLayer| Ok(layer.decode()?));
    let placed = surrounded(decoded.map(|layer| layer.map_err(Failure)), clearance);
    map_in_order(placed.map(|layer| layer.map_err(|Failure(error)| error)), move |surrounded| {
        let inside = surrounded.inside(clearance);
        let (mut layer, pitch) = (surrounded.layer, surrounded.pitch);
        // Narrower ones would be single pixels, which may cure evenly.
        if screen.cell.um() < 2.0 * pitch.long_side().um() {
            return Err(E::from(Error::settings(format!(
                "--cell {}: cells are at least two pixels wide, and a pixel of this stack has {} um",
                screen.cell,
                short(pitch.long_side())
            ))));
        }
        if inside.change_count() > 0 {
            layer.image = screen.screened(&layer.image, &inside, pitch, layer.info.index).into();
            layer.info.set_record(&DitherRecord::Cells(CellsRecord {
                method: None,
                cell_um: screen.cell.um(),
                cell_level: f64::from(screen.level) / 255.0,
                cell_clearance_um: clearance.um(),
            }));
        }
        Ok(layer.into())
    })
}

/// An error of the layers, or of a layer without a place.
struct Failure<E>(E);

impl<E: From<Error>> From<Unplaced> for Failure<E> {
    fn from(unplaced: Unplaced) -> Self {
        Self(E::from(Error::work(format!(
            "layer {} does not state its resolution, height and thickness: --cell needs all three",
            unplaced.layer
        ))))
    }
}

/// Returns a warning if the pixels of gray layers are wider than dots known to cure evenly.
fn unevenness(pitch: Pitch) -> Option<String> {
    let pitch = pitch.long_side();
    let fear = match homogeneity(pitch) {
        Homogeneity::Even => return None,
        Homogeneity::Unknown => {
            "sizes between are untested: expose a test film, or slice at 1500 dpi or more"
        }
        Homogeneity::Uneven => "gray will cure as spots: slice at 1500 dpi or more",
    };
    let [pitch, even, uneven] = [pitch, EVEN_DOTS, UNEVEN_DOTS].map(short);
    Some(format!(
        "dots are as wide as pixels, {pitch} um; dots of {even} um cured evenly, dots of \
         {uneven} um did not; {fear}"
    ))
}

/// Formats a length in micrometers, to one decimal.
fn short(length: Length) -> String {
    let um = (length.um() * 10.0).round() / 10.0;
    um.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(dpi: f64) -> Option<String> {
        unevenness(Pitch::of_dpi(dpi).unwrap())
    }

    #[test]
    fn dots_that_may_cure_unevenly_are_told_of_with_the_figures() {
        assert_eq!([1500.0, 2400.0].map(told), [None, None]);
        let unknown = told(1000.0).unwrap();
        let uneven = told(300.0).unwrap();
        assert!(unknown.contains("pixels, 25.4 um; dots of 17 um cured evenly"), "{unknown}");
        assert!(unknown.contains("dots of 85 um did not; sizes between"), "{unknown}");
        assert!(uneven.contains("pixels, 84.7 um") && uneven.contains("spots"), "{uneven}");
    }
}
