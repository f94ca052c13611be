//! Compares the pages of `lamp report` with the output of `lamp info` and `lamp check`.

use lamp_fixtures::mug;
use lamp_stack::{GrayMask, Layer, Mask, PageInfo, Pitch, StackInfo};
use lamp_tests::Scratch;
use serde_json::{Value, json};

fn with_mug() -> Scratch {
    let scratch = Scratch::new();
    scratch.mesh("mug.stl", &mug(4000));
    scratch.run("slice mug.stl --dpi 127 --thickness 200um -o mug.tif").succeeds_quietly();
    scratch
}

fn json_of(scratch: &Scratch, line: &str) -> Value {
    serde_json::from_slice(&scratch.run(line).succeeds().stdout).unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// The text of a page, with escapes resolved.
fn shown(html: &str) -> String {
    let mut text = String::new();
    let mut in_tag = false;
    for c in html.chars() {
        match c {
            '<' => in_tag = true,
            '>' => {
                in_tag = false;
                text.push(' ');
            }
            c if !in_tag => text.push(c),
            _ => {}
        }
    }
    text.replace("&lt;", "<").replace("&gt;", ">").replace("&quot;", "\"").replace("&amp;", "&")
}

#[test]
fn numbers_are_those_of_info_and_check() {
    let scratch = with_mug();
    let reported = json_of(&scratch, "lamp report mug.tif -o mug.html --json");
    let stack = &reported["stacks"][0];
    let info = json_of(&scratch, "lamp info mug.tif --json");
    for (key, value) in info.as_object().unwrap() {
        if !["schema", "input", "transitions"].contains(&key.as_str()) {
            assert_eq!(&stack[key], value, "{key}");
        }
    }
    scratch.run("lamp check mug.tif --report check.json").succeeds_quietly();
    let check: Value = serde_json::from_slice(&scratch.bytes("check.json")).unwrap();
    let mut findings = check["findings"].clone();
    for finding in findings.as_array_mut().unwrap() {
        finding.as_object_mut().unwrap().remove("input");
    }
    assert_eq!(stack["findings"], findings);
    assert_eq!(stack["finding_count"], check["inputs"][0]["findings"]);
    assert_eq!(stack["specks"], check["inputs"][0]["specks"]);
    // The page shows the same, word by word.
    let page = shown(&text(&scratch.bytes("mug.html")));
    let info = text(&scratch.run("lamp info mug.tif").succeeds_quietly().stdout);
    // Pages have the signs of units.
    let signs =
        |text: &str| text.replace(" um", " µm").replace(" mm2", " mm²").replace(" mm3", " mm³");
    for value in info.lines().map(|line| signs(line.split_once(':').unwrap().1.trim())) {
        assert!(page.contains(&value), "no `{value}` in {page}");
    }
    let check = text(&scratch.run("lamp check mug.tif").succeeds_quietly().stdout);
    for value in check.lines().skip(1).map(|line| signs(line.split_once(": ").unwrap().1)) {
        assert!(page.contains(&value), "no `{value}` in {page}");
    }
    assert!(page.contains("1 finding") || page.contains("findings of lamp check"));
}

#[test]
fn numbers_of_layers_are_those_of_their_pixels() {
    let scratch = with_mug();
    let layers = scratch.layers("mug.tif");
    let masks = lamp_tests::masks(&layers);
    let stack = &json_of(&scratch, "lamp report mug.tif --json")["stacks"][0];
    let column = |key: &str| stack["by_layer"][key].as_array().unwrap();
    assert_eq!(column("area_px").len(), masks.len());
    let white = |mask: &Mask, column: i64, row: i64| {
        let at = u32::try_from(column).ok().zip(u32::try_from(row).ok());
        at.is_some_and(|(column, row)| mask.is_white(column, row))
    };
    for k in [0, 20, 21, 80, 120, masks.len() - 1] {
        let mask = &masks[k];
        let [width, height] = [mask.width(), mask.height()].map(i64::from);
        let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let all = || pixels().filter(|&(x, y)| white(mask, x, y));
        let sides = |(x, y): (i64, i64)| {
            let beside = [(1, 0), (-1, 0), (0, 1), (0, -1)];
            beside.iter().filter(|(dx, dy)| !white(mask, x + dx, y + dy)).count()
        };
        let new = all().filter(|&(x, y)| k == 0 || !white(masks[k - 1], x, y)).count();
        assert_eq!(column("area_px")[k], json!(all().count()), "layer {k}");
        assert_eq!(column("perimeter_px")[k], json!(all().map(sides).sum::<usize>()), "layer {k}");
        assert_eq!(column("new_px")[k], json!(new), "layer {k}");
    }
    let islands: u64 = column("islands").iter().map(|count| count.as_u64().unwrap()).sum();
    let listed = stack["findings"].as_array().unwrap().iter();
    assert_eq!(islands, listed.filter(|finding| finding["kind"] == "island").count() as u64);
}

#[test]
fn a_page_needs_nothing_but_itself() {
    let scratch = with_mug();
    scratch.run("lamp report mug.tif -o mug.html").succeeds();
    let page = text(&scratch.bytes("mug.html"));
    assert!(page.len() < 3_000_000, "{} bytes", page.len());
    for other in ["<script", "<link", "url(", "@import", "<iframe", "src=\"http", "href="] {
        assert!(!page.contains(other), "{other}");
    }
    assert_eq!(page.matches("src=\"data:image/png;base64,").count(), page.matches("<img").count());
    // Twelve layers, and a picture for each finding up to five.
    assert!(page.matches("<img").count() > 12);
    assert!(page.contains("@page") && page.contains("break-inside: avoid"));
    // Warnings stand before all else.
    assert!(page.find("Look at this first").unwrap() < page.find("<h2>Stack").unwrap());
    let again = scratch.run("lamp report mug.tif --threads 1 -o -").succeeds().stdout;
    assert_eq!(text(&again), page);
    let piped = scratch.run("lamp convert mug.tif -o - | lamp report -o piped.html").succeeds();
    assert!(piped.stderr.is_empty(), "{piped:?}");
}

fn layer(index: u32, exposure_ms: Option<f64>, part: &str) -> Layer {
    let mask = Mask::new(32, vec![0, 2, 4, 6, 6], vec![3, 9, 3, 9, 3, 9]).unwrap();
    let stack = StackInfo {
        part: part.to_owned(),
        commands: vec![format!("slice {part} --material m&m --machine \"><b>x</b>")],
        ..StackInfo::default()
    };
    let info = PageInfo {
        index,
        z_um: Some(f64::from(index) * 100.0),
        thickness_um: Some(100.0),
        exposure_ms,
        stack: (index == 0).then_some(stack),
        ..PageInfo::default()
    };
    Layer { info, pitch: Pitch::of_dpi(254.0), image: mask.into() }
}

#[test]
fn texts_of_files_are_no_markup() {
    let scratch = Scratch::new();
    let hostile = "<script>alert(1)</script> & \"x\" </title><img src=x onerror=1>";
    scratch.stack("a.tif", [layer(0, None, hostile)]);
    scratch.run("lamp report a.tif -o a.html").succeeds();
    let page = text(&scratch.bytes("a.html"));
    assert!(!page.contains("<script") && !page.contains("<img src=x") && !page.contains("<b>x"));
    assert!(page.contains("&lt;script&gt;alert(1)&lt;/script&gt; &amp; &quot;x&quot;"), "{page}");
    std::fs::create_dir(scratch.path("night")).unwrap();
    for name in ["<img src=y>.tif", "b & c.tif"] {
        scratch.stack(&format!("night/{name}"), [layer(0, None, "part")]);
    }
    scratch.run("lamp report night -o reports/").succeeds();
    let index = text(&scratch.bytes("reports/index.html"));
    assert!(!index.contains("<img") && index.contains("&lt;img src=y&gt;.tif"), "{index}");
}

#[test]
fn build_times_are_sums_of_what_is_known() {
    let scratch = Scratch::new();
    scratch.stack("timed.tif", (0..10).map(|k| layer(k, Some(1500.0), "timed")));
    let stack = |line: &str| json_of(&scratch, line)["stacks"][0].clone();
    let alone = stack("lamp report timed.tif --json");
    assert_eq!((&alone["build_exposure_s"], &alone["build_s"]), (&json!(15.0), &json!(15.0)));
    assert_eq!(alone["recoating_s"], json!(null));
    let recoated = stack("lamp report timed.tif --machine alpha --json");
    let seconds = recoated["recoating_s"].as_f64().unwrap();
    let of_layer = seconds / 10.0;
    assert!(of_layer > 0.0 && recoated["build_s"] == json!(15.0 + seconds), "{recoated}");
    let machine = text(&scratch.run("lamp machine show alpha").succeeds_quietly().stdout);
    assert!(machine.contains(&format!("seconds = {of_layer}")), "{machine}");
    // One layer without an exposure: the sum is not known.
    let layers = (0..10).map(|k| layer(k, (k != 4).then_some(1500.0), "gap"));
    scratch.stack("gap.tif", layers);
    let gap = stack("lamp report gap.tif --json");
    assert_eq!((&gap["build_s"], &gap["build_exposure_s"]), (&json!(null), &json!(null)));
    assert!(gap["warnings"].to_string().contains("build time is not known"), "{gap}");
}

#[test]
fn a_folder_of_stacks_gets_an_index() {
    let scratch = with_mug();
    std::fs::create_dir_all(scratch.path("night/deep")).unwrap();
    scratch.run("lamp convert mug.tif --layers 0..8 -o night/mug.tif").succeeds();
    scratch.stack("night/deep/bar.tif", (0..3).map(|k| layer(k, Some(1000.0), "bar")));
    scratch.run("lamp convert mug.tif --layers 0..3 -o night/pages/").succeeds();
    scratch.run("lamp report night -o reports/").succeeds();
    let index = text(&scratch.bytes("reports/index.html"));
    for file in ["report_001_deep_bar_tif.html", "report_002_mug_tif.html", "report_003_pages.html"]
    {
        assert!(index.contains(&format!("href=\"{file}\"")), "{index}");
        assert!(text(&scratch.bytes(&format!("reports/{file}"))).contains("href=\"index.html\""));
    }
    // A stack that is cut off does not hide the others.
    let whole = scratch.bytes("night/mug.tif");
    scratch.write("night/mug.tif", &whole[..whole.len() / 2]);
    let ran = scratch.run("lamp report night -o reports/ --force");
    assert!(
        ran.statuses == [Some(1)] && ran.stderr.contains("1 of 3 stacks cannot be read"),
        "{ran:?}"
    );
    let index = shown(&text(&scratch.bytes("reports/index.html")));
    assert!(index.contains("is cut off") && index.contains("pages"), "{index}");
    let ran = scratch.run("lamp report night -o all.html");
    assert!(ran.statuses == [Some(2)] && ran.stderr.contains("name a folder"), "{ran:?}");
    let ran = scratch.run("lamp report night/mug.tif -o cut.html");
    assert!(
        ran.statuses == [Some(1)] && !scratch.names().contains(&"cut.html".to_owned()),
        "{ran:?}"
    );
}

#[test]
fn odd_stacks_have_pages_too() {
    let scratch = Scratch::new();
    let gray = || {
        let mut gray = GrayMask::new(1);
        gray.push_runs([(1, 90)]).unwrap();
        gray
    };
    let of = |index, image: lamp_stack::LayerImage| Layer {
        info: PageInfo { index, ..PageInfo::default() },
        pitch: None,
        image,
    };
    scratch.stack("pixel.tif", [of(0, gray().into())]);
    let stack = &json_of(&scratch, "lamp report pixel.tif -o pixel.html --json")["stacks"][0];
    assert_eq!(
        (&stack["by_layer"]["gray_px"], &stack["by_layer"]["perimeter_px"]),
        (&json!([1]), &json!([4]))
    );
    // Layers of two sizes cannot be checked, but are reported all the same.
    scratch.stack(
        "sizes.tif",
        [of(0, gray().into()), of(1, Mask::black(40, 3).into()), of(2, gray().into())],
    );
    let stack = &json_of(&scratch, "lamp report sizes.tif -o sizes.html --json")["stacks"][0];
    assert_eq!(stack["by_layer"]["area_px"], json!([1, 0, 1]));
    assert!(stack["unchecked"].as_str().unwrap().contains("40 x 3 pixels"), "{stack}");
    assert_eq!(stack["findings"], json!(null));
    assert!(text(&scratch.bytes("sizes.html")).contains("could not be checked"));
}
