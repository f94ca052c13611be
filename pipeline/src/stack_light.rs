//! The light of a stack's layers, by which design rules judge bonds and cure widths.

use std::path::Path;

use lamp_grayscale::exposure::Exposure;
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::{Dose, ExposureTime};
use lamp_stack::{Length, PageInfo};
use lamp_supports::{LayerCure, LayerLight};

use crate::error::Error;
use crate::exposure::ExposureSettings;
use crate::slice_settings::SlicingRecord;

/// The resin of a stack, and how its layers are exposed.
#[derive(Debug)]
pub struct StackLight {
    exposure: Exposure,
    resin: Material,
}

/// Why the light of layers is not known, as the end of a sentence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoLight(pub String);

const NO_RESIN: &str = "no resin is known: --material";

impl StackLight {
    /// Returns the name of the resin.
    pub fn resin(&self) -> &str {
        &self.resin.name
    }

    /// Returns the light by settings: of the layers that these slice, or of a stack.
    ///
    /// # Errors
    /// Returns an error if the material cannot be read, or says no cure depth.
    pub fn of_settings(settings: &ExposureSettings) -> Result<Result<Self, NoLight>, Error> {
        Ok(match settings.exposure()? {
            Some(recorded) => match recorded.exposure.material().cloned() {
                Some(resin) => Ok(Self { exposure: recorded.exposure, resin }),
                None => Err(NoLight(format!("{} has exposure times and no resin", recorded.word))),
            },
            None => Err(NoLight(NO_RESIN.to_owned())),
        })
    }

    /// Returns the light of a stack by the record on its first page. Materials that are no built-in ones are
    /// searched for in these folders.
    ///
    /// # Errors
    /// Returns why it is not known.
    pub fn of_stack(first: Option<&PageInfo>, folders: &[&Path]) -> Result<Self, NoLight> {
        let record = first.and_then(|info| info.stack.as_ref()).and_then(SlicingRecord::of);
        let Some(mut record) =
            record.filter(|it| it.settings.exposure != ExposureSettings::None {})
        else {
            return Err(NoLight(NO_RESIN.to_owned()));
        };
        let found = record.find_exposure(folders);
        let light = found.and_then(|()| Self::of_settings(&record.settings.exposure));
        light.unwrap_or_else(|error| Err(NoLight(format!("{error}: --material"))))
    }
}

impl LayerLight for StackLight {
    /// The dose comes from the page's exposure time, or else from the material.
    fn cure(&self, layer: &PageInfo) -> LayerCure {
        let Self { exposure, resin } = self;
        // Damaged pages may have other numbers.
        let thickness = layer.thickness_um.filter(|um| um.is_finite() && *um > 0.0);
        let thickness = thickness.map(Length::from_um);
        let time = layer.exposure_ms.filter(|ms| ms.is_finite() && *ms >= 0.0);
        let light = resin.light().ok().flatten();
        let dose = match (time, light) {
            (Some(ms), Some(light)) => Some(light * ExposureTime::from_ms(ms)),
            _ => thickness.and_then(|thickness| exposure.dose(thickness).ok().flatten()),
        };
        let width = |dose: Dose| {
            let [x, y] = resin.edge_growth(dose, thickness).ok().flatten()?;
            // Edges that draw back close nothing.
            Some(x.um().max(y.um()).max(0.0))
        };
        let fades_over = resin.working_curve().ok().flatten().map(|it| it.penetration_depth());
        let reaches_on =
            fades_over.zip(thickness).is_some_and(|(depth, thickness)| depth > thickness);
        let depth_um = dose.and_then(|dose| exposure.depth(dose)).map(Length::um);
        LayerCure {
            needs_others: reaches_on && depth_um == Some(0.0),
            depth_um,
            width_um: dose.and_then(width),
            broadening_um: exposure.broadening_depth().map(Length::um),
        }
    }
}
