//! Targets of planners on a fixed glass: a built-in target or a file.

use std::fs;
use std::ops::Deref;
use std::path::PathBuf;

use lamp_planning::projector::Projector;
use lamp_planning::target::{
    Grid, HeightMap, MapScale, Round, Shapes, Target, TargetError, TargetOptions,
};
use lamp_slicing::Units;
use lamp_stack::{Builtin, Catalogued, Length};
use serde::{Deserialize, Serialize};

use crate::error::{Error, ErrorKind};
use crate::solid::part_notes;
use crate::watcher::{KeptRemarks, Remark, Watcher};
use crate::words::{optional, path, text};

/// A target, and how its file is read.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct TargetSettings {
    /// A built-in target's name, a TOML file of shapes, a PNG height map or a part with a flat
    /// bottom.
    #[serde(with = "path")]
    pub target: PathBuf,
    /// Side of a height map's pixels on the glass; other targets have none.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub pixel: Option<Length>,
    /// Height of a height map's full white; other targets have none.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub full: Option<Length>,
    /// Unit of coordinates in STL and OBJ files; STEP and 3MF files state their own.
    #[serde(with = "text")]
    pub units: Units,
}

/// A target, and how it was given, for messages.
#[derive(Debug)]
pub struct GivenTarget {
    target: Target,
    given: String,
}

impl Deref for GivenTarget {
    type Target = Target;

    fn deref(&self) -> &Target {
        &self.target
    }
}

impl TargetSettings {
    /// Returns the name by which it is given, for messages.
    pub(super) fn given(&self) -> String {
        self.target.display().to_string()
    }

    /// Returns the target's file, for a plan's folder: its name there, and its bytes. A target that is
    /// not a file, such as standard input, cannot be kept.
    ///
    /// # Errors
    /// Returns an error if it cannot be read.
    pub(super) fn kept(&self) -> Result<Option<(String, Vec<u8>)>, Error> {
        let path = &self.target;
        let is_named = |builtin: &&Builtin| path.to_str() == Some(builtin.name);
        if let Some(builtin) = Shapes::BUILTINS.iter().find(is_named) {
            return Ok(Some(("target.toml".to_owned(), builtin.toml.into())));
        }
        let at_given = |error: std::io::Error| Error::from(error).at(self.given());
        if !fs::metadata(path).map_err(at_given)?.is_file() {
            return Ok(None);
        }
        // The format of a target follows from its ending, too.
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
        let name = ending.map_or("target".to_owned(), |ending| format!("target.{ending}"));
        Ok(Some((name, fs::read(path).map_err(at_given)?)))
    }

    /// Returns the built-in target of the name, or the target in the file. `watcher` takes notes
    /// about the parts of a file that are not read.
    ///
    /// # Errors
    /// Returns an error if there is no such target, it cannot be read, the projector's light does not
    /// cover it, or the scale of a height map is missing or has no effect.
    pub fn open(&self, projector: &Projector, watcher: &dyn Watcher) -> Result<GivenTarget, Error> {
        let at_given = |error: TargetError| of_work(error).at(self.given());
        if self.pixel.is_some() != self.full.is_some() {
            return Err(Error::settings("--pixel and --full go together: give both"));
        }
        let target = self.read()?;
        let notes = target.part().map(part_notes);
        notes.into_iter().flatten().for_each(|note| watcher.remark(Remark::note(note)));
        if self.pixel.is_some() && !target.is_picture() {
            return Err(Error::settings("--pixel and --full are for height maps: leave them out"));
        }
        target.check_width(projector).map_err(at_given)?;
        Ok(GivenTarget { target, given: self.given() })
    }

    /// Returns the same as [`open`](Self::open), without the notes, which a plan had already.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub(super) fn open_again(&self, projector: &Projector) -> Result<GivenTarget, Error> {
        self.open(projector, &KeptRemarks::default().of("a target"))
    }

    fn read(&self) -> Result<Target, Error> {
        let path = &self.target;
        if let Some(builtin) = path.to_str().and_then(Target::builtin) {
            return Ok(builtin);
        }
        if !path.exists() {
            let names: Vec<_> = Shapes::BUILTINS.iter().map(|builtin| builtin.name).collect();
            let (path, names) = (path.display(), names.join(", "));
            return Err(Error::work(format!(
                "{path}: there is no such file, nor a built-in target: {names}"
            )));
        }
        let scale = self.pixel.zip(self.full).map(|(pixel, full)| MapScale { pixel, full });
        let options = TargetOptions { scale, units: self.units };
        Target::open(path, &options).map_err(|error| of_work(error).at(self.given()))
    }
}

impl GivenTarget {
    /// Returns the heights of a grid's columns, none above the projector's chamber.
    ///
    /// # Errors
    /// Returns an error if a column has no height that light can cure, or one above the chamber.
    pub fn heights(&self, grid: &Grid, projector: &Projector) -> Result<HeightMap, Error> {
        let heights = || {
            let heights = self.target.heights(grid)?;
            if let Some(chamber) = &projector.chamber {
                heights.check_chamber(chamber.value)?;
            }
            Ok::<_, TargetError>(heights)
        };
        heights().map_err(|error| of_work(error).at(&self.given))
    }

    /// Returns the heights over the distance from the axis, about which it must be round.
    ///
    /// # Errors
    /// Returns an error if it is not round.
    pub fn profile(&self) -> Result<Round, Error> {
        let [width, height] = self.target.size().map(Length::um);
        let step_um = (width.max(height) / 1000.0).max(2.0);
        let round = self.target.round(Length::from_um(step_um));
        round.map_err(|error| of_work(error).at(&self.given))
    }
}

/// Returns an error of the planners as an error of the work.
pub(super) fn of_work(error: impl std::error::Error + Send + Sync + 'static) -> Error {
    Error::new(ErrorKind::Work, error)
}
