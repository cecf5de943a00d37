"""A four-switch buck-boost converter that holds current and voltage, its legs switched at most every quarter of a unit.

Source: D. Patino, P. Riedinger, F. Ruiz, A predictive control approach for DC-DC power converters and cyclic switched
systems, IEEE International Conference on Industrial Technology 2010, pages 1259-1264; the numbers as
github.com/danielvie/doutorado_patino recomputes them. Source, inductor, capacitor and load are 1, and (current,
voltage) are to stay at (2, 1). That converter inverts; with both legs switched together ("together") the one with four
switches has the same equations but for the voltage's sign. On average, each leg half of the time, it stays at (2, 1) at
no cost; with a dwell of 1/4 the best it can do is a cycle. The integer problem is four such cycles long and ends where
it begins.
"""

import solenoid
from task import Task


def task():
    m = solenoid.Model("gallery_buck_boost", "a four-switch buck-boost converter in units of its parts")
    current = m.state("current", start=2.0, unit="A")
    voltage = m.state("voltage", start=1.0, unit="V")
    source = m.switch("input_leg", min_dwell_s=0.25)  # the inductor's one end at the source, else at ground
    load = m.switch("output_leg", min_dwell_s=0.25)  # its other end at the load, else at ground
    m.rate(current, source - load * voltage)
    m.rate(voltage, load * current - voltage)
    m.output(current, target=2.0)
    m.output(voltage, target=1.0)
    m.modes("together", {"charge": {source: 1}, "discharge": {load: 1}})
    m.modes("four", {"charge": {source: 1}, "discharge": {load: 1}, "through": {source: 1, load: 1}, "idle": {}})
    m.timing(tick_s=0.025, ticks_per_period=10)
    return Task(m, (current - 2)**2 + (voltage - 1)**2, target=(2.0, 1.0), intervals=8, relaxed_solver="relaxed_pulses",
                relaxed_keys={"rounding": {"iterations": 1000}}, integer_solver="branch_and_bound", cyclic=True,
                per=4.0)
