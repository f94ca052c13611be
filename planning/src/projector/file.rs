//! Projector files.

use lamp_grayscale::resin::{Intensity, ModelError, plausible};
use lamp_stack::{Builtin, CatalogueError, Catalogued, Length};
use thiserror::Error;

use super::{GrayLight, Lens, Projector, Rays};

/// Why a projector's numbers contradict each other.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ProjectorError {
    /// The display has no mirrors, or more than any display has.
    #[error("display: columns and rows must be between 1 and 32768, 67 million mirrors at most")]
    Display,
    /// A number is outside of all that are known.
    #[error(transparent)]
    Implausible(#[from] ModelError),
    /// The file gives no spread of light, or two.
    #[error("spread: give either cone or sigma")]
    Spread,
    /// The file gives no light, or two that may contradict each other.
    #[error("give either [rays] or [light]")]
    Light,
    /// The numbers of rays cannot be counted.
    #[error("rays: points and directions must be between 1 and 99")]
    Rays,
    /// No projector has this light: a unit may be wrong.
    #[error("the light of a wide white field is {0}: no projector has this little or this much")]
    ImplausibleLight(Intensity),
    /// The shares of gray levels are invalid.
    #[error(
        "gray: shares must go from level 0 to 255, levels rising, shares from 0 to 1 and never falling"
    )]
    Gray,
    /// Rays leave a point in a wider or narrower beam than any lens accepts.
    #[error("lens: divergence must be above 0 and below 90 degrees")]
    Divergence,
    /// The lens does not focus light.
    #[error("lens: index must be above 1 and at most 5")]
    Index,
    /// The lens images the mirrors nowhere behind it.
    #[error("lens: {object} is too near to it: it images the mirrors nowhere")]
    NoImage {
        /// The distance from the mirrors to the middle of the lens.
        object: Length,
    },
    /// The lens is out of focus.
    #[error(
        "lens: it is out of focus by {off}: it images mirrors {object} away at {image}, not at \
         {wanted}; there, the light of a point would be {blur} wide, wider than a mirror's image \
         ({mirror})"
    )]
    OutOfFocus {
        /// The distance by which the image is off.
        off: Length,
        /// The distance from the mirrors to the middle of the lens.
        object: Length,
        /// The distance of the image.
        image: Length,
        /// The distance at which the image is wanted.
        wanted: Length,
        /// The width of the light of a point there.
        blur: Length,
        /// The side of a mirror's image.
        mirror: Length,
    },
}

/// The most mirrors along a side, and in all.
const MOST_MIRRORS: [u32; 2] = [1 << 15, 1 << 26];

macro_rules! builtin {
    ($name:literal) => {
        Builtin { name: $name, toml: include_str!(concat!("../../projectors/", $name, ".toml")) }
    };
}

impl Catalogued for Projector {
    const KIND: &'static str = "projector";
    const BUILTINS: &'static [Builtin] = &[builtin!("jariwala"), builtin!("zhao")];
    type CheckError = ProjectorError;

    fn name(&self) -> &str {
        &self.name
    }

    fn check(&self) -> Result<(), ProjectorError> {
        let [columns, rows] = [self.display.columns, self.display.rows];
        let possible = |mirrors: u32| (1..=MOST_MIRRORS[0]).contains(&mirrors);
        if !(possible(columns) && possible(rows) && columns * rows <= MOST_MIRRORS[1]) {
            return Err(ProjectorError::Display);
        }
        plausible::SIDE.check("pitch.value", self.pitch.value)?;
        if let Some(mirror) = &self.mirror {
            plausible::SIDE.check("mirror.side", mirror.side.value)?;
            plausible::SIDE.check_or_zero("mirror.gap", mirror.gap.value)?;
        }
        if let Some(voxel) = &self.voxel {
            plausible::SIDE.check("voxel.value", voxel.value)?;
        }
        if let Some(chamber) = &self.chamber {
            plausible::CHAMBER.check("chamber.value", chamber.value)?;
        }
        match (&self.spread.cone, &self.spread.sigma) {
            (Some(cone), None) => plausible::SPREAD.check_or_zero("spread.cone", cone.value)?,
            (None, Some(sigma)) => plausible::SPREAD.check_or_zero("spread.sigma", sigma.value)?,
            _ => return Err(ProjectorError::Spread),
        }
        plausible::STEP.check("step.value", self.step.value)?;
        self.check_light()?;
        self.gray.as_ref().map_or(Ok(()), GrayLight::check)?;
        self.lens.as_ref().map_or(Ok(()), |lens| lens.check(self.mirror_image()))
    }
}

impl Projector {
    /// Writes a projector's file, which reads back as the same projector.
    ///
    /// # Errors
    /// Returns an error if [`Self::from_toml`] would refuse what was written.
    ///
    /// # Panics
    /// Never: texts and numbers in tables are TOML.
    pub fn to_toml(&self) -> Result<String, CatalogueError<ProjectorError>> {
        let text = toml::to_string(self).expect("texts and numbers in tables are TOML");
        Self::from_toml(&text).map(|_| text)
    }

    fn check_light(&self) -> Result<(), ProjectorError> {
        if self.rays.is_some() == self.light.is_some() {
            return Err(ProjectorError::Light);
        }
        self.rays.as_ref().map_or(Ok(()), Rays::check)?;
        let light = self.irradiance();
        let fine = plausible::INTENSITY.contains(&light);
        if fine { Ok(()) } else { Err(ProjectorError::ImplausibleLight(light)) }
    }
}

impl Rays {
    fn check(&self) -> Result<(), ProjectorError> {
        let some = 1..=99;
        let countable = some.contains(&self.points) && some.contains(&self.directions);
        if countable { Ok(()) } else { Err(ProjectorError::Rays) }
    }
}

impl GrayLight {
    fn check(&self) -> Result<(), ProjectorError> {
        let shares = &self.shares;
        let ends = [shares.first(), shares.last()].map(|end| end.map(|&(level, _)| level));
        let rises = shares.windows(2).all(|two| two[0].0 < two[1].0 && two[0].1 <= two[1].1);
        let shares_of_one = shares.iter().all(|(_, share)| (0.0..=1.0).contains(share));
        let fine = ends == [Some(0), Some(255)] && rises && shares_of_one;
        if fine { Ok(()) } else { Err(ProjectorError::Gray) }
    }
}

impl Lens {
    /// Checks that it images points within the image of a mirror.
    fn check(&self, mirror: Length) -> Result<(), ProjectorError> {
        for (key, length) in [
            ("lens.radius", &self.radius),
            ("lens.object", &self.object),
            ("lens.image", &self.image),
        ] {
            plausible::LENS.check(key, length.value)?;
        }
        plausible::LENS.check_or_zero("lens.thickness", self.thickness.value)?;
        if !(1.0 < self.index.value && self.index.value <= 5.0) {
            return Err(ProjectorError::Index);
        }
        if !(0.0 < self.divergence.value && self.divergence.value < 90.0) {
            return Err(ProjectorError::Divergence);
        }
        let object = self.object.value;
        let focus = self.focus().ok_or(ProjectorError::NoImage { object })?;
        let blur = Length::from_um(2.0 * focus.blur.um());
        if blur.um() <= mirror.um() {
            return Ok(());
        }
        let [off, image] = [focus.off.um().abs(), focus.image.um()].map(rounded_to_10_um);
        let [blur, mirror] = [blur, mirror].map(|it| Length::from_um(it.um().round()));
        let wanted = self.image.value;
        Err(ProjectorError::OutOfFocus { off, object, image, wanted, blur, mirror })
    }
}

fn rounded_to_10_um(um: f64) -> Length {
    Length::from_um((um / 10.0).round() * 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::projector::SpreadOf;

    const WHOLE: &str = r#"name = "mine"
description = "A projector of mine"

[display]
columns = 1920
rows = 1080
source = "data sheet"

[mirror]
side = { value = "7 um", source = "data sheet" }
gap = { value = "0.6 um", source = "data sheet" }

[pitch]
value = "15.2 um"
source = "ruler"

[spread]
sigma = { value = "8 um", source = "camera" }

[light]
value = "12 mW/cm2"
source = "radiometer"

[step]
value = "10 ms"
source = "data sheet"

[chamber]
value = "0.5 mm"
source = "spacer"

[gray]
shares = [[0, 0], [128, 0.3], [255, 1]]
source = "radiometer"

[lens]
radius = { value = "50 mm", source = "data sheet" }
thickness = { value = "5 mm", source = "data sheet" }
index = { value = 1.5, source = "data sheet" }
object = { value = "150 mm", source = "ruler" }
image = { value = "309.69 mm", source = "ruler" }
divergence = { value = 1, source = "data sheet" }
"#;

    fn refused(from: &str, to: &str) -> String {
        assert!(WHOLE.contains(from), "{from}");
        let error = Projector::from_toml(&WHOLE.replacen(from, to, 1)).unwrap_err().to_string();
        assert!(!error.contains('\n'), "{error:?}");
        error
    }

    #[test]
    fn built_in_projectors_are_whole_and_bear_their_names() {
        for builtin in Projector::BUILTINS {
            let projector = Projector::from_toml(builtin.toml).unwrap();
            assert_eq!(projector.name, builtin.name);
        }
        assert!(Projector::BUILTINS.is_sorted_by_key(|builtin| builtin.name));
        let [jariwala, zhao] = ["jariwala", "zhao"].map(|name| Projector::builtin(name).unwrap());
        assert_eq!(zhao.spread(), SpreadOf::Cone(Length::from_um(12.0)));
        assert!((zhao.irradiance().mw_per_cm2() - 0.18821).abs() < 1e-5);
        assert!((zhao.mirror_image().um() - 25.838).abs() < 1e-3);
        assert!((zhao.image()[0].mm() - 28.550).abs() < 1e-3);
        assert_eq!(jariwala.irradiance().to_string(), "2.57 mW/cm2");
        assert!((jariwala.pitch.value.um() * 90.0 - 560.0).abs() < 1e-9);
        assert_eq!(jariwala.fill(), 1.0);
    }

    #[test]
    fn gray_levels_have_their_share() {
        let mine = Projector::from_toml(WHOLE).unwrap();
        assert_eq!([0, 64, 128, 255].map(|level| mine.share(level)), [0.0, 0.15, 0.3, 1.0]);
        let plain = Projector { gray: None, ..mine };
        assert_eq!([0, 51, 255].map(|level| plain.share(level)), [0.0, 0.2, 1.0]);
    }

    #[test]
    fn errors_name_the_key_and_what_to_do() {
        for (from, to, words) in [
            ("rows = 1080", "rows = 0", &["display", "between 1 and"][..]),
            ("rows = 1080", "rows = 32769", &["display", "between 1 and"]),
            ("1920\nrows = 1080", "32768\nrows = 32768", &["display", "67 million"]),
            ("15.2 um", "15.2", &["line 14", "pitch.value", "unit"]),
            ("15.2 um", "0 um", &["pitch.value must be above zero"]),
            ("15.2 um", "15.2 mm", &["pitch.value must be 0.01 to 1e3 um: a unit"]),
            ("\"7 um\"", "\"-7 um\"", &["mirror.side must be above zero"]),
            ("0.6 um", "-0.6 um", &["mirror.gap must be zero or more"]),
            ("sigma", "sigmas", &["line 18", "spread", "sigmas"]),
            ("sigma = { value = \"8 um\", source = \"camera\" }", "", &["either cone or sigma"]),
            ("8 um", "-8 um", &["spread.sigma must be zero or more"]),
            ("12 mW/cm2", "0 mW/cm2", &["wide white field", "0 mW/cm2"]),
            ("12 mW/cm2", "nan mW/cm2", &["light.value", "not an intensity"]),
            ("[light]", "[lamp]", &["unknown key `lamp`"]),
            ("\"radiometer\"", "\"\"", &["light.source", "is empty"]),
            ("10 ms", "0 ms", &["step.value must be above zero"]),
            ("0.5 mm", "0 mm", &["chamber.value must be above zero"]),
            ("[128, 0.3]", "[128, 1.3]", &["gray: shares"]),
            ("[128, 0.3]", "[255, 0.3]", &["gray: shares"]),
            ("[0, 0], ", "", &["gray: shares", "from level 0"]),
            ("[128, 0.3]", "[128, nan]", &["gray: shares"]),
            ("value = 1.5", "value = 1.0", &["lens: index"]),
            ("value = 1,", "value = nan,", &["lens: divergence"]),
            ("150 mm", "90 mm", &["lens", "nowhere"]),
            ("309.69 mm", "250 mm", &["out of focus by 59.69mm", "at 309.69mm, not at 250mm"]),
        ] {
            let error = refused(from, to);
            for word in words {
                assert!(error.contains(word), "no `{word}` in {error:?}");
            }
        }
        let rays = "[rays]\npoints = 9\ndirections = 15\nsource = \"a\"\n\
                    power = { value = \"1 mW\", source = \"a\" }\n[step]";
        assert_eq!(refused("[step]", rays), "give either [rays] or [light]");
    }

    #[test]
    fn the_lens_of_000_is_refused_with_how_far_it_is_off() {
        let lens = WHOLE
            .replace("15.2 um", "11.85 um")
            .replace("\"50 mm", "\"34.25 mm")
            .replace("\"5 mm\"", "\"4.4 mm\"")
            .replace("value = 1.5", "value = 1.460")
            .replace("150 mm", "152 mm")
            .replace("309.69 mm", "132 mm");
        let error = Projector::from_toml(&lens).unwrap_err().to_string();
        assert!(error.contains("out of focus by 15.22mm"), "{error}");
        assert!(error.contains("152mm away at 147.22mm, not at 132mm"), "{error}");
    }
}
