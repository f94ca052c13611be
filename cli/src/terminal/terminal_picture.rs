//! Draws pictures in a terminal: with characters, or as sixels.

use std::io::{self, Write};

use lamp_plots::{Picture, PictureRegion, PictureScale};

/// The width to draw for where the terminal does not report its own, in characters.
const USUAL_COLUMNS: u32 = 80;
/// The width of a character of most terminals, in pixels.
const COLUMN_PIXELS: u32 = 8;
/// Characters that look the brighter the later they stand.
const RAMP: &[u8; 10] = b" .:-=+*#%@";
/// The gray levels of a sixel picture. Terminals have 16 colors at least.
const GRAYS: u32 = 16;
/// The rows of pixels that a row of sixels has.
const SIXEL_ROWS: usize = 6;

/// How a picture is drawn in a terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TerminalForm {
    Ascii,
    Sixel,
}

impl TerminalForm {
    /// Returns the scale, at most 1, at which a region is as wide as the terminal.
    pub(crate) fn fitting(self, region: &PictureRegion) -> PictureScale {
        let across = match self {
            Self::Ascii => columns(),
            Self::Sixel => columns() * COLUMN_PIXELS,
        };
        PictureScale::Down((region.columns.len() as u32).div_ceil(across).max(1))
    }

    /// Writes a picture.
    pub(crate) fn write(self, picture: Picture<'_>, out: impl Write) -> io::Result<()> {
        match self {
            Self::Ascii => write_ascii(picture, out),
            Self::Sixel => write_sixel(picture, out),
        }
    }
}

/// Returns the terminal's width in characters: from `COLUMNS`, or from the terminal itself.
fn columns() -> u32 {
    let told = std::env::var("COLUMNS").ok().and_then(|text| text.trim().parse::<u16>().ok());
    let own = || terminal_size::terminal_size().map(|(width, _)| width.0);
    // A width of 0 means that it is not known.
    told.filter(|&columns| columns > 0).or_else(own).map_or(USUAL_COLUMNS, u32::from).max(1)
}

/// Writes a line for each two rows: characters are twice as high as wide. Pixels that are not black
/// are never blank.
fn write_ascii(picture: Picture<'_>, mut out: impl Write) -> io::Result<()> {
    let mut rows = picture.into_rows();
    while let Some(upper) = rows.next() {
        let lower = rows.next();
        let mean = |(column, &level): (usize, &u8)| {
            let sum = u32::from(level) + lower.as_ref().map_or(0, |row| u32::from(row[column]));
            character(sum, if lower.is_some() { 2 } else { 1 })
        };
        let mut line: Vec<u8> = upper.iter().enumerate().map(mean).collect();
        // Blanks at the end show nothing, and may wrap in a narrow terminal.
        line.truncate(line.iter().rposition(|&c| c != b' ').map_or(0, |last| last + 1));
        line.push(b'\n');
        out.write_all(&line)?;
    }
    out.flush()
}

/// Returns the character for the mean of levels, given their sum and number.
fn character(sum: u32, count: u32) -> u8 {
    let steps = RAMP.len() as u32 - 1;
    // Rounds to the nearest step in whole numbers: the sum is at most 510, so 32 bits are enough.
    let step = (2 * sum * steps + 255 * count) / (2 * 255 * count);
    RAMP[step.max(u32::from(sum > 0)) as usize]
}

/// Writes a picture in the form of DEC's VT340: rows of sixels, each color of a row by itself.
fn write_sixel(picture: Picture<'_>, mut out: impl Write) -> io::Result<()> {
    let (width, height) = (picture.width, picture.height);
    // Pixels that no color draws stay as they are (1), and pixels are square (1;1).
    write!(out, "\x1bP0;1q\"1;1;{width};{height}")?;
    for gray in 0..GRAYS {
        // Sixels have colors in percent.
        let percent = (100 * gray + (GRAYS - 1) / 2) / (GRAYS - 1);
        write!(out, "#{gray};2;{percent};{percent};{percent}")?;
    }
    let mut rows = picture.into_rows();
    loop {
        let band: Vec<Vec<u8>> = rows.by_ref().take(SIXEL_ROWS).collect();
        if band.is_empty() {
            break;
        }
        write_band(&band, &mut out)?;
    }
    out.write_all(b"\x1b\\\n")?;
    out.flush()
}

fn write_band(rows: &[Vec<u8>], out: &mut impl Write) -> io::Result<()> {
    let gray = |level: u8| (u32::from(level) * (GRAYS - 1) + 127) / 255;
    let width = rows.first().map_or(0, Vec::len);
    for colour in 0..GRAYS {
        if !rows.iter().flatten().any(|&level| gray(level) == colour) {
            continue;
        }
        let sixel = |column: usize| {
            let bits = rows.iter().enumerate().filter(|(_, row)| gray(row[column]) == colour);
            // A sixel is six bits above `?`, the uppermost pixel the lowest bit.
            bits.map(|(row, _)| 1 << row).sum::<u8>() + b'?'
        };
        let sixels: Vec<u8> = (0..width).map(sixel).collect();
        write!(out, "#{colour}")?;
        for run in sixels.chunk_by(|a, b| a == b) {
            let sixel = char::from(run[0]);
            match run.len() {
                // A repeat takes three characters, so runs of up to three are written out.
                1..=3 => write!(out, "{}", sixel.to_string().repeat(run.len()))?,
                length => write!(out, "!{length}{sixel}")?,
            }
        }
        // Back to the left: the next color draws over the same rows.
        out.write_all(b"$")?;
    }
    out.write_all(b"-")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(rows: &[&[u8]], form: TerminalForm) -> String {
        let rows: Vec<Vec<u8>> = rows.iter().map(|row| row.to_vec()).collect();
        let picture = Picture::from_rows(rows[0].len() as u32, rows.len() as u32, rows.into_iter());
        let mut text = Vec::new();
        form.write(picture, &mut text).unwrap();
        String::from_utf8(text).unwrap()
    }

    #[test]
    fn characters_stand_for_two_rows_and_thin_lines_stay() {
        let rows: [&[u8]; 3] = [&[0, 255, 255, 1, 0], &[0, 255, 0, 0, 0], &[255, 0, 0, 0, 0]];
        assert_eq!(drawn(&rows, TerminalForm::Ascii), " @+.\n@\n");
    }

    #[test]
    fn sixels_have_six_rows() {
        let column: Vec<&[u8]> = vec![&[255, 255, 255, 255, 0]; 7];
        let text = drawn(&column, TerminalForm::Sixel);
        let (head, pixels) = text.split_once("#15;2;100;100;100").unwrap();
        assert!(head.starts_with("\u{1b}P0;1q\"1;1;5;7#0;2;0;0;0#1;2;7;7;7"), "{head}");
        assert_eq!(pixels, "#0!4?~$#15!4~?$-#0!4?@$#15!4@?$-\u{1b}\\\n");
    }
}
