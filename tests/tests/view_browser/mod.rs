//! The viewer in a real browser: what is on its canvas is what the stack says. Without Chromium
//! and its driver, a test says so and passes.

mod browser;

use lamp_stack::{Image, Layer, Mask, MaskBuilder, PageInfo, Pitch};
use lamp_tests::{Scratch, Viewing, mask};
use serde_json::{Value, json};

use browser::Browser;

const WINDOW: [u32; 2] = [1400, 900];
/// The tower's layers fit into it, each pixel 4 screen pixels wide.
const LARGE: [u32; 2] = [1800, 1500];
const UP: char = '\u{e013}';
const END: char = '\u{e010}';
const TAB: char = '\u{e004}';

const BLACK: [u8; 3] = [0; 3];
const WHITE: [u8; 3] = [255; 3];

/// The demo build, as `lamp demo` makes it.
fn demo() -> Scratch {
    let scratch = Scratch::new();
    scratch.run("lamp demo").succeeds();
    scratch
}

/// Whether an overlay colors a pixel.
type Rule<'a> = &'a dyn Fn([u32; 2]) -> bool;

fn white(layer: &Layer, [column, row]: [u32; 2]) -> bool {
    mask(layer).is_white(column, row)
}

/// The pixels that the canvas must show as colored are the pixels for which `wanted` is true, over
/// black and white.
#[track_caller]
fn is_laid_over(browser: &Browser, layer: &Layer, wanted: impl Fn([u32; 2]) -> bool) -> usize {
    let [width, height] = [layer.image.width(), layer.image.height()];
    let pixels: Vec<_> = (0..height).flat_map(|y| (0..width).map(move |x| [x, y])).collect();
    let mut seen = 0;
    let mut count = 0;
    for (pixel, colour) in pixels.iter().zip(browser.colours(&pixels)) {
        let Some(colour) = colour else { continue };
        seen += 1;
        count += usize::from(wanted(*pixel));
        let plain = if white(layer, *pixel) { WHITE } else { BLACK };
        assert_eq!(colour != plain, wanted(*pixel), "{pixel:?} is {colour:?} on {plain:?}");
    }
    assert_eq!(seen, pixels.len(), "the whole layer fits on the screen");
    count
}

#[test]
fn the_demo_build_is_seen_to_the_pixel() {
    let scratch = demo();
    let viewing = Viewing::unopened(&scratch, "lamp-demo/alpha.tif --check", &[]);
    let Some(browser) = Browser::open(&viewing, WINDOW) else { return };
    let layers = scratch.layers("lamp-demo/alpha.tif");
    browser.shows(&["0/0/layer"]);

    // Zoomed in by keys from where pixels are smaller than the screen's, they are squares.
    browser.go("#stack=0&layer=5&at=3100.5,3600.5&zoom=0.6");
    assert_ne!(browser.shades(), 0);
    for _ in 0..3 {
        browser.press('+');
    }
    browser.settle();
    let zoom: f64 = browser.place()["zoom"].as_str().unwrap().parse().unwrap();
    assert!(zoom > 1.0, "{zoom}");
    assert_eq!(browser.shades(), 0);

    // Layers by keys and by the field; place and zoom stay.
    browser.go("#stack=0&layer=0&at=3100.5,3600.5&zoom=2");
    let before = browser.place();
    browser.press(UP);
    browser.shows(&["0/1/layer"]);
    browser.press(END);
    browser.shows(&[&format!("0/{}/layer", layers.len() - 1)]);
    browser.type_into("#layer", "44.4mm");
    browser.shows(&["0/5/layer"]);
    let after = browser.place();
    assert_eq!((&after["at"], &after["zoom"]), (&before["at"], &before["zoom"]));
    assert!(browser.text("#layer-facts").contains("44.400 mm"));

    // Twenty pixels along an edge, each 40 screen pixels wide: black and white as in the mask.
    let layer = &layers[5];
    let row = 3375;
    let edge = mask(layer).row(row)[6];
    browser.go(&format!("#stack=0&layer=5&at={edge}.5,{row}.5&zoom=40"));
    let known: Vec<_> = (edge - 10..edge + 10).map(|column| [column, row]).collect();
    let shown = browser.colours(&known);
    let wanted: Vec<_> =
        known.iter().map(|&at| Some(if white(layer, at) { WHITE } else { BLACK })).collect();
    assert_eq!(shown, wanted);
    assert!(wanted.contains(&Some(BLACK)) && wanted.contains(&Some(WHITE)));

    follow_a_finding(&browser);
    see_the_part(&browser);
    browser.was_quiet();
}

/// Browsers keep the cookie from what other pages lead to, as the file of `--open` does.
#[cfg(unix)]
#[test]
fn the_private_file_leads_to_the_page() {
    let scratch = Scratch::with_tower_and_torus();
    let (viewing, path) = Viewing::opened(&scratch, "torus.tif");
    let file = format!("file://{}", path.trim_end());
    let Some(browser) = Browser::open_by(&viewing, &file, WINDOW) else { return };
    let place =
        || browser.run("return location.origin + location.pathname + location.search", vec![]);
    let page = format!("http://127.0.0.1:{}/", viewing.port);
    assert_eq!(place(), json!(page));
    browser.reload();
    assert_eq!(place(), json!(page));
    assert_eq!(browser.run("return document.cookie", vec![]), json!(""), "it is for the server");
}

fn follow_a_finding(browser: &Browser) {
    browser.wait_for("document.querySelector('#findings-list button')");
    let list = "document.querySelectorAll('#findings-list button')";
    // The first has a place; white at the border, the last, has none.
    browser.run(&format!("{list}[0].click()"), vec![]);
    let line = browser.run(&format!("return {list}[0].textContent"), vec![]);
    browser.settle();
    let layer = browser.text("#layer-facts");
    let number = layer.lines().nth(1).unwrap();
    let mut words =
        line.as_str().unwrap().split([' ', ',']).skip_while(|word| !word.starts_with("layer"));
    assert_eq!(words.nth(1), Some(number), "{line}");
    let place = browser.place();
    assert_eq!(place["overlays"], "findings");
    let marked = "return document.querySelector('#marks path.under').getAttribute('d').length";
    assert!(browser.run(marked, vec![]).as_u64() > Some(10), "a rectangle is around it");
}

/// Opens the panel of the part, which must draw more than its ground.
fn see_the_part(browser: &Browser) {
    browser.run("document.querySelector('#solid').open = true", vec![]);
    browser.wait_for("document.querySelector('#solid-view canvas')");
    browser.settle();
    let script = "const canvas = document.querySelector('#solid-view canvas');
        const copy = document.createElement('canvas');
        [copy.width, copy.height] = [canvas.width, canvas.height];
        const pen = copy.getContext('2d');
        pen.drawImage(canvas, 0, 0);
        const data = pen.getImageData(0, 0, copy.width, copy.height).data;
        const seen = new Set();
        for (let at = 0; at < data.length; at += 4) {
          if (data[at + 3] === 255) seen.add(data[at] << 16 | data[at + 1] << 8 | data[at + 2]);
        }
        return seen.size;";
    let colours = browser.run(script, vec![]);
    assert!(colours.as_u64() > Some(50), "shades of the part: {colours}");
}

/// The demo's blade is whole, so overlays of rows are seen on a tower with defects.
#[test]
fn overlays_cover_the_pixels_that_they_tell_of() {
    let scratch = Scratch::new();
    scratch
        .run("lamp sample tower --facets 20k --defect drop --count 40 --seed 7 -o tower.stl")
        .succeeds();
    scratch.run("slice tower.stl --dpi 300 --layers 4..17 -o stray.tif").succeeds();
    scratch.run("fix stray.tif --max-width 2 -o fixed.tif").succeeds();
    let viewing = Viewing::unopened(&scratch, "fixed.tif stray.tif", &[]);
    let Some(browser) = Browser::open(&viewing, LARGE) else { return };
    let (fixed, stray) = (scratch.layers("fixed.tif"), scratch.layers("stray.tif"));
    let mut counts = [0; 6];
    for position in [5, 11] {
        let (layer, below, other) = (&fixed[position], &fixed[position - 1], &stray[position]);
        let changed = layer.info.other.get("fix").map_or_else(Vec::new, |fix| bands(&fix["bands"]));
        let rules: [(&str, Rule); 6] = [
            ("below", &|at| white(below, at) && !white(layer, at)),
            ("new", &|at| white(layer, at) && !white(below, at)),
            ("added", &|at| white(other, at) && !white(layer, at)),
            ("missing", &|at| white(layer, at) && !white(other, at)),
            ("fixed", &|[_, row]| changed.iter().any(|band| band.contains(&row))),
            ("stray", &|[_, row]| layer.info.stray_rows.contains(&row)),
        ];
        browser.go(&format!("#stack=0&layer={position}&at=160,151.5&zoom=4"));
        for ((overlay, wanted), count) in rules.into_iter().zip(&mut counts) {
            browser.click(&format!("#overlay-{overlay}"));
            let sheets = ["layer", overlay].map(|kind| format!("0/{position}/{kind}"));
            browser.shows(&sheets.each_ref().map(String::as_str));
            *count += is_laid_over(&browser, layer, wanted);
            browser.click(&format!("#overlay-{overlay}"));
            browser.shows(&[&sheets[0]]);
        }
        assert_eq!(is_laid_over(&browser, layer, |_| false), 0, "all are off again");
    }
    assert!(counts.iter().all(|&count| count > 0), "each overlay had pixels: {counts:?}");
    browser.was_quiet();
}

/// After each control that takes keys, each kind of key does what it says.
#[test]
fn keys_work_after_fields_and_lists() {
    let scratch = Scratch::with_tower_and_torus();
    let viewing = Viewing::unopened(&scratch, "tower.tif torus.tif", &[]);
    let Some(browser) = Browser::open(&viewing, WINDOW) else { return };
    browser.shows(&["0/0/layer"]);
    let by_field = |browser: &Browser| {
        browser.press('g');
        browser.type_where_the_focus_is("7\u{e007}");
    };
    let given_up = |browser: &Browser| {
        browser.press('g');
        browser.type_where_the_focus_is("999\u{e00c}");
    };
    type Control<'a> = (&'a str, &'a dyn Fn(&Browser));
    let controls: [Control; 3] = [
        ("the field and Enter", &by_field),
        ("the field and Escape", &given_up),
        ("a choice from the list", &|browser| browser.click("#stack option:last-child")),
    ];
    let number = |key: &str| browser.place()[key].as_str().unwrap().parse::<f64>().unwrap();
    for (name, control) in controls {
        browser.go("#stack=0&layer=3&at=20.5,20.5&zoom=4");
        control(&browser);
        browser.settle();
        if name == "the field and Enter" {
            assert_eq!(number("layer"), 7.0);
        }
        let before = [number("layer"), number("zoom")];
        browser.press('+');
        browser.settle();
        let near = number("zoom");
        assert!(near > before[1], "+ after {name}");
        browser.press('-');
        browser.settle();
        assert!(number("zoom") < near, "- after {name}");
        browser.press(UP);
        browser.settle();
        assert_eq!(number("layer"), before[0] + 1.0, "an arrow after {name}");
        for open in [true, false] {
            browser.press('m');
            let pressed =
                browser.run("return document.querySelector('#measure').ariaPressed", vec![]);
            assert_eq!(pressed, json!(open.to_string()), "m after {name}");
        }
    }
    browser.was_quiet();
}

fn bands(json: &Value) -> Vec<std::ops::Range<u32>> {
    let number = |value: &Value| value.as_u64().unwrap() as u32;
    let bands = json.as_array().into_iter().flatten();
    bands.map(|band| number(&band["row"])..number(&band["row"]) + number(&band["rows"])).collect()
}

/// An island of 5 x 4 pixels, alone in its layer next to a block.
#[test]
fn an_island_is_coloured_and_all_is_reached_by_keys() {
    let scratch = Scratch::new();
    let layer = |index: u32| Layer {
        info: PageInfo {
            index,
            z_um: Some(100.0 * f64::from(index)),
            thickness_um: Some(100.0),
            origin_mm: Some([0.0, 0.0]),
            ..PageInfo::default()
        },
        pitch: Pitch::of_dpi(300.0),
        image: Image::Mask(block_and_island(index == 1)).into(),
    };
    scratch.stack("island.tif", (0..3).map(layer));
    let viewing = Viewing::unopened(&scratch, "island.tif --check", &[]);
    let Some(browser) = Browser::open(&viewing, WINDOW) else { return };
    browser.wait_for("document.querySelector('#findings-list button')");
    browser.press('n');
    browser.shows(&["0/1/layer", "0/1/findings"]);
    browser.press('0');
    browser.settle();
    let layer = &scratch.layers("island.tif")[1];
    let of_island = |[x, y]: [u32; 2]| (30..35).contains(&x) && (10..14).contains(&y);
    assert_eq!(is_laid_over(&browser, layer, of_island), 20);
    reach_all_by_keys(&browser);
    browser.was_quiet();
}

fn block_and_island(island: bool) -> Mask {
    let mut mask = MaskBuilder::new(40);
    for row in 0..30 {
        let columns: &[u32] = match row {
            10..14 if island => &[5, 20, 30, 35],
            5..25 => &[5, 20],
            _ => &[],
        };
        mask.push_row(columns).unwrap();
    }
    mask.finish()
}

/// Tab goes to each control that is shown, and each has a name.
fn reach_all_by_keys(browser: &Browser) {
    browser
        .run("document.querySelector('#solid').open = true; document.activeElement.blur()", vec![]);
    browser.settle();
    let controls =
        "[...document.querySelectorAll('button, input, select, summary, [tabindex=\"0\"]')]
        .filter((one) => one.checkVisibility() && !one.closest('.navigator'))";
    let nameless = browser.run(
        &format!(
            "return {controls}.filter((one) => !(one.ariaLabel || one.textContent.trim() ||
               [...(one.labels ?? [])].some((label) => label.textContent.trim())))
             .map((one) => one.outerHTML)"
        ),
        vec![],
    );
    assert_eq!(nameless, json!([]));
    browser.run("window.reached = new Set()", vec![]);
    for _ in 0..60 {
        browser.press(TAB);
        browser.run("reached.add(document.activeElement)", vec![]);
    }
    let missed = browser.run(
        &format!(
            "return {controls}.filter((one) => !reached.has(one)).map((one) => one.outerHTML)"
        ),
        vec![],
    );
    assert_eq!(missed, json!([]));
}

/// Takes the picture of the README: `cargo test -p lamp-tests view_browser:: -- --ignored`.
#[test]
#[ignore = "writes docs/view.png"]
fn screenshot() {
    let scratch = demo();
    let viewing = Viewing::unopened(&scratch, "lamp-demo/build.tif --check", &[]);
    let browser = Browser::open(&viewing, WINDOW).expect("Chromium takes the picture");
    browser.go("#stack=0&layer=965&overlays=new");
    browser.run("document.querySelector('#solid').open = true", vec![]);
    browser.wait_for("document.querySelector('#solid-view canvas')");
    browser.run("document.querySelector('#solid').scrollIntoView()", vec![]);
    browser.settle();
    let path = lamp_tests::workspace_root().join("docs/view.png");
    std::fs::write(path, browser.screenshot()).unwrap();
}
