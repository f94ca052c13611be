"""Parts and programs that several tests share."""

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
import trimesh

import lamp_slicer as lamp


def ring() -> trimesh.Trimesh:
    """A ring with a conical hole: sections have curved outlines and a hole that narrows."""
    outline = [[3.0, 0.0], [8.0, 0.0], [8.0, 5.0], [2.0, 5.0], [3.0, 0.0]]
    return trimesh.creation.revolve(outline, sections=64)


@pytest.fixture(scope="session")
def mesh() -> trimesh.Trimesh:
    made = ring()
    assert made.is_watertight
    return made


@pytest.fixture(scope="session")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("shared")


@pytest.fixture(scope="session")
def stl(folder, mesh) -> Path:
    path = folder / "ring.stl"
    mesh.export(path)
    return path


@pytest.fixture(scope="session")
def stack(folder, stl) -> lamp.Stack:
    path = folder / "ring.tif"
    lamp.write(path, lamp.slice(stl, dpi=300, thickness="200um"))
    return lamp.open(path)


@pytest.fixture
def program():
    """Runs a program, and returns what it did. Tests that compare with it need it built."""
    programs = os.environ.get("LAMP_PROGRAMS")
    if not programs:
        pytest.skip("LAMP_PROGRAMS names no folder of programs")

    def run(*words, check=False):
        command = [Path(programs, words[0]), *map(str, words[1:])]
        return subprocess.run(command, capture_output=True, text=True, check=check)

    return run


def noise(layers: int, rows: int, columns: int, gray: bool = False) -> np.ndarray:
    """Layers without any structure to rely on, the same each time."""
    numbers = np.random.default_rng(20261126)
    if gray:
        return numbers.integers(0, 256, (layers, rows, columns), dtype=np.uint8)
    return numbers.random((layers, rows, columns)) < 0.4
