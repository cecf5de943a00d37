"""Three tanks in a row, two inflows and a bypass of which one is open: the three tank multimode problem.

Source: https://mintoc.de/index.php?title=Three_Tank_multimode_problem, the revision of 14 October 2025, which has the
bypass carry sqrt(c3 x1); the ones before wrote x3, which is another problem than the one that was solved.
"""

import solenoid
import sympy as sp
from task import Task


def task():
    m = solenoid.Model("gallery_three_tanks", "three tanks in a row, one of two inflows and a bypass open")
    first, second, third = (m.state(name, start=2.0, low=0.0) for name in ("first", "second", "third"))
    small, large, bypass = (m.switch(name) for name in ("small_inflow", "large_inflow", "bypass"))
    past = bypass * sp.sqrt(0.8 * first)
    m.rate(first, small + 2 * large - sp.sqrt(first) - past)
    m.rate(second, sp.sqrt(first) - sp.sqrt(second))
    m.rate(third, sp.sqrt(second) - sp.sqrt(third) + past)
    m.output(second, weight=2.0, target=3.0)
    m.output(third, target=3.0)
    m.modes("one_open", {"small_inflow": {small: 1}, "large_inflow": {large: 1}, "bypass": {bypass: 1}})
    m.timing(tick_s=0.015, ticks_per_period=8)
    return Task(m, 2 * (second - 3)**2 + (third - 3)**2, target=(3.0, 3.0), intervals=100)
