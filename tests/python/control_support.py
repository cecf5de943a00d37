"""What the tests of controllers in Python share."""

import itertools

import numpy as np
import solenoid

TIMED = ("solve_us", "deadline_misses")


def untimed(run):
    return {key: value for key, value in run.items() if not key.startswith(TIMED)}


def numbers(run):
    """What two variants of one behaviour have in common."""
    return {key: value for key, value in untimed(run).items() if key != "variant"}


def flight(name="flight", duration_s=1.0, **keys):
    return solenoid.scenario(name,
                             system="thrusters",
                             trajectory={"x": {
                                 "kind": "step",
                                 "height_m": 0.1
                             }},
                             noise=True,
                             duration_s=duration_s,
                             **keys)


class Lines:
    """Fires against the error of x where it is beyond a switching line."""
    DEAD_M = 0.01

    def step(self, measurement):
        s = measurement.reference[0] - measurement.estimate[0] + 2.0 * (measurement.reference_rate[0] -
                                                                        measurement.estimate[3])
        if abs(s) < self.DEAD_M:
            return "coast"
        return "+x" if s > 0 else "-x"


def lines(name="lines", make=Lines, **keys):
    return solenoid.PythonController(name, make, system="thrusters", thrusters="pairs", **keys)


def exactly(name, step, **keys):
    """A law of one function."""
    return lines(name, type("Exactly", (), {"step": lambda self, measurement: step(measurement)}), **keys)


class Exhaustive:
    """Every sequence of modes."""

    def solve(self, problem):
        plans = np.array(list(itertools.product(range(len(problem.modes)), repeat=len(problem.blocks))))
        return plans[np.argmin(problem.cost(plans))]


SHORT = {"system": "thrusters", "thrusters": "single", "horizon": {"steps": 40, "blocks": [2, 2]}}
