"""The interface itself: keywords, descriptions and types."""

import inspect
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import lamp_slicer as lamp
from lamp_slicer import _native

# Options that name files beside the stack, print, or choose layers of an input: Python has other
# ways, or leaves them to the program.
OF_COMMANDS = {
    "around", "classic", "evidence", "expose", "fields", "force", "format", "help", "json", "keep-white", "layers", "layout-out",
    "layout-picture", "map", "map-layer", "map-region", "memory", "mirrors", "no-config", "no-sync",
    "options", "output", "overlap", "packbits", "plot", "profile", "quiet", "recipe", "recoat", "report", "seam",
    "sources", "strict", "strips", "threads", "time", "timeout", "verbose", "version",
}


STAGES = ["slice", "fix", "dither", "compensate", "tile"]
PLANNERS = ["plan speed", "plan voxels", "plan column-cure", "plan ecpl"]


@pytest.mark.parametrize("name", STAGES + PLANNERS)
def test_each_option_is_a_keyword(name, program):
    text = program("lamp", *name.split(), "--help", check=True).stdout
    options = set(re.findall(r"^ +(?:-\w, )?--([a-z][a-z-]*)", text, re.MULTILINE))
    keywords = inspect.signature(getattr(lamp, name.replace(" ", "_").replace("-", "_"))).parameters
    keywords = {keyword.replace("_", "-") for keyword in keywords}
    assert options - OF_COMMANDS <= keywords
    own = {"part", "parts", "layers", "target", "name", "memory-bytes"}
    assert keywords - own <= options


def test_everything_public_is_described():
    for name in lamp.__all__:
        public = getattr(lamp, name)
        assert inspect.getdoc(public), name
    for kind in [lamp.Stack, lamp.Layer, lamp.Layers]:
        for name, member in vars(kind).items():
            if not name.startswith("_"):
                assert inspect.getdoc(member), f"{kind.__name__}.{name}"


def test_stubs_have_the_members_of_native_types():
    stub = Path(lamp.__file__).with_name("_native.pyi").read_text(encoding="utf-8")
    for kind in [lamp.Stack, lamp.Layer, lamp.Layers]:
        of_kind = stub.split(f"class {kind.__name__}")[1].split("\nclass ")[0]
        names = {name for name in vars(kind) if not name.startswith("_")}
        assert names == set(re.findall(r"def ([a-z]\w*)", of_kind.split("\nPath = ")[0]))
    functions = {name for name, member in vars(_native).items() if inspect.isbuiltin(member)}
    assert functions == set(re.findall(r"^def (\w+)", stub, re.MULTILINE))


def test_types_hold(tmp_path):
    use = tmp_path / "use.py"
    use.write_text(
        "import lamp_slicer as lamp\n"
        "layers: lamp.Layers = lamp.dither(lamp.fix(lamp.slice('a.stl', dpi=300)))\n"
        "for report in lamp.write('a.tif', layers): print(report.stage)\n"
        "stack: lamp.Stack = lamp.open('a.tif')\n"
        "area: int = stack[3].exposed_px + len(list(stack[2:5]))\n"
        "for feature in lamp.check(stack): print(feature.finding.text)\n"
        "plan: lamp.Plan = lamp.plan_ecpl('lens', projector='jariwala', material='tmpta')\n"
        "height: float = plan.cured_um.max()\n"
        "times = [layer.exposure_ms for layer in plan.layers]\n",
        encoding="utf-8",
    )
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache")]
    command += ["-p", "lamp_slicer", "-m", "use"]
    environment = {**os.environ, "MYPYPATH": str(tmp_path)}
    answer = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert answer.returncode == 0, answer.stdout


def test_the_version_is_one(program):
    assert program("lamp", "--version", check=True).stdout.split()[1] == lamp.__version__
