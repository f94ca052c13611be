"""Plans of exposures, against the program."""

import json

import numpy as np
import pytest

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
    words = ["--material", RESIN, "--exposure", "3s", "--min-level", "20", "--margin", "0.1"]
    program("lamp", "plan", "voxels", bridge.path, *words, "-o", theirs, check=True)
    layers = lamp.plan_voxels(bridge, material=RESIN, exposure="3s", min_level=20, margin="10%")
    plan = lamp.write(ours, layers)[-1]
    assert ours.read_bytes() == theirs.read_bytes()
    assert plan.layers == 12 and plan.bound <= plan.cost
    assert lamp.open(ours).is_gray


@pytest.mark.parametrize(
    ("keywords", "why"),
    [
        ({"material": "mud"}, "mud: there is no such file"),
        ({"material": RESIN, "margin": 1}, "margin: `1` is not below 1"),
        ({"material": RESIN, "gap": 0}, "gap: the share must be above zero"),
        ({"material": RESIN, "wanted": 0}, "wanted: "),
        ({"material": RESIN, "at": "side"}, "at: `side` is none of"),
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
