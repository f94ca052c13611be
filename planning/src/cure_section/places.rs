//! The sizes that a stack cures at named places.

use std::fmt;
use std::ops::Range;

use lamp_grayscale::SolidHeights;
use lamp_grayscale::resin::{Dose, Resin};
use lamp_stack::{Layer, Length, LengthError, read_toml};
use rayon::prelude::*;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};

use super::error::{CureSectionError, PlacesError};
use super::exposures::{CureRule, CureSection};
use super::line::{SectionLine, SectionPlane};

/// Places with names, from a TOML file, in part coordinates.
///
/// Two lengths make a line along the third axis, whose cured length counts: a column has a thickness
/// or height, a line along x or y a width. Ranges alone make a box, whose cured volume counts. An axis
/// that is left out has all of the part.
///
/// ```
/// use lamp_planning::cure_section::Places;
///
/// let places = Places::parse(
///     "[[place]]
///      name = 'notch'
///      x = '0mm'
///      y = '0mm'
///      wanted = '479um'
///      [[place]]
///      name = 'bridge'
///      x = ['-1.1mm', '1.1mm']
///      wanted = '0.9mm3'",
/// )?;
/// assert_eq!(places.all().len(), 2);
/// # Ok::<(), lamp_planning::cure_section::PlacesError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Places(Vec<Place>);

/// A place, with the sizes that its file states.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// Its name.
    pub name: String,
    pub(crate) shape: Shape,
    /// The wanted size.
    pub wanted: Option<PlaceSize>,
    /// The size measured on a print.
    pub measured: Option<PlaceSize>,
    /// The standard deviation of the measured size.
    pub sd: Option<PlaceSize>,
}

/// A size of a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PlaceSize {
    /// The length of a line.
    Length(Length),
    /// The volume of a box, in mm³.
    Volume(f64),
}

impl PlaceSize {
    /// Returns the number, in micrometers or mm³.
    pub fn number(self) -> f64 {
        match self {
            Self::Length(length) => length.um(),
            Self::Volume(mm3) => mm3,
        }
    }
}

/// A line or a box, with ranges in millimeters. A range may be endless.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Shape {
    /// Along z.
    Column {
        x: Length,
        y: Length,
        z: Range<f64>,
    },
    /// Along x.
    AlongX {
        y: Length,
        z: Length,
        x: Range<f64>,
    },
    /// Along y.
    AlongY {
        x: Length,
        z: Length,
        y: Range<f64>,
    },
    Box {
        x: Range<f64>,
        y: Range<f64>,
        z: Range<f64>,
    },
}

const ALL: Range<f64> = f64::NEG_INFINITY..f64::INFINITY;

/// A file of places.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlacesFile {
    place: Vec<PlaceTable>,
    /// Another table of the same print.
    csv: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlaceTable {
    name: String,
    x: Option<Coordinate>,
    y: Option<Coordinate>,
    z: Option<Coordinate>,
    wanted: Option<String>,
    measured: Option<String>,
    sd: Option<String>,
}

/// A length, or the ends of a range.
enum Coordinate {
    At(Length),
    Within(Range<f64>),
}

impl<'de> Deserialize<'de> for Coordinate {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(
            untagged,
            expecting = "write a place such as \"12mm\", or a range such as [\"10mm\", \"14mm\"]"
        )]
        enum Written {
            At(String),
            Within([String; 2]),
        }
        let length = |text: &str| text.parse::<Length>().map_err(D::Error::custom);
        match Written::deserialize(from)? {
            Written::At(text) => Ok(Self::At(length(&text)?)),
            Written::Within([low, high]) => {
                let range = length(&low)?.mm()..length(&high)?.mm();
                if range.is_empty() {
                    let problem = format!("the range from {low} to {high} is empty");
                    return Err(D::Error::custom(problem));
                }
                Ok(Self::Within(range))
            }
        }
    }
}

impl Place {
    fn new(table: PlaceTable) -> Result<Self, PlacesError> {
        use Coordinate::{At, Within};
        let PlaceTable { name, x, y, z, wanted, measured, sd } = table;
        let shape = match [x, y, z].map(|of| of.unwrap_or(Within(ALL))) {
            [At(x), At(y), Within(z)] => Shape::Column { x, y, z },
            [Within(x), At(y), At(z)] => Shape::AlongX { y, z, x },
            [At(x), Within(y), At(z)] => Shape::AlongY { x, z, y },
            [Within(x), Within(y), Within(z)] => Shape::Box { x, y, z },
            _ => return Err(PlacesError::Shape(name)),
        };
        let size = |text: Option<String>, key| {
            let read = |text: String| match &shape {
                Shape::Box { .. } => volume(&text).map(PlaceSize::Volume),
                _ => text
                    .parse()
                    .map(PlaceSize::Length)
                    .map_err(|error: LengthError| error.to_string()),
            };
            let size = text.map(read).transpose();
            size.map_err(|problem| PlacesError::Size { name: name.clone(), key, problem })
        };
        let (wanted, measured) = (size(wanted, "wanted")?, size(measured, "measured")?);
        let sd = size(sd, "sd")?;
        Ok(Self { name, shape, wanted, measured, sd })
    }

    /// Returns the place as TOML.
    fn to_toml(&self) -> String {
        let mut text = format!("[[place]]\nname = {}\n", toml::Value::from(self.name.as_str()));
        let mut line = |key: &str, value: String| text += &format!("{key} = {value}\n");
        let at = |length: &Length| Some(format!("\"{}mm\"", length.mm()));
        // A range without ends is left out.
        let within = |range: &Range<f64>| {
            let text = format!("[\"{}mm\", \"{}mm\"]", range.start, range.end);
            range.start.is_finite().then_some(text)
        };
        let [x, y, z] = match &self.shape {
            Shape::Column { x, y, z } => [at(x), at(y), within(z)],
            Shape::AlongX { y, z, x } => [within(x), at(y), at(z)],
            Shape::AlongY { x, z, y } => [at(x), within(y), at(z)],
            Shape::Box { x, y, z } => [within(x), within(y), within(z)],
        };
        for (axis, text) in [("x", x), ("y", y), ("z", z)] {
            if let Some(text) = text {
                line(axis, text);
            }
        }
        let sizes = [("wanted", self.wanted), ("measured", self.measured), ("sd", self.sd)];
        for (key, size) in sizes.into_iter().filter_map(|(key, size)| Some((key, size?))) {
            line(
                key,
                match size {
                    PlaceSize::Length(length) => format!("\"{}um\"", length.um()),
                    PlaceSize::Volume(mm3) => format!("\"{mm3}mm3\""),
                },
            );
        }
        text
    }

    /// Returns the unit of its size: `um` or `mm3`.
    pub fn unit(&self) -> &'static str {
        if matches!(self.shape, Shape::Box { .. }) { "mm3" } else { "um" }
    }

    /// Returns a length as a size of the place, if that is a length.
    pub(crate) fn length(&self, um: f64) -> Option<PlaceSize> {
        let is_box = matches!(self.shape, Shape::Box { .. });
        (!is_box).then(|| PlaceSize::Length(Length::from_um(um)))
    }

    /// Returns a number in the place's unit as its size, as a table has it: to the nanometer, or to a cube
    /// of 10 um.
    pub(crate) fn rounded(&self, number: f64) -> PlaceSize {
        let length = self.length((1000.0 * number).round() / 1000.0);
        length.unwrap_or(PlaceSize::Volume((1e6 * number).round() / 1e6))
    }

    /// Returns the planes of the sections that show the place, in images like the layer's.
    fn planes(&self, layer: &Layer) -> Result<Vec<SectionPlane>, CureSectionError> {
        Ok(match &self.shape {
            Shape::Column { x, y, .. } => {
                SectionLine::new(SectionPlane::X(*x), layer)?;
                vec![SectionPlane::Y(*y)]
            }
            Shape::AlongX { y, .. } => vec![SectionPlane::Y(*y)],
            Shape::AlongY { x, .. } => vec![SectionPlane::X(*x)],
            Shape::Box { y, .. } => {
                let planes = SectionLine::rows_within(y, layer)?;
                if planes.is_empty() {
                    return Err(CureSectionError::EmptyStretch);
                }
                planes
            }
        })
    }

    /// Returns the size that is cured, from the sections of its planes.
    fn size(&self, sections: &[(&SectionLine, &[SolidHeights])]) -> PlaceSize {
        let within = |solid: &SolidHeights, z: &Range<f64>| -> f64 {
            let shared =
                |[from, to]: &[f64; 2]| (to / 1000.0).min(z.end) - (from / 1000.0).max(z.start);
            solid.iter().map(|stretch| shared(stretch).max(0.0)).sum()
        };
        let along = |z: Length, range: &Range<f64>| {
            let holds = |solid: &SolidHeights| {
                solid.iter().any(|[from, to]| (*from..*to).contains(&z.um()))
            };
            let cured = |(line, cured): &(&SectionLine, &[SolidHeights])| {
                let pixels =
                    line.within(range).filter(|at| cured.get(*at as usize).is_some_and(holds));
                pixels.count() as f64 * line.pixel_mm()
            };
            Length::from_mm(sections.iter().map(cured).sum())
        };
        match &self.shape {
            Shape::Column { x, z, .. } => {
                let at = |(line, cured): &(&SectionLine, &[SolidHeights])| {
                    Some(within(cured.get(line.pixel_at(*x) as usize)?, z))
                };
                PlaceSize::Length(Length::from_mm(sections.iter().filter_map(at).sum()))
            }
            Shape::AlongX { z, x, .. } => PlaceSize::Length(along(*z, x)),
            Shape::AlongY { z, y, .. } => PlaceSize::Length(along(*z, y)),
            Shape::Box { x, z, .. } => {
                let volume = |(line, cured): &(&SectionLine, &[SolidHeights])| {
                    let solids = line.within(x).filter_map(|at| cured.get(at as usize));
                    let [wide, high] = line.pitch.mm();
                    solids.map(|solid| within(solid, z)).sum::<f64>() * wide * high
                };
                // The sum of nothing is -0.
                PlaceSize::Volume(sections.iter().map(volume).sum::<f64>() + 0.0)
            }
        }
    }
}

/// Parses `0.27mm3`.
fn volume(text: &str) -> Result<f64, String> {
    let number = text.trim().strip_suffix("mm3").and_then(|number| number.trim().parse().ok());
    number
        .filter(|mm3: &f64| mm3.is_finite())
        .ok_or_else(|| format!("`{text}` is not a volume: write one such as 0.27mm3"))
}

impl Places {
    /// Reads places from TOML.
    ///
    /// # Errors
    /// Returns an error if the text is not TOML, if a key is unknown, missing or wrong, if two places
    /// have one name, or if a place is a point.
    pub fn parse(text: &str) -> Result<Self, PlacesError> {
        Self::parse_with_table(text).map(|(places, _)| places)
    }

    /// Reads places, and the text of the table `csv` of the same print, if there is one.
    pub(crate) fn parse_with_table(text: &str) -> Result<(Self, Option<String>), PlacesError> {
        let file: PlacesFile = read_toml(text)?;
        let mut places: Vec<Place> = Vec::new();
        for table in file.place {
            let place = Place::new(table)?;
            if places.iter().any(|other| other.name == place.name) {
                return Err(PlacesError::Twice(place.name));
            }
            places.push(place);
        }
        Ok((Self(places), file.csv))
    }

    /// Returns places that have other names.
    pub(crate) fn of(places: Vec<Place>) -> Self {
        Self(places)
    }

    /// Returns the file of the places, which [`parse`](Self::parse) reads.
    pub fn to_toml(&self) -> String {
        self.0.iter().map(Place::to_toml).collect::<Vec<_>>().join("\n")
    }

    /// Returns the places, in the order of their file.
    pub fn all(&self) -> &[Place] {
        &self.0
    }
}

impl fmt::Display for PlaceSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length(length) => write!(f, "{:.1} um", length.um()),
            Self::Volume(mm3) => write!(f, "{mm3:.4} mm3"),
        }
    }
}

/// The resin that a stack cures at places.
///
/// Time and memory grow with the rows of pixels that the places lie on.
#[derive(Debug)]
pub struct CuredPlaces<'a> {
    /// The sections of each place, by their numbers.
    of_places: Vec<(&'a Place, Vec<usize>)>,
    sections: Vec<CureSection<'a>>,
}

/// The sizes of a place that exposures cure, with their names: `white`, with every pixel that is not
/// black exposed in full, and `gray`, by gray levels, if there are any.
pub type CuredSizes = Vec<(&'static str, PlaceSize)>;

impl<'a> CuredPlaces<'a> {
    /// Starts without a layer, for images like the layer's.
    ///
    /// # Errors
    /// Returns an error if the layer does not state its position or resolution, or if a place lies beside
    /// its image.
    pub fn new(
        places: &'a Places,
        resin: &'a Resin,
        rule: CureRule,
        layer: &Layer,
    ) -> Result<Self, CureSectionError> {
        let (mut of_places, mut sections) = (Vec::new(), Vec::<CureSection<'a>>::new());
        for place in places.all() {
            let beside = |error| CureSectionError::Place {
                name: place.name.clone(),
                problem: Box::new(error),
            };
            let mut numbers = Vec::new();
            for plane in place.planes(layer).map_err(beside)? {
                let line = SectionLine::new(plane, layer).map_err(beside)?;
                let known = sections.iter().position(|other| other.course().line == line.line);
                numbers.push(known.unwrap_or(sections.len()));
                if known.is_none() {
                    sections.push(CureSection::new(resin, rule, line));
                }
            }
            of_places.push((place, numbers));
        }
        Ok(Self { of_places, sections })
    }

    /// Exposes a layer, and returns the dose of its white. Layers come from the bottom up.
    ///
    /// # Errors
    /// Returns the errors of [`CureSection::add`].
    pub fn add(&mut self, layer: &Layer) -> Result<Option<Dose>, CureSectionError> {
        let doses = self.sections.par_iter_mut().map(|section| section.add(layer));
        Ok(doses.collect::<Result<Vec<_>, _>>()?.first().copied())
    }

    /// Returns the places and the sizes that are cured there.
    pub fn sizes(&self) -> Vec<(&'a Place, CuredSizes)> {
        let cured: Vec<_> = self.sections.par_iter().map(CureSection::cured).collect();
        let sizes = |(place, numbers): &(&'a Place, Vec<usize>)| {
            let names = numbers.first().map_or(&[][..], |number| &cured[*number]);
            let of_name = |at: usize| {
                let section =
                    |number: &usize| (self.sections[*number].course(), &cured[*number][at].1[..]);
                (names[at].0, place.size(&numbers.iter().map(section).collect::<Vec<_>>()))
            };
            (*place, (0..names.len()).map(of_name).collect())
        };
        self.of_places.iter().map(sizes).collect()
    }
}

#[cfg(test)]
mod tests {
    use lamp_grayscale::material::Material;
    use lamp_grayscale::resin::FadingLight;
    use lamp_stack::{Catalogued, Mask, PageInfo, Pitch};

    use super::*;

    /// White of 1.2 mm x 0.8 mm from (10, 20) on, in 5 layers of 100 um from 3 mm up, with black from
    /// x = 10.8 mm on in the upper two.
    fn steps() -> Vec<Layer> {
        let layer = |index: u32| {
            // A row that is white to its end has one change.
            let changes: &[u32] = if index < 3 { &[0] } else { &[0, 8] };
            let ends = (0..=8).map(|row| row * changes.len() as u32).collect();
            let image = Mask::new(12, ends, changes.repeat(8)).unwrap();
            let info = PageInfo {
                index,
                z_um: Some(3000.0 + 100.0 * f64::from(index)),
                thickness_um: Some(100.0),
                origin_mm: Some([10.0, 20.8]),
                exposure_ms: Some(1e4),
                ..PageInfo::default()
            };
            Layer { info, pitch: Pitch::of_dpi(254.0), image: image.into() }
        };
        (0..5).map(layer).collect()
    }

    fn sizes(text: &str) -> Result<Vec<f64>, CureSectionError> {
        let material = Material::builtin("lamp-suspension").unwrap();
        let resin = material.resin().unwrap();
        let fading: FadingLight = material.fading().unwrap();
        let places = Places::parse(text).unwrap();
        let layers = steps();
        let mut cured = CuredPlaces::new(&places, &resin, CureRule::Straight(fading), &layers[0])?;
        for layer in &layers {
            cured.add(layer)?;
        }
        Ok(cured.sizes().into_iter().map(|(_, sizes)| sizes[0].1.number()).collect())
    }

    #[test]
    fn sizes_of_steps_are_theirs() {
        // Light cures below the lowest layer, too.
        let text = "
            place = [
                { name = 'high', x = '10.35mm', y = '20.4mm', z = ['3mm', '9mm'] },
                { name = 'low', x = '11.15mm', y = '20.4mm', z = ['3mm', '9mm'] },
                { name = 'part of it', x = '11.15mm', y = '20.4mm', z = ['3.15mm', '9mm'] },
                { name = 'wide', y = '20.4mm', z = '3.05mm' },
                { name = 'narrow', y = '20.4mm', z = '3.45mm' },
                { name = 'right of it', x = ['10.5mm', '30mm'], y = '20.4mm', z = '3.45mm' },
                { name = 'deep', x = '10.35mm', z = '3.05mm' },
                { name = 'over it', x = '10.35mm', z = '3.55mm' },
                { name = 'all', z = ['3mm', '9mm'] },
                { name = 'corner', x = ['10.7mm', '10.9mm'], y = ['20.2mm', '20.5mm'], z = ['3.2mm', '4mm'] },
            ]";
        let expected = [
            500.0,
            300.0,
            150.0,
            1200.0,
            800.0,
            300.0,
            800.0,
            0.0,
            0.8 * (1.2 * 0.3 + 0.8 * 0.2),
            0.3 * (0.1 * 0.3 + 0.1 * 0.1),
        ];
        for (found, expected) in sizes(text).unwrap().into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-6, "{found} {expected}");
        }
    }

    #[test]
    fn a_written_file_reads_back() {
        let text = "
            place = [
                { name = 'a \"notch\"', x = '10.35mm', y = '20.4mm', z = ['3mm', '9.5mm'] },
                { name = 'wide', y = '-20.4mm', z = '3.05mm', wanted = '479um', sd = '2.5um' },
                { name = 'deep', x = '0.1mm', z = '3mm', measured = '0.47912mm' },
                { name = 'all', z = ['3mm', '9mm'], wanted = '0.25mm3', measured = '0.1mm3' },
            ]";
        let places = Places::parse(text).unwrap();
        let written = places.to_toml();
        assert_eq!(Places::parse(&written).unwrap(), places, "{written}");
    }

    #[test]
    fn places_that_are_none_are_refused() {
        let refused = |text: &str| Places::parse(text).unwrap_err().to_string();
        let place = |keys: &str| format!("[[place]]\nname = 'p'\n{keys}");
        let point = refused(&place("x = '1mm'\ny = '1mm'\nz = '1mm'"));
        assert!(point.starts_with("the place p is neither a line nor a box"), "{point}");
        assert!(refused(&place("x = '1mm'")).starts_with("the place p is neither"));
        let twice = place("x = '1mm'\ny = '1mm'").repeat(2).replace("1mm'[[", "1mm'\n[[");
        assert_eq!(refused(&twice), "two places have the name p");
        assert_eq!(
            refused(&place("wanted = '3um'")),
            "the place p: wanted: `3um` is not a volume: write one such as 0.27mm3"
        );
        assert!(refused(&place("x = '1mm'\ny = '2mm'\nwanted = '3'")).contains("wanted: "));
        assert!(
            refused(&place("x = ['2mm', '1mm']")).contains("the range from 2mm to 1mm is empty")
        );
        assert!(refused(&place("x = 3")).contains("write a place such as"));
        assert!(refused(&place("w = '1mm'")).starts_with("line 3: "));
        let beside = sizes(&place("x = '30mm'\ny = '20.4mm'")).unwrap_err().to_string();
        assert_eq!(beside, "the place p: x = 30.000 mm is outside its images: 10.000 to 11.200 mm");
        let none = sizes(&place("y = ['20.41mm', '20.42mm']")).unwrap_err();
        assert_eq!(none.to_string(), "the place p: no pixel of the section lies in this stretch");
    }
}
