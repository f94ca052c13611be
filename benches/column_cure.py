#!/usr/bin/env python3
"""Times column cure (000) beside general solvers, on the same matrix, in one run.

    python3 benches/column_cure.py [SHAPE BLUR]...        zhao's blur in um, others' in mirrors

Installs scipy and clarabel of PyPI into an environment of its own, builds this project, and gives
each solver one thread and a process. Every plan of 512 x 512 mirrors must be proved to be near the
least sum of error and term for even times: within 1e-4 for zhao, who has no such term, and 1e-3 for
others. The gap is computed here from the times and scipy's matrices, one for each axis. L-BFGS-B
multiplies by these; Clarabel gets their product, where it is small enough. CPU time of ours is the
whole process, of the peers only the solver. Peak memory is always that of the whole process. At last
ours plans zhao's 1024 x 768 mirrors on two threads. LAMP_COLUMN_CURE names another program of ours.
"""

import os
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

MIRRORS = 512
CASES = [("zhao", "5"), ("zhao", "12")] + [("lenses", blur) for blur in ("0.3", "1.5", "4", "5")] + [
    (shape, blur) for shape in ("cone", "asphere", "waves", "rings", "channels")
    for blur in ("0.3", "1.5", "4")]
# With more numbers, Clarabel takes longer than five minutes.
MOST_NUMBERS = 7_000_000
PEERS = "scipy==1.17.1", "clarabel==0.11.1"
ROOT = Path(__file__).parent.parent
OURS = os.environ.get("LAMP_COLUMN_CURE", "target/release/examples/column_cure")


class Problem:
    """The light of mirrors as a matrix for each axis, the doses wanted, and the times allowed."""

    def __init__(self, folder):
        import numpy as np
        import scipy.sparse as sp

        def read(name):
            return np.fromfile(Path(folder, name))

        self.longest, self.evenness, self.gap = read("allowed")
        along, down = (read(name).reshape(MIRRORS, -1) for name in ("along", "down"))
        # Products of both factors below a mirror's least share are rounding.
        self.along, self.down = (
            sp.csr_matrix(np.where(light > 1e-12 * light.max(), light, 0)) for light in (along, down))
        self.back = self.along.T.tocsr(), self.down.T.tocsr()
        self.wanted = read("wanted").reshape(self.down.shape[1], self.along.shape[1])

    def light(self, times):
        """Returns the doses of the times."""
        return (self.back[0] @ (self.back[1] @ times.reshape(MIRRORS, MIRRORS)).T).T

    def sum_and_gap(self, times):
        """Returns the error with the term for even times, its slopes, and how much smaller any
        plan's sum can be: the sum is convex, by the term's curvature at least."""
        import numpy as np

        missing = self.light(times) - self.wanted
        slopes = (self.along @ (self.down @ missing).T).T.ravel() + self.evenness * times
        if self.evenness > 0:
            way = np.clip(times - slopes / self.evenness, 0, self.longest) - times
        else:
            way = np.where(slopes > 0, 0, self.longest) - times
        gap = -(slopes @ way) - self.evenness / 2 * (way @ way)
        return (missing**2).sum() / 2 + self.evenness / 2 * (times @ times), slopes, gap


def lbfgsb(problem):
    import numpy as np
    from scipy.optimize import minimize

    last = [np.inf, np.inf]

    def value(times):
        last[0], slopes, last[1] = problem.sum_and_gap(times)
        return last[0], slopes

    def is_done(_):
        if last[1] <= problem.gap * last[0]:
            raise StopIteration

    nothing = np.zeros(MIRRORS**2)
    options = {"maxiter": 100_000, "maxfun": 100_000, "ftol": 0, "gtol": 0}
    bounds = [(0, problem.longest)] * nothing.size
    return minimize(value, nothing, jac=True, method="L-BFGS-B", bounds=bounds, callback=is_done,
                    options=options).x


def clarabel(problem):
    """Half the squares of what is missing, as variables of their own: the normal matrix is denser."""
    import clarabel
    import numpy as np
    import scipy.sparse as sp

    if problem.along.nnz * problem.down.nnz > MOST_NUMBERS:
        return None
    light = sp.kron(problem.back[1], problem.back[0], format="csc")
    voxels, mirrors = light.shape
    squares = sp.block_diag((problem.evenness * sp.eye(mirrors), sp.eye(voxels)), format="csc")
    rows = sp.bmat([[light, -sp.eye(voxels)], [-sp.eye(mirrors), None], [sp.eye(mirrors), None]],
                   format="csc")
    right = np.r_[problem.wanted.ravel(), np.zeros(mirrors), np.full(mirrors, problem.longest)]
    cones = [clarabel.ZeroConeT(voxels), clarabel.NonnegativeConeT(2 * mirrors)]
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_threads = False, 1
    settings.tol_gap_rel, settings.tol_gap_abs = problem.gap / 10, problem.gap / 10
    solver = clarabel.DefaultSolver(squares, np.zeros(mirrors + voxels), rows, right, cones, settings)
    return np.clip(solver.solve().x[:mirrors], 0, problem.longest)


def peer(name, folder):
    """Runs in a process of its own; prints CPU seconds, the sum, the gap's share and the longest
    time's, or nothing where a solver cannot."""
    problem = Problem(folder)
    if name == "ours":
        import numpy as np

        times, taken = np.fromfile(Path(folder, "times")), 0.0
    else:
        start = time.process_time()
        times = globals()[name](problem)
        taken = time.process_time() - start
    if times is not None:
        value, _, gap = problem.sum_and_gap(times)
        print(taken, value, gap / value, times.max() / problem.longest)


def run(*command, threads=1):
    """Returns what a command prints, its CPU and wall seconds, and its peak memory in MB."""
    number = str(threads)
    own = {"RAYON_NUM_THREADS": number, "OMP_NUM_THREADS": number, "OPENBLAS_NUM_THREADS": number}
    start = time.monotonic()
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ | own)
    output = process.stdout.read()
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"{' '.join(map(str, command))} failed")
    wall = time.monotonic() - start
    return output, usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 1024


def python_with_peers(folder):
    venv.create(folder, with_pip=True)
    python = str(Path(folder, "bin", "python"))
    subprocess.run([python, "-m", "pip", "install", "--quiet", *PEERS], check=True)
    return python


def compare(python, folder, shape, blur):
    case = str(MIRRORS), str(MIRRORS), shape, blur
    run(OURS, "matrix", folder, *case)
    said, own_cpu, _, own_memory = run(OURS, "plan", folder, *case)
    print(f"\n{shape}, blur of {blur} {'um' if shape == 'zhao' else 'mirrors'}: {said.strip()}\n")
    print("| solver | CPU | CPU / ours | peak memory | memory / ours | sum | gap / sum | longest / bound |")
    print("|---|---|---|---|---|---|---|---|")
    for name in "ours", "lbfgsb", "clarabel":
        output, _, _, memory = run(python, __file__, "--peer", name, folder)
        if not output:
            print(f"| {name} | too large |||||||", flush=True)
            continue
        cpu, value, gap, longest = map(float, output.split())
        if name == "ours":
            cpu, memory = own_cpu, own_memory
        print(f"| {name} | {cpu:.2f} s | {cpu / own_cpu:.1f} | {memory:.0f} MB "
              f"| {memory / own_memory:.1f} | {value:.4f} | {gap:.1e} | {longest:.2f} |", flush=True)


def main():
    if sys.argv[1:2] == ["--peer"]:
        return peer(*sys.argv[2:])
    os.chdir(ROOT)
    if OURS.startswith("target/"):
        build = "cargo build --release --quiet -p lamp-benches --example column_cure"
        subprocess.run(build.split(), check=True)
    words = sys.argv[1:]
    cases = list(zip(words[::2], words[1::2], strict=True)) or CASES
    with tempfile.TemporaryDirectory() as folder:
        python = python_with_peers(Path(folder, "peers"))
        for shape, blur in cases:
            compare(python, folder, shape, blur)
        for blur in (blur for shape, blur in cases if shape == "zhao"):
            large = "plan", folder, "1024", "768", "zhao", blur
            _, cpu, wall, memory = run(OURS, *large, threads=2)
            print(f"\n1024 x 768 mirrors, zhao, blur of {blur} um, on two threads: {wall:.2f} s, "
                  f"{cpu:.2f} s of CPU, {memory:.0f} MB")


if __name__ == "__main__":
    main()
