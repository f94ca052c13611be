//! The stage that moves edges by the cure width, and enlarges images for shrinkage.

use std::cell::{Cell, Ref, RefCell};
use std::fmt;
use std::ops::Range;
use std::path::PathBuf;
use std::str::FromStr;

use lamp_grayscale::exposure::{LampLight, MeasuredDoses};
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::{CureWidth, Dose, EdgeLight, ExposureTime};
use lamp_offset::{CompensateError, CompensateOptions, CompensateProblem, Shrinkage, Widths};
use lamp_stack::{CompensateRecord, Layer, Length, LengthError, Pitch};
use serde::{Deserialize, Serialize};

use crate::documents::{canonical_word, document, is_file};
use crate::error::{Error, ErrorKind};
use crate::solid::is_default;
use crate::wall_report::WallReport;
use crate::words::{optional, words_of};

/// Changes when the same settings and layers give other bytes.
pub const CODE: u32 = 7;

/// How edges move and images grow.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct CompensateSettings {
    /// Moves all edges inwards by this distance, or outwards if it is negative.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub uniform: Option<EdgeDistance>,
    /// Moves edges inwards by the cure width of a material: a built-in one's name, or a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub material: Option<PathBuf>,
    /// Dose of full white; `None` is the page's exposure times the material's intensity.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub dose: Option<Dose>,
    /// The lamp as it is now; `None` is the material's.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub lamp_intensity: Option<LampLight>,
    /// Walls stay at least this wide, or as they are if thinner; `None` is two pixels.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub min_feature: Option<Length>,
    /// Shrinkage in firing, for which images are enlarged.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub shrinkage: Option<FiringShrinkage>,
    /// Rounds edges to whole pixels, without gray.
    #[serde(skip_serializing_if = "is_default")]
    pub one_bit: bool,
}

/// The distance that edges move, as people write it: `25um`, or `25x40um` along x and y.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct EdgeDistance {
    /// Not on both sides of zero.
    xy: [Length; 2],
}

/// Shrinkage as people write it: `2.1%`, or `x:2.1%,y:1.8%`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FiringShrinkage {
    /// Percent along x and y, from 0 to 50.
    percent: [f64; 2],
}

impl FiringShrinkage {
    /// Returns the shares that parts shrink by.
    pub fn shares(self) -> Shrinkage {
        let [x, y] = self.percent.map(|percent| percent / 100.0);
        Shrinkage { x, y }
    }
}

impl CompensateSettings {
    /// Returns the files that are read.
    pub fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        // Built-in materials are part of the program: they are no inputs.
        self.material.iter().filter(|path| is_file::<Material>(path))
    }

    /// Returns the files that are read, to be changed.
    pub fn inputs_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        self.material.iter_mut().filter(|path| is_file::<Material>(path))
    }

    /// Returns the settings as one text. Files have no names in it.
    pub fn canonical(&self) -> String {
        // The digest of a file is among the inputs of a task, so its name decides nothing.
        let material = self.material.as_deref().map(canonical_word::<Material>);
        let settings = Self { material: material.map(PathBuf::from), ..self.clone() };
        format!("compensate{}", words_of(&settings))
    }
}

/// Layers whose edges are being moved.
pub struct Compensating<'a> {
    settings: &'a CompensateSettings,
    by: EdgeMove,
    walls: RefCell<WallReport>,
    layer_count: Cell<usize>,
    done_before: RefCell<DoneBefore>,
}

impl<'a> Compensating<'a> {
    /// Reads the material, if there is one.
    ///
    /// # Errors
    /// Returns an error if there is nothing to do, or the material cannot be read.
    pub fn new(settings: &'a CompensateSettings) -> Result<Self, Error> {
        Ok(Self {
            by: EdgeMove::of(settings)?,
            settings,
            walls: RefCell::default(),
            layer_count: Cell::default(),
            done_before: RefCell::default(),
        })
    }

    /// Returns the layers with edges moved. Findings in layers of `counted` are reported.
    pub fn layers<'b, E: From<CompensateError> + From<Error> + Send + 'b>(
        &'b self,
        layers: impl Iterator<Item = Result<Layer, E>> + 'b,
        counted: Range<u32>,
    ) -> impl Iterator<Item = Result<Layer, E>> + 'b {
        let CompensateSettings { min_feature, one_bit, shrinkage, .. } = *self.settings;
        let shrinkage = shrinkage.map(FiringShrinkage::shares).unwrap_or_default();
        let layers = layers.inspect(|layer| {
            self.layer_count.set(self.layer_count.get() + 1);
            // An error is left to the library, which passes it on in its place.
            layer.iter().for_each(|layer| self.done_before.borrow_mut().look_at(layer));
        });
        let options = CompensateOptions { min_feature, one_bit, shrinkage };
        let by = &self.by;
        let widths = |layer: &Layer, pitch| Ok(by.widths(layer, pitch)?);
        lamp_offset::compensate(layers, options, widths, move |done| {
            if counted.contains(&done.layer.info.index) {
                self.walls.borrow_mut().add(done);
            }
        })
    }

    /// Returns lines about the layers so far, which came from `name`.
    pub fn lines(&self, name: &str) -> Vec<String> {
        let CompensateSettings { uniform, material, shrinkage, .. } = self.settings;
        let moves = uniform.is_some() || material.is_some();
        let again = self.done_before.borrow().lines(name, moves, shrinkage.is_some());
        let doubts = self.by.doubts();
        again
            .into_iter()
            .chain(self.by.counted_above())
            .chain(doubts)
            .chain(self.walls.borrow().lines())
            .collect()
    }

    /// Returns walls and losses so far, and the number of layers.
    pub fn report(&self) -> (Ref<'_, WallReport>, usize) {
        (self.walls.borrow(), self.layer_count.get())
    }
}

/// Returns whether the cause is layers that this stage cannot change.
pub fn is_of_stage(error: &Error) -> bool {
    error.cause::<CompensateError>().is_some() || error.cause::<NoDose>().is_some()
}

/// Changes already made to the layers, according to their pages.
#[derive(Default)]
struct DoneBefore {
    moved: bool,
    enlarged: bool,
}

impl DoneBefore {
    fn look_at(&mut self, layer: &Layer) {
        let Some(page) = layer.info.record::<CompensateRecord>() else { return };
        self.moved |= page.moves();
        self.enlarged |= page.shrinkage.is_some();
    }

    /// Returns messages about what has now been done twice.
    fn lines(&self, name: &str, moves: bool, enlarges: bool) -> Vec<String> {
        let again = [
            (
                self.moved && moves,
                "its layers were compensated before, and their edges have moved again",
            ),
            (
                self.enlarged && enlarges,
                "its layers were enlarged for shrinkage before, and now again",
            ),
        ];
        again.iter().filter(|(is, _)| *is).map(|(_, text)| format!("{name}: {text}")).collect()
    }
}

/// How far edges move.
enum EdgeMove {
    Uniform(EdgeDistance),
    CureWidth(Box<ByCureWidth>),
    Spread(Box<BySpread>),
}

/// Edges that move back by how far light spreads along x and y, and the doses that it is for.
struct BySpread {
    light: EdgeLight,
    material: Material,
    dose: Option<Dose>,
    /// A doubt about the lamp.
    lamp_doubt: Option<String>,
}

/// Cure widths along x and y, and the doses that they are for.
struct ByCureWidth {
    widths: [CureWidth; 2],
    material: Material,
    dose: Option<Dose>,
    doses: MeasuredDoses,
    /// Doubts about the lamp and the directions.
    more_doubts: Vec<String>,
}

/// A layer without a dose, and why.
#[derive(Debug)]
pub struct NoDose(String);

impl std::fmt::Display for NoDose {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for NoDose {}

impl EdgeMove {
    fn of(args: &CompensateSettings) -> Result<Self, Error> {
        let Some(path) = &args.material else {
            return match (args.uniform, args.shrinkage) {
                (None, None) => {
                    Err(Error::settings("give --uniform 25um, --material M or --shrinkage 2.1%"))
                }
                // Shrinkage alone enlarges images and leaves edges where they are: a move by zero.
                (by, _) => Ok(Self::Uniform(by.unwrap_or_default())),
            };
        };
        let material: Material = document(path)?;
        let lamp = args.lamp_intensity;
        let width_doubt = lamp.map(|light| light.width_doubt(&material)).transpose();
        let width_doubt =
            width_doubt.map_err(|error| Error::new(ErrorKind::Work, error))?.flatten();
        let (material, lamp_doubt) = match lamp {
            Some(light) => {
                light.material(&material).map_err(|error| Error::new(ErrorKind::Work, error))?
            }
            None => (material, None),
        };
        let name = &material.name;
        let at_name = |error| Error::new(ErrorKind::Work, error).at(name.clone());
        let dose = args.dose;
        let spread = material.spread().map_err(at_name)?;
        let has_directions = spread.is_some_and(|spread| spread.sigma().is_none());
        let widths = material.cure_widths().map_err(at_name)?;
        // Squares measure one cure width for all directions: two widths of light say more.
        let light = material.edge_light().map_err(at_name)?;
        if let Some(light) = light.filter(|_| has_directions || widths.is_none()) {
            return Ok(Self::Spread(Box::new(BySpread { light, material, dose, lamp_doubt })));
        }
        let widths = widths.ok_or_else(|| {
            if material.has_composition_laws() {
                return Error::work(format!(
                    "{name} has laws over ingredients, and no cure width of one composition: make a \
                     material of one amount with lamp material make"
                ));
            }
            Error::work(format!(
                "{name} states no cure width: add [[cure-width]] or the critical-dose of [spread] \
                 to its file, or give --uniform"
            ))
        })?;
        let two = widths[0] != widths[1];
        let of_directions = (has_directions && !two).then(|| {
            format!(
                "light of {name} spreads differently along and across the scan, and its cure \
                 widths do not: add the critical-dose of [spread], as lamp calibrate scan does"
            )
        });
        let of_sizes = (two && widths.iter().any(|width| width.lines().len() > 1)).then(|| {
            format!(
                "cure widths of {name} differ along and across the scan: all features move as its \
                 largest squares do"
            )
        });
        let doses = MeasuredDoses::of_widths(&material);
        // The critical dose of depths, which lamp_doubt is on, does not matter to widths.
        let more_doubts = width_doubt.into_iter().chain(of_directions).chain(of_sizes).collect();
        Ok(Self::CureWidth(Box::new(ByCureWidth { widths, material, dose, doses, more_doubts })))
    }

    /// Returns a sentence on the share of the doses of layers above that counts.
    fn counted_above(&self) -> Option<String> {
        let Self::CureWidth(by) = self else { return None };
        let share = by.material.many_layers.as_ref()?.value;
        let name = &by.material.name;
        Some(format!(
            "by [many-layers] of {name}, a share of {share} of the doses of layers above counts"
        ))
    }

    /// Returns sentences on a lamp and on doses at which the widths were not measured.
    fn doubts(&self) -> Vec<String> {
        match self {
            Self::Uniform(_) => Vec::new(),
            Self::CureWidth(by) => {
                by.more_doubts.iter().cloned().chain(by.doses.doubt("layers")).collect()
            }
            Self::Spread(by) => by.lamp_doubt.iter().cloned().collect(),
        }
    }

    fn widths(&self, layer: &Layer, pitch: Pitch) -> Result<Widths, Error> {
        let (width, dose) = match self {
            Self::Uniform(by) => return Ok(elliptic(by.xy, pitch)),
            Self::Spread(by) => {
                let dose = by.dose.map_or_else(|| dose_of(layer, &by.material), Ok)?;
                let edges = by.light.edges(dose).ok_or_else(|| {
                    let (layer, name) = (layer.info.name(), &by.material.name);
                    Error::new(
                        ErrorKind::Work,
                        NoDose(format!(
                            "{layer} gets {dose}, and {name} cures from {} on: give a greater --dose",
                            by.light.critical_dose()
                        )),
                    )
                })?;
                return Ok(elliptic(edges, pitch));
            }
            Self::CureWidth(by) => {
                let dose = by.dose.map_or_else(|| dose_of(layer, &by.material), Ok)?;
                // Doubts need the doses of all layers, which are known only at the end.
                by.doses.see(dose);
                let dose = by.of_many_layers(layer, dose)?;
                let [x, y] = &by.widths;
                if x != y {
                    // 002 section 3.4.4: beyond the largest size widths stay.
                    let of = |width: &CureWidth| width.width(dose, Length::from_um(f64::MAX));
                    return Ok(elliptic([of(x), of(y)], pitch));
                }
                (x, dose)
            }
        };
        // The image has the wanted sizes, not the sizes to expose.
        let dpi = pitch.square("widths by size need").map_err(|why| {
            let (layer, problem) = (layer.info.name(), CompensateProblem::NotSquare(why));
            CompensateError { layer, problem }
        })?;
        let sizes: Vec<f64> = width.cured_sizes(dose).iter().map(|size| size.pixels(dpi)).collect();
        let pitch = dpi.pitch().um();
        let size = |pixels: f64| Length::from_um(pixels * pitch);
        Ok(Widths::by_size(&sizes, |pixels| width.width_of_cured(dose, size(pixels)).pixels(dpi)))
    }
}

impl ByCureWidth {
    /// Returns the dose that counts for the width of a layer, with its share of the doses of the layers
    /// above (002 section 3.4.8 a).
    fn of_many_layers(&self, layer: &Layer, dose: Dose) -> Result<Dose, Error> {
        if self.material.many_layers.is_none() {
            return Ok(dose);
        }
        let thickness = layer.info.thickness_um.filter(|um| *um > 0.0 && um.is_finite());
        let thickness = thickness.ok_or_else(|| {
            let (layer, name) = (layer.info.name(), &self.material.name);
            let why = format!("{layer} states no thickness, which [many-layers] of {name} needs");
            Error::new(ErrorKind::Work, NoDose(why))
        })?;
        let times = self.material.many_layers(Length::from_um(thickness));
        let times = times.map_err(|error| Error::new(ErrorKind::Work, error))?;
        Ok(Dose::from_mj_per_cm2(dose.mj_per_cm2() * times))
    }
}

/// Returns distances along x and y in pixels.
fn elliptic([x, y]: [Length; 2], pitch: Pitch) -> Widths {
    Widths::elliptic([x.pixels(pitch.x), y.pixels(pitch.y)])
}

/// Returns the dose of a layer from its page's exposure time.
fn dose_of(layer: &Layer, material: &Material) -> Result<Dose, Error> {
    let no_dose = |text: String| Error::new(ErrorKind::Work, NoDose(text));
    // NaN and negative times of damaged pages are no times.
    let time = layer.info.exposure_ms.filter(|ms| *ms >= 0.0).ok_or_else(|| {
        no_dose(format!("{} states no exposure time: give --dose", layer.info.name()))
    })?;
    let light =
        material.light().map_err(|error| Error::new(ErrorKind::Work, error))?.ok_or_else(|| {
            let name = &material.name;
            no_dose(format!(
                "{name} states no intensity of full white: give --dose, or add [intensity] to its \
             file"
            ))
        })?;
    Ok(light * ExposureTime::from_ms(time))
}

impl FromStr for EdgeDistance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Some(xy) = Length::pair(text) else {
            let both: Length = text.parse().map_err(|error: LengthError| error.to_string())?;
            return Ok(Self { xy: [both; 2] });
        };
        let [x, y] = xy.map(Length::um);
        if x.min(y) < 0.0 && x.max(y) > 0.0 {
            return Err(format!(
                "`{text}` moves edges inwards along one axis and outwards along the other: give \
                 both alike"
            ));
        }
        Ok(Self { xy })
    }
}

impl fmt::Display for EdgeDistance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.xy;
        if x == y { write!(f, "{x}") } else { write!(f, "{}x{}um", x.um(), y.um()) }
    }
}

impl FromStr for FiringShrinkage {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "`{text}` is not a shrinkage: write a share from 0% to 50%, such as 2.1% or \
                 x:2.1%,y:1.8%"
            )
        };
        let share = |text: &str| {
            let percent: f64 = text.trim().strip_suffix('%')?.trim_end().parse().ok()?;
            (0.0..=50.0).contains(&percent).then_some(percent)
        };
        if !text.contains(':') {
            let both = share(text).ok_or_else(wrong)?;
            return Ok(Self { percent: [both; 2] });
        }
        let [mut x, mut y] = [None; 2];
        for part in text.split(',') {
            let (axis, value) = part.split_once(':').ok_or_else(wrong)?;
            let side = match axis.trim() {
                "x" | "X" => &mut x,
                "y" | "Y" => &mut y,
                _ => return Err(wrong()),
            };
            // An axis that stands twice would hide a slip.
            if side.replace(share(value).ok_or_else(wrong)?).is_some() {
                return Err(wrong());
            }
        }
        // An axis that is not named does not shrink.
        Ok(Self { percent: [x, y].map(Option::unwrap_or_default) })
    }
}

impl fmt::Display for FiringShrinkage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [x, y] = self.percent;
        write!(f, "x:{x}%,y:{y}%")
    }
}

#[cfg(test)]
mod tests {
    use lamp_stack::{Image, Mask, PageInfo};

    use super::*;

    fn parsed(text: &str) -> Result<Shrinkage, String> {
        text.parse().map(FiringShrinkage::shares)
    }

    /// The widths of a layer of 100 um that gets 200 mJ/cm², at 10 um a pixel.
    fn widths_of(material: &str) -> Widths {
        let file = tempfile::NamedTempFile::new().unwrap();
        let head = "name = \"mine\"\ndescription = \"\"\n[working-curve]\n\
                    critical-dose = { value = \"50 mJ/cm2\", source = \"a\" }\n\
                    penetration-depth = { value = \"200 um\", source = \"a\" }\n";
        std::fs::write(file.path(), format!("{head}{material}")).unwrap();
        let settings = CompensateSettings {
            material: Some(file.path().to_owned()),
            dose: Some(Dose::from_mj_per_cm2(200.0)),
            ..CompensateSettings::default()
        };
        let info = PageInfo { thickness_um: Some(100.0), ..PageInfo::default() };
        let pitch = Pitch::of_dpi(2540.0).unwrap();
        let image = Image::Mask(Mask::new(1, vec![0, 0], vec![]).unwrap()).into();
        let layer = Layer { info, pitch: Some(pitch), image };
        EdgeMove::of(&settings).unwrap().widths(&layer, pitch).unwrap()
    }

    fn cure_width(more: &str, critical: f64) -> String {
        format!(
            "[[cure-width]]\nfeature-size = \"8 mm\"\n{more}\
             critical-dose = {{ value = \"{critical} mJ/cm2\", source = \"a\" }}\n\
             sensitivity = {{ value = \"0.25 um/(mJ/cm2)\", source = \"a\" }}\n"
        )
    }

    #[test]
    fn widths_of_two_directions_move_edges_by_an_ellipse() {
        let sizes = ["across", "along"].map(|direction| format!("direction = \"{direction}\"\n"));
        let widths = widths_of(&(cure_width(&sizes[0], 80.0) + &cure_width(&sizes[1], 40.0)));
        // 0.25 (200 - 80) and 0.25 (200 - 40) um, in pixels of 10 um.
        let [x, y] = widths.range();
        assert!((x - 3.0).abs() < 1e-9 && (y - 4.0).abs() < 1e-9, "{x} {y}");
        // Along y edges move farther.
        assert_eq!(widths, Widths::elliptic([x, y]));
    }

    #[test]
    fn doses_of_layers_above_widen_by_their_share() {
        let share = "[many-layers]\nvalue = 0.5\nsource = \"a\"\n";
        let [least, most] = widths_of(&(cure_width("", 80.0) + share)).range();
        // 1/(1 - exp(-1/2)) is 2.541494: half of the 1.541494 above counts.
        let wanted = 0.025 * (200.0 * (1.0 + 0.5 * 1.541_494) - 80.0);
        assert!((least - wanted).abs() < 1e-4 && (most - wanted).abs() < 1e-4, "{least} {wanted}");
        let [alone, _] = widths_of(&cure_width("", 80.0)).range();
        assert!((alone - 3.0).abs() < 1e-9, "{alone}");
    }

    #[test]
    fn distances_people_write() {
        let um = |text: &str| text.parse::<EdgeDistance>().map(|by| by.xy.map(Length::um));
        for (text, xy, shown) in [
            ("25um", [25.0, 25.0], "25um"),
            ("-1mil", [-25.4, -25.4], "-25.4um"),
            ("25x40um", [25.0, 40.0], "25x40um"),
            ("0.1mm x 40 um", [100.0, 40.0], "100x40um"),
            ("-25x-40um", [-25.0, -40.0], "-25x-40um"),
            ("25x25um", [25.0, 25.0], "25um"),
            ("0x40um", [0.0, 40.0], "0x40um"),
        ] {
            assert_eq!(um(text), Ok(xy), "{text}");
            assert_eq!(text.parse::<EdgeDistance>().unwrap().to_string(), shown);
            assert_eq!(um(shown), Ok(xy), "{text}");
        }
        for wrong in ["", "25", "x40um", "25x", "25x40", "25um x", "-25x40um", "infx1um"] {
            assert!(um(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn shrinkages_people_write() {
        assert_eq!(parsed("2%"), Ok(Shrinkage { x: 0.02, y: 0.02 }));
        assert_eq!(parsed("x:2%, y: 50 %"), Ok(Shrinkage { x: 0.02, y: 0.5 }));
        assert_eq!(parsed("Y:0%"), Ok(Shrinkage { x: 0.0, y: 0.0 }));
        for wrong in
            ["", "2", "%", "-1%", "51%", "nan%", "x:2", "x2%", "z:2%", "x:1%,x:2%", "1%,2%"]
        {
            assert!(parsed(wrong).is_err(), "{wrong}");
        }
    }
}
