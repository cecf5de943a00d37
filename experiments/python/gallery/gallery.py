"""Switched systems of others as solenoid.Model, and their optima over a whole horizon: relaxed and integer.

    python3 experiments/python/gallery/gallery.py                      # a table of all
    python3 experiments/python/gallery/gallery.py fishing three_tanks  # of these

What others found stands in docs/results/gallery.md, with its sources.
"""

from __future__ import annotations

import argparse
import importlib
import json
import time
from dataclasses import asdict, dataclass

import numpy as np
import solenoid

SYSTEMS = ("fishing", "double_tank", "van_der_pol", "three_tanks", "buck_boost")


@dataclass
class Optimum:
    """Both values are of plans that were found, integrated anew; `error` is what the integration leaves open."""

    system: str
    relaxed: float
    integer: float
    switches: int  # changes of a switch in the integer plan
    error: float
    build_s: float
    solve_s: float


def optimum(name, **keys):
    """Relaxes the task's problem; sums its weights up to one mode an interval, and has a solver go on from there. Keys
    are a variant's."""
    task = importlib.import_module(name).task()
    begin = time.monotonic()
    task.model.relaxed = [solver for solver in ("sqp", "ipopt") if solver == task.relaxed_solver]
    system = task.model.build()
    built = time.monotonic()
    problem = posed(task, system, task.relaxed_solver, **task.relaxed_keys, **keys)
    found = checked(problem.solve())
    relaxed, error, _ = task.value(problem, found.weights)
    if task.cyclic:
        integer, switches, other_error = cycle(task, system, **keys)
    else:
        problem = posed(task, system, task.integer_solver, **keys)
        start = problem.plan(summed_up(found.weights[::task.model.ticks_per_period]))
        integer, switches, other_error = min(judged(task, problem, plan)[:3] for plan in (start, problem.solve(start)))
    return Optimum(name, relaxed, integer, switches, max(error, other_error), built - begin, time.monotonic() - built)


def posed(task, system, solver, **keys):
    """The task as the problem of a variant, at the model's start."""
    horizon = {"steps": task.intervals * task.model.ticks_per_period, "blocks": [1] * task.intervals}
    variant = solenoid.variant(f"{system.name}_{solver}", system=system.name, solver=solver, horizon=horizon, **keys)
    problem = solenoid.Problem(variant)
    problem.initial = task.start
    problem.reference = task.target
    return problem


def summed_up(weights):
    """In each interval the mode that is owed most time."""
    owed, modes = np.zeros(weights.shape[1]), []
    for row in weights:
        owed += row
        modes.append(int(np.argmax(owed)))
        owed[modes[-1]] -= 1
    return modes


def cycle(task, system, tolerance=1e-10, **keys):
    """The best plan from where the best plan ends, until that is where it begins."""
    problem = posed(task, system, task.integer_solver, **keys)
    for _ in range(200):
        plan = problem.solve()
        *value, end = judged(task, problem, plan)
        if np.max(np.abs(problem.initial - end)) < tolerance:
            return tuple(value)
        problem.initial = end
    raise RuntimeError(f"{task.model.name}: no cycle")


def judged(task, problem, plan):
    """What an integer plan is worth, its switch changes, how much that may be off, and where it ends."""
    value, error, end = task.value(problem, np.eye(len(problem.modes))[checked(plan).modes])
    return value, plan.switches, error, end


def checked(plan):
    if plan.status in ("infeasible", "numerical_failure"):
        raise RuntimeError(f"no plan: {plan.status}")
    return plan


def table(optima):
    """Lines, the first one of headings."""
    yield f"{'system':<12} {'relaxed':>10} {'integer':>10} {'switches':>8} {'error':>8} {'build s':>8} {'solve s':>8}"
    for o in optima:
        yield (f"{o.system:<12} {o.relaxed:10.7f} {o.integer:10.7f} {o.switches:8d} {o.error:8.0e} {o.build_s:8.1f} "
               f"{o.solve_s:8.1f}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("systems", nargs="*", metavar="SYSTEM", help=f"of {', '.join(SYSTEMS)}; none: all")
    parser.add_argument("--modes", help="another mode set of the model than its first")
    parser.add_argument("--format", choices=("text", "json"), default="text")
    said = parser.parse_args()
    for name in said.systems:
        if name not in SYSTEMS:
            parser.error(f"no system '{name}' (allowed: {', '.join(SYSTEMS)})")
    keys = {"modes": said.modes} if said.modes else {}
    optima = (optimum(name, **keys) for name in said.systems or SYSTEMS)
    if said.format == "json":
        print(json.dumps([asdict(o) for o in optima], indent=2))
    else:
        for line in table(optima):
            print(line, flush=True)


if __name__ == "__main__":
    main()
