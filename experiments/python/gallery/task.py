"""A switched system and what is to be minimised over a whole horizon, judged by integrating the same model finely."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import sympy as sp


@dataclass
class Task:
    """Minimise the integral of `objective`, an expression in the states of `model`, over `intervals` control periods.

    `target` is what the model's outputs track; its weights make of that the objective. `quadrature` "trapezium" takes
    the integrand at the ends of the intervals only, as some published values do. Both values are divided by `per`.
    """

    model: object  # solenoid.Model
    objective: sp.Expr
    target: tuple
    intervals: int
    quadrature: str = "integral"
    relaxed_solver: str = "ipopt"
    relaxed_keys: dict = field(default_factory=dict)  # of its variant
    integer_solver: str = "cia"
    cyclic: bool = False  # whether the integer plan begins where it ends; else both begin at the model's start
    per: float = 1.0
    step_s: float = 0.005  # of the judge, at most
    _rates: object = field(default=None, init=False, repr=False)

    @property
    def start(self):
        return [state.start for state in self.model.states]

    def value(self, problem, weights):
        """What a plan, weights of the modes in each block, is worth; by how much that may be wrong; where it ends."""
        (fine, end), (coarse, _) = (self._integrated(problem, weights, refine) for refine in (2, 1))
        return fine / self.per, abs(fine - coarse) / self.per, end

    def _integrated(self, problem, weights, refine):
        """Runge-Kutta's fourth-order method, in steps that end where an interval does."""
        if self._rates is None:
            self._rates = self._compiled()
        rates = self._rates
        state, total = [*map(float, problem.initial), 0.0], 0.0
        before = rates(*state, *np.zeros(len(self.model.switches)))[-1]
        for block, inputs in zip(problem.blocks, (weights @ problem.points).tolist()):
            length = block * problem.dt_s
            steps = refine * math.ceil(length / self.step_s)
            for _ in range(steps):
                state = _step(rates, state, inputs, length / steps)
            after = rates(*state, *inputs)[-1]
            total += 0.5 * length * (before + after)
            before = after
        return total if self.quadrature == "trapezium" else state[-1], state[:-1]

    def _compiled(self):
        m = self.model
        states, inputs = [s.symbol for s in m.states], [s.symbol for s in m.switches]
        usual = {p.symbol: p.value for p in m.parameters}
        expressions = [sp.sympify(e).subs(usual) for e in (*(m.rates[s] for s in states), self.objective)]
        return sp.lambdify([*states, sp.Dummy("integral"), *inputs], expressions, "math", cse=True)


def _step(rates, x, inputs, h):
    k1 = rates(*x, *inputs)
    k2 = rates(*[a + 0.5 * h * k for a, k in zip(x, k1)], *inputs)
    k3 = rates(*[a + 0.5 * h * k for a, k in zip(x, k2)], *inputs)
    k4 = rates(*[a + h * k for a, k in zip(x, k3)], *inputs)
    return [a + h / 6 * (p + 2 * q + 2 * r + s) for a, p, q, r, s in zip(x, k1, k2, k3, k4)]
