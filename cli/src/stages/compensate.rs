//! The stage that moves edges by the cure width, and enlarges images for shrinkage.

use std::cell::{Cell, RefCell};
use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use clap::Args;
use lamp_grayscale::exposure::MeasuredDoses;
use lamp_grayscale::material::Material;
use lamp_grayscale::resin::{CureWidth, Dose, ExposureTime, QuantityError};
use lamp_postprocess::{CompensateError, CompensateOptions, Shrinkage, Widths};
use lamp_stack::{Dpi, Layer, Length, LengthError};

use crate::catalogue::{canonical_word, entry, is_file};
use crate::compensate_report::WallReport;
use crate::exit::Exit;
use crate::lamp_option::LampOption;
use crate::options::parse_distance;
use crate::progress::Progress;

/// Changes when other bytes come from the same options and layers.
pub(crate) const CODE: u32 = 6;

/// By what edges move and images grow.
#[derive(Args, Clone)]
pub(crate) struct CompensateSettings {
    /// Move all edges inwards by this distance, or outwards if it is negative
    #[arg(long, value_name = "LENGTH", value_parser = parse_offset, allow_hyphen_values = true)]
    uniform: Option<Length>,

    /// Move edges inwards by the cure width of a material: a built-in one or a file (see lamp material)
    #[arg(long, value_name = "M", conflicts_with = "uniform")]
    material: Option<PathBuf>,

    /// Dose of full white, for example 300mJ/cm2 [default: the page's exposure times the material's
    /// intensity]
    #[arg(long, value_name = "DOSE", value_parser = parse_dose, requires = "material")]
    dose: Option<Dose>,

    #[command(flatten)]
    lamp: LampOption,

    /// Keep walls at least this wide, or as they are if thinner; 0um lets them vanish [default: two
    /// pixels]
    #[arg(long, value_name = "LENGTH", value_parser = parse_distance, allow_hyphen_values = true)]
    min_feature: Option<Length>,

    /// Round edges to whole pixels, without gray
    #[arg(long)]
    one_bit: bool,

    /// Shrinkage s in firing, for example 2.1% or x:2.1%,y:1.8%: images are enlarged by 1 / (1 - s)
    #[arg(long, value_name = "SHARE", value_parser = parse_shrinkage, allow_hyphen_values = true)]
    shrinkage: Option<Shrinkage>,
}

impl CompensateSettings {
    /// Returns the files that are read.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = &PathBuf> {
        self.material.iter().filter(|path| is_file::<Material>(path))
    }

    /// Returns the files that are read, to be changed.
    pub(crate) fn inputs_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        self.material.iter_mut().filter(|path| is_file::<Material>(path))
    }

    /// Returns the options as one text. Files have no names in it.
    pub(crate) fn canonical(&self) -> String {
        let Self { uniform, material, dose, lamp, min_feature, one_bit, shrinkage } = self;
        let mut words = "compensate".to_owned();
        let mut add = |key: &str, value: Option<String>| {
            words.extend(value.map(|value| format!(" --{key} {value}")));
        };
        add("uniform", uniform.map(|by| by.to_string()));
        add("material", material.as_deref().map(canonical_word::<Material>));
        // Debug tells a number apart from every other.
        add("dose", dose.map(|dose| format!("{dose:?}")));
        add("lamp-intensity", lamp.canonical());
        add("min-feature", min_feature.map(|width| width.to_string()));
        add("shrinkage", shrinkage.map(|Shrinkage { x, y }| format!("{x},{y}")));
        if *one_bit {
            words.push_str(" --one-bit");
        }
        words
    }
}

/// Layers whose edges are being moved.
pub(crate) struct Compensating<'a> {
    settings: &'a CompensateSettings,
    by: EdgeMove,
    walls: RefCell<WallReport>,
    layer_count: Cell<usize>,
    done_before: RefCell<DoneBefore>,
}

impl<'a> Compensating<'a> {
    /// Reads the material, if there is one.
    pub(crate) fn new(settings: &'a CompensateSettings) -> Result<Self, Exit> {
        Ok(Self {
            by: EdgeMove::of(settings)?,
            settings,
            walls: RefCell::default(),
            layer_count: Cell::default(),
            done_before: RefCell::default(),
        })
    }

    /// Returns the layers with edges moved. Findings in those of `counted` are reported.
    pub(crate) fn layers<'b>(
        &'b self,
        layers: impl Iterator<Item = Result<Layer, Exit>> + 'b,
        counted: Range<u32>,
    ) -> impl Iterator<Item = Result<Layer, Exit>> + 'b {
        let CompensateSettings { min_feature, one_bit, shrinkage, .. } = *self.settings;
        let shrinkage = shrinkage.unwrap_or_default();
        let layers = layers.inspect(|layer| {
            self.layer_count.set(self.layer_count.get() + 1);
            layer.iter().for_each(|layer| self.done_before.borrow_mut().look_at(layer));
        });
        let options = CompensateOptions { min_feature, one_bit, shrinkage };
        let by = &self.by;
        let widths = |layer: &Layer, dpi| by.widths(layer, dpi);
        lamp_postprocess::compensate(layers, options, widths, move |done| {
            if counted.contains(&done.layer.info.index) {
                self.walls.borrow_mut().add(done);
            }
        })
    }

    /// Tells what was found. The layers came from `name`.
    pub(crate) fn tell(&self, name: &str, progress: &Progress) {
        let CompensateSettings { uniform, material, shrinkage, .. } = self.settings;
        let moves = uniform.is_some() || material.is_some();
        let again = self.done_before.borrow().lines(name, moves, shrinkage.is_some());
        let doubts = self.by.doubts();
        for line in again.into_iter().chain(doubts).chain(self.walls.borrow().lines()) {
            progress.say(&line);
        }
    }

    /// Writes walls and losses as JSON.
    pub(crate) fn write_report(&self, path: &Path) -> Result<(), Exit> {
        self.walls.borrow().write(self.layer_count.get(), path)
    }
}

/// Returns whether layers that this stage cannot change are the cause.
pub(crate) fn is_of_stage(error: &Exit) -> bool {
    matches!(error, Exit::Failed(error) if error.is::<CompensateError>() || error.is::<NoDose>())
}

/// What was already done to the layers, according to their pages.
#[derive(Default)]
struct DoneBefore {
    moved: bool,
    enlarged: bool,
}

impl DoneBefore {
    fn look_at(&mut self, layer: &Layer) {
        let Some(page) = layer.info.other.get("compensate") else { return };
        let by = page["inwards_um"].as_array();
        self.moved |= by.is_some_and(|by| by.iter().any(|by| by.as_f64() != Some(0.0)));
        self.enlarged |= page.get("shrinkage").is_some();
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

/// By what edges move.
enum EdgeMove {
    Uniform(Length),
    CureWidth(Box<ByCureWidth>),
}

/// A cure width, and the doses that it is for.
struct ByCureWidth {
    width: CureWidth,
    material: Material,
    dose: Option<Dose>,
    doses: MeasuredDoses,
    /// What is doubtful about the lamp.
    lamp_doubt: Option<String>,
}

/// A layer without a dose, and why.
#[derive(Debug)]
struct NoDose(String);

impl std::fmt::Display for NoDose {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for NoDose {}

impl EdgeMove {
    fn of(args: &CompensateSettings) -> Result<Self, Exit> {
        let Some(path) = &args.material else {
            return match (args.uniform, args.shrinkage) {
                (None, None) => {
                    Err(Exit::usage("give --uniform 25um, --material M or --shrinkage 2.1%"))
                }
                (by, _) => Ok(Self::Uniform(by.unwrap_or_default())),
            };
        };
        let (material, lamp_doubt) = args.lamp.material(entry(path)?)?;
        let name = &material.name;
        let width =
            material.cure_width().map_err(|error| Exit::Failed(error.into()).at(name.clone()))?;
        let width = width.ok_or_else(|| {
            Exit::Failed(anyhow!(
                "{name} states no cure width: add [[cure-width]] to its file, or give --uniform"
            ))
        })?;
        let doses = MeasuredDoses::of_widths(&material);
        let dose = args.dose;
        Ok(Self::CureWidth(Box::new(ByCureWidth { width, material, dose, doses, lamp_doubt })))
    }

    /// Returns sentences on a lamp and on doses that the widths were not measured at.
    fn doubts(&self) -> Vec<String> {
        match self {
            Self::Uniform(_) => Vec::new(),
            Self::CureWidth(by) => {
                by.lamp_doubt.clone().into_iter().chain(by.doses.doubt("layers")).collect()
            }
        }
    }

    fn widths(&self, layer: &Layer, dpi: Dpi) -> Result<Widths, Exit> {
        let (width, dose) = match self {
            Self::Uniform(by) => return Ok(Widths::uniform(by.pixels(dpi))),
            Self::CureWidth(by) => {
                let dose = by.dose.map_or_else(|| dose_of(layer, &by.material), Ok)?;
                by.doses.see(dose);
                (&by.width, dose)
            }
        };
        // The image has the sizes that are wanted, not those that are to be exposed.
        let sizes: Vec<f64> = width.cured_sizes(dose).iter().map(|size| size.pixels(dpi)).collect();
        let pitch = dpi.pitch().um();
        let size = |pixels: f64| Length::from_um(pixels * pitch);
        Ok(Widths::by_size(&sizes, |pixels| width.width_of_cured(dose, size(pixels)).pixels(dpi)))
    }
}

/// Returns the dose of a layer from its page's exposure time.
fn dose_of(layer: &Layer, material: &Material) -> Result<Dose, Exit> {
    let no_dose = |text: String| Exit::Failed(NoDose(text).into());
    let time = layer.info.exposure_ms.filter(|ms| *ms >= 0.0).ok_or_else(|| {
        no_dose(format!("{} states no exposure time: give --dose", layer.info.name()))
    })?;
    let light = material.light().map_err(anyhow::Error::new)?.ok_or_else(|| {
        let name = &material.name;
        no_dose(format!(
            "{name} states no intensity of full white: give --dose, or add [intensity] to its \
             file"
        ))
    })?;
    Ok(light * ExposureTime::from_ms(time))
}

fn parse_offset(text: &str) -> Result<Length, String> {
    text.parse().map_err(|error: LengthError| error.to_string())
}

fn parse_dose(text: &str) -> Result<Dose, String> {
    text.parse().map_err(|error: QuantityError| error.to_string())
}

/// Parses `2.1%`, or `x:2.1%,y:1.8%`.
fn parse_shrinkage(text: &str) -> Result<Shrinkage, String> {
    let wrong = || {
        format!(
            "`{text}` is not a shrinkage: write a share from 0% to 50%, as 2.1% or x:2.1%,y:1.8%"
        )
    };
    let share = |text: &str| {
        let percent: f64 = text.trim().strip_suffix('%')?.trim_end().parse().ok()?;
        (0.0..=50.0).contains(&percent).then_some(percent / 100.0)
    };
    if !text.contains(':') {
        let both = share(text).ok_or_else(wrong)?;
        return Ok(Shrinkage { x: both, y: both });
    }
    let [mut x, mut y] = [None; 2];
    for part in text.split(',') {
        let (axis, value) = part.split_once(':').ok_or_else(wrong)?;
        let side = match axis.trim() {
            "x" | "X" => &mut x,
            "y" | "Y" => &mut y,
            _ => return Err(wrong()),
        };
        if side.replace(share(value).ok_or_else(wrong)?).is_some() {
            return Err(wrong());
        }
    }
    Ok(Shrinkage { x: x.unwrap_or(0.0), y: y.unwrap_or(0.0) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shrinkages_people_write() {
        assert_eq!(parse_shrinkage("2%"), Ok(Shrinkage { x: 0.02, y: 0.02 }));
        assert_eq!(parse_shrinkage("x:2%, y: 50 %"), Ok(Shrinkage { x: 0.02, y: 0.5 }));
        assert_eq!(parse_shrinkage("Y:0%"), Ok(Shrinkage { x: 0.0, y: 0.0 }));
        for wrong in
            ["", "2", "%", "-1%", "51%", "nan%", "x:2", "x2%", "z:2%", "x:1%,x:2%", "1%,2%"]
        {
            assert!(parse_shrinkage(wrong).is_err(), "{wrong}");
        }
    }
}
