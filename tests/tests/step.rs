//! Checks slicing, checking, converting and refusing STEP parts.

use lamp_fixtures::{StepDefect, StepSample, StepUnit, broken_step, iges, step};
use lamp_stack::Image;
use lamp_tests::{Scratch, mask, masks};

fn with(part: StepSample) -> Scratch {
    let scratch = Scratch::new();
    scratch.write("part.step", step(part, StepUnit::Inch).as_bytes());
    scratch
}

fn broken(defect: StepDefect) -> Scratch {
    let scratch = Scratch::new();
    scratch.write("part.step", broken_step(defect).as_bytes());
    scratch
}

/// Returns the standard error of a command that succeeds.
fn said(scratch: &Scratch, line: &str) -> String {
    scratch.run(line).succeeds().stderr
}

/// The tower begins with a cylinder of radius 12.7 mm, 19.05 mm high.
#[test]
fn a_tower_in_inches_has_its_discs() {
    let scratch = with(StepSample::Tower);
    let slice = "slice part.step --dpi 600 --thickness 1mm -o part.tif";
    assert_eq!(said(&scratch, slice), "");
    let text = said(&scratch, &format!("{slice} --verbose"));
    assert!(text.contains("crossings were moved from facets to exact surfaces"), "{text}");
    let layers = scratch.layers("part.tif");
    assert_eq!(layers.len(), 76);
    let pitch = 25.4 / 600.0;
    for (layer, mask) in layers.iter().zip(masks(&layers)).take(19) {
        let [left, top] = layer.info.origin_mm.unwrap();
        let is_inside = |column: u32, row: u32| {
            let x = left + (f64::from(column) + 0.5) * pitch;
            let y = top - (f64::from(row) + 0.5) * pitch;
            x.hypot(y) < 12.7
        };
        for row in 0..mask.height() {
            let inside: Vec<u32> = (0..mask.width()).filter(|&c| is_inside(c, row)).collect();
            let ends = inside.first().map(|first| vec![*first, inside[inside.len() - 1] + 1]);
            assert_eq!(mask.row(row), ends.unwrap_or_default(), "{} {row}", layer.info.index);
        }
    }
}

#[test]
fn threads_memory_and_pipes_change_no_byte() {
    let scratch = with(StepSample::Tower);
    let line = "slice part.step --dpi 600 --thickness 1mm --rotate x:40 --quiet";
    scratch.run(&format!("{line} --threads 1 -o one.tif")).succeeds_quietly();
    scratch.run(&format!("{line} --threads 3 --memory 16MB -o three.tif")).succeeds_quietly();
    assert!(scratch.bytes("one.tif") == scratch.bytes("three.tif"));
    let piped = "slice - --dpi 600 --thickness 1mm --rotate x:40 --quiet -o piped.tif";
    scratch.run_on(piped, &scratch.bytes("part.step")).succeeds_quietly();
    assert_eq!(masks(&scratch.layers("piped.tif")), masks(&scratch.layers("one.tif")));
}

#[test]
fn facets_of_a_file_are_those_of_the_stl_made_of_it() {
    let scratch = with(StepSample::Torus);
    scratch.run("lamp convert part.step part.stl --chord 20um").succeeds_quietly();
    let line = "--dpi 600 --thickness 1mm --margin 4";
    scratch
        .run(&format!("slice part.step {line} --tolerance 20um --no-polish --quiet -o a.tif"))
        .succeeds_quietly();
    scratch.run(&format!("slice part.stl {line} -o b.tif")).succeeds_quietly();
    scratch.run(&format!("slice part.step {line} --tolerance 20um --quiet -o c.tif")).succeeds();
    let [a, b, c] = ["a.tif", "b.tif", "c.tif"].map(|name| scratch.layers(name));
    // Most planes of the torus meet facets at the same heights in both files.
    let same = masks(&a).iter().zip(masks(&b)).filter(|(a, b)| **a == *b).count();
    assert!(same + 2 > a.len(), "{same} of {}", a.len());
    let same = masks(&a).iter().zip(masks(&c)).filter(|(a, c)| **a == *c).count();
    assert!(same < 3, "{same} of {}", a.len());
}

#[test]
fn heights_gray_and_sections_work_as_for_an_stl() {
    let scratch = with(StepSample::Sphere);
    let text = scratch.run("lamp heights part.step --dpi 300 --min 100um --max 1mm").succeeds();
    assert!(String::from_utf8(text.stdout).unwrap().contains("uniform 1mm"));
    let line = "--material lamp-suspension --dpi 300 --quiet -o gray.tif";
    scratch.run(&format!("slice part.step --gray {line}")).succeeds_quietly();
    let layers = scratch.layers("gray.tif");
    assert!(layers.iter().any(|layer| matches!(*layer.image, Image::Gray(_))));
    let cure = "lamp cure gray.tif --part part.step --material lamp-suspension --section y=0mm";
    scratch.run(&format!("{cure} -o cure.png")).succeeds();
}

#[test]
fn a_report_names_what_a_file_holds() {
    let scratch = with(StepSample::Pair);
    let text = String::from_utf8(scratch.run("lamp brep part.step").succeeds().stdout).unwrap();
    for words in ["unit:       inch", "bodies:     2", "1 (1 sphere)", "yes, it is closed"] {
        assert!(text.contains(words), "{words}: {text}");
    }
    let scratch = broken(StepDefect::Apart { gap_nm: 1000 });
    let text = String::from_utf8(scratch.run("lamp brep part.step").succeeds().stdout).unwrap();
    assert!(text.contains("sliced:   yes") && text.contains("tried:"), "{text}");
    let scratch = broken(StepDefect::Missing);
    let text = String::from_utf8(scratch.run("lamp brep part.step").succeeds().stdout).unwrap();
    assert!(text.contains("sliced:   no: "), "{text}");
    let ran = scratch.run("lamp brep part.step --strict");
    assert_eq!(ran.statuses, [Some(3)], "{}", ran.stderr);
}

#[test]
fn what_a_file_holds_beside_its_solids_is_said() {
    let scratch = Scratch::new();
    let text = step(StepSample::Pair, StepUnit::Millimetre);
    // Both spheres stand in one place.
    scratch.write("part.step", text.replace("'',#33,#29)", "'',#33,#26)").as_bytes());
    let words = "#14, a solid that is placed twice in one place, is sliced once";
    let report = scratch.run("lamp brep part.step").succeeds().stdout;
    let report = String::from_utf8(report).unwrap();
    assert!(report.contains(&format!("found:      {words}\n")), "{report}");
    assert!(report.contains("bodies:     1"), "{report}");
    let report = said(&scratch, "slice part.step --dpi 600 --thickness 1mm -o part.tif");
    assert!(report.contains(words), "{report}");
    let others = "ISO-10303-21;DATA;#1=DOCUMENT_FILE('nut.stp','','',#2,'',$);\
                  #2=DOCUMENT_TYPE('geometry');ENDSEC;END-ISO-10303-21;";
    scratch.write("others.step", others.as_bytes());
    scratch.run("lamp brep others.step").is_refused_with(&[
        "#1 is a part in another file, `nut.stp`",
        "slice those files, or export the assembly as one",
    ]);
}

#[test]
fn what_is_broken_is_refused_or_healed_and_said() {
    for (defect, words) in [
        (StepDefect::Missing, "edges of facets are open"),
        (StepDefect::Crossing, "cross"),
        (StepDefect::Apart { gap_nm: 100_000 }, "edges of facets are open"),
    ] {
        let scratch = broken(defect);
        scratch.run("slice part.step -o part.tif").is_refused_with(&["part.step: ", words]);
        assert_eq!(scratch.names(), ["part.step"], "{defect:?}");
    }
    for (defect, words) in [
        (StepDefect::Apart { gap_nm: 1000 }, "joined"),
        (StepDefect::Inverted, "turned over"),
        (StepDefect::InsideOut, "turned over"),
    ] {
        let scratch = broken(defect);
        let text = said(&scratch, "slice part.step --dpi 600 --thickness 1mm -o part.tif");
        assert!(text.contains(words), "{defect:?}: {text}");
        let whole = with(StepSample::Block);
        said(&whole, "slice part.step --dpi 600 --thickness 1mm -o part.tif");
        let [a, b] = [&scratch, &whole].map(|scratch| scratch.layers("part.tif"));
        assert_eq!(masks(&a), masks(&b), "{defect:?}");
    }
}

/// Writes a block without its top. On its side, every layer has a gap.
#[test]
fn layers_with_gaps_come_from_the_fallback() {
    let scratch = broken(StepDefect::Missing);
    scratch.write("whole.step", step(StepSample::Block, StepUnit::Millimetre).as_bytes());
    scratch.run("lamp convert whole.step whole.stl").succeeds_quietly();
    let line = "--dpi 600 --thickness 1mm --rotate x:90";
    said(&scratch, &format!("slice whole.step {line} -o whole.tif"));
    let bridged = format!("slice part.step --fallback whole.stl {line} -o part.tif");
    let text = said(&scratch, &bridged);
    assert!(text.contains("layers with gaps taken from whole.stl: 0-"), "{text}");
    let [a, b] = ["part.tif", "whole.tif"].map(|name| scratch.layers(name));
    let differ = masks(&a).iter().zip(masks(&b)).filter(|(a, b)| **a != *b).count();
    assert_eq!(differ, 0, "{text}");
    assert!(a.iter().all(|layer| layer.info.closed == Some(true)));
    // Upright, no layer has a gap.
    let text = said(&scratch, "slice part.step --fallback whole.stl --dpi 600 -o up.tif");
    assert!(!text.contains("gaps"), "{text}");
    scratch.run("lamp sample sphere -o other.stl").succeeds();
    scratch
        .run("slice part.step --fallback other.stl --margin 999 -o wrong.tif")
        .is_refused_with(&["other.stl: it is not the same part"]);
    scratch
        .run("slice whole.stl --fallback whole.stl -o wrong.tif")
        .is_wrong_usage(&["--fallback needs a STEP part"]);
}

/// Without a face that closes around the part, a section has no gap but lacks a contour.
#[test]
fn layers_without_a_contour_come_from_the_fallback() {
    let whole = step(StepSample::Tower, StepUnit::Millimetre);
    let scratch = Scratch::new();
    scratch.write("whole.step", whole.as_bytes());
    scratch.run("lamp convert whole.step -o whole.stl").succeeds_quietly();
    let line = "--dpi 300 --thickness 2mm";
    said(&scratch, &format!("slice whole.step {line} -o whole.tif"));
    let expected = scratch.layers("whole.tif");
    let start = whole.find("CLOSED_SHELL('',(").unwrap() + "CLOSED_SHELL('',(".len();
    let end = start + whole[start..].find(')').unwrap();
    let faces: Vec<&str> = whole[start..end].split(',').collect();
    for missing in 0..faces.len() {
        let mut left = faces.clone();
        left.remove(missing);
        let text = format!("{}{}{}", &whole[..start], left.join(","), &whole[end..]);
        scratch.write("part.step", text.as_bytes());
        scratch.run(&format!("slice part.step {line} -o no.tif")).is_refused_with(&["open"]);
        said(&scratch, &format!("slice part.step --fallback whole.stl {line} -o part.tif"));
        let layers = scratch.layers("part.tif");
        for (layer, expected) in layers.iter().zip(&expected) {
            let [a, b] = [layer, expected].map(|layer| mask(layer).white_pixels() as f64);
            assert!((a / b - 1.0).abs() < 2e-3, "{}: {a} for {b}", layer.info.index);
        }
    }
}

#[test]
fn wrong_usage_is_told() {
    let scratch = with(StepSample::Sphere);
    scratch.run("slice part.step --units inch -o a.tif").is_wrong_usage(&["leave out --units"]);
    scratch.run("slice part.step --tolerance 0um -o a.tif").is_wrong_usage(&["--tolerance"]);
    scratch.run("slice part.step --timeout 0 -o a.tif").is_wrong_usage(&["write seconds"]);
    scratch.run("lamp convert part.step part.obj").is_wrong_usage(&[".stl"]);
    scratch.run("lamp sample blade -o blade.step").is_wrong_usage(&["as STL only"]);
    scratch
        .run("slice part.step --timeout 0.000001 --tolerance 1um -o a.tif")
        .is_refused_with(&["takes longer than"]);
    assert_eq!(scratch.names(), ["part.step"]);
}

#[test]
fn a_sample_is_the_fixture() {
    let scratch = Scratch::new();
    scratch.run("lamp sample torus -o torus.step").succeeds_quietly();
    let expected = step(StepSample::Torus, StepUnit::Millimetre);
    assert_eq!(scratch.bytes("torus.step"), expected.as_bytes());
}

#[cfg(not(feature = "occt"))]
#[test]
fn what_needs_opencascade_is_refused_without_it() {
    let scratch = with(StepSample::Sphere);
    for line in ["lamp brep part.step --both", "slice part.step --kernel both -o a.tif"] {
        scratch.run(line).is_wrong_usage(&["this build is without OpenCASCADE"]);
    }
    assert_eq!(scratch.names(), ["part.step"]);
    let text = iges(StepSample::Block, StepUnit::Inch).unwrap();
    scratch.write("part.igs", text.as_bytes());
    for line in ["slice part.igs -o a.tif", "lamp brep part.igs"] {
        scratch.run(line).is_refused_with(&[
            "part.igs: this is an IGES file, which only OpenCASCADE reads",
            "a build with --features occt",
        ]);
    }
}

#[cfg(feature = "occt")]
#[test]
fn iges_gives_the_pixels_of_the_same_step() {
    for part in [StepSample::Block, StepSample::Frustum, StepSample::Torus] {
        let scratch = with(part);
        let text = iges(part, StepUnit::Inch).unwrap();
        scratch.write("part.igs", text.as_bytes());
        let line = "--dpi 300 --thickness 500um --rotate x:20";
        scratch.run(&format!("slice part.step {line} --quiet -o step.tif")).succeeds();
        let iges = format!("{line} --kernel occt --quiet");
        scratch.run(&format!("slice part.igs {iges} -o iges.tif")).succeeds();
        // From a pipe, too.
        scratch.run_on(&format!("slice - {iges} -o piped.tif"), text.as_bytes()).succeeds();
        let [step, file, pipe] =
            ["step", "iges", "piped"].map(|name| scratch.layers(&format!("{name}.tif")));
        assert!(masks(&step) == masks(&file) && masks(&file) == masks(&pipe), "{part:?}");
        let report = scratch.run("lamp brep part.igs --kernel occt").succeeds().stdout;
        assert!(String::from_utf8(report).unwrap().contains("unit:       in\n"), "{part:?}");
        for kernel in ["lamp", "both"] {
            scratch
                .run(&format!("slice part.igs --kernel {kernel} -o a.tif"))
                .is_refused_with(&["part.igs: this is an IGES file", "give --kernel occt"]);
        }
        let half = &text.as_bytes()[..text.len() / 2];
        scratch.write("half.igs", half);
        scratch
            .run("slice half.igs --kernel occt -o a.tif")
            .is_refused_with(&["half.igs: it is cut off"]);
        assert!(!scratch.names().contains(&"a.tif".to_owned()));
    }
}

#[cfg(feature = "occt")]
#[test]
fn a_second_opinion_agrees_on_good_parts() {
    for part in [StepSample::Pair, StepSample::Blade, StepSample::Frustum, StepSample::Tower] {
        let scratch = with(part);
        let text =
            String::from_utf8(scratch.run("lamp brep part.step --both").succeeds().stdout).unwrap();
        assert!(text.contains("second:     OpenCASCADE agrees: volumes within 0.0"), "{text}");
        let line = "slice part.step --dpi 300 --thickness 2mm --quiet";
        scratch.run(&format!("{line} -o one.tif")).succeeds();
        scratch.run(&format!("{line} --kernel both -o both.tif")).succeeds();
        assert!(scratch.bytes("one.tif") == scratch.bytes("both.tif"), "{part:?}");
    }
}

/// OpenCASCADE reads a torus that meets itself with both of its parts.
#[cfg(feature = "occt")]
#[test]
fn kernels_that_disagree_stop_the_slicer() {
    let scratch = with(StepSample::Apple);
    let ran = scratch.run("lamp brep part.step --both --json");
    assert_eq!(ran.statuses, [Some(3)], "{ran:?}");
    assert!(ran.stderr.contains("LAMP and OpenCASCADE read it differently"), "{ran:?}");
    let answer: serde_json::Value = serde_json::from_slice(&ran.stdout).unwrap();
    let second = &answer["second"];
    assert!(!second["differences"].as_array().unwrap().is_empty(), "{second}");
    let volume = &second["pairs"][0]["measures"][6];
    let [one, two, allowed] =
        ["first", "second", "allowed"].map(|key| volume[key].as_f64().unwrap());
    assert!(volume["what"] == "volume_mm3" && (one - two).abs() > allowed, "{volume}");
    let text = String::from_utf8(scratch.run("lamp brep part.step --both").stdout).unwrap();
    assert!(text.contains("differs:    body 1") && text.contains("its volume is"), "{text}");
    scratch
        .run("slice part.step --kernel both -o part.tif")
        .is_refused_with(&["the kernels disagree about body 1", "lamp brep --both reports more"]);
    assert_eq!(scratch.names(), ["part.step"]);
    scratch.run("slice part.step --dpi 100 -o part.tif").succeeds();
}

#[cfg(feature = "occt")]
#[test]
fn kernels_agree_pixel_by_pixel() {
    let scratch = with(StepSample::Torus);
    let line = "--dpi 600 --thickness 1mm --rotate x:20 --quiet";
    for kernel in ["lamp", "occt"] {
        scratch
            .run(&format!("slice part.step {line} --kernel {kernel} -o {kernel}.tif"))
            .succeeds_quietly();
    }
    let [a, b] = ["lamp.tif", "occt.tif"].map(|name| scratch.layers(name));
    assert_eq!(masks(&a), masks(&b));
    assert!(a[0].info.stack != b[0].info.stack, "the stack remembers the kernel");
    let broken = broken(StepDefect::Missing);
    broken.run("slice part.step --kernel occt -o a.tif").is_refused_with(&["part.step: "]);
    assert_eq!(broken.names(), ["part.step"]);
}
