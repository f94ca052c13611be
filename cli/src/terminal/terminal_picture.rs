//! Draws pictures in a terminal: with characters, or as the terminal's own pictures.

use std::io::{self, Write};

use clap::ValueEnum;
use lamp_plots::{Picture, PictureRegion, PictureScale};

use crate::output::base64::base64;

/// The size to draw for where the terminal does not report its own, in characters.
const USUAL_COLUMNS: u32 = 80;
/// The size of a character of most terminals, in pixels.
const COLUMN_PIXELS: u32 = 8;
const LINE_PIXELS: u32 = 16;
/// Lines that stay free for the command, a message and the next prompt.
const OTHER_LINES: u32 = 3;
/// Characters that look the brighter the later they stand.
const RAMP: &[u8; 10] = b" .:-=+*#%@";
/// The gray levels of a sixel picture. Terminals have 16 colors at least.
const GRAYS: u32 = 16;
/// The rows of pixels that a row of sixels has.
const SIXEL_ROWS: usize = 6;
/// The most letters of a part of a picture in Kitty's protocol.
const KITTY_LETTERS: usize = 4096;

/// How a picture is drawn in a terminal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum TerminalForm {
    /// Letters, denser for brighter pixels
    Ascii,
    /// Half blocks in 26 grays
    Blocks,
    /// A sixel picture: foot, mlterm, xterm -ti vt340
    Sixel,
    /// A picture in Kitty's protocol: Kitty, Ghostty
    Kitty,
    /// A picture in iTerm2's protocol: iTerm2, WezTerm
    Iterm,
}

impl TerminalForm {
    /// Returns the best form that the terminal is known to draw.
    pub(crate) fn of_terminal() -> Self {
        let variable = |name: &str| std::env::var(name).unwrap_or_default();
        let (term, program) = (variable("TERM"), variable("TERM_PROGRAM"));
        // The first that is set decides (POSIX, 8.2).
        let locale = ["LC_ALL", "LC_CTYPE", "LANG"].map(variable);
        let locale = locale.into_iter().find(|it| !it.is_empty()).unwrap_or_default();
        let is_utf8 = ["utf-8", "utf8"].iter().any(|it| locale.to_lowercase().ends_with(it));
        if ["kitty", "ghostty"].iter().any(|it| term.contains(it)) {
            Self::Kitty
        } else if ["iTerm.app", "WezTerm"].contains(&&*program) {
            Self::Iterm
        } else if ["foot", "mlterm"].iter().any(|it| term.starts_with(it)) {
            Self::Sixel
        } else if term != "dumb" && (is_utf8 || cfg!(windows)) {
            Self::Blocks
        } else {
            Self::Ascii
        }
    }

    /// Returns the scale, at most 1, at which a region fits the terminal. Pixels are `aspect` widths
    /// high.
    pub(crate) fn fitting(self, region: &PictureRegion, aspect: f64) -> PictureScale {
        // A character is two pixels high.
        let [wide, high] = match self {
            Self::Ascii | Self::Blocks => [1, 2],
            _ => [COLUMN_PIXELS, LINE_PIXELS],
        };
        let across = (region.columns.len() as u32).div_ceil(columns() * wide);
        let rows = (region.rows.len() as f64 * aspect).ceil() as u32;
        let up = lines().map_or(1, |lines| rows.div_ceil(lines * high));
        PictureScale::Down(across.max(up).max(1))
    }

    /// Writes a picture.
    pub(crate) fn write(self, picture: Picture<'_>, out: impl Write) -> io::Result<()> {
        match self {
            Self::Ascii => write_ascii(picture, out),
            Self::Blocks => write_blocks(picture, out),
            Self::Sixel => write_sixel(picture, out),
            Self::Kitty => write_kitty(picture, out),
            Self::Iterm => write_iterm(picture, out),
        }
    }
}

/// Returns the terminal's width in characters: from `COLUMNS`, or from the terminal itself.
fn columns() -> u32 {
    let own = || terminal_size::terminal_size().map(|(width, _)| width.0);
    stated("COLUMNS").or_else(own).map_or(USUAL_COLUMNS, u32::from).max(1)
}

/// Returns the lines of a terminal that a picture may take: from `LINES`, or from the terminal
/// itself. A pipe has no such limit.
fn lines() -> Option<u32> {
    let own = || terminal_size::terminal_size().map(|(_, height)| height.0);
    let lines = u32::from(stated("LINES").or_else(own)?);
    Some(lines.saturating_sub(OTHER_LINES).max(1))
}

/// Returns the number above zero in an environment variable.
fn stated(name: &str) -> Option<u16> {
    let number = std::env::var(name).ok()?.trim().parse().ok();
    number.filter(|&number| number > 0)
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

/// Writes a line for each two rows, the upper one as the upper half of a block.
fn write_blocks(picture: Picture<'_>, mut out: impl Write) -> io::Result<()> {
    let mut rows = picture.into_rows();
    while let Some(upper) = rows.next() {
        let lower = rows.next();
        let mut last = None;
        for (column, &level) in upper.iter().enumerate() {
            let inks =
                [Some(level), lower.as_ref().map(|row| row[column])].map(|it| it.map(gray_of));
            if last != Some(inks) {
                // Below a last single row, the terminal's own background shows.
                let below = inks[1].map_or("49".into(), |gray| format!("48;5;{gray}"));
                write!(out, "\x1b[38;5;{};{below}m", inks[0].unwrap_or_default())?;
                last = Some(inks);
            }
            out.write_all("\u{2580}".as_bytes())?;
        }
        out.write_all(b"\x1b[0m\n")?;
    }
    out.flush()
}

/// Returns the nearest gray of a terminal's 256 colors: black and white of its cube, and 24 grays
/// between them. No gray pixel is as black as black.
fn gray_of(level: u8) -> u8 {
    match level {
        0 => 16,
        255 => 231,
        // They are 8, 18 and so on, up to 238.
        level => 232 + ((i32::from(level) - 3) / 10).clamp(0, 23) as u8,
    }
}

/// Writes a PNG in the protocol of Kitty: parts of at most 4096 letters (`m=1` until the last).
fn write_kitty(picture: Picture<'_>, mut out: impl Write) -> io::Result<()> {
    let letters = base64(&png_of(picture)?);
    let parts: Vec<&[u8]> = letters.as_bytes().chunks(KITTY_LETTERS).collect();
    for (number, part) in parts.iter().enumerate() {
        let begin = if number == 0 { "a=T,f=100," } else { "" };
        write!(out, "\x1b_G{begin}m={};", u8::from(number + 1 < parts.len()))?;
        out.write_all(part)?;
        out.write_all(b"\x1b\\")?;
    }
    out.write_all(b"\n")?;
    out.flush()
}

/// Writes a PNG in the protocol of iTerm2.
fn write_iterm(picture: Picture<'_>, mut out: impl Write) -> io::Result<()> {
    let png = png_of(picture)?;
    writeln!(out, "\x1b]1337;File=inline=1;size={}:{}\x07", png.len(), base64(&png))?;
    out.flush()
}

fn png_of(picture: Picture<'_>) -> io::Result<Vec<u8>> {
    let mut png = Vec::new();
    picture.write_png(&mut png)?;
    Ok(png)
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
    for color in 0..GRAYS {
        if !rows.iter().flatten().any(|&level| gray(level) == color) {
            continue;
        }
        let sixel = |column: usize| {
            let bits = rows.iter().enumerate().filter(|(_, row)| gray(row[column]) == color);
            // A sixel is six bits above `?`, the uppermost pixel the lowest bit.
            bits.map(|(row, _)| 1 << row).sum::<u8>() + b'?'
        };
        let sixels: Vec<u8> = (0..width).map(sixel).collect();
        write!(out, "#{color}")?;
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
    fn blocks_hold_two_rows() {
        let rows: [&[u8]; 3] = [&[0, 255, 255], &[0, 0, 0], &[1, 254, 128]];
        let half = "\u{2580}";
        let two = format!("\x1b[38;5;16;48;5;16m{half}\x1b[38;5;231;48;5;16m{half}{half}\x1b[0m\n");
        let one = format!("\x1b[38;5;232;49m{half}\x1b[38;5;255;49m{half}\x1b[38;5;244;49m{half}");
        assert_eq!(drawn(&rows, TerminalForm::Blocks), format!("{two}{one}\x1b[0m\n"));
    }

    #[test]
    fn each_level_has_the_nearest_gray() {
        // xterm's: black, white, and 8 + 10 k.
        let value = |color: u8| match color {
            16 => 0,
            231 => 255,
            color => 8 + 10 * i32::from(color - 232),
        };
        for level in 1..=254 {
            let off = (value(gray_of(level)) - i32::from(level)).abs();
            let least = (0..24).map(|k| (8 + 10 * k - i32::from(level)).abs()).min().unwrap();
            assert_eq!(off, least, "{level}");
        }
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
