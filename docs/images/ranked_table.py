#!/usr/bin/env python3
"""Draws the ranking that `./solenoid compare` prints: standard input to an SVG on standard output.

    ./solenoid compare | python3 docs/images/ranked_table.py > docs/images/ranked_table.svg

The bar is the RMSE, green where a variant is better than the best of the thesis's own; bold is the
least of a column. The times of the worst cycle are left out: beside other work they are the machine's. The picture's
description holds the lines as printed, which packaging.docs_commands compares with what the program prints.
"""
import re
import sys
from xml.sax.saxutils import escape

VARIANT = 58
COLUMNS = [("", 42), ("variant", VARIANT), ("RMSE mm", 340), ("worst mm", 450), ("switches/s", 550), ("air g", 630),
           ("solve p50 us", 740)]  # right edges, but the variant's left
BAR_FROM, BAR_LENGTH, ROW, TOP, WIDTH = 200, 84, 26, 62, 764
INK, PALE, OURS, THESIS = "#1b2733", "#5b6875", "#2f9e6e", "#9aa7b4"


def rows_of(lines):
    """The printed lines of the ranking, and their cells: rank, variant, five numbers."""
    printed = [line.rstrip() for line in lines if re.match(r" *\d+  [a-z]\w+ ", line)]
    return printed, [line.split()[:7] for line in printed]


def text(x, y, content, anchor="end", fill=INK, bold=False, size=14):
    weight = ' font-weight="700"' if bold else ""
    return f'<text x="{x}" y="{y}" text-anchor="{anchor}" fill="{fill}" font-size="{size}"{weight}>{escape(content)}</text>'


def cell(column, y, content):
    """A number, bold where the program has marked it as the least of its column."""
    name, edge = COLUMNS[column]
    if name == "variant":
        return text(VARIANT, y, content, "start")
    return text(edge, y, content.rstrip("*"), fill=PALE if not name else INK, bold=content.endswith("*"))


def bar(y, share, fill):
    return f'<rect x="{BAR_FROM}" y="{y - 12}" width="{BAR_LENGTH * share:.1f}" height="15" rx="2" fill="{fill}"/>'


def drawing(printed, rows):
    rmse = [float(row[2].rstrip("*")) for row in rows]
    the_thesis = min(value for value, row in zip(rmse, rows) if row[1].startswith("thesis"))
    height = TOP + ROW * len(rows) + 34
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" role="img" '
             'font-family="system-ui, Helvetica, Arial, sans-serif" style="font-variant-numeric: tabular-nums">',
             "<title>Twelve controllers, ranked by tracking error</title>", "<desc>", *map(escape, printed), "</desc>",
             f'<rect width="{WIDTH}" height="{height}" rx="8" fill="#ffffff" stroke="#d5dbe1"/>',
             text(24, 27, "./solenoid compare", "start", bold=True, size=15)]
    for name, edge in COLUMNS[1:]:
        left = name == "variant"
        parts.append(text(edge, 50, name, "start" if left else "end", PALE, size=12))
    for index, (row, value) in enumerate(zip(rows, rmse)):
        y = TOP + ROW * index + 18
        parts.append(f'<line x1="24" x2="{WIDTH - 24}" y1="{y - 18}" y2="{y - 18}" stroke="#e6eaee"/>')
        parts.append(bar(y, value / max(rmse), OURS if value < the_thesis else THESIS))
        parts += [cell(column, y, content) for column, content in enumerate(row)]
    parts.append(text(24, height - 14, "RMSE: geometric mean over six of the thesis's tasks. Green: better than the thesis's best. "
                      "Bold: least of its column.", "start", PALE, size=11))
    return "\n".join([*parts, "</svg>"])


if __name__ == "__main__":
    printed, rows = rows_of(sys.stdin)
    if not rows:
        sys.exit("ranked_table.py: no ranking on standard input")
    print(drawing(printed, rows))
