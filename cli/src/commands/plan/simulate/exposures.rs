//! Bitmaps that are given: pages of a stack, or discs and rings in a text.

use std::ffi::OsStr;
use std::path::Path;

use anyhow::anyhow;
use lamp_grayscale::resin::ExposureTime;
use lamp_planning::ShownBitmap;
use lamp_planning::ecpl::RingExposure;
use lamp_planning::projector::Projector;

use crate::exit::Exit;
use crate::streams::{input_name, is_stream, layers_of, open_pages};

/// No plan takes longer.
const A_DAY_MS: f64 = 86_400_000.0;

/// Bitmaps in their order.
pub(super) struct Exposures {
    /// The file's name without its folder, or the text.
    pub(super) name: String,
    pub(super) bitmaps: Vec<ShownBitmap>,
}

impl Exposures {
    /// Reads bitmaps from a stack, or from a text if there is no file of that name.
    pub(super) fn read(given: &OsStr, projector: &Projector) -> Result<Self, Exit> {
        let path = Path::new(given);
        // A file of that name is meant as it is.
        let text = given.to_str().filter(|text| text.contains(':') && !path.exists());
        let exposures = match text {
            Some(text) => Self::of_text(text, projector)?,
            None => Self::of_stack(path, projector)?,
        };
        exposures
            .check_times(projector.step.value)
            .map_err(|error| error.at(exposures.name.clone()))?;
        Ok(exposures)
    }

    /// Draws discs and rings on the display.
    fn of_text(text: &str, projector: &Projector) -> Result<Self, Exit> {
        let [columns, rows] = [projector.display.columns, projector.display.rows];
        let bitmap = |text: &str| {
            let exposure: RingExposure =
                text.parse().map_err(|error| Exit::Usage(anyhow::Error::new(error)))?;
            let (reach, most) = (exposure.reach(), columns.min(rows) / 2);
            if reach > most {
                let name = &projector.name;
                return Err(Exit::usage(format!(
                    "{text}: the display of {name} reaches {most} mirrors from its middle"
                )));
            }
            Ok(ShownBitmap { image: exposure.drawn(columns, rows).into(), time: exposure.time })
        };
        let bitmaps = text.split(',').map(bitmap).collect::<Result<_, _>>()?;
        Ok(Self { name: text.to_owned(), bitmaps })
    }

    fn of_stack(path: &Path, projector: &Projector) -> Result<Self, Exit> {
        let mut bitmaps: Vec<ShownBitmap> = Vec::new();
        let [columns, rows] = [projector.display.columns, projector.display.rows];
        for layer in layers_of(open_pages(path)?, path, None) {
            let layer = layer?;
            let failed = |why: String| {
                let name = layer.info.name();
                Err(Exit::Failed(anyhow!("{name}: {why}")).at(input_name(path)))
            };
            let [width, height] = [layer.image.width(), layer.image.height()];
            if width > columns || height > rows {
                return failed(format!(
                    "it has {width} x {height} pixels, and the display of {} has {columns} x \
                     {rows} mirrors",
                    projector.name
                ));
            }
            if let Some(first) = bitmaps.first()
                && [first.image.width(), first.image.height()] != [width, height]
            {
                return failed("its size differs from the first page's".to_owned());
            }
            let Some(ms) = layer.info.exposure_ms else {
                return failed("it does not state how long it is shown (exposure_ms)".to_owned());
            };
            bitmaps.push(ShownBitmap {
                image: layer.image.into_image(),
                time: ExposureTime::from_ms(ms),
            });
        }
        let name = match path.file_name() {
            Some(name) if !is_stream(path) => name.to_string_lossy().into_owned(),
            _ => "-".to_owned(),
        };
        Ok(Self { name, bitmaps })
    }

    /// Checks that the display can show each as long.
    fn check_times(&self, step: ExposureTime) -> Result<(), Exit> {
        for (ShownBitmap { time, .. }, of) in self.bitmaps.iter().zip(1..) {
            // Times that were written as decimals may be short of a step by rounding.
            let is_shown = time.ms() >= step.ms() * (1.0 - 1e-9);
            if time.ms() > A_DAY_MS {
                return Err(Exit::Failed(anyhow!("bitmap {of} is shown for more than a day")));
            }
            if !is_shown {
                return Err(Exit::Failed(anyhow!(
                    "bitmap {of} is shown for {time}, and the display's step is {step}"
                )));
            }
        }
        Ok(())
    }

    /// Returns how long all take, in seconds.
    pub(super) fn seconds(&self) -> f64 {
        self.bitmaps.iter().map(|bitmap| bitmap.time.ms()).sum::<f64>() / 1000.0
    }
}
