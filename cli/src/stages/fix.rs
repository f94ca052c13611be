//! The stage that corrects stray rows.

use std::cell::{Ref, RefCell};
use std::ops::Range;

use clap::Args;
use lamp_postprocess::{FixMethod, FixOptions, Fixed};
use lamp_stack::{Layer, PassingLayer};

use crate::exit::Exit;
use crate::fix_report::FixReport;
use crate::options::one_of_described;

/// Changes when other bytes come from the same options and layers.
pub(crate) const CODE: u32 = 4;

/// How rows are corrected.
#[derive(Args, Clone)]
pub(crate) struct FixSettings {
    /// Source of the missing crossings
    #[arg(long, default_value_t, value_parser = one_of_described::<FixMethod>(&[
        "What the good rows above and below share; edges of wide bands become steps",
        "Smooth curves along the part's contours",
    ]))]
    method: FixMethod,

    /// Leave bands of more rows as they are, however certain their correction is [default: no limit]
    #[arg(long, value_name = "ROWS")]
    max_width: Option<u32>,

    /// Leave bands whose correction is less certain than this as they are, from 0 to 1
    #[arg(long, value_name = "SHARE", default_value_t = FixOptions::default().min_confidence)]
    #[arg(value_parser = parse_share)]
    min_confidence: f64,

    /// Use the layers below and above to find where contours cross bands of three rows and more
    #[arg(long)]
    use_neighbours: bool,
}

impl FixSettings {
    pub(crate) fn options(&self) -> FixOptions {
        FixOptions {
            method: self.method,
            max_width: self.max_width,
            min_confidence: self.min_confidence,
            use_neighbours: self.use_neighbours,
        }
    }

    /// Returns the options as one text, defaults filled in.
    pub(crate) fn canonical(&self) -> String {
        let Self { method, max_width, min_confidence, use_neighbours } = self;
        let width = max_width.map(|rows| format!(" --max-width {rows}")).unwrap_or_default();
        let neighbours = if *use_neighbours { " --use-neighbours" } else { "" };
        format!("fix --method {method}{width} --min-confidence {min_confidence}{neighbours}")
    }
}

/// Layers whose rows are being corrected.
pub(crate) struct Fixing {
    options: FixOptions,
    report: RefCell<FixReport>,
}

impl Fixing {
    pub(crate) fn new(settings: &FixSettings) -> Self {
        let options = settings.options();
        Self { options, report: RefCell::new(FixReport::new(options)) }
    }

    /// Returns the corrected layers. Findings in those of `counted` are reported, and shown to
    /// `see`.
    pub(crate) fn layers<'a>(
        &'a self,
        layers: impl Iterator<Item = Result<Layer, Exit>> + 'a,
        counted: Range<u32>,
        mut see: impl FnMut(&Fixed<'_>) + 'a,
    ) -> impl Iterator<Item = Result<Layer, Exit>> + 'a {
        lamp_postprocess::fix(layers, self.options, move |fixed| {
            if counted.contains(&fixed.before.info.index) {
                see(fixed);
                self.report.borrow_mut().add(fixed);
            }
        })
    }

    /// Returns the corrected layers. Those whose pages say that all rows are good are not decoded.
    pub(crate) fn passing<'a>(
        &'a self,
        layers: impl Iterator<Item = Result<PassingLayer, Exit>> + 'a,
        decode: impl Fn(PassingLayer) -> Result<Layer, Exit> + Sync + 'a,
        mut see: impl FnMut(&Fixed<'_>) + 'a,
    ) -> impl Iterator<Item = Result<PassingLayer, Exit>> + 'a {
        lamp_postprocess::fix_passing(layers, self.options, decode, move |fixed| {
            see(fixed);
            self.report.borrow_mut().add(fixed);
        })
    }

    /// Returns what was found so far.
    pub(crate) fn report(&self) -> Ref<'_, FixReport> {
        self.report.borrow()
    }
}

/// Parses a share from 0 to 1.
fn parse_share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(share) if (0.0..=1.0).contains(&share) => Ok(share),
        _ => Err(format!("`{text}` is not a share: write a number from 0 to 1")),
    }
}
