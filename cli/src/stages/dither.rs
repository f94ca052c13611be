//! The stage that turns gray layers into dots.

use clap::Args;
use lamp_grayscale::{DitherMethod, EVEN_DOTS, Homogeneity, UNEVEN_DOTS, homogeneity};
use lamp_stack::{Dpi, Image, Layer, Length, PassingLayer};

use crate::exit::Exit;
use crate::options::one_of_described;
use crate::progress::Progress;

/// Changes when other bytes come from the same options and layers.
pub(crate) const CODE: u32 = 3;

/// How dots are made.
#[derive(Args, Clone)]
pub(crate) struct DitherSettings {
    /// Dithering method
    #[arg(long, default_value_t, value_parser = one_of_described::<DitherMethod>(&[
        "Dots far from each other, in no pattern: a mask of 128 x 128 thresholds",
        "Bayer's pattern of 16 x 16 thresholds",
        "Error diffusion, with the thresholds of blue noise",
        "Error diffusion in rows that turn: the most even gray within a layer",
        "No dots: levels of 128 and more, of 255, are white",
    ]))]
    method: DitherMethod,
}

impl DitherSettings {
    /// Returns the options as one text, defaults filled in.
    pub(crate) fn canonical(&self) -> String {
        format!("dither --method {}", self.method)
    }

    /// Returns the layers as dots, and warns once if these may cure unevenly.
    pub(crate) fn layers<I: Iterator<Item = Result<Layer, Exit>>>(
        &self,
        layers: I,
        progress: &Progress,
    ) -> impl Iterator<Item = Result<Layer, Exit>> + use<I> {
        let mut warn = self.warning(progress);
        let layers = layers.inspect(move |layer| {
            if let Ok(Layer { dpi: Some(dpi), image, .. }) = layer
                && let Image::Gray(_) = **image
            {
                warn(*dpi);
            }
        });
        lamp_grayscale::dither(layers, self.method)
    }

    /// Returns the layers as [`layers`](Self::layers) does. Masks are not decoded.
    pub(crate) fn passing<'a>(
        &self,
        layers: impl Iterator<Item = Result<PassingLayer, Exit>> + 'a,
        decode: impl Fn(PassingLayer) -> Result<Layer, Exit> + Sync + 'a,
        progress: &Progress,
    ) -> impl Iterator<Item = Result<PassingLayer, Exit>> + 'a {
        let mut warn = self.warning(progress);
        let layers = layers.inspect(move |layer| {
            if let Ok(layer) = layer
                && let Some(dpi) = layer.dpi().filter(|_| layer.is_gray())
            {
                warn(dpi);
            }
        });
        lamp_grayscale::dither_passing(layers, self.method, decode)
    }

    /// Returns what warns once if dots of the pixels of gray layers may cure unevenly.
    fn warning(&self, progress: &Progress) -> impl FnMut(Dpi) + use<> {
        let progress = progress.clone();
        let mut told = self.method == DitherMethod::Threshold;
        move |dpi| {
            if let Some(line) = Some(dpi).filter(|_| !told).and_then(unevenness) {
                told = true;
                progress.say(&line);
            }
        }
    }
}

/// Returns a warning if the pixels of gray layers are wider than dots that are known to cure
/// evenly.
fn unevenness(dpi: Dpi) -> Option<String> {
    let pitch = dpi.pitch();
    let fear = match homogeneity(pitch) {
        Homogeneity::Even => return None,
        Homogeneity::Unknown => {
            "sizes between are untested: expose a test film, or slice at 1500 dpi or more"
        }
        Homogeneity::Uneven => "gray will cure as spots: slice at 1500 dpi or more",
    };
    let [pitch, even, uneven] = [pitch, EVEN_DOTS, UNEVEN_DOTS].map(short);
    Some(format!(
        "dots are as wide as pixels, {pitch} um; dots of {even} um cured evenly, those of \
         {uneven} um did not; {fear}"
    ))
}

/// Formats a length in micrometres, to one decimal.
fn short(length: Length) -> String {
    let um = (length.um() * 10.0).round() / 10.0;
    um.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(dpi: f64) -> Option<String> {
        unevenness(Dpi::new(dpi).unwrap())
    }

    #[test]
    fn dots_that_may_cure_unevenly_are_told_of_with_the_figures() {
        assert_eq!([1500.0, 2400.0].map(told), [None, None]);
        let unknown = told(1000.0).unwrap();
        let uneven = told(300.0).unwrap();
        assert!(unknown.contains("pixels, 25.4 um; dots of 17 um cured evenly"), "{unknown}");
        assert!(unknown.contains("those of 85 um did not; sizes between"), "{unknown}");
        assert!(uneven.contains("pixels, 84.7 um") && uneven.contains("spots"), "{uneven}");
    }
}
