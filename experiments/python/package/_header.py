"""The C++ header of a model: what core/mpc/hybrid_model.hpp asks of one, for any scalar."""

from __future__ import annotations

import itertools

import sympy as sp

from . import _expressions as ex

WIDTH = 120


def wrapped(line, indent):
    """A statement in lines of at most WIDTH, broken behind operators and commas."""
    lines, room = [], WIDTH - indent
    text = line
    while len(text) > room:
        at = max(text.rfind(sign, 0, room) + len(sign) for sign in (" + ", " - ", " * ", ", ", " / ", "? ", " = "))
        if at < 20:
            break
        lines.append(text[:at].rstrip())
        text = text[at:]
        room = WIDTH - indent - 4
    lines.append(text)
    return "\n".join(" " * (indent + (4 if k else 0)) + part for k, part in enumerate(lines))


class Header:
    """Writes one; `model` is a solenoid.Model that has been checked."""

    def __init__(self, model):
        self.model = model
        self.states = [s.symbol for s in model.states]
        self.switched = [s.symbol for s in model.switches]
        self.inputs = [u.symbol for u in model.inputs]
        self.parameters = [p.symbol for p in model.parameters]
        self.rates = [model.rates[s] for s in self.states]
        self.constants = ex.Constants(self.parameters)
        self.inexact = any(r.has(*ex.INEXACT) or _has_power(r) for r in self.rates)
        self.includes = set()
        self.roles = {**{p: 0 for p in self.parameters}, **{s: 1 for s in self.switched + self.inputs},
                      **{x: 2 for x in self.states}}
        self.scheme = {"euler": Euler, "rk4": RungeKutta, "exact": exact_scheme}[model.integrator](self)

    # Bodies.

    def reads(self):
        """The C++ of each symbol; a local whose name C++ or this header takes for something else has a longer one."""
        return {s: s.name if s.name not in TAKEN else f"{s.name}_value" for s in self.roles}

    def block(self):
        return ex.Block(self.constants, self.roles, self.reads())

    def trial(self):
        return ex.Block(ex.Constants(self.parameters), self.roles, self.reads())

    def body(self, expressions, indent=4, choose=True):
        """Statements that compute expressions, and the C++ of each."""
        if choose:
            expressions = ex.cheapest(expressions, self.trial)
        block = self.block()
        items = block.lower(expressions)
        texts = [i.text for i in items]
        everything = " ".join(block.lines + texts)
        lines = []
        using = [f"std::{name}" for name in ("abs", "max", "min") if f"{name}(" in everything]
        if "select(" in everything:
            using.append("solenoid::select")
        if using:
            lines.append(f"using {', '.join(using)};")
        if any(name in everything for name in ("exponential<", "logarithm<", "hyperbolic_tangent<", "power<", "sine<",
                                               "cosine<", "square_root<")):
            self.includes.add("solenoid/solvers/search/model_functions.hpp")
        if any(f"{name}(" in everything for name in ("max", "min")):
            self.includes.add("algorithm")
        reads = self.reads()
        for vector, symbols in (("state", self.states), ("switched", self.switched), ("continuous", self.inputs)):
            lines += [f"const S& {reads[s]} = {vector}[{i}];" for i, s in enumerate(symbols) if s in block.used]
        return [wrapped(line, indent) for line in lines + block.lines], texts

    def arguments(self, body, *vectors):
        """Parameters of a function over vectors, those that the body does not use without a name."""
        shapes = {"state": len(self.states), "switched": len(self.switched), "continuous": len(self.inputs)}
        return ", ".join(f"const Vector<S, {shapes[v]}>&" + (f" {v}" if f"{v}[" in body or f"{v}," in body or
                                                            f"{v})" in body else "") for v in vectors)

    def function(self, name, expressions, vectors, about, returns=None):
        """A private or public function of S that returns expressions as a vector, or one as a scalar."""
        lines, texts = self.body(expressions)
        if returns == "S":
            last = [wrapped(f"return {texts[0]};", 4)]
        else:
            last = self.returned(texts)
        text = "\n".join(lines + last)
        head = wrapped(f"{returns or f'Vector<S, {len(expressions)}>'} {name}({self.arguments(text, *vectors)}) const {{", 2)
        return "\n".join([f"  /// {about}", "  template <class S>", head, text, "  }"])

    @staticmethod
    def returned(texts, indent=4, begin="return {"):
        one = begin + ", ".join(texts) + "};"
        if len(one) + indent <= WIDTH:
            return [" " * indent + one]
        return [" " * indent + begin] + [wrapped(t + ("," if k + 1 < len(texts) else "};"), indent + 4)
                                              for k, t in enumerate(texts)]

    # The whole.

    def text(self):
        m = self.model
        public, private = self.scheme.functions()
        output = self.function_of_outputs()
        consumption = []
        if m.drawn:
            consumption = [self.function("consumption", [m.drawn.rate], ("state", "switched"),
                                         f"{_sentence(m.drawn.name)} [{m.drawn.unit}/s].", "S")]
        scale = []
        if any(s.scale is not None for s in m.states):
            values = ", ".join(ex.number_text(1.0 if s.scale is None else s.scale) for s in m.states)
            scale = ["  /// By how much the states move over a horizon.",
                     f"  Vector<double, {len(m.states)}> state_scale() const {{ return {{{values}}}; }}"]
        constructor = self.constructor()
        members = self.members()
        sizes = wrapped(f"static constexpr std::size_t state_size = {len(m.states)}, switched_size = {len(m.switches)}, "
                        f"continuous_size = {len(m.inputs)}, output_size = {len(m.outputs)};", 2)
        includes = sorted(i for i in self.includes if "/" not in i) + ["cmath", "span"]
        ours = sorted({i for i in self.includes if "/" in i} | {"solenoid/core/mpc/hybrid_model.hpp"})
        pieces = ["#pragma once", "", *(f"#include <{i}>" for i in sorted(set(includes))), "",
                  *(f"#include <{i}>" for i in ours), "", f"namespace models::{m.name} {{", "", "using solenoid::Vector;", "",
                  *self.about(),
                  f"class {m._class_name} {{", " public:", sizes, "", *constructor, ""]
        pieces += ["\n\n".join([*public, output, *consumption, "\n".join(scale)] if scale else
                               [*public, output, *consumption])]
        if private or members:
            pieces += ["", " private:"] + ["\n\n".join(private)] * bool(private)
            pieces += [""] * bool(private and members) + members
        pieces += ["};", "", f"}}  // namespace models::{m.name}", ""]
        text = "\n".join(pieces)
        return text

    def about(self):
        m = self.model
        lines = [f"{_sentence(m.summary)}:", ""]
        lines += [f"    d {s.name}/dt = {sp.sstr(m.said_rates[s.symbol])}" for s in m.states]
        lines.append("")
        for kind, all_of in (("state", m.states), ("switched", m.switches), ("continuous", m.inputs)):
            said = ", ".join(f"{s.name}{f' [{s.unit}]' if getattr(s, 'unit', '') else ''}" +
                             (f", {s.meaning}" if getattr(s, "meaning", "") else "") for s in all_of)
            if said:
                lines.append(f"{kind:<12}{said}")
        lines.append(f"{'output':<12}{', '.join(o.state.name for o in m.outputs)}")
        lines += ["", *self.scheme.about]
        wrapped_lines = []
        for line in lines:
            wrapped_lines += wrapped(line, 4).split("\n") if line else [""]
        return [("///" + " " + line[4:]).rstrip() if line else "///" for line in wrapped_lines]

    def constructor(self):
        m, c = self.model, self.constants
        names = ", ".join(p.name for p in m.parameters)
        about = f"  /// {names}, in this order." if names else "  /// It has no parameters."
        first = [f"{c.names[p.symbol]}(p[{i}])" for i, p in enumerate(m.parameters)]
        later = [f"{name}({ex.double_text(e, {k: v for k, v in c.names.items() if k in c.parameters})})"
                 for name, e in c.derived]
        initial = first + later
        argument = "std::span<const double>" + (" p" if first else "")
        body = self.scheme.constructor_body()
        head = f"  explicit {m._class_name}({argument})"
        if initial:
            head += "\n      : " + ",\n        ".join(wrapped(i, 8).lstrip() for i in initial)
        head += " {" + ("\n" + "\n".join(body) + "\n  }" if body else "}")
        return [wrapped(about.strip(), 2).replace("\n    ", "\n  /// "), head]

    def members(self):
        c = self.constants
        lines = []
        for p in self.model.parameters:
            said = " ".join(filter(None, [f"[{p.unit}]" if p.unit else "", p.meaning]))
            lines.append(f"  double {c.names[p.symbol]};" + (f"  // {said}" if said else ""))
        lines += [f"  double {name};" + _comment(e) for name, e in c.derived]
        return lines + self.scheme.members()

    def function_of_outputs(self):
        values = ", ".join(f"state[{self.states.index(o.state.symbol)}]" for o in self.model.outputs)
        return "\n".join(["  template <class S>", f"  Vector<S, {len(self.model.outputs)}> output(const Vector<S, "
                          f"{len(self.states)}>& state) const {{", f"    return {{{values}}};", "  }"])

    def step_head(self):
        n, s, u = len(self.states), len(self.switched), len(self.inputs)
        begin = f"  Vector<S, {n}> step("
        return ["  template <class S>", f"{begin}const Vector<S, {n}>& state, const Vector<S, {s}>& switched,",
                f"{' ' * len(begin)}const Vector<S, {u}>& continuous, double dt) const {{"]


class Scheme:
    """How the rates become a step."""

    about: list[str] = []

    def __init__(self, header):
        self.header = header

    def constructor_body(self):
        return []

    def members(self):
        return []

    def rates(self, expressions=None, name="rates", about="The time derivatives of the states.",
              vectors=("state", "switched", "continuous")):
        return self.header.function(name, expressions or self.header.rates, vectors, about)


class Euler(Scheme):
    about = ["A step is one of the explicit Euler method."]

    def functions(self):
        n = len(self.header.states)
        next_of = [f"state[{i}] + S(dt) * k[{i}]" for i in range(n)]
        return ["\n".join(self.header.step_head() + ["    const auto k = rates<S>(state, switched, continuous);"] +
                          self.header.returned(next_of) + ["  }"])], [self.rates()]


def after(n):
    """A local function for the stages of a Runge-Kutta method."""
    return ([f"    const auto after = [&](const Vector<S, {n}>& k, double time) {{",
             "      const S h(time);",
             wrapped(f"return Vector<S, {n}>{{" + ", ".join(f"S(state[{i}] + h * k[{i}])" for i in range(n)) + "};", 6),
             "    };"])


class RungeKutta(Scheme):
    about = ["A step is one of the classical Runge-Kutta method."]

    def functions(self):
        n = len(self.header.states)
        next_of = [f"state[{i}] + sixth * ((k1[{i}] + k4[{i}]) + two * (k2[{i}] + k3[{i}]))" for i in range(n)]
        held = "switched, continuous"
        lines = self.header.step_head() + after(n) + [
            f"    const auto k1 = rates<S>(state, {held});", f"    const auto k2 = rates<S>(after(k1, dt / 2), {held});",
            f"    const auto k3 = rates<S>(after(k2, dt / 2), {held});",
            f"    const auto k4 = rates<S>(after(k3, dt), {held});",
            "    const S sixth(dt / 6), two(2.0);"]
        return ["\n".join(lines + self.header.returned(next_of) + ["  }"])], [self.rates()]


def _has_power(expression):
    return any(not p.exp.is_Integer and not (p.exp.is_Rational and p.exp.q == 2) for p in expression.atoms(sp.Pow))


def _sentence(text):
    return text[:1].upper() + text[1:].rstrip(".") if text else "A model"


def _comment(expression):
    numbers = {r: sp.Float(r) for r in expression.atoms(sp.Rational) if r.q > 1000}
    text = sp.sstr(expression.xreplace(numbers))
    return f"  // {text}" if len(text) < 70 else ""


def exact_scheme(header):
    from . import _exact
    return _exact.scheme(header)


# What a local variable cannot be called: types, functions and locals of the header, macros of the C library.
TAKEN = frozenset(
    "S state switched continuous dt rates step output consumption abs max min select std solenoid models exact series "
    "k k1 k2 k3 k4 after h sixth two p slope drift rest linear corner NULL EOF I errno assert major minor linux unix i386 "
    "stdin stdout stderr NAN INFINITY BUFSIZ RAND_MAX Vector".split()) | frozenset(f"t{i}" for i in itertools.chain(range(400)))
