"""Stages, each against what it must do to arrays."""

import numpy as np
import pytest
import trimesh

import lamp_slicer as lamp


def blocks(*boxes) -> np.ndarray:
    """Five layers of 60 x 80 pixels: boxes of (layers, rows, columns) are white."""
    images = np.zeros((5, 60, 80), bool)
    for layers, rows, columns in boxes:
        images[layers[0] : layers[1], rows[0] : rows[1], columns[0] : columns[1]] = True
    return images


def given(images) -> lamp.Layers:
    return lamp.layers(images, dpi=254, thickness="100um")


def test_fix_mends_a_row_that_runs_out():
    whole = blocks(((0, 5), (10, 50), (20, 60)))
    damaged = whole.copy()
    damaged[2, 30, 20:] = True
    fixed = lamp.fix(given(damaged))
    with pytest.warns(lamp.LampNote, match="fix: 1 band of stray rows in 1 layer was corrected"):
        images = [layer.array() for layer in fixed]
    assert np.array_equal(images, whole)
    (report,) = fixed.reports
    (band,) = report.bands
    assert (report.stage, report.bands_corrected, report.pixels_changed) == ("fix", 1, 20)
    assert (band.layer, band.first_row, band.last_row, band.outcome) == (2, 30, 30, "corrected")
    with pytest.raises(AttributeError, match="has no 'width': it has layer"):
        band.width
    # With no trust in any correction, all stays.
    with pytest.warns(lamp.LampWarning, match="1 band of stray rows was left"):
        left = [layer.array() for layer in lamp.fix(given(damaged), min_confidence=1)]
    assert np.array_equal(left, damaged)


def test_dots_have_the_share_of_their_level():
    level = np.full((3, 128, 128), 64, np.uint8)
    # At 254 dpi, dots are too wide to average.
    with pytest.warns(lamp.LampNote, match="dither: dots are as wide as pixels"):
        dots = [layer.array() for layer in lamp.dither(given(level))]
    assert all(image.dtype == bool for image in dots)
    assert np.mean(dots) == pytest.approx(64 / 255, abs=1e-3)
    threshold = lamp.dither(given(level), method="threshold")
    assert not np.any([layer.array() for layer in threshold])


def test_compensation_moves_edges():
    images = blocks(((0, 5), (10, 50), (20, 60)))
    inwards = lamp.compensate(given(images), uniform="200um", one_bit=True)
    # A pixel is 100 um wide.
    expected = blocks(((0, 5), (12, 48), (22, 58)))
    assert np.array_equal([layer.array() for layer in inwards], expected)
    assert inwards.reports[0].stage == "compensate" and inwards.reports[0].walls == []
    outwards = lamp.compensate(given(images), uniform="-100um", one_bit=True)
    # Corners become round, by less than a pixel here.
    assert next(outwards).exposed_px == pytest.approx(42 * 42, abs=4)
    for keywords, why in [
        ({}, "give --uniform"),
        ({"dose": "1mJ/cm2"}, "dose: it needs material"),
        ({"uniform": "1um", "material": "lamp-suspension"}, "not both"),
        ({"uniform": "wide"}, "uniform: "),
        ({"shrinkage": "70%"}, "shrinkage: "),
    ]:
        with pytest.raises(lamp.LampSettingsError, match=why):
            next(lamp.compensate(given(images), **keywords))


def test_edits_change_layers(tmp_path):
    edits = tmp_path / "edits.toml"
    edits.write_text('[[edit]]\nop = "cut"\nbox = "2,2,0 3,3,1"\n', encoding="utf-8")
    with pytest.raises(lamp.LampError, match="edits.toml: "):
        list(lamp.edit(given(blocks()), tmp_path / "edits.toml"))


def test_copies_lie_on_the_area():
    images = blocks(((0, 5), (10, 50), (20, 60)))
    build = lamp.tile(given(images), area="30x20mm", copies=3, mesh="none")
    layers = [layer.array() for layer in build]
    assert {layer.shape for layer in layers} == {(200, 300)}
    assert [int(layer.sum()) for layer in layers] == [3 * 1600] * 5
    layout = build.reports[-1].layout
    assert len(layout.copies) == 3
    # With a mesh, five layers of mesh come first.
    meshed = list(lamp.tile(given(images), area="30x20mm", copies=1))
    assert len(meshed) == 10 and meshed[0].exposed_px > 0


@pytest.mark.parametrize("keywords", [{}, {"pack": "outline"}, {"fit": True, "moat": "outline"}])
def test_several_parts_make_one_build(tmp_path, keywords):
    images = blocks(((0, 5), (10, 50), (20, 60)))
    path = tmp_path / "second.tif"
    lamp.write(path, blocks(((0, 5), (5, 55), (5, 75))), dpi=254, thickness="100um")
    parts = [(lamp.fix(given(images)), 2), (path, 1)]
    build = lamp.tile(parts, area="40x40mm", mesh="none" if "moat" not in keywords else "square",
                      **keywords)
    top = list(build)[-1]
    if "moat" not in keywords:
        assert top.exposed_px == 2 * 1600 + 50 * 70
    else:
        assert top.exposed_px > 2 * 1600 + 50 * 70
    with pytest.raises(lamp.LampError, match="the machine|area"):
        list(lamp.tile(path, machine="alpha", area="100x100in"))


def test_the_program_tiles_the_same_build(tmp_path, stack, program):
    ours, theirs = tmp_path / "ours.tif", tmp_path / "theirs.tif"
    for keywords, options in [
        ({"machine": "alpha", "copies": 4}, ["--machine", "alpha", "--copies", "4"]),
        ({"fit": True, "copies": 2, "cell": "4mm", "least_piece": "2mm2", "base_layers": 2},
         ["--fit", "--copies", "2", "--cell", "4mm", "--least-piece", "2mm2", "--base-layers", "2"]),
    ]:
        words = ["tile", stack.path, *options, "-q", "-o", theirs]
        answer = program(*words)
        if answer.returncode == 0:
            lamp.write(ours, lamp.tile(stack, **keywords))
            assert ours.read_bytes() == theirs.read_bytes()
        else:
            with pytest.raises(lamp.LampError) as caught:
                lamp.write(ours, lamp.tile(stack, **keywords))
            assert str(caught.value) in answer.stderr


@pytest.mark.parametrize(
    ("keywords", "why"),
    [
        ({"cell": "0mm"}, "cell: the length must be above zero"),
        ({"gap": "-1mm"}, "gap: -1mm is below zero"),
        ({"mesh": "none", "cell": "4mm"}, "--cell has no effect"),
        ({"mesh": "nosuch.png"}, "mesh nosuch.png: there is no such image"),
        ({"area": "wide"}, "area: `wide` is not a size"),
        ({"copies": 0}, "one copy of it or more"),
        ({"copies": -1}, "copies: "),
        ({"turns": "15deg"}, "run lamp tile by hand"),
        ({"turns": "twice"}, "turns: write none"),
    ],
)
def test_wrong_builds_are_refused(stack, keywords, why):
    with pytest.raises(lamp.LampError, match=why):
        next(lamp.tile(stack, **keywords))


def test_an_island_is_found():
    images = blocks(((0, 5), (10, 50), (5, 40)), ((2, 5), (20, 40), (50, 70)))
    found = lamp.check(given(images))
    (feature,) = [feature for feature in found if feature.kind == "island"]
    island = feature.finding
    assert (feature.severity, island.layer, island.area_px) == ("blocks", 2, 400)
    assert island.box_px == [50, 70, 20, 40] and island.drag_mn > 0
    assert str(feature).startswith("island: ") and found.layers == 5
    assert found.needs_a_person == 1 and island in found.all
    assert "bodies" not in dir(island) and "area_px" in dir(island)
    assert lamp.check(given(images), only=["pockets", "overhangs"]) == []
    for keywords, why in [
        ({"only": "everything"}, "only: `everything` is none of"),
        ({"machine": "nosuch"}, "nosuch: there is no such file"),
        ({"threshold": 0}, "threshold: "),
        ({"speck": "-1mm"}, "speck: -1mm is below zero"),
    ]:
        with pytest.raises(lamp.LampError, match=why):
            lamp.check(given(images), **keywords)


def test_a_check_finds_what_the_program_finds(tmp_path, stack, program):
    report = tmp_path / "check.json"
    program("lamp", "check", stack.path, "--report", report, check=True)
    theirs = __import__("json").loads(report.read_text(encoding="utf-8"))
    ours = lamp.check(stack)
    without = {"input", "text"}
    assert [{key: value for key, value in finding.items() if key not in without}
            for finding in ours.all] == [
        {key: value for key, value in finding.items() if key not in without}
        for finding in theirs["findings"]
    ]
    assert ours.needs_a_person == theirs["inputs"][0]["findings"]
    unchecked = theirs["inputs"][0]["unchecked_rules"]
    assert [", ".join(it["rules"]) + "; " + it["why"] for it in unchecked] == [
        line.split("not checked: ")[1] for line in ours.unchecked_rules
    ]


def test_a_scene_of_trimesh_is_no_mesh(mesh):
    with pytest.raises(lamp.LampSettingsError, match="is no part"):
        lamp.slice(trimesh.Scene([mesh]))
