#!/usr/bin/env python3
"""Draws the rig's wiring (docs/how-to/wiring.md), an SVG on standard output.

    python3 docs/images/wiring.py > docs/images/wiring.svg
"""
from xml.sax.saxutils import escape

WIDTH, HEIGHT = 960, 640
INK, PALE, POWER, SIGNAL, AIR, SAFETY = "#1b2733", "#5b6875", "#b3261e", "#2563a8", "#2f9e6e", "#8a5a00"

# name: x, y, width, height, title, lines below it, colour of its frame
BOXES = {
    "computer": (24, 296, 132, 74, "Computer", ["./solenoid run", "1 kHz, UDP"], INK),
    "node": (216, 262, 168, 142, "Node", ["microcontroller", "with Ethernet", "20 ms timeout,", "own watchdog"], INK),
    "opto": (448, 226, 132, 62, "Opto-isolators", ["coils 0 to 3"], INK),
    "drivers": (636, 226, 138, 62, "Low-side drivers", ["clamped at 60 V"], INK),
    "coils": (828, 226, 108, 62, "Coils", ["4 two-way", "or 2 three-way"], POWER),
    "dac": (448, 306, 132, 52, "±5 V output", ["isolated DAC"], INK),
    "amplifier": (636, 306, 138, 52, "Motor amplifier", ["0.2 A/V, 1 A"], INK),
    "motor": (828, 306, 108, 52, "Motor", [], POWER),
    "adc": (448, 400, 132, 62, "ADC front end", ["filter, divider", "0..5 V to 0..3.3 V"], INK),
    "position": (636, 384, 138, 44, "Position", ["potentiometer"], INK),
    "pressures": (636, 440, 138, 44, "Pressures A, B", ["50 Hz Bessel"], INK),
    "monostable": (448, 130, 132, 62, "Monostable", ["retriggered, 30 ms", "fed by edges"], SAFETY),
    "supply": (24, 36, 132, 52, "24 V supply", ["5 A, isolated"], POWER),
    "estop": (216, 36, 168, 52, "Emergency stop", ["two channels, latching"], SAFETY),
    "safety": (448, 36, 132, 52, "Safety relay", ["with reset"], SAFETY),
    "watchdog": (636, 36, 138, 52, "Watchdog relay", ["contact in series"], SAFETY),
    "fuses": (828, 36, 108, 52, "Fuses", ["F1 coils 1 A", "F2 motor 1 A"], POWER),
    "air": (24, 548, 132, 56, "Air supply", ["shut-off valve"], AIR),
    "regulator": (216, 548, 168, 56, "Regulator 150 kPa", ["filter, gauge"], AIR),
    "relief": (448, 548, 132, 56, "Relief valve", ["200 kPa"], AIR),
    "valves": (636, 548, 138, 56, "Valves", ["mufflers"], AIR),
    "cylinder": (828, 548, 108, 56, "Cylinder", ["chambers A, B"], AIR),
}


def text(x, y, content, size=12, fill=INK, bold=False, anchor="middle"):
    weight = ' font-weight="700"' if bold else ""
    return (f'<text x="{x}" y="{y}" text-anchor="{anchor}" fill="{fill}" font-size="{size}"{weight}>'
            f'{escape(content)}</text>')


def box(x, y, width, height, title, lines, colour):
    middle, top = x + width / 2, y + (height - 14 * len(lines)) / 2 + 4
    parts = [f'<rect x="{x}" y="{y}" width="{width}" height="{height}" rx="6" fill="#ffffff" stroke="{colour}" '
             'stroke-width="1.6"/>', text(middle, top, title, 13, bold=True)]
    return parts + [text(middle, top + 15 + 14 * i, line, 11, PALE) for i, line in enumerate(lines)]


def wire(points, colour, label="", at=None, dashed=False):
    path = " ".join(f"{x},{y}" for x, y in points)
    dash = ' stroke-dasharray="5 4"' if dashed else ""
    parts = [f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.8"{dash}/>']
    if label:
        parts.append(text(at[0], at[1], label, 11, colour))
    return parts


def right(name):
    x, y, width, height = BOXES[name][:4]
    return x + width, y + height / 2


def left(name):
    x, y, _, height = BOXES[name][:4]
    return x, y + height / 2


def across(one, other, colour):
    """A straight wire from the right of one box to the left of the other, at the other's height."""
    return wire([(right(one)[0], left(other)[1]), left(other)], colour)


def drawing():
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" '
             'font-family="system-ui, Helvetica, Arial, sans-serif">',
             "<title>Wiring of the rig</title>",
             "<desc>24 V runs through the emergency stop's safety relay and the watchdog's contact to the fuses of "
             "coils and motor amplifier. The node drives the coils through opto-isolators and clamped drivers, the "
             "motor through an isolated output, and measures position and pressures. Air runs through regulator and relief "
             "valve.</desc>",
             f'<rect width="{WIDTH}" height="{HEIGHT}" rx="8" fill="#ffffff" stroke="#d5dbe1"/>']
    for first, second in (("supply", "estop"), ("estop", "safety"), ("safety", "watchdog"), ("watchdog", "fuses")):
        parts += across(first, second, POWER)
    for first, second in (("air", "regulator"), ("regulator", "relief"), ("relief", "valves"), ("valves", "cylinder")):
        parts += across(first, second, AIR)
    for first, second in (("computer", "node"), ("opto", "drivers"), ("drivers", "coils"), ("dac", "amplifier"),
                          ("amplifier", "motor")):
        parts += across(first, second, SIGNAL if first in ("computer", "opto", "dac") else POWER)
    parts.append(text(186, 326, "UDP", 11, SIGNAL))
    edge = right("node")[0]
    parts += wire([(edge, 280), (416, 280), (416, 257), left("opto")], SIGNAL, "4 lines", (416, 296))
    parts += wire([(edge, 332), left("dac")], SIGNAL, "SPI", (430, 326))
    parts += wire([left("adc"), (416, 431), (416, 390), (edge, 390)], SIGNAL, "SPI", (431, 425))
    parts += wire([left("position"), (608, 406), (608, 418), (580, 418)], SIGNAL)
    parts += wire([left("pressures"), (608, 462), (608, 446), (580, 446)], SIGNAL)
    # What breaks the power: edges of the node feed the monostable, which holds the contact.
    parts += wire([(300, 262), (300, 161), left("monostable")], SAFETY, "edges, 500 Hz", (374, 155), True)
    parts += wire([right("monostable"), (705, 161), (705, 88)], SAFETY, "holds", (640, 155), True)
    # Fused 24 V to coils and amplifier.
    parts += wire([(866, 88), (866, 226)], POWER, "F1", (852, 160))
    parts += wire([(910, 88), (910, 206), (800, 206), (800, 296), (705, 296), (705, 306)], POWER, "F2", (924, 160))
    # Coils move valves, the cylinder's pressures are measured.
    parts += wire([(948, 257), (952, 257), (952, 520), (705, 520), (705, 548)], AIR, "", None, True)
    parts += wire([(936, 257), (948, 257)], AIR, "", None, True)
    parts += wire([(882, 548), (882, 462), (774, 462)], AIR, "tubes", (900, 506), True)
    for name in BOXES:
        parts += box(*BOXES[name])
    key = [("24 V", POWER), ("signals", SIGNAL), ("what makes it safe", SAFETY), ("air", AIR)]
    for i, (name, colour) in enumerate(key):
        parts += wire([(24, 140 + 20 * i), (52, 140 + 20 * i)], colour)
        parts.append(text(60, 144 + 20 * i, name, 11, PALE, anchor="start"))
    return "\n".join(parts + ["</svg>"])


if __name__ == "__main__":
    print(drawing())
