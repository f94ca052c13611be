//! The stage that turns gray layers into dots.

use lamp_grayscale::{DitherError, DitherMethod, EVEN_DOTS, Homogeneity, UNEVEN_DOTS, homogeneity};
use lamp_stack::{Length, PassingLayer, Pitch, StackError};
use serde::{Deserialize, Serialize};

use crate::watcher::{Remark, Watcher};
use crate::words::{text, words_of};

/// Changes when the same settings and layers give other bytes.
pub const CODE: u32 = 3;

/// How dots are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct DitherSettings {
    /// The method.
    #[serde(with = "text")]
    pub method: DitherMethod,
}

impl DitherSettings {
    /// Returns the settings as one text, defaults filled in.
    pub fn canonical(&self) -> String {
        format!("dither{}", words_of(self))
    }

    /// Returns the layers as dots, and warns once if they may cure unevenly. Masks are not decoded.
    pub fn layers<'a, E: From<DitherError> + From<StackError> + Send + 'a>(
        &self,
        layers: impl Iterator<Item = Result<PassingLayer, E>> + 'a,
        watcher: &'a dyn Watcher,
    ) -> impl Iterator<Item = Result<PassingLayer, E>> + 'a {
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
        lamp_grayscale::dither(layers, self.method)
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
