"""The gallery against what others found: docs/results/gallery.md has their values, the program computes ours anew."""

import importlib.util
import json
import os
import pathlib
import re
import subprocess
import sys
import unittest

SOURCES = pathlib.Path(os.environ["SOLENOID_SOURCE_DIR"])


def documented():
    """Rows of the page's first table: published relaxed and integer, ours relaxed and integer, as they are written."""
    rows = {}
    for line in (SOURCES / "docs/results/gallery.md").read_text(encoding="utf-8").splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if len(cells) == 6 and re.fullmatch(r"`\w+`", cells[0]):
            rows.setdefault(cells[0].strip("`"), cells[1:5])
    return rows


def gallery(*arguments):
    program = SOURCES / "experiments/python/gallery/gallery.py"
    said = subprocess.run([sys.executable, program, *arguments, "--format", "json"], check=True, stdout=subprocess.PIPE,
                          text=True)
    return {optimum["system"]: optimum for optimum in json.loads(said.stdout)}


class Gallery(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.ours = gallery()
        cls.table = documented()

    def test_every_system_is_in_the_table(self):
        self.assertEqual(sorted(self.ours), sorted(self.table))
        self.assertEqual(len(self.ours), 5)

    def test_integration_leaves_nothing_open(self):
        for name, ours in self.ours.items():
            self.assertLess(ours["error"], 1e-7, name)

    def test_relaxed_optima_are_the_published_ones(self):
        for name, (relaxed, *_) in self.table.items():
            self.assertAlmostEqual(self.ours[name]["relaxed"], float(relaxed), delta=1e-3 if float(relaxed) else 1e-6,
                                   msg=name)

    def test_integer_plans_lie_above_the_relaxed_optimum_and_not_far_from_the_published_ones(self):
        for name, (_, integer, *_) in self.table.items():
            ours = self.ours[name]
            self.assertGreater(ours["integer"], ours["relaxed"] - 1e-5, name)
            self.assertLess(ours["integer"], 1.03 * float(integer), name)
            self.assertGreater(ours["switches"], 0, name)

    def test_all_four_positions_of_the_converter_halve_what_two_of_them_cost(self):
        four = gallery("buck_boost", "--modes", "four")["buck_boost"]
        self.assertLess(four["integer"], 0.5 * self.ours["buck_boost"]["integer"])

    def test_the_table_has_ours(self):
        """Which integer plan the swaps end at may hang on the last bits of the relaxed one."""
        for name, (_, _, relaxed, integer) in self.table.items():
            ours = self.ours[name]
            self.assertAlmostEqual(ours["relaxed"], float(relaxed), delta=2e-6, msg=name)
            self.assertAlmostEqual(ours["integer"], float(integer), delta=2e-6 + 2e-5 * ours["integer"], msg=name)


if __name__ == "__main__":
    if importlib.util.find_spec("sympy") is None:
        print("SymPy is not installed: apt-get install python3-sympy", file=sys.stderr)
        sys.exit(1 if os.environ.get("CI") else 77)
    unittest.main()
