"""The Van der Pol oscillator whose damping is one of three: the binary variant of the Van der Pol oscillator.

Source: https://mintoc.de/index.php?title=Van_der_Pol_Oscillator_(binary_variant). The published values are those of
the trapezium rule over the 60 control intervals (github.com/czeile/ampl_mintoc, mintocPost.mod), 3e-3 above the
integral of the same plan. Hence a step of the model is an interval here.
"""

import solenoid
from task import Task


def task():
    m = solenoid.Model("gallery_van_der_pol", "an oscillator with one of three dampings")
    x = m.state("position", start=1.0)
    y = m.state("velocity")
    dampings = [m.switch(f"damping_{i}") for i in (1, 2, 3)]
    m.rate(x, y)
    m.rate(y, sum(c * w for c, w in zip((-1.0, 0.75, -2.0), dampings)) * (1 - x**2) * y - x)
    m.output(x)
    m.output(y)
    m.modes("one_damping", {f"damping_{i}": {w: 1} for i, w in enumerate(dampings, 1)})
    m.timing(tick_s=1 / 3, ticks_per_period=1)
    return Task(m, x**2 + y**2, target=(0.0, 0.0), intervals=60, quadrature="trapezium")
