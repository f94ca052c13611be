"""Plans of exposures, against the program."""

import json
import math
import warnings
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import lamp_slicer as lamp

RESIN = "pegda-sudan"


@pytest.fixture(scope="module")
def bridge(tmp_path_factory) -> lamp.Stack:
    """A bridge: light of its upper layers reaches below its span."""
    images = np.zeros((12, 24, 40), bool)
    images[:, 4:20, 4:36] = True
    images[:6, :, 14:26] = False
    path = tmp_path_factory.mktemp("bridge") / "bridge.tif"
    lamp.write(path, images, dpi=1500, thickness="20um", name="bridge")
    return lamp.open(path)


def test_times_are_those_of_the_program(tmp_path, bridge, program):
    ours, theirs, report = tmp_path / "ours.tif", tmp_path / "theirs.tif", tmp_path / "plan.json"
    words = ["--material", RESIN, "--max-change", "0.2", "--speed", "5um/s..1mm/s"]
    program("lamp", "plan", "speed", bridge.path, *words, "--report", report, "-o", theirs, check=True)
    layers = lamp.plan_speed(bridge, material=RESIN, max_change=0.2, speed="5um/s..1mm/s")
    plan = lamp.write(ours, layers)[-1]
    assert ours.read_bytes() == theirs.read_bytes()
    expected = json.loads(report.read_text(encoding="utf-8"))
    for key in ["single_ms", "bound", "error", "gap", "layers"]:
        assert plan[key] == expected[key]
    assert plan.times_ms == [layer.exposure_ms for layer in lamp.open(ours)]
    assert len(set(plan.times_ms)) > 1
    # Layers that come once are kept, and give the same.
    once = lamp.plan_speed(iter(bridge), material=RESIN, max_change=0.2, speed="5um/s..1mm/s")
    assert [layer.exposure_ms for layer in once] == plan.times_ms


@pytest.mark.filterwarnings("ignore:plan")
def test_levels_are_those_of_the_program(tmp_path, bridge, program):
    ours, theirs = tmp_path / "ours.tif", tmp_path / "theirs.tif"
    words = ["--material", RESIN, "--expose", "3s", "--min-level", "20", "--dose-margin", "0.1"]
    program("lamp", "plan", "voxels", bridge.path, *words, "-o", theirs, check=True)
    layers = lamp.plan_voxels(bridge, material=RESIN, expose="3s", min_level=20, dose_margin="10%")
    plan = lamp.write(ours, layers)[-1]
    assert ours.read_bytes() == theirs.read_bytes()
    assert plan.layers == 12 and plan.bound <= plan.cost
    assert lamp.open(ours).is_gray


@pytest.mark.parametrize(
    ("keywords", "why"),
    [
        ({"material": "mud"}, "mud: there is no such file"),
        ({"material": RESIN, "dose_margin": 1}, "dose_margin: `1` is not below 1"),
        ({"material": RESIN, "search_gap": 0}, "search_gap: the share must be above zero"),
        ({"material": RESIN, "wanted": 0}, "wanted: "),
        ({"material": RESIN, "dose_at": "side"}, "dose_at: `side` is none of"),
        ({"material": "lamp-suspension"}, "spread"),
    ],
)
def test_wrong_plans_are_refused(bridge, keywords, why):
    for planner in [lamp.plan_speed, lamp.plan_voxels]:
        with pytest.raises(lamp.LampError, match=why):
            next(planner(bridge, **keywords))
    with pytest.raises(lamp.LampSettingsError, match="speed: `fast` is not a range of speeds"):
        lamp.plan_speed(bridge, material=RESIN, speed="fast")
    with pytest.raises(lamp.LampError, match="thickness|resolution"):
        next(lamp.plan_speed([np.ones((4, 4), bool)], material=RESIN))


PITCH_UM, VOXEL_UM, SIGMA_UM, LIGHT = 20.0, 10.0, 12.0, 2.0
CRITICAL, DEPTH_UM = 10.0, 120.0
FULL_UM = 150.0


@pytest.fixture(scope="module")
def glass(tmp_path_factory) -> Path:
    """A height map without any symmetry, a lens, and a projector and a resin of simple numbers."""
    folder = tmp_path_factory.mktemp("glass")
    given = "source = 'a'"
    (folder / "small.toml").write_text(
        f"name = 'small'\ndescription = 'a'\n"
        f"[display]\ncolumns = 36\nrows = 30\n{given}\n"
        f"[pitch]\nvalue = '{PITCH_UM} um'\n{given}\n[voxel]\nvalue = '{VOXEL_UM} um'\n{given}\n"
        f"[spread]\nsigma = {{ value = '{SIGMA_UM} um', {given} }}\n"
        f"[light]\nvalue = '{LIGHT} mW/cm2'\n{given}\n[step]\nvalue = '1 ms'\n{given}\n"
    )
    (folder / "resin.toml").write_text(
        f"name = 'resin'\ndescription = 'a'\n"
        f"[working-curve.critical-dose]\nvalue = '{CRITICAL} mJ/cm2'\n{given}\n"
        f"[working-curve.penetration-depth]\nvalue = '{DEPTH_UM} um'\n{given}\n"
    )
    (folder / "lens.toml").write_text(
        "name = 'lens'\ndescription = 'a'\n[[lens]]\ndiameter = '80 um'\nsag = '15 um'\n"
    )
    levels = np.random.default_rng(7).integers(100, 256, (5, 7), dtype=np.uint8)
    levels[0, :3] = levels[3:, 5:] = 0
    Image.fromarray(levels).save(folder / "map.png")
    return folder


@pytest.fixture(scope="module")
def sharp(glass) -> Path:
    """A projector for kinetics that hardly blurs, so that small parts can be planned."""
    built_in = Path(__file__).parents[2] / "planning" / "projectors" / "jariwala.toml"
    path = glass / "sharp.toml"
    path.write_text(built_in.read_text(encoding="utf-8").replace("25.2 um", "8 um"), encoding="utf-8")
    return path


def column_cure(glass: Path, **keywords) -> lamp.Plan:
    keywords = {"pixel": f"{PITCH_UM}um", "full": f"{FULL_UM}um", **keywords}
    files = {"projector": glass / "small.toml", "material": glass / "resin.toml"}
    return lamp.plan_column_cure(glass / "map.png", **files, **keywords)


def light_along(mirrors: int, voxels: int) -> np.ndarray:
    """The light of each mirror on each voxel along an axis: a square that a Gaussian blurs, as a mean
    over the voxel."""

    def twice(x: float) -> float:
        """The second integral of the Gaussian."""
        t = x / SIGMA_UM
        bell = math.exp(-0.5 * t * t) / math.sqrt(2 * math.pi)
        return 0.5 * x * (1 + math.erf(t / math.sqrt(2))) + SIGMA_UM * bell

    between = np.subtract.outer(
        (np.arange(voxels) - (voxels - 1) / 2) * VOXEL_UM,
        (np.arange(mirrors) - (mirrors - 1) / 2) * PITCH_UM,
    )
    edge = np.vectorize(twice)
    near, far = (VOXEL_UM + PITCH_UM) / 2, (VOXEL_UM - PITCH_UM) / 2
    return (edge(between + near) - edge(between - far) - edge(between + far) + edge(between - near)) / VOXEL_UM


@pytest.mark.parametrize("gray", [False, True])
def test_bitmaps_give_the_doses_and_heights_that_a_plan_states(glass, gray):
    plan = column_cure(glass, gray=gray, bitmaps=6)
    assert len(plan.layers) == 6 and {layer.is_gray for layer in plan.layers} == {gray}
    levels = np.asarray(Image.open(glass / "map.png")) / 255 * FULL_UM
    rows, columns = (2 * side for side in levels.shape)
    margin = (plan.target_um.shape[0] - rows) // 2
    inside = plan.target_um[margin : margin + rows, margin : margin + columns]
    assert np.allclose(inside, np.kron(levels, np.ones((2, 2))))
    assert plan.target_um.sum() == inside.sum()

    white = 255 if gray else 1
    seconds = sum(layer.array() / white * layer.exposure_ms / 1000 for layer in plan.layers)
    down, across = (light_along(*sides) for sides in zip(seconds.shape, plan.target_um.shape))
    doses = LIGHT * down @ seconds @ across.T
    wanted = np.where(plan.target_um > 0, CRITICAL * np.exp(plan.target_um / DEPTH_UM), 0)
    error = 0.5 * np.sum((doses - wanted) ** 2)
    assert error == pytest.approx(plan.bitmaps.error, rel=1e-6)
    # The best times are even, so bitmaps may have a smaller error.
    assert error >= plan.best.error - plan.best.price
    assert max(error, plan.best.error) == pytest.approx(plan.best.error * (1 + plan.bitmaps.excess), rel=1e-6)
    cured = DEPTH_UM * np.log(np.maximum(doses / CRITICAL, 1))
    assert np.allclose(cured, plan.cured_um, atol=1e-3)
    off = (cured - plan.target_um)[plan.target_um > 0]
    assert off.max() == pytest.approx(plan.bitmaps.measures.highest_um, abs=1e-3)
    assert off.min() == pytest.approx(plan.bitmaps.measures.lowest_um, abs=1e-3)


def test_rings_cure_the_profile_that_a_plan_states(glass, sharp):
    plan = lamp.plan_ecpl(glass / "lens.toml", projector=sharp, material="tmpta")
    rows, columns = plan.layers[0].shape
    y, x = np.indices((rows, columns))
    away = np.hypot(x - (columns - 1) / 2, y - (rows - 1) / 2)
    for layer, bitmap in zip(plan.layers, plan.bitmaps):
        white = sum((away >= start) & (away < end) for start, end in bitmap.rings)
        assert np.array_equal(layer.array(), white > 0)
        assert layer.exposure_ms == bitmap.exposure_ms
    assert sum(layer.exposure_ms for layer in plan.layers) == pytest.approx(1000 * plan.exposure_s)

    radius, cured, wanted = (np.array(plan.profile[key]) for key in ["radius_um", "cured_um", "wanted_um"])
    part = (cured > 0) | (wanted > 0)
    # A cell stands for its ring.
    mean = np.average((cured - wanted)[part] ** 2, weights=radius[part])
    assert math.sqrt(mean) == pytest.approx(plan.measures.rms_um, abs=2e-3)
    # A sphere of the lens's radius and height.
    ball_um = (40**2 + 15**2) / (2 * 15)
    side = plan.target_um.shape[0]
    at = (np.arange(side) - (side - 1) / 2) * plan.column_um
    from_axis = np.hypot.outer(at, at)
    cap = np.sqrt(np.maximum(ball_um**2 - from_axis**2, 0)) - (ball_um - 15)
    assert np.allclose(plan.target_um, np.where(from_axis < 40, cap, 0), atol=1e-6)
    assert plan.cured_um[side // 2, side // 2] == pytest.approx(plan.cured.sag_um, abs=0.01)
    assert plan.cured_um[from_axis < 30] == pytest.approx(
        np.interp(from_axis[from_axis < 30], radius, cured), abs=0.5
    )


@pytest.mark.parametrize(
    ("command", "target", "words"),
    [
        ("column-cure", "map.png", "--pixel 20um --full 150um --bitmaps 5 --optimize height --robust 2um"),
        ("column-cure", "map.png", "--pixel 20um --full 150um --gray --rays 9x15 --voxel 8um --search-gap 1% --dose-error 2%"),
        ("ecpl", "lens.toml", ""),
        ("ecpl", "lens.toml", "--method seed"),
    ],
)
def test_bitmaps_are_those_of_the_program(tmp_path, glass, sharp, command, target, words, program):
    files = {"projector": glass / "small.toml", "material": glass / "resin.toml"}
    if command == "ecpl":
        files = {"projector": sharp, "material": "tmpta"}
    keywords, words = {}, words.split()
    for word in words:
        if word.startswith("--"):
            key = word[2:].replace("-", "_")
            keywords[key] = True
        else:
            keywords[key] = word
    files_as_words = [f"--{key}={value}" for key, value in files.items()]
    theirs = tmp_path / "theirs"
    program("lamp", "plan", command, glass / target, *files_as_words, *words, "-o", theirs, check=True)
    planner = {"column-cure": lamp.plan_column_cure, "ecpl": lamp.plan_ecpl}[command]
    plan = planner(glass / target, **files, **keywords)
    assert plan == json.loads((theirs / "report.json").read_text(encoding="utf-8"))
    lamp.write(tmp_path / "ours.tif", plan.layers)
    assert (tmp_path / "ours.tif").read_bytes() == (theirs / "bitmaps.tif").read_bytes()


ZHAO = {"projector": "zhao", "material": "pegda-mw700"}
JARIWALA = {"projector": "jariwala", "material": "tmpta"}


@pytest.mark.parametrize(
    ("command", "target", "keywords", "kind"),
    [
        ("column-cure", "mud", ZHAO, lamp.LampError),
        ("column-cure", "sphere", {**ZHAO, "projector": "mud"}, lamp.LampError),
        ("column-cure", "sphere", {**ZHAO, "material": "mud"}, lamp.LampError),
        ("column-cure", "sphere", {**ZHAO, "projector": "jariwala"}, lamp.LampError),
        ("column-cure", "sphere", {**ZHAO, "bitmaps": 0}, lamp.LampSettingsError),
        ("column-cure", "sphere", {**ZHAO, "search_gap": 0}, lamp.LampSettingsError),
        ("column-cure", "sphere", {**ZHAO, "max_time": "25h"}, lamp.LampSettingsError),
        ("column-cure", "sphere", {**ZHAO, "rays": "9"}, lamp.LampSettingsError),
        ("column-cure", "sphere", {**ZHAO, "voxel": "0um"}, lamp.LampSettingsError),
        ("column-cure", "sphere", {**ZHAO, "robust": "1mm"}, lamp.LampSettingsError),
        ("column-cure", "sphere", {**ZHAO, "rays": "1x1"}, lamp.LampError),
        ("column-cure", "sphere", {**ZHAO, "pixel": "1um", "full": "1um"}, lamp.LampSettingsError),
        ("column-cure", "sphere", {**ZHAO, "flat_field": "none.png"}, lamp.LampFileNotFoundError),
        ("ecpl", "sphere", ZHAO, lamp.LampError),
        ("ecpl", "lens-array", JARIWALA, lamp.LampError),
        ("ecpl", "sphere", {**JARIWALA, "projector": "zhao"}, lamp.LampError),
        ("ecpl", "sphere", {**JARIWALA, "method": "guess"}, lamp.LampSettingsError),
    ],
)
def test_what_has_no_plan_is_refused_as_by_the_program(tmp_path, command, target, keywords, kind, program):
    planner = {"column-cure": lamp.plan_column_cure, "ecpl": lamp.plan_ecpl}[command]
    with pytest.raises(lamp.LampError) as refused, warnings.catch_warnings():
        warnings.simplefilter("ignore", lamp.LampWarning)
        planner(target, **keywords)
    assert type(refused.value) is kind
    words = [f"--{key.replace('_', '-')}={value}" for key, value in keywords.items()]
    ran = program("lamp", "plan", command, target, *words, "-o", tmp_path / "plan")
    assert ran.returncode == (2 if kind is lamp.LampSettingsError else 1)
    if keywords.get("method") != "guess":
        # The program names an option, and Python a keyword.
        place, _, why = str(refused.value).partition(": ")
        sentence = why if place in keywords else str(refused.value)
        assert sentence in ran.stderr


def test_half_a_scale_is_refused(glass):
    with pytest.raises(lamp.LampSettingsError, match="give both"):
        column_cure(glass, full=None)


def test_doubts_about_a_plan_are_warnings(glass):
    with pytest.warns(lamp.LampWarning, match="lower than 180um") as found:
        lamp.plan_column_cure("hemisphere", **ZHAO)
    assert found[0].filename == __file__
    nothing = pytest.warns(lamp.LampWarning, match="the plan cures no column")
    with pytest.warns(lamp.LampNote, match="mirrors are on for all of --max-time 0.0[0-9]+s"), nothing:
        column_cure(glass, max_time="50ms", bitmaps=1)
