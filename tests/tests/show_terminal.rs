//! Reads back what `lamp show --draw` prints.

use lamp_stack::{GrayMask, Layer, Mask, PageInfo, Pitch};
use lamp_tests::{Scratch, ask};

fn layer(image: impl Into<lamp_stack::LayerImage>) -> [Layer; 1] {
    [Layer { info: PageInfo::default(), pitch: Pitch::of_dpi(254.0), image: image.into() }]
}

/// A ring of a width and a height of 120 pixels.
fn ring() -> Mask {
    let mut ends = vec![0];
    let mut transitions = Vec::new();
    for row in 0..120i32 {
        let away = (2 * row - 119).pow(2);
        let half = |radius: i32| f64::from((4 * radius * radius - away).max(0)).sqrt() as i32 / 2;
        let (outer, inner) = (half(55), half(40));
        if outer > 0 {
            let ends = if inner > 0 { vec![outer, inner] } else { vec![outer] };
            let left = ends.iter().map(|end| 60 - end);
            let columns = left.chain(ends.iter().rev().map(|end| 60 + end));
            transitions.extend(columns.map(|column| column as u32));
        }
        ends.push(transitions.len() as u32);
    }
    Mask::new(120, ends, transitions).unwrap()
}

fn lines(scratch: &Scratch, columns: &str, options: &str) -> Vec<String> {
    let mut command = scratch.command("lamp show ring.tif --layer 0 --draw ascii");
    command.args(options.split_whitespace()).env("COLUMNS", columns);
    let out = command.output().unwrap();
    assert!(out.status.success() && out.stderr.is_empty(), "{out:?}");
    String::from_utf8(out.stdout).unwrap().lines().map(str::to_owned).collect()
}

#[test]
fn characters_fit_the_width_of_the_terminal() {
    let scratch = Scratch::new();
    scratch.stack("ring.tif", layer(ring()));
    // The ring is 108 pixels wide and 110 high, and black around it is left out.
    for (columns, width, height) in
        [("200", 108, 55), ("108", 108, 55), ("60", 54, 28), ("53", 36, 19), ("1", 1, 1)]
    {
        let lines = lines(&scratch, columns, "");
        assert_eq!(lines.len(), height, "{columns}");
        let longest = lines.iter().map(String::len).max().unwrap();
        assert!(longest <= width && longest + 8 >= width, "{columns}: {longest}");
        assert!(lines.iter().all(|line| line.is_ascii()));
    }
    // At one character for 1 x 2 pixels, each says whether both are white.
    let (lines, mask) = (lines(&scratch, "120", ""), ring());
    for (y, x) in (0..55u32).flat_map(|y| (0..108u32).map(move |x| (y, x))) {
        let rows = [2 * y + 5, 2 * y + 6];
        let white = rows.iter().filter(|&&row| mask.is_white(x + 6, row)).count();
        let shown = lines[y as usize].as_bytes().get(x as usize).copied().unwrap_or(b' ');
        assert_eq!(shown, [b' ', b'+', b'@'][white], "column {x}, line {y}");
    }
}

#[test]
fn scale_and_region_hold_for_characters_too() {
    let scratch = Scratch::new();
    scratch.stack("ring.tif", layer(ring()));
    let part = lines(&scratch, "80", "--region 58,10,3,4 --zoom 2");
    assert_eq!(part, ["@@@@@@"; 4]);
    assert_eq!(lines(&scratch, "20", "--zoom 1/2").len(), 28);
    let ran = scratch.run("lamp show ring.tif --layers 0..1 --draw ascii");
    assert_eq!(ran.statuses, [Some(2)]);
    scratch.run("lamp show ring.tif --layer 0 --draw ascii -o ring.txt").succeeds_quietly();
    assert!(scratch.bytes("ring.txt").starts_with(b"     "));
}

#[test]
fn a_picture_fits_the_height_of_the_terminal_too() {
    let scratch = Scratch::new();
    scratch.stack("ring.tif", layer(ring()));
    for (height, lines) in [("24", 19), ("100", 55), ("4", 1)] {
        let mut command = scratch.command("lamp show ring.tif --layer 0 --draw blocks");
        let out = command.env("COLUMNS", "300").env("LINES", height).output().unwrap();
        let text = String::from_utf8(out.stdout).unwrap();
        assert_eq!(text.lines().count(), lines, "{height}");
        assert!(text.lines().all(|line| line.ends_with("\x1b[0m")), "{text}");
    }
}

#[test]
fn pictures_of_terminals_hold_the_png() {
    let scratch = Scratch::new();
    // Noise has more letters than a part of Kitty's protocol may have.
    let mut gray = GrayMask::new(120);
    let mut state = 1u32;
    for _ in 0..90 {
        let levels = (0..120).map(|_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (1, (state >> 24) as u8 | 1)
        });
        gray.push_runs(levels).unwrap();
    }
    scratch.stack("noise.tif", layer(gray));
    scratch.run("lamp show noise.tif --layer 0 -o noise.png").succeeds_quietly();
    let drawn = |form: &str| {
        let mut command = scratch.command(&format!("lamp show noise.tif --layer 0 --draw {form}"));
        let out = command.env("COLUMNS", "200").env("LINES", "200").output().unwrap();
        String::from_utf8(out.stdout).unwrap()
    };
    let kitty = drawn("kitty");
    let parts: Vec<_> = kitty.trim_end().split_terminator("\x1b\\").collect();
    assert!(parts.len() > 2, "{}", parts.len());
    let letters: String = (0..)
        .zip(&parts)
        .map(|(number, part)| {
            let begin = if number == 0 { "a=T,f=100," } else { "" };
            let more = u8::from(number + 1 < parts.len());
            let letters = part.strip_prefix(&format!("\x1b_G{begin}m={more};")).unwrap();
            assert!(letters.len() <= 4096);
            letters
        })
        .collect();
    let iterm = drawn("iterm");
    let (head, of_iterm) = iterm.trim_end().strip_suffix('\x07').unwrap().split_once(':').unwrap();
    let size = scratch.bytes("noise.png").len();
    assert_eq!(head, format!("\x1b]1337;File=inline=1;size={size}"));
    for letters in [&letters, of_iterm] {
        scratch.write("letters", letters.as_bytes());
        let decode = ["-c", "base64 -d letters > decoded.png"];
        let Some(_) = ask(&scratch, "sh", &decode) else { return };
        assert!(scratch.bytes("decoded.png") == scratch.bytes("noise.png"));
    }
}

#[test]
fn sixels_are_what_an_independent_decoder_reads() {
    let scratch = Scratch::new();
    // 50 columns and 9 rows of all gray levels, so that the last row of sixels is not full.
    let mut gray = GrayMask::new(50);
    for row in 0..9u32 {
        gray.push_runs((0..50u32).map(|column| (1, ((row * 50 + column) % 256) as u8))).unwrap();
    }
    scratch.stack("gray.tif", layer(gray.clone()));
    scratch.run("lamp show gray.tif --layer 0 --draw sixel -o gray.six").succeeds_quietly();
    let asked = ["sixel:gray.six", "-alpha", "off", "-depth", "8", "gray.png"];
    let Some(_) = ask(&scratch, "convert", &asked) else { return };
    let png = std::io::Cursor::new(scratch.bytes("gray.png"));
    let mut decoder = png::Decoder::new(png);
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut pixels).unwrap();
    assert_eq!((frame.width, frame.height), (50, 9));
    let samples = frame.color_type.samples();
    for (y, x) in (0..9u32).flat_map(|y| (0..50u32).map(move |x| (y, x))) {
        let found = i32::from(pixels[samples * (y * 50 + x) as usize]);
        // 16 grays, stated in whole percent.
        assert!(
            (found - i32::from(gray.level(x, y))).abs() <= 8 + 2,
            "column {x}, row {y}: {found}"
        );
    }
}
