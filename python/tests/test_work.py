"""Threads, signals and memory."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import lamp_slicer as lamp


def run(code: str, *words) -> subprocess.Popen:
    command = [sys.executable, "-c", textwrap.dedent(code), *map(str, words)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def test_threads_read_one_stack_together(stack):
    expected = [layer.array() for layer in stack]
    places = np.random.default_rng(1).integers(0, len(stack), 400)
    with ThreadPoolExecutor(8) as threads:
        images = threads.map(lambda place: stack.array(int(place)), places)
        assert all(np.array_equal(image, expected[place]) for image, place in zip(images, places))


def test_threads_share_an_iterator(stack):
    layers = lamp.fix(stack)
    with ThreadPoolExecutor(4) as threads:
        parts = list(threads.map(lambda _: [layer.index for layer in layers], range(4)))
    assert sorted(sum(parts, [])) == list(range(len(stack)))


def test_python_runs_while_layers_are_made(tmp_path, stl):
    """A thread that counts goes on while another writes a stack."""
    code = """
        import sys, threading, time, lamp_slicer as lamp
        layers = lamp.slice(sys.argv[1], dpi=2400, thickness="10um")
        thread = threading.Thread(target=lamp.write, args=(sys.argv[2], layers))
        thread.start()
        turns = 0
        while thread.is_alive():
            time.sleep(0.001)
            turns += 1
        print(turns)
    """
    work = run(code, stl, tmp_path / "out.tif")
    out, errors = work.communicate(timeout=120)
    assert work.returncode == 0, errors
    assert int(out) > 20


@pytest.mark.skipif(os.name != "posix", reason="signals are sent in another way there")
@pytest.mark.parametrize(
    "work",
    [
        "for layer in layers: pass",
        "lamp.write(sys.argv[2], layers)",
        "lamp.check(layers)",
        "list(lamp.fix(layer.array() for layer in layers))",
    ],
)
def test_control_c_ends_work(tmp_path, stl, work):
    code = f"""
        import sys, lamp_slicer as lamp
        layers = lamp.slice(sys.argv[1], dpi=9600, thickness="0.1um", trust_extent=True)
        print("begins", flush=True)
        try:
            {work}
        except KeyboardInterrupt:
            print("interrupted", flush=True)
    """
    started = run(code, stl, tmp_path / "out.tif")
    assert started.stdout.readline() == "begins\n"
    time.sleep(1.0)
    assert started.poll() is None
    begun = time.monotonic()
    started.send_signal(signal.SIGINT)
    out, errors = started.communicate(timeout=60)
    assert out == "interrupted\n", errors
    assert time.monotonic() - begun < 2
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="it counts threads as Linux lists them")
def test_control_c_ends_a_search(tmp_path):
    """A search that would take minutes leaves Python its lock, and ends with its thread."""
    code = """
        import os, threading, time, lamp_slicer as lamp
        tasks = lambda: len(os.listdir("/proc/self/task"))
        turns, ended, before = 0, False, tasks()
        def count():
            global turns
            while not ended:
                time.sleep(0.001)
                turns += 1
        counting = threading.Thread(target=count)
        counting.start()
        print("begins", flush=True)
        try:
            lamp.plan_column_cure(
                "lens-array", projector="zhao", material="pegda-mw700",
                optimize="height", voxel="2um", search_gap=1e-99,
            )
        except KeyboardInterrupt:
            ended = True
            counting.join()
            deadline = time.monotonic() + 20
            # The threads of the pool stay.
            while tasks() > before + os.cpu_count() and time.monotonic() < deadline:
                time.sleep(0.05)
            print(turns, tasks() - before - os.cpu_count(), flush=True)
    """
    started = run(code)
    assert started.stdout.readline() == "begins\n"
    time.sleep(2.0)
    assert started.poll() is None
    begun = time.monotonic()
    started.send_signal(signal.SIGINT)
    out, errors = started.communicate(timeout=60)
    assert time.monotonic() - begun < 30
    turns, left = map(int, out.split())
    assert turns > 20 and left <= 0, errors


@pytest.fixture(scope="module")
def stripes(tmp_path_factory):
    """Two stacks of stripes: a layer takes 400 kB as runs and 200 kB as an array."""
    image = np.indices((450, 450))[1] // 2 % 2 == 0
    # Rows that end white would be stray.
    image = np.pad(image, 10)
    paths = []
    for layers in [80, 400]:
        paths.append(tmp_path_factory.mktemp("stripes") / "stack.tif")
        lamp.write(paths[-1], (image for _ in range(layers)), dpi=254, thickness="100um")
    return paths


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="it reads a peak as Linux keeps it")
@pytest.mark.parametrize(
    "work",
    [
        "for layer in lamp.open(path): layer.runs",
        "for layer in lamp.open(path): layer.array()",
        "lamp.write(path + '.copy.tif', lamp.fix(path))",
        "lamp.write(path + '.copy.tif', (layer.array() for layer in lamp.open(path)))",
    ],
)
def test_memory_is_of_layers_not_of_stacks(stripes, work):
    """A stack of five times as many layers takes hardly more memory."""
    code = f"""
        import resource, sys, lamp_slicer as lamp
        path = sys.argv[1]
        {work}
        print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
    """
    peaks_mb = []
    for path in stripes:
        started = run(code, path)
        out, errors = started.communicate(timeout=300)
        assert started.returncode == 0, errors
        peaks_mb.append(int(out) / 1024)
    # 320 more layers are 130 MB of runs.
    assert peaks_mb[1] - peaks_mb[0] < 40, peaks_mb


def test_layers_that_nobody_takes_end(stl):
    before = len(os.listdir("/proc/self/task")) if os.path.isdir("/proc/self/task") else None
    for _ in range(30):
        layers = lamp.slice(stl, dpi=600, thickness="20um")
        next(layers)
        del layers
    if before is not None:
        deadline = time.monotonic() + 20
        # The threads of the pool stay.
        while len(os.listdir("/proc/self/task")) > before + os.cpu_count() + 1:
            assert time.monotonic() < deadline
            time.sleep(0.05)
