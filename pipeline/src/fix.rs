//! The stage that corrects stray rows.

use std::cell::{Ref, RefCell};
use std::ops::Range;

use lamp_fix::{FixMethod, FixOptions, Fixed};
use lamp_stack::{PassingLayer, StackError};
use serde::{Deserialize, Serialize};

use crate::fix_report::FixReport;
use crate::solid::is_default;
use crate::words::{optional, text, words_of};

/// Changes when the same settings and layers give other bytes.
pub const CODE: u32 = 4;

/// How rows are corrected.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, rename_all = "kebab-case")]
pub struct FixSettings {
    /// Source of the missing crossings.
    #[serde(with = "text")]
    pub method: FixMethod,
    /// Bands of more rows are left as they are; `None` leaves no band for its width.
    #[serde(with = "optional", skip_serializing_if = "Option::is_none")]
    pub max_width: Option<u32>,
    /// Bands whose correction is less certain are left as they are, from 0 to 1.
    #[serde(with = "text")]
    pub min_confidence: f64,
    /// Uses the layers below and above to find where contours cross bands of three rows and more.
    // Keys of stored results hold this name; the command line knows it as an alias.
    #[serde(skip_serializing_if = "is_default")]
    pub use_neighbours: bool,
}

impl Default for FixSettings {
    fn default() -> Self {
        let FixOptions { method, max_width, min_confidence, use_neighbours } =
            FixOptions::default();
        Self { method, max_width, min_confidence, use_neighbours }
    }
}

impl FixSettings {
    /// Returns the options of the library.
    pub fn options(&self) -> FixOptions {
        let Self { method, max_width, min_confidence, use_neighbours } = *self;
        FixOptions { method, max_width, min_confidence, use_neighbours }
    }

    /// Returns the settings as one text, defaults filled in.
    pub fn canonical(&self) -> String {
        format!("fix{}", words_of(self))
    }
}

/// Layers whose rows are being corrected.
pub struct Fixing {
    options: FixOptions,
    // A cell, since the layers' iterator still borrows this while the report is read.
    report: RefCell<FixReport>,
}

impl Fixing {
    /// Begins without findings.
    pub fn new(settings: &FixSettings) -> Self {
        let options = settings.options();
        Self { options, report: RefCell::new(FixReport::new(options)) }
    }

    /// Returns the corrected layers. Layers whose pages say that all rows are good are decoded only
    /// where they lie next to others. Findings in layers of `counted` are reported, and shown to
    /// `see`.
    pub fn layers<'a, E: From<StackError> + Send + 'a>(
        &'a self,
        layers: impl Iterator<Item = Result<PassingLayer, E>> + 'a,
        counted: Range<u32>,
        mut see: impl FnMut(&Fixed<'_>) + 'a,
    ) -> impl Iterator<Item = Result<PassingLayer, E>> + 'a {
        lamp_fix::fix(layers, self.options, move |fixed| {
            if counted.contains(&fixed.before.info.index) {
                see(fixed);
                self.report.borrow_mut().add(fixed);
            }
        })
    }

    /// Returns the findings so far.
    pub fn report(&self) -> Ref<'_, FixReport> {
        self.report.borrow()
    }
}
