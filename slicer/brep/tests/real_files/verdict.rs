//! Compares the findings in a file with its reference figures.

use std::fmt;

use super::figures::Figures;
use super::one_file::{Answer, ENDED, Part};

/// The tolerated relative error of volumes, and of boxes by the part's size.
const SAME: f64 = 1e-3;
/// The tolerated relative error of section areas.
const SAME_AREA: f64 = 2e-3;
/// A section narrower than this part of the size is not compared.
const NARROW: f64 = 1e-9;
/// The limits of every file, for reports.
pub(crate) const LIMITS: &str = "10 s or 300 MB";
const MOST_SECONDS: f64 = 10.0;
const MOST_MB: f64 = 300.0;

/// The verdict on a file. It prints as a row of a table.
pub(crate) struct Verdict {
    pub(crate) name: String,
    answer: Answer,
    /// `None` if the part was rejected.
    errors: Option<Errors>,
    /// Whether the reference finds a solid.
    has_solid: bool,
}

/// The errors of a part.
struct Errors {
    /// The surplus of bodies.
    bodies: i64,
    /// The errors of the box, by the part's size, of the volume and of the worst section. `None`
    /// where the reference has no body to compare.
    relative: Option<[f64; 3]>,
}

impl Errors {
    fn new(part: &Part, figures: &Figures) -> Self {
        let bodies = part.bodies as i64 - figures.bodies as i64;
        let relative = figures.box_mm.zip(figures.volume_mm3).map(|(box_mm, volume_mm3)| {
            let size_mm = figures.size_mm();
            let apart = |k: usize| (part.box_mm[k / 3][k % 3] - box_mm[k / 3][k % 3]).abs();
            let narrow = NARROW * size_mm * size_mm;
            let areas = part.areas_mm2.iter().zip(&figures.areas_mm2);
            [
                (0..6).map(apart).fold(0.0, f64::max) / size_mm,
                part.volumes_mm3[0] / volume_mm3 - 1.0,
                areas.map(|(a, b)| (a - b).abs() / b.max(narrow)).fold(0.0, f64::max),
            ]
        });
        Self { bodies, relative }
    }

    fn is_none(&self) -> bool {
        let is_near = |[corners, volume, area]: [f64; 3]| {
            corners <= SAME && volume.abs() <= SAME && area <= SAME_AREA
        };
        self.bodies == 0 && self.relative.is_some_and(is_near)
    }
}

impl Verdict {
    pub(crate) fn new(figures: &Figures, answer: Answer) -> Self {
        let errors = answer.read.as_ref().ok().map(|part| Errors::new(part, figures));
        Self { name: figures.name.clone(), answer, errors, has_solid: figures.has_solid }
    }

    /// Returns whether the part matches the reference, or is rejected where the reference has no
    /// solid.
    pub(crate) fn is_right(&self) -> bool {
        match (&self.errors, &self.answer.read) {
            (Some(errors), _) => errors.is_none(),
            (None, Err(why)) => !self.has_solid && why != ENDED,
            (None, Ok(_)) => false,
        }
    }

    /// Returns whether a part that differs from the reference would be sliced.
    pub(crate) fn is_wrong(&self) -> bool {
        self.errors.is_some() && !self.is_right()
    }

    /// Returns whether the part took too much time or memory at the default tolerance.
    pub(crate) fn is_beyond_limits(&self) -> bool {
        self.answer.seconds > MOST_SECONDS || self.answer.peak_mb.is_none_or(|mb| mb > MOST_MB)
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "| `{}` | ", self.name)?;
        if self.is_wrong() {
            f.write_str("WRONG ")?;
        }
        match (&self.answer.read, &self.errors) {
            (Ok(part), Some(Errors { bodies, relative })) => {
                write!(f, "{}", part.bodies)?;
                if *bodies != 0 {
                    write!(f, " ({bodies:+})")?;
                }
                write!(f, " | {} | ", part.facets)?;
                match relative.map(|errors| errors.map(|error| 100.0 * error)) {
                    Some([corners, volume, area]) => {
                        write!(f, "{corners:.4} | {volume:+.4} | {area:.4}")?;
                    }
                    None => write!(f, "| {:.3} mm³ | ", part.volumes_mm3[0])?,
                }
            }
            _ => f.write_str("refused | | | | ")?,
        }
        let said = self.answer.read.as_ref().map_or_else(|why| why, |part| &part.said);
        let mb = self.answer.peak_mb.map_or("?".to_owned(), |mb| format!("{mb:.0}"));
        write!(f, " | {:.1} | {mb} | {said} |", self.answer.seconds)
    }
}
