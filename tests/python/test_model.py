"""Models in Python: the C++ they become against SymPy, and the systems that are built of it. PYTHONPATH has the package.

Skipped (77) where there is no SymPy, but not under CI.
"""

import ctypes
import json
import math
import os
import pathlib
import random
import subprocess
import sys
import tempfile
import time
import unittest
from unittest import mock

try:
    import sympy as sp
    from mpmath import mp
except ImportError:
    print("no SymPy (apt-get install python3-sympy)", file=sys.stderr)
    sys.exit(1 if os.environ.get("CI") else 77)

import numpy as np
import solenoid
from solenoid import _compiler, _plugin_files
from solenoid.model import Model

mp.dps = 30
FOLDER = tempfile.TemporaryDirectory()
CACHE = os.environ["XDG_CACHE_HOME"] = FOLDER.name + "/cache"


def fishing(name="fishing", integrator="rk4"):
    m = Model(name, "predator and prey, with a fleet that fishes or does not")
    x = m.state("prey", start=0.5, low=0.0)
    y = m.state("predator", start=0.7, low=0.0)
    c0, c1 = m.parameter("c0", 0.4, low=0.0), m.parameter("c1", 0.2)
    w = m.switch("fleet")
    m.rate(x, x - x * y - c0 * x * w)
    m.rate(y, x * y - y - c1 * y * w)
    m.output(x, target=1.0)
    m.output(y, target=1.0)
    m.consumption("catch", "t", (c0 * x + c1 * y) * w)
    m.modes("fleet", {"ashore": {}, "fishing": {w: 1}})
    m.timing(tick_s=0.05, ticks_per_period=2)
    m.horizon(blocks=[1, 1, 2, 2, 4, 4, 6], steps=40)
    m.integrator = integrator
    return m


def odd(name, integrator):
    """Every function, names that C++ and the header have for themselves, powers of every kind."""
    m = Model(name)
    x, v = m.state("x"), m.state("state")
    u, w = m.input("u", 2.0), m.switch("S")
    a, b = m.parameter("a", 2.0), m.parameter("dt", 0.5)
    m.rate(x, v + sp.Piecewise((sp.sqrt(x), sp.And(x > 0, v < a)), (sp.Max(x, -a, u), True)) - b * x + sp.Min(x, v, 1)**3)
    m.rate(v, -a**2 * x - sp.sign(v) * 0.1 * w + sp.sin(x) * sp.tanh(u / (1 + x**2)) + sp.Abs(v)**1.5 + v**3 / 7
           + sp.exp(-x**2 / a) * sp.pi - x**4 * (v**2 + 1)**-2 * w / (2 + u) + sp.Heaviside(x - 1) * w + sp.tan(x / 10)
           + sp.log(1 + x**2) * sp.cos(v) + (1 + v**2)**b + (2 + sp.sin(v))**-0.5 + sp.Abs(x)**sp.Rational(7, 3) + 1e-7 * v)
    m.output(x)
    m.output(v, rate_of=x)
    m.integrator = integrator
    return m


def chain(name="chain"):
    """Linear, with a matrix of parameters that has a whole block of zeros and eigenvalues far apart."""
    m = Model(name)
    x = [m.state(f"x{i}") for i in range(3)]
    k = [m.parameter(f"k{i}", value) for i, value in enumerate((1.0, 20.0, 0.3))]
    w, u = m.switch("w"), m.input("u")
    m.rate(x[0], -k[0] * x[0] + 2 * w)
    m.rate(x[1], k[0] * x[0] - k[1] * x[1] + sp.exp(u) - 1)
    m.rate(x[2], k[1] * x[1] / 3 - k[2] * x[2])
    m.output(x[2])
    m.timing(tick_s=0.1)
    m.integrator = "exact"
    return m


def boost(name="boost"):
    """A converter: its matrix depends on the switch."""
    m = Model(name, "a boost converter")
    i, v, s = m.state("current", "A"), m.state("voltage", "V"), m.switch("transistor")
    ind, cap, load, source = (m.parameter(n, value) for n, value in (("L", 1e-3), ("C", 1e-4), ("R", 10.0), ("E", 12.0)))
    m.rate(i, (source - (1 - s) * v) / ind)
    m.rate(v, ((1 - s) * i - v / load) / cap)
    m.output(v, target=20.0)
    m.timing(tick_s=2e-5)
    m.integrator = "exact"
    return m


def stiff(name="stiff"):
    """A fast decay towards a slow pendulum: its linear part alone is stiff."""
    m = Model(name)
    fast, angle, rate = m.state("fast"), m.state("angle"), m.state("turning")
    k, w = m.parameter("k", 300.0), m.switch("w")
    m.rate(fast, -k * fast + k * sp.cos(angle))
    m.rate(angle, rate)
    m.rate(rate, -sp.sin(angle) - rate / 10 + w)
    m.output(angle)
    m.timing(tick_s=0.05)
    m.integrator = "exact"
    return m


MODELS = [fishing("fish_rk4"), fishing("fish_euler", "euler"), odd("odd_rk4", "rk4"), odd("odd_euler", "euler"),
          odd("odd_exact", "exact"), chain(), boost(), stiff()]

WRAPPER = """
using {cls} = models::{name}::{Cls};
extern "C" void {name}_step(const double* p, const double* x, const double* s, const double* u, double dt, double* out) {{
  const {cls} model(std::span<const double>(p, {parameters}));
  solenoid::StateOf<{cls}> state;
  solenoid::SwitchedOf<{cls}> switched;
  solenoid::ContinuousOf<{cls}> continuous{{}};
  std::copy_n(x, state.size(), state.begin());
  std::copy_n(s, switched.size(), switched.begin());
  std::copy_n(u, continuous.size(), continuous.begin());
  const auto next = model.step<double>(state, switched, continuous, dt);
  std::copy(next.begin(), next.end(), out);
}}
// How many of a register's lanes differ from the scalar step in any bit.
extern "C" int {name}_lanes(const double* p, const double* x, const double* s, const double* u, double dt) {{
  using Batch = xsimd::batch<double>;
  constexpr std::size_t n = {cls}::state_size;
  const {cls} model(std::span<const double>(p, {parameters}));
  solenoid::Vector<Batch, n> state;
  solenoid::Vector<Batch, {cls}::switched_size> switched;
  solenoid::Vector<Batch, {cls}::continuous_size> continuous;
  for (std::size_t i = 0; i < n; ++i) state[i] = Batch({{x[i], x[i] * 1.25}});
  for (std::size_t i = 0; i < switched.size(); ++i) switched[i] = Batch({{s[i], 1.0 - s[i]}});
  for (std::size_t i = 0; i < continuous.size(); ++i) continuous[i] = Batch(u[i]);
  const auto next = model.step<Batch>(state, switched, continuous, dt);
  int differ = 0;
  for (std::size_t lane = 0; lane < 2; ++lane) {{
    solenoid::StateOf<{cls}> one;
    solenoid::SwitchedOf<{cls}> on;
    solenoid::ContinuousOf<{cls}> input{{}};
    for (std::size_t i = 0; i < n; ++i) one[i] = state[i].get(lane);
    for (std::size_t i = 0; i < on.size(); ++i) on[i] = switched[i].get(lane);
    std::copy_n(u, input.size(), input.begin());
    const auto alone = model.step<double>(one, on, input, dt);
    for (std::size_t i = 0; i < n; ++i) differ += next[i].get(lane) != alone[i];
  }}
  return differ;
}}
// Derivatives of the step by the state, row by row.
extern "C" void {name}_slope(const double* p, const double* x, const double* s, const double* u, double dt, double* out) {{
  constexpr std::size_t n = {cls}::state_size;
  using Dual = solenoid::Dual<static_cast<int>(n)>;
  const {cls} model(std::span<const double>(p, {parameters}));
  solenoid::Vector<Dual, n> state;
  solenoid::Vector<Dual, {cls}::switched_size> switched;
  solenoid::Vector<Dual, {cls}::continuous_size> continuous;
  for (std::size_t i = 0; i < n; ++i) state[i] = Dual(x[i], static_cast<int>(i));
  for (std::size_t i = 0; i < switched.size(); ++i) switched[i] = Dual(s[i]);
  for (std::size_t i = 0; i < continuous.size(); ++i) continuous[i] = Dual(u[i]);
  const auto next = model.step<Dual>(state, switched, continuous, dt);
  for (std::size_t i = 0; i < n; ++i) {{
    double row[Dual::size];
    next[i].copy_derivatives(row);
    std::copy_n(row, n, out + i * n);
  }}
}}
// The same by the filters' scalar.
extern "C" void {name}_slope_of_filters(const double* p, const double* x, const double* s, const double* u, double dt,
                                        double* out) {{
  constexpr int n = static_cast<int>({cls}::state_size);
  using Dual = Eigen::AutoDiffScalar<Eigen::Matrix<double, n, 1>>;
  const {cls} model(std::span<const double>(p, {parameters}));
  solenoid::Vector<Dual, {cls}::state_size> state;
  solenoid::Vector<Dual, {cls}::switched_size> switched;
  solenoid::Vector<Dual, {cls}::continuous_size> continuous;
  for (std::size_t i = 0; i < state.size(); ++i) state[i] = Dual(x[i], n, static_cast<int>(i));
  for (std::size_t i = 0; i < switched.size(); ++i) switched[i] = Dual(s[i]);
  for (std::size_t i = 0; i < continuous.size(); ++i) continuous[i] = Dual(u[i]);
  const auto next = model.step<Dual>(state, switched, continuous, dt);
  for (std::size_t i = 0; i < next.size(); ++i)
    for (int j = 0; j < n; ++j) out[i * next.size() + static_cast<std::size_t>(j)] = next[i].derivatives()[j];
}}
"""


def setUpModule():
    Compiled.load()


class Compiled:
    """All MODELS' headers in one shared object, and what oracles need of one of them."""

    library = None

    @classmethod
    def load(cls):
        if cls.library is None:
            folder = pathlib.Path(FOLDER.name)
            tools = _compiler.toolchain()
            source = ["#include <algorithm>", "#include <solenoid/controllers/estimators/sensitivity.hpp>",
                      "#include <solenoid/solvers/relaxed/dual.hpp>", "#include <xsimd/xsimd.hpp>"]
            for m in MODELS:
                (folder / f"{m.name}.hpp").write_text(m.header())
                source += [f'#include "{m.name}.hpp"', WRAPPER.format(name=m.name, Cls=m._class_name, cls=f"Of_{m.name}",
                                                                      parameters=len(m.parameters))]
            (folder / "steps.cpp").write_text("\n".join(source))
            subprocess.run([*tools.compiler, *tools.flags, "-Wall", "-Wextra", "-Wconversion", "-Werror", "-Wno-psabi",
                            "-shared", "-o", "steps.so", "steps.cpp"], cwd=folder, check=True)
            cls.library = ctypes.CDLL(str(folder / "steps.so"))
        return cls.library

    def __init__(self, model):
        self.model, self.library = model, self.load()
        self.arguments = [t.symbol for t in [*model.parameters, *model.states, *model.switches, *model.inputs]]
        steps = {"Heaviside": lambda x, half=0.5: mp.mpf(half) if x == 0 else mp.mpf(x > 0)}
        self.lambda_rates = sp.lambdify(self.arguments, [model.said_rates[s.symbol] for s in model.states],
                                        [steps, "mpmath"])

    def call(self, what, point, dt, out=0):
        vectors = [(ctypes.c_double * max(1, len(v)))(*v) for v in point]
        result = (ctypes.c_double * out)()
        function = getattr(self.library, f"{self.model.name}_{what}")
        returned = function(*vectors, ctypes.c_double(dt), *([result] if out else []))
        return list(result) if out else returned

    def step(self, point, dt):
        return self.call("step", point, dt, len(self.model.states))

    def rates(self, point, state):
        parameters, _, switched, inputs = ([mp.mpf(v) for v in vector] for vector in point)
        return [mp.mpf(r) for r in self.lambda_rates(*parameters, *state, *switched, *inputs)]

    def rk4(self, point, dt, steps=1):
        x, h = [mp.mpf(v) for v in point[1]], mp.mpf(dt) / steps
        for _ in range(steps):
            k1 = self.rates(point, x)
            k2 = self.rates(point, [v + h / 2 * k for v, k in zip(x, k1)])
            k3 = self.rates(point, [v + h / 2 * k for v, k in zip(x, k2)])
            k4 = self.rates(point, [v + h * k for v, k in zip(x, k3)])
            x = [v + h / 6 * (a + 2 * b + 2 * c + d) for v, a, b, c, d in zip(x, k1, k2, k3, k4)]
        return x

    def euler(self, point, dt):
        return [mp.mpf(x) + mp.mpf(dt) * k for x, k in zip(point[1], self.rates(point, [mp.mpf(v) for v in point[1]]))]

    def points(self, count, seed=1, spread=1.5):
        draw = random.Random(seed)
        for _ in range(count):
            yield ([p.value * draw.uniform(0.5, 1.5) for p in self.model.parameters],
                   [draw.uniform(0.1 if s.low == 0.0 else -spread, spread) for s in self.model.states],
                   [float(draw.randrange(2)) for _ in self.model.switches],
                   [draw.uniform(-i.most, i.most) for i in self.model.inputs])


def of(name):
    return Compiled(next(m for m in MODELS if m.name == name))


class Steps(unittest.TestCase):
    def close(self, found, right, relative=1e-13, what=None):
        size = max(abs(float(r)) for r in right)
        for a, b in zip(found, right):
            self.assertLessEqual(abs(a - b), relative * max(1.0, size), what)

    def test_runge_kutta_and_euler_are_those_of_sympy(self):
        for name in ("fish_rk4", "odd_rk4"):
            for point in of(name).points(40):
                self.close(of(name).step(point, 0.05), of(name).rk4(point, 0.05), what=point)
        for name in ("fish_euler", "odd_euler"):
            for point in of(name).points(40, seed=2):
                self.close(of(name).step(point, 0.05), of(name).euler(point, 0.05), what=point)

    def test_both_branches_and_the_ends_between_them(self):
        model = of("odd_euler")
        for x in (-1.0, -1e-300, 0.0, 1e-300, 1.0, 1.5):
            for v in (-2.0, 0.0, 1.0, 2.0, 3.0):
                for w in (0.0, 1.0):
                    point = ([2.0, 0.5], [x, v], [w], [0.3])
                    self.close(model.step(point, 1.0), model.euler(point, 1.0), what=point)

    def test_half_the_step_is_a_sixteenth_of_the_error(self):
        model = of("fish_rk4")
        point = ([0.4, 0.2], [0.5, 0.7], [1.0], [])

        def error(steps):
            x = point[1]
            for _ in range(steps):
                x = model.step((point[0], x, point[2], []), 2.0 / steps)
            return abs(x[0] - float(exact[0]))

        exact = model.rk4(point, 2.0, 400)
        for coarse in (8, 16):
            self.assertAlmostEqual(math.log2(error(coarse) / error(2 * coarse)), 4.0, delta=0.3)

    def exponential(self, a, b, x, dt):
        """exp of [[A, b], [0, 0]] dt, times (x, 1)."""
        n = len(x)
        m = mp.zeros(n + 1)
        for i in range(n):
            for j in range(n):
                m[i, j] = a[i][j] * dt
            m[i, n] = b[i] * dt
        e = mp.expm(m)
        return [sum(e[i, j] * x[j] for j in range(n)) + e[i, n] for i in range(n)]

    def linear(self, model, point):
        """A and b of the rates at held inputs, of lambdify at 0 and at unit vectors."""
        n = len(point[1])
        b = model.rates(point, [mp.mpf(0)] * n)
        columns = [model.rates(point, [mp.mpf(i == j) for i in range(n)]) for j in range(n)]
        return [[columns[j][i] - b[i] for j in range(n)] for i in range(n)], b

    def test_linear_steps_are_matrix_exponentials(self):
        # Also of other steps than the model's own, of long ones, and of switches half on.
        for name, times in (("chain", (0.1, 0.037, 2.5)), ("boost", (2e-5, 7e-6, 3e-3))):
            model = of(name)
            for count, point in enumerate(model.points(12)):
                if count % 3 == 0:
                    point = (*point[:2], [0.37], point[3])
                a, b = self.linear(model, point)
                for dt in times:
                    right = self.exponential(a, b, [mp.mpf(v) for v in point[1]], mp.mpf(dt))
                    self.close(model.step(point, dt), right, 1e-12, (name, point, dt))

    def test_a_partly_linear_step_has_order_four_and_takes_what_is_stiff(self):
        model = of("stiff")

        def error(k, steps):
            x = [0.2, 1.0, -0.5]
            exact = [float(v) for v in model.rk4(([k], x, [1.0], []), 0.8, int(10 * k) + 500)]
            for _ in range(steps):
                x = model.step(([k], x, [1.0], []), 0.8 / steps)
            return np.abs(np.subtract(x, exact)).max()

        self.assertLess(error(300.0, 16), 1e-4)  # |lambda dt| is 15, and the classical method's limit 2.8
        self.assertAlmostEqual(math.log2(error(10.0, 32) / error(10.0, 64)), 4.0, delta=0.3)
        other = of("odd_exact")
        smooth = 0
        for p in other.points(20, spread=0.9):
            fine = other.rk4(p, 0.01, 20)
            if max(abs(a - b) for a, b in zip(fine, other.rk4(p, 0.01))) < 1e-8:  # no jump on the way
                self.close(other.step(p, 0.01), fine, 1e-8, p)
                smooth += 1
        self.assertGreater(smooth, 10)

    def test_a_part_that_nothing_drives_is_exact(self):
        model = of("stiff")
        k, dt, turned = 300.0, 0.05, math.pi / 2  # cos(pi/2) is 0 but for rounding, and 0.3 is held by its own rate
        x = model.step(([k], [1.0, turned, 0.0], [0.0], []), dt)
        self.assertGreater(x[0], 0.0)
        self.assertLess(abs(model.step(([k], [1.0, 0.0, 0.0], [0.0], []), dt)[0] - 1.0), 1e-14)
        self.assertLess(abs(model.step(([k], [0.5, 0.0, 0.0], [0.0], []), dt)[0] - (1 - 0.5 * math.exp(-k * dt))), 1e-13)

    def test_lanes_are_the_scalar_step_to_the_last_bit(self):
        for m in MODELS:
            for point in of(m.name).points(50, seed=3, spread=1.2):
                self.assertEqual(of(m.name).call("lanes", point, m.tick_s), 0, (m.name, point))

    def test_derivatives_are_those_of_sympy(self):
        for name in ("fish_euler", "odd_euler"):
            compiled, m = of(name), of(name).model
            n = len(m.states)
            jacobian = sp.Matrix([m.said_rates[s.symbol] for s in m.states]).jacobian([s.symbol for s in m.states])
            for point in compiled.points(10, seed=4):
                at = dict(zip(compiled.arguments, [*point[0], *point[1], *point[2], *point[3]]))
                slopes = jacobian.xreplace({k: sp.Float(v, 30) for k, v in at.items()}).doit()
                right = [int(i == j) + 0.05 * sp.N(slopes[i, j], 20) for i in range(n) for j in range(n)]
                self.close(compiled.call("slope", point, 0.05, n * n), [mp.mpf(str(r)) for r in right], 1e-12, point)

    def test_the_filters_find_the_same_derivatives(self):
        for m in MODELS:
            n = len(m.states)
            for point in of(m.name).points(10, seed=5):
                found, right = (of(m.name).call(f"slope{of_whom}", point, 0.7 * m.tick_s, n * n)
                                for of_whom in ("_of_filters", ""))
                self.close(found, right, 1e-12, (m.name, point))

    def test_constants_are_whole(self):
        m = Model("numbers")
        x, w = m.state("x"), m.switch("w")
        m.rate(x, 0.1 * x + sp.pi * w + sp.Rational(1, 3) + 1e-17 * x * w + 123456789.123456789)
        m.output(x)
        for text in (repr(0.1), repr(math.pi), "1e-17", repr(float(sp.Rational(1, 3) + sp.Rational("123456789.12345679")))):
            self.assertIn(f"S({text})", m.header())


class Headers(unittest.TestCase):
    def test_a_common_part_is_computed_once(self):
        m = Model("shared")
        x, y, w = m.state("x"), m.state("y"), m.switch("w")
        common = sp.exp(-x * y) / (1 + x**2)
        m.rate(x, common * w - x)
        m.rate(y, common + y)
        m.output(x)
        self.assertEqual(m.header().count("exponential"), 1)
        self.assertNotIn("pow", m.header())

    def test_what_is_of_parameters_alone_is_computed_by_the_constructor(self):
        m = Model("fixed")
        x, w = m.state("x"), m.switch("w")
        a, b = m.parameter("a", 1.0), m.parameter("b", 2.0)
        m.rate(x, -x * sp.sqrt(a / b) + w)
        m.output(x)
        body = m.header()[m.header().index("rates("):]
        self.assertNotIn("/", body[:body.index("}")])
        self.assertIn("of_parameters_0_(std::sqrt(a_/b_))", m.header())

    def test_a_choice_by_parameters_is_the_constructor_s(self):
        m = Model("chosen")
        x, w, a = m.state("x"), m.switch("w"), m.parameter("a", 1.0)
        m.rate(x, sp.Piecewise((1, sp.And(a > 1, a < 2)), (-2, True)) * w - sp.Heaviside(a - 1) * x)
        m.output(x)
        self.assertIn("of_parameters_0_(((a_ > 1.0 && a_ < 2.0) ? ( 1.0 ) : ( -2.0 )))", m.header())

    def test_names_that_a_header_has_itself(self):
        for name, parameter, square in (("vector", "exact", 1), ("exact", "of_parameters_0", 1), ("series", "series", 0),
                                        ("exact", "steepest", 0)):
            m = Model(name)
            x, w, a = m.state("x"), m.switch("w"), m.parameter(parameter, 1.0)
            m.rate(x, -a * x * (square + (1 - square) * w) + w / (1 + a))
            m.output(x)
            m.integrator = "exact"
            folder = pathlib.Path(tempfile.mkdtemp(dir=FOLDER.name))
            (folder / "named.cpp").write_text(m.header().replace("#pragma once", "") + f"""
template auto models::{name}::{m._class_name}::step<double>(
    const solenoid::Vector<double, 1>&, const solenoid::Vector<double, 1>&, const solenoid::Vector<double, 0>&,
    double) const -> solenoid::Vector<double, 1>;
""")
            tools = _compiler.toolchain()
            subprocess.run([*tools.compiler, *tools.flags, "-fsyntax-only", "named.cpp"], cwd=folder, check=True)

    def test_sizes_of_relaxed_problems_are_those_of_the_hull(self):
        # tests/solvers: three free switches, two chambers of fill or exhaust, one of four.
        self.assertEqual(_plugin_files.hull_size(range(8), 3, False), (3, 0))
        self.assertEqual(_plugin_files.hull_size(range(8), 3, True), (3, 3))
        two_way = [a | b << 2 for a in (0, 1, 2) for b in (0, 1, 2)]
        self.assertEqual(_plugin_files.hull_size(two_way, 4, False), (4, 2))
        self.assertEqual(_plugin_files.hull_size(two_way, 4, True), (4, 4))
        self.assertEqual(_plugin_files.hull_size([0, 1, 2, 4, 8], 4, False), (4, 1))

    def test_a_kept_folder_passes_its_own_test(self):
        folder = pathlib.Path(FOLDER.name, "kept")
        model = fishing("kept")
        model.save(folder)
        for name in ("CMakeLists.txt", "kept.hpp", "kept.cpp", "kept.toml", "compare.toml"):
            self.assertTrue((folder / name).stat().st_size > 0, name)
        tools = _compiler.toolchain()
        run = [*tools.compiler, *tools.flags, "kept_test.cpp", "-o", "kept_test"]
        subprocess.run(run, cwd=folder, check=True)
        subprocess.run(["./kept_test"], cwd=folder, check=True)
        header = (folder / "kept.hpp").read_text()
        (folder / "kept.hpp").write_text(header.replace("S(c0_)", "S(1.01 * c0_)"))
        subprocess.run(run, cwd=folder, check=True)
        self.assertEqual(subprocess.run(["./kept_test"], cwd=folder, stdout=subprocess.DEVNULL).returncode, 2)
        with self.assertRaisesRegex(solenoid.ConfigError, "is there already"):
            model.save(folder)


class Refusals(unittest.TestCase):
    def refused(self, pattern, act):
        with self.assertRaisesRegex(solenoid.ConfigError, pattern) as caught:
            act()
        text = str(caught.exception)
        self.assertNotIn("\n", text)
        self.assertIn("(allowed: ", text)
        self.assertIsInstance(caught.exception, ValueError)

    def model(self):
        m = Model("mine")
        return m, m.state("x"), m.switch("w")

    def test_names(self):
        for name in ("std", "solenoid", "models", "xsimd"):
            self.refused("cannot be its name", lambda: Model(name))
        for name in ("Two words", "double", "lambda", "a__b", "_x", "x_", "", "1x", "é"):
            self.refused("name", lambda: Model(name))
            m, _, _ = self.model()
            for say in (m.state, m.switch, m.input, lambda n: m.parameter(n, 1.0)):
                self.refused("is no name|is a word", lambda: say(name))
        m, _, _ = self.model()
        self.refused("'x' is said twice", lambda: m.parameter("x", 1.0))
        self.refused("is no name", lambda: m.modes("a b", {"c": {}}))
        for meaning in ("two\nlines", "goes on \\", "long" * 100, 3):
            self.refused("text of one line", lambda: m.state("y", meaning=meaning))

    def test_numbers(self):
        m, x, w = self.model()
        self.refused("low below high", lambda: m.state("y", low=1.0, high=1.0))
        self.refused("start of state 'y' is 3", lambda: m.state("y", start=3.0, high=2.0))
        self.refused("sigma", lambda: m.state("y", sigma=0.0))
        self.refused("value of parameter 'p' is nan", lambda: m.parameter("p", math.nan))
        self.refused("most of input", lambda: m.input("u", most=-1.0))
        self.refused("min_dwell_s", lambda: m.switch("v", min_dwell_s=-1.0))
        self.refused("tick_s is 0", lambda: m.timing(0.0))
        self.refused("ticks_per_period is 1.5", lambda: m.timing(0.1, 1.5))
        self.refused("a block of the horizon is 0", lambda: m.horizon([1, 0]))
        self.refused("horizon has 0 blocks", lambda: m.horizon([]))
        self.refused("target of output", lambda: m.output(x, target="high"))

    def test_more_than_there_is_room_for(self):
        m = Model("mine")
        for k in range(12):
            m.state(f"x{k}")
        self.refused("one too many", lambda: m.state("x12"))
        for k in range(8):
            m.switch(f"w{k}")
        self.refused("one too many", lambda: m.switch("w8"))
        for k in range(4):
            m.input(f"u{k}")
        self.refused("one too many", lambda: m.input("u4"))
        for s in list(m.states):
            m.rate(s.symbol, 0)
        m.output("x0")
        self.refused("12 states are measured .allowed: at most 6", m.header)

    def test_expressions(self):
        m, x, w = self.model()
        self.refused("has 'y', which it cannot depend on .allowed: x, w", lambda: m.rate(x, sp.Symbol("y") * x))
        self.refused("is no expression", lambda: m.rate(x, "x +"))
        self.refused("is no expression", lambda: m.rate(x, x > 0))
        self.refused("finite real numbers", lambda: m.rate(x, x / sp.S.Zero))
        self.refused("'w' is no state .allowed: x", lambda: m.rate(w, 1))
        self.refused("cannot depend on", lambda: m.consumption("c", "kg", m.input("u")))
        m.rate(x, -x)
        self.refused("rate of state 'x' is said twice", lambda: m.rate(x, x))

    def test_what_no_scalar_has(self):
        for bad in (sp.atan, sp.floor, sp.gamma, sp.sinh, lambda x: sp.Piecewise((x, x > 0)), lambda x: (1 + x**2)**x):
            m, x, w = self.model()
            m.output(x)
            m.rate(x, w * bad(x))
            self.refused("allowed: (sqrt, exp, log|a last branch with True)", m.header)

    def test_what_is_missing_or_does_not_fit(self):
        m, x, w = self.model()
        self.refused("state 'x' has no rate", m.header)
        m.rate(x, w)
        self.refused("no output", m.header)
        self.refused("'y' is no state", lambda: m.output("y"))
        self.refused("is the rate of 'x', which is no output", lambda: m.output(m.state("v"), rate_of=x))
        m.rate("v", 0)
        m.output(x)
        self.refused("output 'x' is said twice", lambda: m.output(x))
        m.integrator = "rk5"
        self.refused("integrator 'rk5' .allowed: euler, rk4, exact", m.header)
        m.integrator = "exact"
        self.assertIn("exp(A dt)", m.header())
        m.state("noisy", sigma=0.1)
        m.rate("noisy", 0)
        self.refused("output 'x' is not measured", m.header)
        bare = Model("bare")
        self.refused("no state", bare.header)
        bare.rate(bare.state("x"), 0)
        self.refused("no switch", bare.header)
        n, y, w = self.model()
        n.rate(y, sp.sin(y) * w)
        n.output(y)
        n.integrator = "exact"
        self.refused("no rate has a part that is a number times a state .allowed: rk4, euler", n.header)
        n.timing(1e-3)
        n.switch("late", min_dwell_s=0.1)
        self.refused("a dwell or delay of 0.1 s is more than 62 ticks", n.header)

    def test_modes(self):
        m, x, w = self.model()
        self.refused("'v' is no switch .allowed: w", lambda: m.modes("a", {"on": {sp.Symbol("v"): 1}}))
        self.refused("'x' is no switch", lambda: m.modes("a", {"on": [x]}))
        self.refused("a switch at 2", lambda: m.modes("a", {"on": {w: 2}}))
        self.refused("are the same switches", lambda: m.modes("a", {"on": {w: 1}, "also": [w]}))
        self.refused("no modes", lambda: m.modes("a", {}))
        self.refused("no mode 'out' to be safe .allowed: on", lambda: m.modes("a", {"on": [w]}, safe="out"))
        m.modes("a", {"off": {w: 0}, "on": ["w"]})
        self.refused("mode set 'a' is said twice", lambda: m.modes("a", {"on": [w]}))

    def test_symbols_of_the_same_name_are_the_model_s(self):
        m, x, w = self.model()
        m.rate(x, -sp.Symbol("x") + sp.Symbol("w"))
        m.output(x)
        self.assertIn("w - x", m.header())

    def test_without_sympy_the_package_works_and_says_what_to_install(self):
        code = ("import sys\nsys.modules['sympy'] = None\nimport solenoid\nfrom solenoid.model import Model\n"
                "assert 'default' in solenoid.campaigns()\n"
                "try:\n  Model('x')\nexcept ImportError as e:\n  print(e)")
        said = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True).stdout
        self.assertIn("apt-get install python3-sympy", said)

    def test_without_compiler_or_headers_it_says_what_to_install(self):
        right = json.loads(pathlib.Path(solenoid.__file__).with_name("_build.json").read_text())
        folder = pathlib.Path(tempfile.mkdtemp(dir=FOLDER.name))
        for change, words in (({"compilers": ["g++-none"]}, "apt-get install g\\+\\+"),
                              ({"own_includes": ["/nowhere"]}, "apt-get install libsolenoid-dev"),
                              ({"includes": ["/nowhere"]}, "apt-get install libsolenoid-dev")):
            (folder / "_build.json").write_text(json.dumps({**right, **change}))
            with mock.patch.object(_compiler, "_HERE", folder), self.assertRaisesRegex(RuntimeError, words):
                fishing("nowhere").build()

    def test_a_compiler_s_error_is_told_with_its_log(self):
        real = _plugin_files.sources

        def broken(model):
            files = real(model)
            return {k: v.replace("S(c0_)", "S(no_such_name)") for k, v in files.items()}

        with mock.patch.object(_plugin_files, "sources", broken), self.assertRaises(RuntimeError) as caught:
            fishing("broken").build()
        text = str(caught.exception)
        self.assertRegex(text, r"model 'broken' does not compile: broken\.hpp:\d+:.*error.*no_such_name.*\(log: .*\)")
        self.assertNotIn("\n", text)
        self.assertIn("no_such_name", pathlib.Path(text.split("(log: ")[1].rstrip(")")).read_text())
        self.assertEqual([f for f in os.listdir(CACHE + "/solenoid/models") if "broken" in f and "." not in f[1:]], [])


BUILD = ("import sys; sys.path.insert(0, {tests!r})\nimport test_model, os\nos.environ['XDG_CACHE_HOME'] = {cache!r}\n"
         "print(test_model.fishing().build().library)")


class System(unittest.TestCase):
    """The whole way, with one plug-in."""

    @classmethod
    def setUpClass(cls):
        # Two processes at once: one compiles, the other takes what it made.
        code = BUILD.format(tests=str(pathlib.Path(__file__).parent), cache=CACHE)
        begin = time.monotonic()
        both = [subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) for _ in range(2)]
        said = [p.communicate()[0].strip() for p in both]
        print(f"compiled in {time.monotonic() - begin:.1f} s", file=sys.stderr)
        assert [p.returncode for p in both] == [0, 0], said
        cls.said = said
        with mock.patch.object(subprocess, "Popen", side_effect=AssertionError("compiles again")), \
                mock.patch.object(_compiler.subprocess, "run", wraps=subprocess.run) as asked:
            asked.side_effect = lambda *a, **k: mock.Mock(stdout=VERSION)
            cls.built = fishing().build()

    def variant(self, solver, **keys):
        return solenoid.variant(f"mine_{solver}", system="fishing", solver=solver, **keys)

    def task(self, **keys):
        return solenoid.scenario("task", system="fishing", trajectory={}, duration_s=6.0, **keys)

    def test_it_is_compiled_once(self):
        self.assertEqual(set(self.said), {str(self.built.library)})
        self.assertEqual(self.built.name, "fishing")
        self.assertEqual((self.built.folder / "fishing.hpp").read_text(), self.built.header)
        self.assertEqual(len([f for f in os.listdir(CACHE + "/solenoid/models") if f.startswith("fishing-") and
                              not f.endswith(".lock")]), 1)
        self.assertEqual(fishing().build(), self.built)
        other = fishing()
        other.horizon([1])
        with self.assertRaisesRegex(solenoid.ConfigError, "another model of this name"):
            other.build()

    def test_its_campaign_is_known(self):
        for name in ("fishing_search", "fishing_exhaustive", "fishing_rounded"):
            self.assertIn(name, solenoid.variants())
        runs = solenoid.run_campaign("fishing", variants=["fishing_search"], jobs=1)
        self.assertEqual([r["status"] for r in runs], ["ok"])

    def test_what_the_page_shows_runs(self):
        """The page's first listing is the model of fishing(): nothing is compiled, and another is refused."""
        page = pathlib.Path(os.environ["SOLENOID_SOURCE_DIR"], "docs/how-to/python-models.md").read_text(encoding="utf-8")
        blocks = [[]]
        for line in page.splitlines():
            if line.startswith("    "):
                blocks[-1].append(line[4:])
            elif line and blocks[-1]:
                blocks.append([])
            elif line:
                continue
            elif blocks[-1]:
                blocks[-1].append("")
        listing, variations = (block for block in blocks if block)
        self.assertLessEqual(len([line for line in listing if line]), 30)
        names = {"print": lambda text: None}
        exec(compile("\n".join(listing), "python-models.md", "exec"), names)
        self.assertEqual(names["system"], self.built)
        found = names["found"]
        self.assertEqual(found.failed, [])
        objective = {run["variant"]: run["objective"] for run in found.runs}
        self.assertEqual(set(objective), {"fishing_exhaustive", "fishing_search", "fishing_rounded", "fisher"})
        self.assertEqual(objective["fishing_search"], objective["fishing_exhaustive"])
        self.assertAlmostEqual(objective["fishing_rounded"] / objective["fishing_search"], 1.0, delta=0.01)
        self.assertGreater(objective["fisher"], 1.2 * objective["fishing_search"])
        for name in objective:
            self.assertIn(name, str(found))
        exec(compile("\n".join(variations), "python-models.md", "exec"), names)
        self.assertEqual([run["status"] for run in names["others"].runs], ["ok"] * 2)

    def test_the_program_has_it_as_a_plug_in(self):
        program, library = os.environ["SOLENOID_PROGRAM"], str(self.built.library)
        out = FOLDER.name + "/compared"
        for command in (["compare", "fishing", "--out", out], ["report", out, "--out", FOLDER.name + "/report.html"],
                        ["profile", "fishing", "--variant", "fishing_search", "--passes", "2"],
                        ["run", "fishing_search", "--plant", "sim", "--duration", "1", "--out", FOLDER.name + "/run"]):
            done = subprocess.run([program, "--plugin", library, *command], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, (command, done.stdout, done.stderr))
            self.assertTrue(command[0] == "report" or "fishing_search" in done.stdout, done.stdout)

    def test_searches_find_what_every_sequence_gives(self):
        search, every = (solenoid.simulate(self.variant(s), self.task()) for s in ("branch_and_bound", "exhaustive"))
        np.testing.assert_array_equal(search.cost, every.cost)
        np.testing.assert_array_equal(search.switches, every.switches)
        self.assertLess(search.nodes.sum(), every.nodes.sum())

    def test_relaxed_is_below_integer_is_below_rounded(self):
        first = {}
        for solver in ("exhaustive", "sum_up_rounding", "cia"):
            run = solenoid.simulate(self.variant(solver), self.task())
            first[solver] = run.cost[run.solved][0]
        self.assertLessEqual(first["exhaustive"], first["sum_up_rounding"] + 1e-12)
        self.assertLessEqual(first["exhaustive"], first["cia"] + 1e-12)

    def test_sqp_and_ipopt_agree(self):
        runs = {s: solenoid.simulate(self.variant(s), self.task()) for s in ("sqp", "ipopt")}
        self.assertAlmostEqual(runs["sqp"].metrics.objective, runs["ipopt"].metrics.objective, places=4)
        weighted = solenoid.simulate(self.variant("sqp", cost={"switching": 1e-3}), self.task())
        self.assertGreater(weighted.cost[weighted.solved][0], runs["sqp"].cost[runs["sqp"].solved][0])  # another size

    def test_the_plant_is_the_model(self):
        run = solenoid.simulate(self.variant("branch_and_bound", model={"c0": 0.5}), self.task(plant={"c1": 0.1}))
        model = Compiled(fishing("fish_rk4"))
        caught = 0.0
        for k in range(len(run) - 1):
            on = float(run.switches[k])
            right = model.rk4(([0.5, 0.1], list(run.truth[k]), [on], []), 0.05)
            np.testing.assert_allclose(run.truth[k + 1], [float(v) for v in right], rtol=1e-13)
            caught += 0.05 * on * (0.5 * run.truth[k, 0] + 0.1 * run.truth[k, 1])
        self.assertAlmostEqual(run.metrics.catch_t, caught, delta=0.05)
        self.assertGreater(caught, 0.1)

    def test_parameters_outside_their_range_are_refused(self):
        with self.assertRaisesRegex(solenoid.ConfigError, "c0.*allowed"):
            self.variant("branch_and_bound", model={"c0": -1.0})


VERSION = subprocess.run([*_compiler.toolchain().compiler, "--version"], capture_output=True, text=True).stdout

if __name__ == "__main__":
    try:
        unittest.main()
    finally:
        FOLDER.cleanup()
