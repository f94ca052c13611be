//! The viewer in a real browser: what is on its canvas is what the stack says. Without Chromium
//! and its driver, a test says so and passes.

mod browser;

use lamp_fixtures::Sample;
use lamp_stack::{GrayMask, Image, Layer, Mask, MaskBuilder, PageInfo, Pitch};
use lamp_tests::{Scratch, Viewing, mask};
use serde_json::{Value, json};

use browser::Browser;

const WINDOW: [u32; 2] = [1400, 900];
/// The tower's layers fit into it, each pixel 4 screen pixels wide.
const LARGE: [u32; 2] = [1900, 1500];
const UP: char = '\u{e013}';
const END: char = '\u{e010}';
const HOME: char = '\u{e011}';
const ESCAPE: char = '\u{e00c}';
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
    // Findings were asked for, so they are shown from the start.
    browser.shows(&["0/0/layer", "0/0/findings"]);
    browser.press('o');
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
    browser.wait_for("document.querySelector('#findings-list td')");
    // The first has a place; white at the border, the last, has none.
    browser.run("document.querySelector('#findings-list td').click()", vec![]);
    let layers = browser
        .run("return document.querySelector('#findings-list tr td + td').textContent", vec![]);
    browser.settle();
    let layer = browser.text("#layer-facts");
    let number = layer.lines().nth(1).unwrap();
    assert_eq!(layers.as_str().unwrap().split('–').next(), Some(number), "{layers}");
    let place = browser.place();
    assert_eq!(place["overlays"], "findings", "a row switches them on again");
    let marked = "return document.querySelector('#marks path.under').getAttribute('d').length";
    assert!(browser.run(marked, vec![]).as_u64() > Some(10), "a rectangle is around it");
}

/// Shows the part beside the layer, where it must draw more than its ground. A click on it goes to
/// the layer and the place that are seen there.
fn see_the_part(browser: &Browser) {
    browser.press('3');
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
    let before = browser.place();
    browser.click("#solid-view canvas");
    browser.wait_for("document.querySelector('#pixel').textContent.includes('Column')");
    browser.settle();
    let after = browser.place();
    assert_ne!((&before["layer"], &before["at"]), (&after["layer"], &after["at"]));
    let pixel = browser.text("#pixel");
    let at = pixel.lines().nth(1).unwrap().split(", ").map(|at| at.parse::<f64>().unwrap());
    let middle = after["at"].as_str().unwrap().split(',').map(|at| at.parse::<f64>().unwrap());
    for (pixel, middle) in at.zip(middle) {
        assert!((pixel..=pixel + 1.0).contains(&middle), "{pixel} is in the middle, {middle}");
    }
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

/// After each control that is used by mouse, and after each field that ends with Enter or Escape, each
/// kind of key does what it says.
#[test]
fn keys_work_after_each_control() {
    let scratch = Scratch::new();
    scratch.stack("gray.tif", faulty(2_000).map(grayed));
    scratch.stack("again.tif", faulty(2_000).skip(1));
    let viewing = Viewing::unopened(&scratch, "gray.tif again.tif --check", &[]);
    let Some(browser) = Browser::open(&viewing, LARGE) else { return };
    browser.wait_for("document.querySelector('#findings-list td')");
    // The picture is offered as a file, which would land beside the test.
    browser.run("HTMLAnchorElement.prototype.click = () => {};", vec![]);
    browser.click("#beside");
    browser.wait_for("document.querySelector('#solid-view canvas')");
    let typed = |keys: &'static str| {
        move |browser: &Browser| {
            browser.press('g');
            browser.type_where_the_focus_is(keys);
        }
    };
    type Control = Box<dyn Fn(&Browser)>;
    let mut controls: Vec<(String, Control)> = vec![
        ("the field and Enter".to_owned(), Box::new(typed("4\u{e007}"))),
        ("the field and Escape".to_owned(), Box::new(typed("999\u{e00c}"))),
    ];
    controls.push((
        "a finding".to_owned(),
        Box::new(|browser| browser.click("#findings-list td button")),
    ));
    // A field takes keys until it gets Enter.
    for field in ["#threshold", "#filter-from", "#filter-size"] {
        controls.push((field.to_owned(), Box::new(move |browser| browser.type_into(field, "1"))));
    }
    // All others that there are are clicked: buttons, boxes, sliders, lists, rows, the part.
    let clicked = browser.run(
        "const one = (element) => element.id ? `#${element.id}` :
           element.ariaLabel ? `${element.localName}[aria-label='${element.ariaLabel}']` :
           element.title ? `${element.localName}[title='${element.title}']` : null;
         return [...document.querySelectorAll('button, select, input, #solid-view canvas, #findings-list td')]
           .filter((element) => element.checkVisibility() && !element.closest('.navigator, dialog'))
           .filter((element) => !['number', 'text'].includes(element.type))
           .map((element) => element.localName === 'select' ? `${one(element)} option:last-child` : one(element))
           .filter((selector) => selector && selector !== '#keys');",
        vec![],
    );
    let clicked: Vec<String> = serde_json::from_value(clicked).unwrap();
    for known in ["#play", "#slider", "#overlay-new", "#cut", "#speed option:last-child", "#whole"]
    {
        assert!(clicked.iter().any(|selector| selector == known), "{known} in {clicked:?}");
    }
    for selector in clicked {
        let control = selector.clone();
        controls.push((selector, Box::new(move |browser| browser.click(&control))));
    }
    let dialog = |browser: &Browser| {
        browser.click("#keys");
        browser.click("#help button");
    };
    controls.push(("the dialog of keys".to_owned(), Box::new(dialog)));
    let layer = || browser.run("return document.querySelector('#slider').value", vec![]);
    let is_pressed = |id: &str| {
        let script = format!("return document.querySelector('#{id}').ariaPressed === 'true'");
        browser.run(&script, vec![]).as_bool().unwrap()
    };
    let overlays = || {
        let script = "return document.querySelectorAll('#overlays input:checked').length > 0";
        browser.run(script, vec![]).as_bool().unwrap()
    };
    for (name, control) in controls {
        browser.go("#stack=0&layer=3&at=20.5,20.5&zoom=4");
        // Where no GPU draws the part, it takes its time: it is shown where it is needed.
        let wanted = ["#cut", "canvas"].iter().any(|part| name.contains(part));
        browser.run("if (solid.hidden === arguments[0]) beside.click()", vec![json!(wanted)]);
        control(&browser);
        // A field gives the focus back after its key.
        browser.settle();
        if is_pressed("play") {
            browser.press(' ');
            assert!(!is_pressed("play"), "Space after {name}");
        }
        if name == "the field and Enter" {
            assert_eq!(layer(), "4");
        }
        browser.press(HOME);
        assert_eq!(layer(), "0", "Home after {name}");
        browser.press(UP);
        assert_eq!(layer(), "1", "an arrow after {name}");
        // The six layers must not come to their end between two keys.
        browser.run("speed.value = 1", vec![]);
        for key in ['1', '+', '+', '-'] {
            browser.press(key);
        }
        // On a machine with much to do, the address follows late.
        let zoom = "new URLSearchParams(location.hash.slice(1)).get('zoom')";
        browser
            .wait_for(&format!("/* 1, +, + and - after {name} */ Math.abs({zoom} - 1.5) < 0.01"));
        for (key, id) in [('m', "measure"), ('s', "compare"), (' ', "play")] {
            let before = is_pressed(id);
            for wanted in [!before, before] {
                browser.press(key);
                assert_eq!(is_pressed(id), wanted, "{key:?} after {name}");
            }
        }
        let before = overlays();
        browser.press('o');
        assert_eq!(overlays(), !before, "o after {name}");
        browser.press('?');
        browser.wait_for("document.querySelector('#help').open");
        browser.press(ESCAPE);
        browser.wait_for("!document.querySelector('#help').open");
    }
    browser.was_quiet();
}

/// Layers follow each other up to the highest one, and none is left out.
#[test]
fn layers_are_played_one_after_the_other() {
    let scratch = Scratch::with_tower_and_torus();
    let viewing = Viewing::unopened(&scratch, "torus.tif", &[]);
    let Some(browser) = Browser::open(&viewing, WINDOW) else { return };
    let last = scratch.layers("torus.tif").len() - 1;
    browser.run(
        "const canvas = document.querySelector('#sheets > * > .openseadragon-canvas');
         window.shown = [];
         new MutationObserver(() => shown.push(canvas.dataset.shown))
           .observe(canvas, { attributeFilter: ['data-shown'] });",
        vec![],
    );
    browser.go("#stack=0&layer=2&at=20.5,20.5&zoom=4");
    browser.press('.');
    browser.press(' ');
    browser.wait_for(&format!("shown.includes('0/{last}/layer')"));
    browser.wait_for("document.querySelector('#play').ariaPressed === 'false'");
    let shown: Vec<String> = serde_json::from_value(browser.run("return shown", vec![])).unwrap();
    let wanted: Vec<String> = (2..=last).map(|layer| format!("0/{layer}/layer")).collect();
    assert_eq!(shown, wanted);
    assert_eq!(browser.run("return document.querySelector('#speed').value", vec![]), json!("20"));
    // From the highest one, it starts at the bottom again.
    browser.press(' ');
    browser.wait_for("shown.includes('0/1/layer')");
    browser.press(' ');
    browser.was_quiet();
}

/// On the left of the border the canvas has the first stack, on the right the second.
#[test]
fn two_stacks_are_seen_on_both_sides_of_a_border() {
    let scratch = Scratch::new();
    // The second begins 3 columns further right and 2 rows further down, and is smaller.
    let layer = |origin_mm, size: [u32; 2], every: u32| Layer {
        info: PageInfo {
            z_um: Some(0.0),
            thickness_um: Some(100.0),
            origin_mm: Some(origin_mm),
            ..PageInfo::default()
        },
        pitch: Pitch::of_dpi(254.0),
        image: Image::Mask(stripes(size, every)).into(),
    };
    let (first, second) = (layer([0.0, 6.0], [90, 60], 5), layer([0.3, 5.8], [80, 50], 3));
    scratch.stack("a.tif", [first.clone()]);
    scratch.stack("b.tif", [second.clone()]);
    let viewing = Viewing::unopened(&scratch, "a.tif b.tif", &[]);
    let Some(browser) = Browser::open(&viewing, WINDOW) else { return };
    let pixels: Vec<[u32; 2]> = (0..60).flat_map(|y| (0..90).map(move |x| [x, y])).collect();
    for (share, stack) in [(0.5, 0), (0.35, 1)] {
        browser.go(&format!("#stack={stack}&layer=0&at=45,30&zoom=12&swipe={share}"));
        let sheets = match stack {
            0 => ["0/0/layer", "1/0/layer@3,2"],
            _ => ["1/0/layer", "0/0/layer@-3,-2"],
        };
        browser.shows(&sheets);
        let width = browser.run("return document.querySelector('#picture').clientWidth", vec![]);
        let border = 45.0 + (share - 0.5) * width.as_f64().unwrap() / 12.0;
        let mut sides = [0; 2];
        for (&[x, y], colour) in pixels.iter().zip(browser.colours(&pixels)) {
            // The pixel that the border cuts may be of either, and some are beside the screen.
            let Some(colour) = colour.filter(|_| (f64::from(x) + 0.5 - border).abs() > 1.0) else {
                continue;
            };
            let side = usize::from(f64::from(x) > border);
            // The shown stack's pixels are where they are; the other's begin 3 and 2 further or less far.
            let by = match (stack, side) {
                (0, 1) => [-3, -2],
                (1, 0) => [3, 2],
                _ => [0, 0],
            };
            let of = [&first, &second][side];
            let at =
                moved([x, y], by).filter(|&[x, y]| x < of.image.width() && y < of.image.height());
            let Some(at) = at else { continue };
            sides[side] += 1;
            let wanted = if white(of, at) { WHITE } else { BLACK };
            assert_eq!(
                colour,
                wanted,
                "{x} {y} with the border at {border}, stack {stack}, {}",
                browser.place()
            );
        }
        assert!(sides.iter().all(|&seen| seen > 500), "{sides:?}");
    }
    browser.press('s');
    browser.shows(&["1/0/layer"]);
    browser.was_quiet();
}

/// Returns a pixel that is moved, if it is in the image still.
fn moved(at: [u32; 2], by: [i32; 2]) -> Option<[u32; 2]> {
    Some([at[0].checked_add_signed(by[0])?, at[1].checked_add_signed(by[1])?])
}

/// Columns are black and white in turn, each so wide; the rows at the border are black.
fn stripes([width, height]: [u32; 2], every: u32) -> Mask {
    let mut mask = MaskBuilder::new(width);
    let columns: Vec<u32> =
        (1..).map(|stripe| stripe * every).take_while(|&at| at < width).collect();
    for row in 0..height {
        let inside = row > 3 && row + 3 < height;
        mask.push_row(if inside { &columns } else { &[] }).unwrap();
    }
    mask.finish()
}

/// Each copy of a build has a color of its own, and its number; the mesh beside has none.
#[test]
fn copies_have_colors() {
    let scratch = Scratch::with_tower_and_torus();
    scratch.run("slice torus.stl --dpi 50 --thickness 1mm -o small.tif").succeeds();
    scratch.run("tile small.tif --area 135x135mm --copies 4 --mesh none -o build.tif").succeeds();
    let layers = scratch.layers("build.tif");
    let viewing = Viewing::unopened(&scratch, "build.tif", &[]);
    let Some(browser) = Browser::open(&viewing, LARGE) else { return };
    let layer = &layers[layers.len() / 2];
    let [width, height] = [layer.image.width(), layer.image.height()];
    let position = layers.len() / 2;
    browser.go(&format!(
        "#stack=0&layer={position}&at={},{}&zoom=5",
        f64::from(width) / 2.0,
        f64::from(height) / 2.0
    ));
    browser.shows(&[&format!("0/{position}/layer")]);
    browser.wait_for("!document.querySelector('#overlay-copies').disabled");
    browser.click("#overlay-copies");
    browser.shows(&[&format!("0/{position}/layer"), &format!("0/{position}/copies")]);
    let info = layers[0].info.stack.clone().unwrap();
    let built = info.built_parts().unwrap().next().unwrap().unwrap();
    let pixels: Vec<_> = (0..height).flat_map(|y| (0..width).map(move |x| [x, y])).collect();
    let mut colours: Vec<Vec<[u8; 3]>> = vec![Vec::new(); built.copies.len()];
    for (&[x, y], colour) in pixels.iter().zip(browser.colours(&pixels)) {
        // The border of the layer, which is black, may be beside the screen.
        let Some(colour) = colour else { continue };
        let holds = |&[left, top]: &[i64; 2]| {
            (left..left + i64::from(built.part_pixels[0])).contains(&x.into())
                && (top..top + i64::from(built.part_pixels[1])).contains(&y.into())
        };
        match built.copies.iter().position(holds) {
            Some(copy) if white(layer, [x, y]) => colours[copy].push(colour),
            _ => assert_eq!(colour, if white(layer, [x, y]) { WHITE } else { BLACK }, "{x} {y}"),
        }
    }
    let firsts: std::collections::BTreeSet<[u8; 3]> = colours.iter().map(|of| of[0]).collect();
    assert_eq!(firsts.len(), 4, "four copies have four colors");
    for of in &colours {
        assert!(of.len() > 50 && of.iter().all(|colour| colour == &of[0] && *colour != WHITE));
    }
    let numbers =
        "return [...document.querySelectorAll('#marks text')].map((one) => one.textContent)";
    assert_eq!(browser.run(numbers, vec![]), json!(["1", "2", "3", "4"]));
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
    scratch.stack("island.tif", faulty(40).take(3));
    let viewing = Viewing::unopened(&scratch, "island.tif --check", &[]);
    let Some(browser) = Browser::open(&viewing, WINDOW) else { return };
    browser.wait_for("document.querySelector('#findings-list td')");
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

/// The table has the findings that its filters leave, in the order of a column.
#[test]
fn findings_are_filtered_and_sorted() {
    let scratch = Scratch::new();
    scratch.stack("faulty.tif", faulty(40));
    let viewing = Viewing::unopened(&scratch, "faulty.tif --check", &[]);
    let Some(browser) = Browser::open(&viewing, WINDOW) else { return };
    browser.wait_for("document.querySelector('#findings-list td')");
    filter_findings(&browser);
    browser.was_quiet();
}

fn filter_findings(browser: &Browser) {
    let all = rows(browser);
    let kinds: Vec<&String> = all.iter().map(|row| &row[0]).collect();
    let islands: Vec<&Vec<String>> = all.iter().filter(|row| row[0] == "island").collect();
    let island = |layer: &str, size: &str| ["island", layer, size].map(str::to_owned).to_vec();
    let [small, large] = [island("1", "0.423 mm"), island("3", "1.016 mm")];
    assert!(
        islands.len() == 2 && islands.contains(&&small) && islands.contains(&&large),
        "{all:?}"
    );
    assert!(all.len() > 2, "{all:?}");
    let reset = || {
        browser.click("#findings-filters [type=reset]");
        browser.wait_for(&format!(
            "document.querySelectorAll('#findings-list tbody').length === {}",
            all.len()
        ));
    };
    browser.run(
        "const kind = document.querySelector('#filter-kind');
         kind.value = 'island';
         kind.dispatchEvent(new Event('input', { bubbles: true }));",
        vec![],
    );
    assert_eq!(rows(browser).iter().collect::<Vec<_>>(), islands);
    assert!(browser.text("#findings-state").starts_with(&format!("2 of {}", all.len())));
    reset();
    browser.type_into("#filter-from", "2");
    let left = rows(browser);
    assert!(left.contains(&large) && !left.contains(&small), "{left:?}");
    reset();
    browser.type_into("#filter-size", "0.5");
    let left = rows(browser);
    assert!(left.contains(&large) && !left.contains(&small), "{left:?}");
    reset();
    let mut sorted = kinds.clone();
    sorted.sort();
    let by_kind = || rows(browser).into_iter().map(|row| row[0].clone()).collect::<Vec<_>>();
    browser.click("[data-by=kind] button");
    assert_eq!(by_kind().iter().collect::<Vec<_>>(), sorted);
    browser.click("[data-by=kind] button");
    sorted.reverse();
    assert_eq!(by_kind().iter().collect::<Vec<_>>(), sorted);
    browser.click("[data-by=kind] button");
    assert_eq!(rows(browser), all, "the worst first again");
}

/// The table of findings: kind, layers and size of each.
fn rows(browser: &Browser) -> Vec<Vec<String>> {
    let script = "return [...document.querySelectorAll('#findings-list tbody')].map((rows) =>
        [...rows.rows[0].cells].map((cell) => cell.textContent))";
    serde_json::from_value(browser.run(script, vec![])).unwrap()
}

/// Six layers of a block in images so wide, with islands of 5 x 4 pixels in layer 1 and of 12 x 9 pixels in layer 3, and
/// with white at the border of layer 5.
fn faulty(width: u32) -> impl Iterator<Item = Layer> {
    (0..6).map(move |index| Layer {
        info: PageInfo {
            index,
            z_um: Some(100.0 * f64::from(index)),
            thickness_um: Some(100.0),
            origin_mm: Some([0.0, 0.0]),
            ..PageInfo::default()
        },
        pitch: Pitch::of_dpi(300.0),
        image: Image::Mask(block_and_island(index, width)).into(),
    })
}

/// The same layer, its white a light gray.
fn grayed(layer: Layer) -> Layer {
    let mut gray = GrayMask::new(layer.image.width());
    for row in 0..layer.image.height() {
        let ends = mask(&layer).row(row).iter().copied().chain([layer.image.width()]);
        let mut start = 0;
        let runs = ends.zip([0, 200].into_iter().cycle()).map(|(end, level)| {
            let run = (end - start, level);
            start = end;
            run
        });
        gray.push_runs(runs.filter(|&(length, _)| length > 0)).unwrap();
    }
    Layer { image: Image::Gray(gray).into(), ..layer }
}

fn block_and_island(index: u32, width: u32) -> Mask {
    let mut mask = MaskBuilder::new(width);
    for row in 0..30 {
        let columns: &[u32] = match row {
            10..14 if index == 1 => &[5, 20, 30, 35],
            10..19 if index == 3 => &[5, 20, 25, 37],
            8 if index == 5 => &[0, 20],
            5..25 => &[5, 20],
            _ => &[],
        };
        mask.push_row(columns).unwrap();
    }
    mask.finish()
}

/// Tab goes to each control that is shown, and each has a name.
fn reach_all_by_keys(browser: &Browser) {
    browser.press('3');
    browser.wait_for("document.querySelector('#solid-view canvas')");
    browser.run("document.activeElement.blur()", vec![]);
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
    for _ in 0..80 {
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

/// A person drops a part on the page, chooses, looks at it, and gets the build.
#[test]
fn a_part_becomes_a_build_in_the_browser() {
    let scratch = Scratch::new();
    scratch.part("torus.stl", Sample::Torus, 2_000);
    let viewing = Viewing::unopened(&scratch, "--work work", &[]);
    let Some(browser) = Browser::open(&viewing, WINDOW) else { return };
    assert!(browser.text("#nothing").contains("anywhere on this page"));
    let drop = |bytes: Vec<u8>| {
        let script = "const file = new File([new Uint8Array(arguments[0])], 'torus.stl');
             const dataTransfer = new DataTransfer();
             dataTransfer.items.add(file);
             const event = new DragEvent('drop', { dataTransfer, bubbles: true, cancelable: true });
             document.querySelector('#picture').dispatchEvent(event);";
        browser.run(script, vec![json!(bytes)]);
    };
    drop(scratch.bytes("torus.stl"));
    browser.wait_for("document.querySelector('#work-file').value === 'torus.stl'");
    assert!(scratch.bytes("work/torus.stl") == scratch.bytes("torus.stl"));

    let choose = |id: &str, value: &str| {
        let script = "const [id, value] = arguments;
             document.getElementById(id).value = value;
             document.getElementById(id).dispatchEvent(new Event('change', { bubbles: true }));";
        browser.run(script, vec![json!(id), json!(value)]);
    };
    choose("work-machine", "mars3");
    assert_eq!(browser.run("return document.querySelector('#work-mesh').checked", vec![]), false);
    choose("work-turn", "x:90");
    choose("work-thickness", "200um");
    browser.run("window.before = true", vec![]);
    browser.click("#work-slice");
    browser.wait_for("!window.before && document.querySelector('#stack option')");
    browser.settle();
    assert_eq!(browser.text("#stack option"), "torus-layers.tif");
    // The form is as it was, and the layers are turned.
    let field =
        |id: &str| browser.run(&format!("return document.getElementById('{id}').value"), vec![]);
    browser.wait_for("document.getElementById('work-machine').value === 'mars3'");
    assert_eq!(field("work-rotate"), "x:90");
    let turned = "slice torus.stl --machine mars3 --rotate x:90 --thickness 200um -o turned.tif";
    scratch.run(turned).succeeds();
    let layers = scratch.layers("work/torus-layers.tif");
    assert_eq!(layers.len(), scratch.layers("turned.tif").len());
    let middle = layers.len() / 2;
    browser.go(&format!("#stack=0&layer={middle}&at=2049.5,1280.5&zoom=1"));
    let known: Vec<_> = (1600..2500).step_by(7).map(|column| [column, 1280]).collect();
    let wanted: Vec<_> = known
        .iter()
        .map(|&at| Some(if white(&layers[middle], at) { WHITE } else { BLACK }))
        .collect();
    assert_eq!(browser.colours(&known), wanted);
    assert!(wanted.contains(&Some(BLACK)) && wanted.contains(&Some(WHITE)));
    browser.wait_for("document.querySelector('#findings-state').textContent.includes('inding')");

    choose("work-copies", "2");
    choose("work-format", "ctb");
    browser.run("window.before = true", vec![]);
    browser.click("#work-build");
    browser.wait_for("!window.before && document.querySelector('#work-get')?.textContent");
    browser.settle();
    assert_eq!(browser.text("#work-get"), "Download torus-build.ctb");
    assert_eq!(scratch.layers("work/torus-build.ctb").len(), layers.len());

    // The same part again is the same file; another of its name needs a word.
    drop(scratch.bytes("torus.stl"));
    scratch.part("other.stl", Sample::Torus, 1_000);
    drop(scratch.bytes("other.stl"));
    browser.wait_for("!document.querySelector('#work-replace').hidden");
    assert!(scratch.bytes("work/torus.stl") == scratch.bytes("torus.stl"));
    browser.click("#work-replace");
    browser.wait_for("document.querySelector('#work-replace').hidden");
    assert!(scratch.bytes("work/torus.stl") == scratch.bytes("other.stl"));
}

/// Takes the picture of the README: `cargo test -p lamp-tests view_browser:: -- --ignored`.
#[test]
#[ignore = "writes docs/view.png"]
fn screenshot() {
    let scratch = demo();
    let viewing = Viewing::unopened(&scratch, "lamp-demo/build.tif --check", &[]);
    let browser = Browser::open(&viewing, WINDOW).expect("Chromium takes the picture");
    browser.go("#stack=0&layer=965&overlays=new,findings");
    browser.wait_for("document.querySelector('#findings-list td')");
    browser.press('3');
    browser.wait_for("document.querySelector('#solid-view canvas')");
    browser.run("document.activeElement.blur()", vec![]);
    browser.settle();
    let path = lamp_tests::workspace_root().join("docs/view.png");
    std::fs::write(path, browser.screenshot()).unwrap();
}
