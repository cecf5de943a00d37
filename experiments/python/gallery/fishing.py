"""Prey and predators with three fleets of which one is always at sea: the Lotka-Volterra multimode fishing problem.

Source: https://mintoc.de/index.php?title=Lotka_Volterra_Multimode_fishing_problem
"""

import solenoid
from task import Task


def task():
    m = solenoid.Model("gallery_fishing", "prey and predators, one of three fleets at sea")
    prey = m.state("prey", start=0.5, low=0.0)
    predators = m.state("predators", start=0.7, low=0.0)
    fleets = [m.switch(f"fleet_{i}") for i in (1, 2, 3)]
    prey_caught = sum(c * w for c, w in zip((0.2, 0.4, 0.01), fleets))
    predators_caught = sum(c * w for c, w in zip((0.1, 0.2, 0.1), fleets))
    m.rate(prey, prey - prey * predators - prey * prey_caught)
    m.rate(predators, -predators + prey * predators - predators * predators_caught)
    m.output(prey, target=1.0)
    m.output(predators, target=1.0)
    m.modes("one_fleet", {f"fleet_{i}": {w: 1} for i, w in enumerate(fleets, 1)})
    m.timing(tick_s=0.015, ticks_per_period=2)
    return Task(m, (prey - 1)**2 + (predators - 1)**2, target=(1.0, 1.0), intervals=400)
