//! Draws a picture of each band that `fix` corrected or left, for `--evidence`.

use std::io;
use std::path::{Path, PathBuf};

use lamp_fix::{Band, BandOutcome, Fixed};
use lamp_stack::{FolderBeside, Image, Pitch, write_rgb_png};

use crate::exit::Exit;
use crate::streams::new_folder;
use lamp_plots::{PictureRegion, levels_of_region};

/// Rows above and below a band, and columns at its sides, that are shown with it.
const ROWS_AROUND: u32 = 16;
const COLUMNS_AROUND: u32 = 48;
/// Largest region shown, from the gap and the first row on: a stray run may cross the whole image,
/// and this much shows how it was corrected.
const MAX_COLUMNS: u32 = 400;
const MAX_ROWS: u32 = 200;
/// Picture pixels that an image pixel is wide.
const SCALE: usize = 4;
/// Color of the gap between two panels.
const GUTTER: [u8; 3] = [128; 3];

/// A folder of pictures, one for each band.
pub(crate) struct BandPictures {
    folder: FolderBeside,
    name: PathBuf,
    failed: Option<io::Error>,
}

impl BandPictures {
    /// Prepares the folder, in place of one that an earlier run wrote if that is forced.
    pub(crate) fn new(folder: &Path, force: bool) -> Result<Self, Exit> {
        Ok(Self { folder: new_folder(folder, force)?, name: folder.to_owned(), failed: None })
    }

    /// Draws the bands of a layer. After a failure it draws no more.
    pub(crate) fn add(&mut self, fixed: &Fixed<'_>) {
        for band in fixed.bands {
            // The stack is still written, so a failure waits for the end.
            if self.failed.is_none() {
                self.failed = self.draw(fixed, band).err();
            }
        }
    }

    /// Gives the folder its name, or returns the first failure to draw.
    pub(crate) fn finish(self) -> Result<(), Exit> {
        let Self { folder, name, failed } = self;
        let whole = failed.map_or(Ok(folder), |error| Err(error.into()));
        let whole = whole.and_then(FolderBeside::persist);
        whole.map_err(|error| Exit::from(error).at(name.display().to_string()))
    }

    fn draw(&self, fixed: &Fixed<'_>, band: &Band) -> io::Result<()> {
        let region = region(&fixed.before.image, band);
        let panel = |image: &Image| -> Vec<Vec<u8>> { levels_of_region(image, &region).collect() };
        let before = panel(&fixed.before.image);
        let corrected = band.outcome == BandOutcome::Corrected;
        let panels = if corrected {
            let after = panel(&fixed.after.image);
            vec![plain(&before), plain(&after), difference(&before, &after)]
        } else {
            vec![plain(&before)]
        };
        let aspect = fixed.before.pitch.map_or(1.0, Pitch::aspect);
        let rows = enlarged(&panels, (SCALE as f64 * aspect).round().max(1.0) as usize);
        let name = format!(
            "layer_{:05}_rows_{:05}-{:05}{}.png",
            fixed.before.info.index,
            band.first_row,
            band.end() - 1,
            if corrected { "" } else { "_left" },
        );
        let (width, height) = (rows[0].len() as u32 / 3, rows.len() as u32);
        self.folder.add(&name, |out| write_rgb_png(out, width, height, rows.into_iter()))
    }
}

/// Returns the region to show of a band, from a little left of its gap on.
fn region(image: &Image, band: &Band) -> PictureRegion {
    let gap = band.gap.clone().unwrap_or_else(|| band.columns.clone());
    let left = gap.start.min(image.width() - 1).saturating_sub(COLUMNS_AROUND);
    let right = band.columns.end.max(gap.end).saturating_add(COLUMNS_AROUND);
    let [top, bottom] =
        [band.first_row.saturating_sub(ROWS_AROUND), band.end().saturating_add(ROWS_AROUND)];
    let bottom = bottom.min(top.saturating_add(MAX_ROWS));
    PictureRegion {
        columns: left..right.min(left.saturating_add(MAX_COLUMNS)).min(image.width()),
        rows: top..bottom.min(image.height()),
    }
}

/// Rows of red, green and blue.
type Panel = Vec<Vec<[u8; 3]>>;

fn plain(levels: &[Vec<u8>]) -> Panel {
    levels.iter().map(|row| row.iter().map(|&level| [level; 3]).collect()).collect()
}

/// Shows brighter pixels in blue, darker ones in red and the rest dimmed.
fn difference(before: &[Vec<u8>], after: &[Vec<u8>]) -> Panel {
    let shade = |(&before, &after): (&u8, &u8)| match after.cmp(&before) {
        std::cmp::Ordering::Equal => [before / 3; 3],
        std::cmp::Ordering::Greater => [0, 110, 255],
        std::cmp::Ordering::Less => [230, 30, 30],
    };
    before.iter().zip(after).map(|(a, b)| a.iter().zip(b).map(shade).collect()).collect()
}

/// The panels one below the other, each row so many pixels high.
fn enlarged(panels: &[Panel], high: usize) -> Vec<Vec<u8>> {
    let wide =
        |row: &[[u8; 3]]| -> Vec<u8> { row.iter().flat_map(|pixel| pixel.repeat(SCALE)).collect() };
    let width = panels[0][0].len();
    let gutter = vec![wide(&vec![GUTTER; width]); SCALE];
    let panels: Vec<Vec<Vec<u8>>> = panels
        .iter()
        .map(|panel| panel.iter().flat_map(|row| vec![wide(row); high]).collect())
        .collect();
    panels.join(&gutter[..])
}
