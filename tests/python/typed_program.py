"""A program with types that uses most of the package: read by mypy, not run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

import solenoid


class Lines:

    def __init__(self, variant: solenoid.Variant, scenario: solenoid.Scenario) -> None:
        self.known: tuple[str, float] = (variant.system, scenario.duration_s)

    def step(self, measurement: solenoid.Measurement) -> tuple[str, NDArray[np.float64]]:
        ahead: NDArray[np.float64] = measurement.reference_at(measurement.time_s + 0.1)
        error: float = ahead[0, 0] - measurement.estimate_x_m
        return ("+x" if error > 0 else "coast"), np.zeros(0)


class First:

    def solve(self, problem: solenoid.PeriodProblem) -> list[int]:
        costs: list[float] = [problem.cost([mode] * len(problem.blocks)) for mode in range(len(problem.modes))]
        return [int(np.argmin(costs))] * len(problem.blocks)


def compared(folder: str) -> NDArray[np.void]:
    task: solenoid.Scenario = solenoid.scenario("flight", system="thrusters", trajectory={}, duration_s=1.0)
    law = solenoid.PythonController("lines", Lines, system="thrusters", thrusters="pairs")
    solver = solenoid.PythonSolver("first", First, system="thrusters")
    found: solenoid.Comparison = solenoid.compare(
        ["flyer_single", law, solver, solenoid.variant("flyer_pairs")],
        task,
        seeds=[1, 2],
        jobs=2,
        baseline="flyer_single",
        out=folder)
    messages: list[str] = [run["message"] for run in found.failed]
    assert not messages and found.folder == folder
    run: solenoid.Run = solenoid.simulate(law, task, seed=3)
    assert run.time_s.shape == run.switches.shape and run.metrics.finite and not law.variant.real_time
    return found.table()
