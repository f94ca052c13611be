"""Starts the program: `python -m lamp_slicer slice part.stl -o part.tif`."""

import os
import shutil
import subprocess
import sys
import sysconfig


def main() -> int:
    """Runs `lamp` with the arguments of this command, and returns its exit status."""
    # The program of this installation comes before others in PATH.
    folders = sysconfig.get_path("scripts"), sysconfig.get_path("scripts", f"{os.name}_user")
    program = next(filter(None, (shutil.which("lamp", path=folder) for folder in folders)), None)
    program = program or shutil.which("lamp")
    if program is None:
        print("lamp: the program is not installed: pip install lamp-slicer", file=sys.stderr)
        return 1
    if os.name == "posix":
        os.execv(program, ["lamp", *sys.argv[1:]])
    return subprocess.call([program, *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
