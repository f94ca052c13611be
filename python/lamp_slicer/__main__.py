"""The programs: `python -m lamp_slicer slice part.stl -o part.tif`, and the scripts of the package."""

import os
import sys
from typing import Optional

from lamp_slicer._native import run_program


def run(name: str) -> int:
    """Runs `lamp`, or a stage of the pipeline, with the words of this process; returns its status."""
    # A process that lamp starts for work of its own has to be lamp, and not a stage.
    lamp = "lamp.exe" if os.name == "nt" else "lamp"
    program = os.path.join(os.path.dirname(os.path.abspath(sys.argv[0])), lamp)
    if not os.path.exists(program):
        import sysconfig

        program = os.path.join(sysconfig.get_path("scripts"), lamp)
    stage: Optional[str] = None if name == "lamp" else name
    return run_program(program, [name, *sys.argv[1:]], stage)


def lamp() -> int:
    """Runs `lamp`."""
    return run("lamp")


def slice() -> int:
    """Runs `slice`."""
    return run("slice")


def fix() -> int:
    """Runs `fix`."""
    return run("fix")


def dither() -> int:
    """Runs `dither`."""
    return run("dither")


def tile() -> int:
    """Runs `tile`."""
    return run("tile")


if __name__ == "__main__":
    sys.exit(lamp())
