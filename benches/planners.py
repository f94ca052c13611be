#!/usr/bin/env python3
"""Times plans of gray levels beside general solvers of linear programs, on the same problems.

Needs numpy, scipy, highspy and ortools of PyPI, and half an hour:

    python3 benches/planners.py [LIMIT]        seconds for each solver and tolerance, default 300

Every solver has one thread, and its time is CPU time without building the program. A plan counts
when its cost is within 0.1 % of the unplanned error of the best bound known; solvers that end at
a tolerance get a few, and the loosest that counts is theirs. Programs are written in the sparsest
form: light spread along rows, then along columns, then down by the layers' recursion.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from multiprocessing import Process, SimpleQueue
from pathlib import Path

os.environ |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1"}

import numpy as np
import scipy.sparse as sp

GAP = 1e-3
REPEATS = 20
FAINTEST = 1e-6
TOLERANCES = (3e-2, 2e-2, 1e-2, 3e-3, 2e-3, 1e-3)


class Problem:
    """A part's voxels from the light, and how doses follow from light."""

    def __init__(self, folder, line):
        name, *numbers = line.split(";")
        layers, rows, columns = map(int, numbers[:3])
        sigma, fade, critical = map(float, numbers[3:6])
        self.name, self.results = name, [float(number) for number in numbers[6:]]
        self.shape, self.passed = (layers, rows, columns), 10**-fade
        wanted = np.frombuffer(Path(folder, name).read_bytes(), np.uint8)
        self.wanted = wanted.reshape(self.shape) == 1

        def spread(side):
            apart = np.subtract.outer(np.arange(side), np.arange(side))
            weights = np.exp(-(apart**2) / (2 * sigma**2))
            return np.where(weights < FAINTEST, 0, weights)

        self.along, self.down = spread(columns), spread(rows) / critical

    def cost(self, light):
        doses = self.down @ light @ self.along
        for layer in range(1, len(doses)):
            doses[layer] += self.passed * doses[layer - 1]
        return np.maximum(np.where(self.wanted, 1 - doses, doses - 1), 0).sum()

    def program(self):
        """Returns A, the bounds of rows and columns, and the costs: light of the part's pixels,
        light spread along rows, doses and errors are the columns."""
        layers, rows, columns = self.shape
        voxels, wanted = self.wanted.size, self.wanted.ravel()
        pixels = np.flatnonzero(wanted)
        place = sp.csr_matrix((np.ones(pixels.size), (pixels, np.arange(pixels.size))),
                              (voxels, pixels.size))
        one = sp.identity
        along = sp.kron(one(layers * rows), sp.csr_matrix(self.along)) @ place
        down = sp.kron(one(layers), sp.kron(sp.csr_matrix(self.down), one(columns)))
        above = sp.diags([1.0], [-1], shape=(layers, layers))
        own = one(voxels) - self.passed * sp.kron(above, one(rows * columns))
        side = np.where(wanted, 1.0, -1.0)
        matrix = sp.bmat([
            [-along, one(voxels), None, None],
            [None, -down, own, None],
            [None, None, sp.diags(side), one(voxels)],
        ]).tocsc()
        nothing, endless = np.zeros(2 * voxels), np.full(voxels, np.inf)
        bounds = np.r_[nothing, side], np.r_[nothing, endless]
        least = np.zeros(matrix.shape[1])
        most = np.r_[np.ones(pixels.size), np.full(3 * voxels, np.inf)]
        costs = np.r_[np.zeros(pixels.size + 2 * voxels), np.ones(voxels)]
        return matrix, bounds, (least, most), costs

    def cost_of_solution(self, solution):
        light = np.zeros(self.shape)
        if len(solution):
            light[self.wanted] = np.clip(solution[: self.wanted.sum()], 0, 1)
        return self.cost(light)


def highs(method):
    def solve(program, unplanned, tolerance, limit):
        import highspy

        matrix, rows, columns, costs = program
        solver, model = highspy.Highs(), highspy.HighsLp()
        model.num_row_, model.num_col_ = matrix.shape
        model.col_cost_, (model.col_lower_, model.col_upper_) = costs, columns
        model.row_lower_, model.row_upper_ = rows
        model.a_matrix_.format_ = highspy.MatrixFormat.kColwise
        model.a_matrix_.start_, model.a_matrix_.index_ = matrix.indptr, matrix.indices
        model.a_matrix_.value_ = matrix.data
        options = {"output_flag": False, "solver": method, "threads": 1, "time_limit": limit,
                   "run_crossover": "off", "primal_feasibility_tolerance": tolerance,
                   "dual_feasibility_tolerance": tolerance, "pdlp_optimality_tolerance": tolerance,
                   "ipm_optimality_tolerance": tolerance}
        for option, value in options.items():
            solver.setOptionValue(option, value)
        solver.passModel(model)
        start = time.process_time()
        solver.run()
        return time.process_time() - start, solver.getSolution().col_value

    return solve


def or_tools(program, unplanned, tolerance, limit):
    from ortools.pdlp import solvers_pb2
    from ortools.pdlp.python import pdlp

    matrix, rows, columns, costs = program
    model = pdlp.QuadraticProgram()
    model.constraint_matrix, model.objective_vector = matrix, costs
    model.constraint_lower_bounds, model.constraint_upper_bounds = rows
    model.variable_lower_bounds, model.variable_upper_bounds = columns
    options = solvers_pb2.PrimalDualHybridGradientParams(num_threads=1)
    ends = options.termination_criteria
    ends.time_sec_limit, ends.optimality_norm = limit, solvers_pb2.OPTIMALITY_NORM_L_INF
    to = ends.detailed_optimality_criteria
    to.eps_optimal_primal_residual_absolute = to.eps_optimal_dual_residual_absolute = tolerance
    to.eps_optimal_primal_residual_relative = to.eps_optimal_dual_residual_relative = 0
    to.eps_optimal_objective_gap_absolute, to.eps_optimal_objective_gap_relative = GAP * unplanned, 0
    start = time.process_time()
    result = pdlp.primal_dual_hybrid_gradient(model, options)
    return time.process_time() - start, result.primal_solution


PEERS = {
    "OR-tools PDLP": (or_tools, TOLERANCES),
    "HiGHS PDLP": (highs("pdlp"), TOLERANCES),
    "HiGHS interior point": (highs("ipm"), (1e-2,)),
    "HiGHS simplex": (highs("simplex"), (1e-2,)),
}


def apart(solve, *arguments):
    """Runs a solver in a process of its own: what it leaves behind is gone."""
    queue = SimpleQueue()
    process = Process(target=lambda: queue.put(solve(*arguments)))
    process.start()
    result = queue.get()
    process.join()
    return result


def plan(folder, number, repeats):
    """Plans a problem so often with this project; returns its line, and CPU seconds."""
    command = ["target/release/examples/planners", folder, str(number), str(repeats)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    line = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return line, sum(getattr(after, of) - getattr(before, of) for of in ("ru_utime", "ru_stime"))


def compare(folder, number, limit):
    line, _ = plan(folder, number, 1)
    problem = Problem(folder, line)
    unplanned, (cost, bound) = problem.cost(problem.wanted * 1.0), problem.results
    seconds = (plan(folder, number, REPEATS)[1] - plan(folder, number, 0)[1]) / REPEATS
    print(f"\n{problem.name}: {problem.wanted.size} voxels, unplanned {unplanned:.1f}\n")
    print("| solver | CPU | above the bound | CPU / ours |\n|---|---|---|---|")

    def row(name, seconds, cost, of_ours):
        above = (cost - bound) / unplanned
        print(f"| {name} | {seconds:.3g} s | {above:.3%} | {of_ours} |", flush=True)
        return above <= GAP

    row("ours", seconds, cost, "1")
    program = problem.program()
    for name, (solve, tolerances) in PEERS.items():
        for tolerance in tolerances:
            taken, solution = apart(solve, program, unplanned, tolerance, limit)
            cost = problem.cost_of_solution(np.asarray(solution))
            if row(f"{name}, {tolerance:g}", taken, cost, f"{taken / seconds:.0f}"):
                break


def main():
    limit = float(sys.argv[1]) if len(sys.argv) > 1 else 300.0
    os.chdir(Path(__file__).parent.parent)
    build = "cargo build --release --quiet -p lamp-benches --example planners"
    subprocess.run(build.split(), check=True)
    with tempfile.TemporaryDirectory() as folder:
        for number in range(2):
            compare(folder, number, limit)


if __name__ == "__main__":
    main()
