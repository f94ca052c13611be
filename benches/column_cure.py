#!/usr/bin/env python3
"""Times column cure (000) beside general solvers, on the same matrix, in one run.

    python3 benches/column_cure.py [CONE_UM]        half the blur of a mirror's image, default 5

Installs scipy and clarabel of PyPI into an environment of its own, builds this project, and gives
each solver one thread and a process. Every plan of 512 x 512 mirrors must be proved to be within
1e-4 of the least error by the Frank-Wolfe gap, which is computed here from the times and scipy's
matrix. CPU time of ours is the whole process, of the peers only the solver. Peak memory is always
that of the whole process. At last ours plans 1024 x 768 mirrors on two threads.
"""

import os
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path

GAP, LONGEST = 1e-4, 300.0
MIRRORS = 512
PEERS = "scipy==1.17.1", "clarabel==0.11.1"
ROOT = Path(__file__).parent.parent
OURS = "target/release/examples/column_cure"


def load(folder):
    """Returns the matrix (column voxels by mirrors) and the doses wanted."""
    import numpy as np
    import scipy.sparse as sp

    starts, voxels, weights, wanted = (
        np.fromfile(Path(folder, name)) for name in ("starts", "voxels", "weights", "wanted"))
    shape = wanted.size, starts.size - 1
    parts = weights, voxels.astype(np.int32), starts.astype(np.int32)
    return sp.csc_matrix(parts, shape).tocsr(), wanted


def error_and_gap(light, wanted, times):
    """Returns the error, its slopes, and how much smaller any plan's error can be."""
    import numpy as np

    missing = light @ times - wanted
    slopes = light.T @ missing
    gap = slopes @ times + LONGEST * np.maximum(-slopes, 0).sum()
    return missing @ missing / 2, slopes, gap


def lbfgsb(light, wanted):
    import numpy as np
    from scipy.optimize import minimize

    last = [np.inf, np.inf]

    def value(times):
        error, slopes, last[1] = error_and_gap(light, wanted, times)
        last[0] = error
        return error, slopes

    def is_done(_):
        if last[1] <= GAP * last[0]:
            raise StopIteration

    nothing = np.zeros(light.shape[1])
    options = {"maxiter": 100_000, "maxfun": 100_000, "ftol": 0, "gtol": 0}
    bounds = [(0, LONGEST)] * nothing.size
    return minimize(value, nothing, jac=True, method="L-BFGS-B", bounds=bounds, callback=is_done,
                    options=options).x


def clarabel(light, wanted):
    """Half the squares of what is missing, as variables of their own: the normal matrix is denser."""
    import clarabel
    import numpy as np
    import scipy.sparse as sp

    voxels, mirrors = light.shape
    squares = sp.block_diag((sp.csc_matrix((mirrors, mirrors)), sp.eye(voxels)), format="csc")
    rows = sp.bmat([[light, -sp.eye(voxels)], [-sp.eye(mirrors), None], [sp.eye(mirrors), None]],
                   format="csc")
    right = np.r_[wanted, np.zeros(mirrors), np.full(mirrors, LONGEST)]
    cones = [clarabel.ZeroConeT(voxels), clarabel.NonnegativeConeT(2 * mirrors)]
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_threads = False, 1
    settings.tol_gap_rel, settings.tol_gap_abs = GAP / 10, GAP / 10
    solver = clarabel.DefaultSolver(squares, np.zeros(mirrors + voxels), rows, right, cones, settings)
    return np.clip(solver.solve().x[:mirrors], 0, LONGEST)


def peer(name, folder):
    """Runs in a process of its own; prints CPU seconds, the error and the gap's share."""
    light, wanted = load(folder)
    if name == "ours":
        import numpy as np

        times, taken = np.fromfile(Path(folder, "times")), 0.0
    else:
        start = time.process_time()
        times = globals()[name](light, wanted)
        taken = time.process_time() - start
    error, _, gap = error_and_gap(light, wanted, times)
    print(taken, error, gap / error)


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


def compare(folder, cone):
    python = python_with_peers(Path(folder, "peers"))
    size = str(MIRRORS), str(MIRRORS), cone
    run(OURS, "matrix", folder, *size)
    _, own_cpu, _, own_memory = run(OURS, "plan", folder, *size)
    print(f"{MIRRORS} x {MIRRORS} mirrors, blur of {cone} um\n")
    print("| solver | CPU | CPU / ours | peak memory | memory / ours | error | gap / error |")
    print("|---|---|---|---|---|---|---|")
    for name in "ours", "lbfgsb", "clarabel":
        output, _, _, memory = run(python, __file__, "--peer", name, folder)
        cpu, error, gap = map(float, output.split())
        if name == "ours":
            cpu, memory = own_cpu, own_memory
        print(f"| {name} | {cpu:.2f} s | {cpu / own_cpu:.1f} | {memory:.0f} MB "
              f"| {memory / own_memory:.1f} | {error:.4f} | {gap:.1e} |", flush=True)
    _, cpu, wall, memory = run(OURS, "plan", folder, "1024", "768", cone, threads=2)
    print(f"\n1024 x 768 mirrors on two threads: {wall:.2f} s, {cpu:.2f} s of CPU, {memory:.0f} MB")


def main():
    if sys.argv[1:2] == ["--peer"]:
        return peer(*sys.argv[2:])
    os.chdir(ROOT)
    build = "cargo build --release --quiet -p lamp-benches --example column_cure"
    subprocess.run(build.split(), check=True)
    with tempfile.TemporaryDirectory() as folder:
        compare(folder, sys.argv[1] if len(sys.argv) > 1 else "5")


if __name__ == "__main__":
    main()
