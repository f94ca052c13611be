#!/usr/bin/env python3
"""Times `lamp view` in a headless browser on a stack of 1000 beta layers, beside `vips dzsave`.

Needs a release build of lamp, selenium of PyPI, chromium, chromedriver and vips, 4 GB of disk and
about ten minutes; as root, files are read from disk at the start:

    python3 benches/viewer.py [LAMP] [FOLDER]    default target/release/lamp, and a new folder

The stack is made in FOLDER, unless build.tif is there already. A time is from the action to the
first frame in which all visible tiles are drawn; animations are off, and a frame is 17 ms.
"""

import random
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service

MEMORY_MB = 512
STARTS = 5
STEPS = 40
PAUSE = 0.7
JUMPS = 40
PLACES = 12
BROWSED = 1000

# In every page from its start: `settled(act)` gives the milliseconds until all tiles are drawn.
WATCH = """
const isSettled = () => {
  const viewer = globalThis.OpenSeadragon?.getViewer("sheets");
  if (!viewer || viewer.canvas.getAttribute("aria-busy") !== "false") return false;
  const { world } = viewer;
  const items = [...Array(world.getItemCount()).keys()].map((k) => world.getItemAt(k));
  return items.length > 0 && items.every((item) => item.getFullyLoaded()) && !world.needsDraw();
};
globalThis.settled = async (act) => {
  const start = performance.now();
  await act();
  // The picture follows in the next frame.
  for (let frame = 0; frame < 2 || !isSettled(); frame++) await new Promise(requestAnimationFrame);
  return performance.now() - start;
};
globalThis.press = (key, shiftKey) =>
  document.dispatchEvent(new KeyboardEvent("keydown", { key, shiftKey, bubbles: true }));
globalThis.goTo = (hash) => new Promise((changed) => {
  addEventListener("hashchange", changed, { once: true });
  location.hash = hash;
});
addEventListener("DOMContentLoaded", () =>
  settled(() => {}).then(() => (globalThis.firstPicture = performance.timeOrigin + performance.now())));
"""


class Server:
    """A running viewer."""

    def __init__(self, lamp, stack):
        self.begin = time.time()
        words = [lamp, "view", stack, "--memory", f"{MEMORY_MB}MB"]
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().strip()

    def cpu(self):
        tasks = Path(f"/proc/{self.process.pid}/task").glob("*/schedstat")
        return sum(int(task.read_text().split()[0]) for task in tasks) / 1e9

    def peak_mb(self):
        status = Path(f"/proc/{self.process.pid}/status").read_text().splitlines()
        return next(int(line.split()[1]) for line in status if line.startswith("VmHWM:")) * 1024 / 1e6

    def end(self):
        self.process.terminate()
        self.process.wait()


def make_stack(lamp, folder):
    for line in (
        "sample blade -o blade.stl --facets 750k",
        "slice blade.stl --dpi 1500 --thickness 100um -q -o blade.tif",
        "tile blade.tif --machine beta --fit --layers 0..1000 -q -o build.tif",
    ):
        subprocess.run([lamp, *line.split()], cwd=folder, check=True)


def browser():
    options = Options()
    options.binary_location = shutil.which("chromium")
    for word in ("headless=new", "no-sandbox", "window-size=1600,1000", "force-prefers-reduced-motion"):
        options.add_argument(f"--{word}")
    driver = webdriver.Chrome(options, Service(shutil.which("chromedriver")))
    driver.set_script_timeout(120)
    driver.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": WATCH})
    return driver


def drop_caches():
    subprocess.run(["sync"], check=True)
    try:
        Path("/proc/sys/vm/drop_caches").write_text("3")
        return True
    except OSError:
        return False


def settled(driver, act):
    return driver.execute_async_script(f"settled(() => {act}).then(arguments[0])")


def told(name, times):
    times = sorted(times)
    slowest = times[int(0.9 * (len(times) - 1))]
    print(f"{name:28} median {statistics.median(times):7.0f} ms, 9 in 10 within {slowest:7.0f} ms", flush=True)


def first_picture(driver, lamp, stack):
    """Starts the viewer; returns the milliseconds and its CPU seconds to the first picture."""
    driver.get("about:blank")
    server = Server(lamp, stack)
    driver.get(server.address)
    while (shown := driver.execute_script("return globalThis.firstPicture")) is None:
        time.sleep(0.005)
    cpu = server.cpu()
    server.end()
    return shown - 1000 * server.begin, cpu


def first_pictures(driver, lamp, stack):
    """Times the first picture from a cold start; returns the CPU seconds that it takes."""
    times, cold = [], True
    for _ in range(STARTS):
        cold &= drop_caches()
        times.append(first_picture(driver, lamp, stack)[0])
    told("first picture" + (", cold" if cold else ", warm: no right to drop caches"), times)
    # A page that does not tell which layer it has come to has none decoded ahead.
    driver.execute_cdp_cmd("Network.enable", {})
    driver.execute_cdp_cmd("Network.setBlockedURLs", {"urls": ["*/api/stacks/0/layers/0"]})
    cpu = [first_picture(driver, lamp, stack)[1] for _ in range(STARTS)]
    driver.execute_cdp_cmd("Network.setBlockedURLs", {"urls": []})
    return statistics.median(cpu)


def steps(driver):
    settled(driver, 'goTo("#stack=0&layer=300")')
    told("next layer, at once", [settled(driver, 'press("ArrowUp")') for _ in range(STEPS)])
    times = []
    for _ in range(STEPS):
        # The next one is fetched ahead meanwhile.
        time.sleep(PAUSE)
        times.append(settled(driver, 'press("ArrowUp")'))
    told(f"next layer, after {PAUSE} s", times)


def jumps(driver, chance):
    layers = [chance.randrange(1000) for _ in range(JUMPS)]
    told("any layer", [settled(driver, f'goTo("#stack=0&layer={layer}")') for layer in layers])


def moves(driver, chance):
    pans, zooms = [], []
    for place in range(PLACES):
        x, y = (chance.randrange(4_000, 30_000) for _ in "xy")
        zoom = (1 / 16, 1 / 8, 1 / 4, 1 / 2, 1, 4)[place % 6]
        settled(driver, f'goTo("#stack=0&layer={place * 80}&at={x},{y}&zoom={zoom}")')
        pans += [settled(driver, f'press("{key}")') for key in ("ArrowRight", "ArrowRight", "ArrowLeft")]
        pans += [settled(driver, f'press("{key}", true)') for key in ("ArrowDown", "ArrowDown")]
        zooms += [settled(driver, f'press("{key}")') for key in ("+", "+", "-", "-", "-", "-")]
    told("pan", pans)
    told("zoom", zooms)


def browse(driver, server, chance):
    """Browses at random, at random places, and tells the most memory."""
    for number in range(BROWSED):
        at = ""
        if number % 4 == 0:
            x, y = (chance.randrange(4_000, 30_000) for _ in "xy")
            at = f"&at={x},{y}&zoom={chance.choice((0.1, 0.5, 2))}"
        settled(driver, f'goTo("#stack=0&layer={chance.randrange(1000)}&n={number}{at}")')
    print(f"{BROWSED} layers at random: at most {server.peak_mb():.0f} MB of {MEMORY_MB} MB", flush=True)


def pyramid(stack, folder):
    """Returns the CPU seconds of vips for a pyramid of one layer, and its number of files."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(["vips", "dzsave", "--tile-size", "512", "--overlap", "0", f"{stack}[page=500]", folder / "pyramid"], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    files = sum(1 for path in folder.rglob("pyramid_files/**/*") if path.is_file())
    shutil.rmtree(folder / "pyramid_files")
    (folder / "pyramid.dzi").unlink()
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, files


def main():
    lamp = Path(sys.argv[1] if len(sys.argv) > 1 else "target/release/lamp").resolve()
    with tempfile.TemporaryDirectory() as new:
        folder = Path(sys.argv[2] if len(sys.argv) > 2 else new)
        stack = folder / "build.tif"
        if not stack.exists():
            make_stack(lamp, folder)
        chance, driver = random.Random(22), browser()
        try:
            cpu = first_pictures(driver, lamp, stack)
            server = Server(lamp, stack)
            driver.get(server.address)
            settled(driver, "{}")
            steps(driver)
            jumps(driver, chance)
            moves(driver, chance)
            browse(driver, server, chance)
            server.end()
        finally:
            driver.quit()
        vips, files = pyramid(stack, folder)
        print(f"CPU of one layer: {cpu:.2f} s from file to first picture; vips dzsave {vips:.2f} s", end="")
        print(f" and {files} files: {vips / cpu:.0f} times as much")


main()
