#!/usr/bin/env python3
"""Compares nights of `lamp batch` with the same pipelines typed by hand.

Needs a release build of lamp and half a minute to several, on a machine without other work:

    python3 benches/night.py [LAMP] [FOLDER]     default target/release/lamp, and a new folder

Eight blade moulds of different finenesses are sliced, fixed, dithered and checked, and two builds
laid out of them, as TIFFs and packed. By hand, each part is `slice | fix | dither -o part.tif` or
`part.lamp`, then `check`, and builds are `tile`. The files of both are compared. Processor time
counts all processes; each figure is the median of ROUNDS.
"""

import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROUNDS = 3
OPTIONS = "--dpi 1500 --thickness 100um"
FACETS = ["100k", "150k", "200k", "300k", "400k", "500k", "600k", "750k"]
BUILDS = {"odd": (0, 2, 4, 6), "even": (1, 3, 5, 7)}
COPIES = 2
LAYOUT = "--area 350x200mm --mesh none"


def measured(act):
    """Returns the seconds of processors, and of the clock, that an action takes."""
    subprocess.run("sync", check=True)
    before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.monotonic()
    act()
    wall, after = time.monotonic() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, wall


def shell(line, folder):
    """Runs a line of a shell in a folder."""
    subprocess.run(["bash", "-c", "set -o pipefail; " + line], cwd=folder, check=True)


def by_hand(lamp, folder, threads, kind):
    """Does the night as one would type it."""
    shell("rm -rf hand; mkdir hand", folder)
    on = f"-q --threads {threads}"
    for k in range(len(FACETS)):
        stack = f"hand/blade-{k}.{kind}"
        shell(
            f"{lamp} slice blade-{k}.stl {OPTIONS} {on} | {lamp} fix {on} | {lamp} dither {on}"
            f" -o {stack}; {lamp} check {stack} {on} > hand/{k}.txt || [ $? = 3 ]",
            folder,
        )
    for name, parts in BUILDS.items():
        stacks = " ".join(f"hand/blade-{k}.{kind}:{COPIES}" for k in parts)
        shell(f"{lamp} tile {stacks} {LAYOUT} {on} -o hand/{name}.{kind}", folder)


def night(lamp, folder, jobs, kind):
    """Does it as a batch, from nothing."""
    text = f'[defaults]\nstages = ["slice {OPTIONS}", "fix", "dither"]\n'
    text += f'[output]\nfolder = "out"\nformat = "{kind}"\n[[part]]\nfile = "blade-*.stl"\n'
    for name, parts in BUILDS.items():
        stacks = ", ".join(f'"blade-{k}:{COPIES}"' for k in parts)
        text += f'[[build]]\nname = "{name}"\nparts = [{stacks}]\ntile = "{LAYOUT}"\n'
    (folder / "night.toml").write_text(text)
    shell("rm -rf out lamp-store", folder)
    return measured(lambda: shell(f"{lamp} batch night.toml -q --jobs {jobs} || [ $? = 3 ]", folder))


def compare(lamp, folder):
    """Measures all, and prints the figures."""
    for k, facets in enumerate(FACETS):
        shell(f"{lamp} sample blade --facets {facets} -q -o blade-{k}.stl", folder)
    times = {}
    for _ in range(ROUNDS):
        for kind in ("tif", "lamp"):
            for threads in (1, 2):
                pair = measured(lambda: by_hand(lamp, folder, threads, kind))
                times.setdefault(f"by hand, {kind}, {threads} threads", []).append(pair)
            for jobs in (1, 2):
                pair = night(lamp, folder, jobs, kind)
                times.setdefault(f"night, {kind}, {jobs} jobs", []).append(pair)
            for stack in BUILDS:
                shell(f"cmp out/builds/{stack}.{kind} hand/{stack}.{kind}", folder)
            for k in range(len(FACETS)):
                shell(f"cmp out/parts/blade-{k}.{kind} hand/blade-{k}.{kind}", folder)
    for name, pairs in times.items():
        cpu, wall = (statistics.median(column) for column in zip(*pairs))
        print(f"{name:24} {cpu:7.2f} s of processors {wall:7.2f} s")


def main():
    lamp = Path(sys.argv[1] if len(sys.argv) > 1 else "target/release/lamp").resolve()
    if len(sys.argv) > 2:
        compare(lamp, Path(sys.argv[2]).resolve())
        return
    with tempfile.TemporaryDirectory() as folder:
        compare(lamp, Path(folder))


main()
