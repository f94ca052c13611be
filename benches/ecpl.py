#!/usr/bin/env python3
"""Times the kinetics of 003 beside scipy's BDF, on the same cells, in one run.

    python3 benches/ecpl.py             times and ratios
    python3 benches/ecpl.py heights     the heights that planning/tests/rows_of_003.rs has by BDF

Installs numpy and scipy of PyPI into an environment of its own, and builds this project. Each
solver has one thread; its time is CPU time. BDF gets the Jacobian written down, sparse, without
how light fades in initiator that is used up: that is small, so its Newton steps converge, and its
factors stay sparse. It gets a few tolerances, and the loosest with which all heights but the
part's foot are within 0.25 um of those of a tight one is its own. At last ours plans the lenses.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

PEERS = "numpy==2.3.5", "scipy==1.17.1"
ROOT = Path(__file__).parent.parent
OURS = "target/release/examples/ecpl"
REPEATS = 20
TIGHT, TOLERANCES = 1e-4, (1e-1, 3e-2, 1e-2, 1e-3)
NEAR_UM = 0.25
FIGURE_11 = (12, 7.9), (11, 0.8), (10, 1.3), (9, 1.2), (8, 1.8), (7, 1.2), (6, 1.7), (5, 1.8)
PIXEL_UM, SIGMA_UM, LIGHT = 560 / 90, 25.2, 25.7
PROPAGATION, TERMINATION, BY_OXYGEN, DIFFUSIVITY = 1.66, 1.31, 125.0, 1e-10
INITIATOR, OXYGEN, ABSORPTIVITY, CONVERSION = 859.0, 1.05, 15.0, 0.2
SPLITTING = 2.3 * 0.6 * ABSORPTIVITY * 365e-9 / (6.02214076e23 * 6.62607015e-34 * 2.99792458e8)


class Chamber:
    """Cells (r, z) of 003's chamber; a vector has initiator, radicals, oxygen and the integral of
    radicals, column by column."""

    def __init__(self, across, deep, width_um=4.0, height_um=1.0):
        import numpy as np
        import scipy.sparse as sp

        self.shape, self.height_um = (across, deep), height_um
        self.middle_um = (np.arange(across) + 0.5) * width_um
        inner, outer = (np.arange(across + 1)[k:k + across] / (np.arange(across) + 0.5) for k in (0, 1))
        outer[-1] = 0
        radial = sp.diags([inner[1:], -(inner + outer), outer[:-1]], [-1, 0, 1], (across, across))
        ones, middle = np.ones(deep - 1), -2 * np.ones(deep)
        middle[[0, -1]] = -1
        axial = sp.diags([ones, middle, ones], [-1, 0, 1], (deep, deep))
        self.spread = DIFFUSIVITY * (sp.kron(radial / (width_um * 1e-6) ** 2, sp.eye(deep))
                                     + sp.kron(sp.eye(across), axial / (height_um * 1e-6) ** 2)).tocsr()

    def light(self, pixels):
        """Returns the light of a blurred disc at each column, or of a wide field."""
        import numpy as np
        from scipy.special import i0e

        if pixels is None:
            return np.full(self.shape[0], LIGHT)
        x, weights = np.polynomial.legendre.leggauss(400)
        radius, variance = pixels * PIXEL_UM, SIGMA_UM**2
        at, of = np.meshgrid(self.middle_um, radius * (x + 1) / 2, indexing="ij")
        ring = np.exp(-((at - of) ** 2) / (2 * variance)) * i0e(at * of / variance) * of / variance
        return LIGHT * ring @ (weights * radius / 2)

    def splitting(self, initiator):
        import numpy as np

        initiator = initiator.reshape(self.shape)
        above = (np.cumsum(initiator, 1) - initiator / 2) * self.height_um * 1e-6
        return (SPLITTING * self.now[:, None] * np.exp(-2.3 * ABSORPTIVITY * above)).ravel()

    def rates(self, _, state):
        import numpy as np

        initiator, radicals, oxygen, _ = state.reshape(4, -1)
        split = self.splitting(initiator) * initiator
        stopped = BY_OXYGEN * radicals * oxygen
        return np.concatenate([-split, 2 * split - 2 * TERMINATION * radicals**2 - stopped,
                               self.spread @ oxygen - stopped, radicals])

    def jacobian(self, _, state):
        import scipy.sparse as sp

        initiator, radicals, oxygen, _ = state.reshape(4, -1)
        split = self.splitting(initiator)
        of_radicals, of_oxygen = BY_OXYGEN * oxygen, BY_OXYGEN * radicals
        one, none = sp.eye(oxygen.size), sp.csr_matrix((oxygen.size, oxygen.size))
        return sp.bmat([
            [sp.diags(-split), None, None, None],
            [sp.diags(2 * split), sp.diags(-4 * TERMINATION * radicals - of_radicals),
             sp.diags(-of_oxygen), None],
            [None, sp.diags(-of_radicals), self.spread - sp.diags(of_oxygen), None],
            [None, one, None, none],
        ]).tocsc()

    def heights(self, plan, tolerance):
        """Returns the heights after each exposure, and CPU seconds."""
        import numpy as np
        from scipy.integrate import BDF

        fresh = INITIATOR, 0.0, OXYGEN, 0.0
        state = np.repeat(fresh, np.prod(self.shape))
        start, heights = time.process_time(), []
        for pixels, seconds in plan:
            self.now = self.light(pixels)
            solver = BDF(self.rates, 0, state, seconds, rtol=tolerance, atol=tolerance / 100,
                         jac=self.jacobian)
            while solver.status == "running":
                solver.step()
            state = solver.y
            heights.append(self.heights_of(state.reshape(4, *self.shape)[3]))
        return heights, time.process_time() - start

    def heights_of(self, growth):
        import numpy as np

        beyond = 1 - np.exp(-PROPAGATION * growth) - CONVERSION
        heights = []
        for column in beyond:
            liquid = np.flatnonzero(column < 0)
            at = liquid[0] if liquid.size else column.size
            share = column[at - 1] / (column[at - 1] - column[at]) if 0 < at < column.size else 0.5
            heights.append((at - 0.5 + share) * self.height_um if at else 0.0)
        return np.array(heights)


WIDE_FIELD = (None, 5.0), (None, 5.0), (None, 7.7)
CASES = {"wide field": ((1, 200), WIDE_FIELD), "figure 11": ((67, 200), FIGURE_11)}


def print_heights():
    for name, tolerance in ("wide field", 1e-6), ("figure 11", 1e-4):
        cells, plan = CASES[name]
        heights, _ = Chamber(*cells).heights(plan, tolerance)
        heights = [after[0] for after in heights] if cells[0] == 1 else heights[-1]
        print(f"{name}:", ", ".join(f"{height:.3f}" for height in heights if height > 0))


def ours(*arguments):
    """Runs this project on one thread; returns the numbers that it prints, and CPU seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    line = subprocess.run([OURS, *arguments], check=True, capture_output=True, text=True,
                          env=os.environ | {"RAYON_NUM_THREADS": "1"}).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    taken = sum(getattr(after, of) - getattr(before, of) for of in ("ru_utime", "ru_stime"))
    return list(map(float, line.split())), taken


def compare():
    import numpy as np

    print("| solver | CPU | CPU / ours | largest difference to BDF of 1e-4 |\n|---|---|---|---|")
    for name, (cells, plan) in CASES.items():
        # The foot falls by more than ten micrometres from column to column.
        seen = slice(None) if cells[0] == 1 else slice(0, -1)
        tight = Chamber(*cells).heights(plan, TIGHT)[0][-1]
        tight = tight[tight > 0][seen]

        def row(solver, heights, taken, of_ours):
            apart = np.abs(heights[:tight.size] - tight).max()
            print(f"| {name}: {solver} | {taken:.3g} s | {of_ours} | {apart:.2f} um |", flush=True)
            return apart <= NEAR_UM

        repeats = REPEATS * 50 if cells[0] == 1 else REPEATS
        heights, many = ours(name, str(repeats))
        own = (many - ours(name, "1")[1]) / (repeats - 1)
        row("ours", np.array(heights), own, "1")
        for tolerance in TOLERANCES:
            heights, taken = Chamber(*cells).heights(plan, tolerance)
            if row(f"BDF, {tolerance:g}", heights[-1], taken, f"{taken / own:.0f}"):
                break
    for lens in "hemisphere", "lens":
        (rms, wall), taken = ours("plan", lens)
        print(f"\n{lens}: planned in {wall:.1f} s, {taken:.1f} s of CPU, RMS {rms:.2f} um")


def with_peers():
    """Runs this script again where its peers are installed."""
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        python = str(Path(folder, "bin", "python"))
        subprocess.run([python, "-m", "pip", "install", "--quiet", *PEERS], check=True)
        one = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
        command = [python, __file__, "--peers", *sys.argv[1:]]
        return subprocess.run(command, env=os.environ | one).returncode


def main():
    os.chdir(ROOT)
    if sys.argv[1:2] != ["--peers"]:
        sys.exit(with_peers())
    if sys.argv[2:] == ["heights"]:
        return print_heights()
    build = "cargo build --release --quiet -p lamp-benches --example ecpl"
    subprocess.run(build.split(), check=True)
    compare()


if __name__ == "__main__":
    main()
