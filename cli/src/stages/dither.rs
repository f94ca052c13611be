//! The stage that turns gray layers into dots.

use clap::Args;
use lamp_grayscale::{DitherMethod, EVEN_DOTS, Homogeneity, UNEVEN_DOTS, homogeneity};
use lamp_stack::{Image, Layer, Length};

use crate::exit::Exit;
use crate::options::one_of_described;
use crate::progress::Progress;

/// Changes when other bytes come from the same options and layers.
pub(crate) const CODE: u32 = 2;

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
        let (method, progress) = (self.method, progress.clone());
        let mut told = method == DitherMethod::Threshold;
        let layers = layers.inspect(move |layer| {
            if let Some(line) = layer.as_ref().ok().filter(|_| !told).and_then(unevenness) {
                told = true;
                progress.say(&line);
            }
        });
        lamp_grayscale::dither(layers, method)
    }
}

/// Returns a warning if the pixels of a gray layer are wider than dots that are known to cure
/// evenly.
fn unevenness(layer: &Layer) -> Option<String> {
    let Image::Gray(_) = *layer.image else { return None };
    let pitch = layer.dpi?.pitch();
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
    use lamp_stack::{Dpi, GrayMask, Mask, PageInfo};

    use super::*;

    fn told(dpi: Option<f64>, image: Image) -> Option<String> {
        let dpi = dpi.map(|dpi| Dpi::new(dpi).unwrap());
        unevenness(&Layer { info: PageInfo::default(), dpi, image: image.into() })
    }

    #[test]
    fn dots_that_may_cure_unevenly_are_told_of_with_the_figures() {
        let gray = || Image::Gray(GrayMask::new(8));
        for dpi in [None, Some(1500.0), Some(2400.0)] {
            assert_eq!(told(dpi, gray()), None);
        }
        assert_eq!(told(Some(100.0), Image::Mask(Mask::black(8, 0))), None);
        let unknown = told(Some(1000.0), gray()).unwrap();
        let uneven = told(Some(300.0), gray()).unwrap();
        assert!(unknown.contains("pixels, 25.4 um; dots of 17 um cured evenly"), "{unknown}");
        assert!(unknown.contains("those of 85 um did not; sizes between"), "{unknown}");
        assert!(uneven.contains("pixels, 84.7 um") && uneven.contains("spots"), "{uneven}");
    }
}
