"""Writes the headers that bench_generated_node compares with hand-written ones: generated_models.py FOLDER. PYTHONPATH has the
package."""

import pathlib
import re
import sys

from solenoid.model import Model


def fishing():
    m = Model("fishing", "predator and prey, with a fleet that fishes or does not")
    x, y = m.state("prey", start=0.5, low=0.0), m.state("predator", start=0.7, low=0.0)
    c0, c1 = m.parameter("c0", 0.4), m.parameter("c1", 0.2)
    w = m.switch("fishing")
    m.rate(x, x - x * y - c0 * x * w)
    m.rate(y, x * y - y - c1 * y * w)
    m.output(x, target=1.0)
    m.output(y, target=1.0)
    return m


def room():
    m = Model("room", "a room with a heater that is on or off, its wall between it and the cold")
    room, wall = m.state("room_c", "degC", 15.0), m.state("wall_c", "degC", 10.0)
    power, outside = m.parameter("power_w", 2000.0), m.parameter("outside_c", 0.0)
    room_heat, wall_heat = m.parameter("room_j_per_k", 1e5), m.parameter("wall_j_per_k", 1e6)
    inner, outer = m.parameter("inner_k_per_w", 0.003), m.parameter("outer_k_per_w", 0.015)
    heater = m.switch("heater")
    m.rate(room, ((wall - room) / inner + power * heater) / room_heat)
    m.rate(wall, ((room - wall) / inner + (outside - wall) / outer) / wall_heat)
    m.output(room, target=20.0)
    return m


if __name__ == "__main__":
    for model in (fishing(), room()):
        # The project's own sources have another include root.
        header = re.sub(r"<solenoid/(.*)>", r'"\1"', model.header())
        pathlib.Path(sys.argv[1], f"generated_{model.name}.hpp").write_text(header)
