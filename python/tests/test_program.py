"""The programs that the package brings, which run within the process of Python."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import lamp_slicer as lamp

STAGES = ["lamp", "slice", "fix", "dither", "tile"]


@pytest.fixture(scope="module")
def scripts(tmp_path_factory) -> Path:
    """A folder of scripts, as `pip install` writes them."""
    if os.name != "posix":
        pytest.skip("pip writes other scripts there")
    folder = tmp_path_factory.mktemp("scripts")
    for name in STAGES:
        script = folder / name
        start = f"from lamp_slicer.__main__ import {name}\nsys.exit({name}())"
        script.write_text(f"#!{sys.executable}\nimport sys\n{start}\n")
        script.chmod(0o755)
    return folder


def answer(*words, **options) -> subprocess.CompletedProcess:
    return subprocess.run([*map(str, words)], capture_output=True, text=True, **options)


def test_the_module_is_a_program():
    text = answer(sys.executable, "-m", "lamp_slicer", "--version", check=True).stdout
    assert text.split()[:2] == ["lamp", lamp.__version__]


def test_a_pipeline_makes_what_the_built_programs_make(tmp_path, stl, scripts, program):
    theirs, own = tmp_path / "theirs.tif", tmp_path / "own.tif"
    words = ["--dpi", "300", "--thickness", "200um", "-q"]
    program("slice", stl, *words, "-o", tmp_path / "sliced.tif", check=True)
    program("fix", tmp_path / "sliced.tif", "-q", "-o", theirs, check=True)
    pipeline = f"{scripts}/slice {stl} {' '.join(words)} | {scripts}/fix -q > {own}"
    subprocess.run(pipeline, shell=True, check=True)
    assert own.read_bytes() == theirs.read_bytes()


def test_statuses_and_sentences_are_those_of_a_program(tmp_path, scripts, program):
    for words in [["slice", "none.stl"], ["slice", "--speed"], ["lamp", "--licenses"], ["fix", "-h"]]:
        theirs, own = program(*words), answer(scripts / words[0], *words[1:])
        assert (own.returncode, own.stdout, own.stderr) == (
            theirs.returncode,
            theirs.stdout,
            theirs.stderr,
        )


def test_a_night_starts_its_tasks(tmp_path, stl, scripts):
    night = tmp_path / "night.toml"
    stages = 'stages = ["slice --dpi 300 --thickness 200um", "fix"]'
    night.write_text(f'[defaults]\n{stages}\n[[part]]\nfile = "{stl}"\n')
    run = answer(scripts / "lamp", "batch", night, "-q", cwd=tmp_path)
    assert run.returncode == 0, run.stderr
    assert len(lamp.open(tmp_path / "night/parts/ring.lamp")) > 0


def test_control_c_ends_a_program(tmp_path, stl, scripts):
    words = ["--dpi", "9600", "--thickness", "0.1um", "--trust-extent", "-q", "-o", tmp_path / "out.tif"]
    with subprocess.Popen([scripts / "slice", stl, *map(str, words)], stderr=subprocess.PIPE) as started:
        begun = time.monotonic()
        while not list(tmp_path.iterdir()):
            assert started.poll() is None and time.monotonic() - begun < 60
            time.sleep(0.01)
        started.send_signal(signal.SIGINT)
        assert started.stderr.read() == b""
    assert (started.returncode, list(tmp_path.iterdir())) == (130, [])
