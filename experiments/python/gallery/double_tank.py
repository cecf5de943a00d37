"""Two tanks, one above the other, and three inflows of which one is open: the double tank multimode problem.

Source: https://mintoc.de/index.php?title=Double_Tank_multimode_problem. The inflow 1 that is always there stands in the
authors' code (github.com/czeile/ampl_mintoc, doubleTank/doubletank.mod) and not on the page; the page's values need it.
"""

import solenoid
import sympy as sp
from task import Task


def task():
    m = solenoid.Model("gallery_double_tank", "an upper tank that runs into a lower one, one of three inflows open")
    upper = m.state("upper", start=2.0, low=0.0)
    lower = m.state("lower", start=2.0, low=0.0)
    valves = [m.switch(f"inflow_{i}") for i in (1, 2, 3)]
    m.rate(upper, 1 + sum(c * w for c, w in zip((1.0, 0.5, 2.0), valves)) - sp.sqrt(upper))
    m.rate(lower, sp.sqrt(upper) - sp.sqrt(lower))
    m.output(lower, weight=2.0, target=3.0)
    m.modes("one_inflow", {f"inflow_{i}": {w: 1} for i, w in enumerate(valves, 1)})
    m.timing(tick_s=0.0125, ticks_per_period=8)
    return Task(m, 2 * (lower - 3)**2, target=(3.0,), intervals=100)
