//! `lamp compare`: finds where two stacks differ.

mod picture;
mod report;
mod walk;

use std::path::{Path, PathBuf};
use std::str::FromStr;

use clap::Args;
use lamp_stack::{IndexedStack, Length, Pairing, Pitch};

use crate::args::options::{Common, parse_distance};
use crate::exit::Exit;
use crate::output::endings::{PNG, check_ending};
use crate::output::json_report::print_answer;
use crate::streams::{check_beside, failed_at, input_name, is_stream, open_indexed, print};
use crate::terminal::progress::Progress;

use picture::write_picture;
use report::{StackComparison, answer, text};
use walk::walk;

/// Find where two stacks differ: pixels added and missing, layer by layer
///
/// Layers of the same height are compared, or of the same index if a stack states no heights. The
/// origins and resolutions on the pages place the images, to whole pixels. A pixel that is brighter
/// in B is added; a darker pixel is missing.
#[derive(Args)]
#[command(after_help = "\
Examples:
  lamp compare blade.tif fixed.tif
  lamp compare old.tif new.tif --tolerance 1px --picture worst.png
  lamp compare coarse.tif fine.tif --json | jq .layers
  fix blade.tif | lamp compare blade.tif - || echo changed

Exit status, as in cmp and diff: 0 if the images are the same, 1 if they differ, 2 if they cannot be
compared or a stack is broken. The other commands end with 1 for bad input and 2 for wrong usage.")]
pub(crate) struct CompareArgs {
    /// The first stack: a TIFF or picture file, a folder of pages, or - for standard input
    #[arg(value_name = "A")]
    a: PathBuf,

    /// The second stack
    #[arg(value_name = "B")]
    b: PathBuf,

    /// Forgive edges up to this far apart, for example 1px or 20um [default: 0px]
    ///
    /// A pixel that differs is forgiven if, within this distance, A also has the color that B has
    /// at the pixel, and B also has the color that A has there. Gaps that close and walls that
    /// appear or vanish are still reported
    #[arg(long, value_name = "LENGTH")]
    tolerance: Option<Tolerance>,

    /// Draw the layer with the most pixels that differ: added ones in orange, missing ones in blue
    #[arg(long, value_name = "FILE.png")]
    picture: Option<PathBuf>,

    /// Print a JSON object (docs/json.md)
    #[arg(long)]
    json: bool,
}

/// How far edges may lie apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Tolerance {
    Pixels(f64),
    Length(Length),
}

impl Tolerance {
    /// Returns it in pixels, along rows and along columns.
    ///
    /// # Errors
    /// Returns an error if it is a length, and pixels have no known size.
    fn pixels(self, pitch: Option<Pitch>) -> Result<[f64; 2], String> {
        match (self, pitch) {
            (Self::Pixels(pixels), _) => Ok([pixels; 2]),
            (Self::Length(_), None) => Err("it states no resolution".to_owned()),
            (Self::Length(length), Some(pitch)) => Ok(pitch.pixels(length)),
        }
    }
}

impl FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.strip_suffix("px") {
            Some(number) => match number.trim_end().parse::<f64>() {
                Ok(pixels) if (0.0..=MOST_PIXELS).contains(&pixels) => Ok(Self::Pixels(pixels)),
                _ => Err(format!("`{text}` is not a distance: write 0px to {MOST_PIXELS}px")),
            },
            None => parse_distance(text).map(Self::Length),
        }
    }
}

/// The greatest tolerance in pixels.
const MOST_PIXELS: f64 = 10_000.0;

pub(crate) fn run(args: &CompareArgs, common: &Common) -> Result<(), Exit> {
    compare(args, common).map_err(|error| match error {
        // A stack that is broken must not look like one that differs.
        Exit::Failed(error) => Exit::Usage(error),
        Exit::Output(_) if error.is_reader_gone() => error,
        Exit::Output(error) => Exit::Usage(error),
        error => error,
    })
}

fn compare(args: &CompareArgs, common: &Common) -> Result<(), Exit> {
    let paths = [&args.a, &args.b];
    if paths.iter().all(|path| is_stream(path)) {
        return Err(Exit::usage("standard input can be read only once: give - once"));
    }
    if let Some(picture) = &args.picture {
        check_ending(picture, &PNG)?;
        check_beside(picture, Path::new("-"), paths)?;
    }
    let [a, b] = [opened(&args.a)?, opened(&args.b)?];
    // Pages of two resolutions are refused when they are compared.
    let pitch = a.headers()[0].pitch;
    let tolerance = args.tolerance.unwrap_or(Tolerance::Pixels(0.0)).pixels(pitch);
    let tolerance = tolerance.map_err(|why| {
        let name = input_name(&args.a);
        Exit::usage(format!("{name}: {why}: give --tolerance in pixels, such as 1px"))
    })?;
    let pairing = Pairing::of(a.headers(), b.headers());
    let names = paths.map(|path| input_name(path));
    let progress = Progress::new("compare", common, true);
    progress.expect(pairing.sections().len() as u64);
    let stacks = [(&a, &*names[0]), (&b, &*names[1])];
    let sections = walk(stacks, &pairing, tolerance, &progress);
    progress.done();
    let comparison = StackComparison {
        names,
        pairing: &pairing,
        headers: [a.headers(), b.headers()],
        tolerance,
        sections: sections?,
    };
    if let Some(path) = &args.picture {
        match comparison.worst() {
            Some(worst) => {
                let stacks = [(&a, &*comparison.names[0]), (&b, &*comparison.names[1])];
                write_picture(path, stacks, &worst.section, tolerance)?;
            }
            None => progress.say("nothing differs, so no picture is drawn"),
        }
    }
    if args.json {
        print_answer("lamp-compare-1", &answer(&comparison))?;
    } else if !common.quiet {
        // Quiet, the status alone answers, as of `cmp -s`.
        print(&text(&comparison, common.verbose))?;
    }
    if comparison.is_same() { Ok(()) } else { Err(Exit::Different) }
}

/// Opens a whole stack, of which any page can be read.
fn opened(path: &Path) -> Result<IndexedStack, Exit> {
    let whole = open_indexed(path)?.into_whole();
    whole.map_err(|error| failed_at(input_name(path), error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tolerances_are_pixels_or_lengths() {
        assert_eq!("1.5px".parse(), Ok(Tolerance::Pixels(1.5)));
        assert_eq!("20um".parse(), Ok(Tolerance::Length(Length::from_um(20.0))));
        let dpi = Pitch::of_dpi(254.0);
        assert_eq!(Tolerance::Length(Length::from_um(150.0)).pixels(dpi), Ok([1.5; 2]));
        let refused = Tolerance::Length(Length::from_um(150.0)).pixels(None);
        assert!(refused.unwrap_err().contains("no resolution"));
        let two = Tolerance::Length(Length::from_um(38.0)).pixels("19x38um".parse().ok());
        assert_eq!(two, Ok([2.0, 1.0]));
        for wrong in ["", "px", "-1px", "nanpx", "1e9px", "-3um"] {
            assert!(wrong.parse::<Tolerance>().is_err(), "{wrong}");
        }
    }
}
