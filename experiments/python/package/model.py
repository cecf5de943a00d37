"""A system written in Python: states, inputs, parameters and their rates as SymPy expressions.

    m = solenoid.Model("fishing", "predator and prey, with a fleet that fishes or does not")
    x, y = m.state("prey", start=0.5, low=0.0), m.state("predator", start=0.7, low=0.0)
    w = m.switch("fishing")
    m.rate(x, x - x*y - 0.4*x*w)
    m.rate(y, x*y - y - 0.2*y*w)
    m.output(x, target=1.0)
    m.output(y, target=1.0)
    m.timing(tick_s=0.05, ticks_per_period=2)
    m.horizon(blocks=[1, 1, 2, 2, 4, 4, 6])
    system = m.build()  # C++, compiled once and kept; from here on a system like any other

Needs SymPy (python3-sympy) and, to build, a C++ compiler and the headers of libsolenoid-dev.
"""

from __future__ import annotations

import dataclasses
import keyword
import math
import pathlib
import re
from typing import Any, NoReturn

from ._core import ConfigError
from ._parts import Consumption, Input, Modes, Output, Parameter, State, Switch

# What a system may have at most (core/system/signals.hpp, core/mpc/mode_set.hpp).
MOST_STATES, MOST_MEASURED, MOST_INPUTS, MOST_AXES, MOST_SWITCHES, MOST_BLOCKS = 12, 6, 4, 4, 8, 20
INTEGRATORS = ("euler", "rk4", "exact")
CPP_WORDS = frozenset(
    "alignas alignof and and_eq asm auto bitand bitor bool break case catch char char8_t char16_t char32_t class co_await "
    "co_return co_yield compl concept const const_cast consteval constexpr constinit continue decltype default delete do "
    "double dynamic_cast else enum explicit export extern false float for friend goto if inline int long mutable namespace "
    "new noexcept not not_eq nullptr operator or or_eq private protected public register reinterpret_cast requires return "
    "short signed sizeof static static_assert static_cast struct switch template this thread_local throw true try typedef "
    "typeid typename union unsigned using virtual void volatile wchar_t while xor xor_eq".split())
NAMESPACES = frozenset({"std", "solenoid", "models", "xsimd"})  # a model has one of its own name


def _sympy():
    try:
        import sympy
    except ImportError:
        raise ImportError("models in Python need SymPy: apt-get install python3-sympy") from None
    return sympy


@dataclasses.dataclass(frozen=True)
class BuiltModel:
    """A model that has been compiled and loaded: a system by its name."""

    name: str
    header: str  # the C++ header's text
    folder: pathlib.Path  # with all sources
    library: pathlib.Path  # the plug-in, as `plugins = [...]` of a campaign and --plugin take it


class Model:
    """See the module. Whatever is said twice, is unknown or cannot be is a ConfigError (a ValueError) of one line."""

    def __init__(self, name: str, summary: str = ""):
        self.sympy = _sympy()
        self.name = str(name)
        self.summary = " ".join(str(summary).split()) or f"the model {name}, of Python"
        self.states: list[State] = []
        self.parameters: list[Parameter] = []
        self.switches: list[Switch] = []
        self.inputs: list[Input] = []
        self.rates: dict[Any, Any] = {}
        self.said_rates: dict[Any, Any] = {}  # as they were written
        self.outputs: list[Output] = []
        self.drawn: Consumption | None = None
        self.mode_sets: list[Modes] = []
        self.tick_s, self.ticks_per_period = 0.01, 1
        self.steps: int | None = None
        self.blocks: list[int] = [1, 1, 2, 2, 4]
        self.duration_s: float | None = None
        self.switching = 0.0
        self.integrator = "rk4"
        self.relaxed = ("sqp", "ipopt")  # solvers that follow derivatives: each takes a compiler some seconds
        if not re.fullmatch(r"[a-z][a-z0-9_]{0,39}", self.name) or "__" in self.name or self.name.endswith("_") or \
                self.name in CPP_WORDS | NAMESPACES or keyword.iskeyword(self.name):
            self._refuse(f"'{self.name}' cannot be its name",
                         "a-z, then a-z, 0-9 and single _, at most 40, no word of C++ or Python")

    # What it has.

    def state(self, name: str, unit: str = "", start: float = 0.0, low: float = -math.inf, high: float = math.inf,
              sigma: float | None = None, process_sigma: float = 1e-3, rest: float = math.inf, meaning: str = "",
              scale: float | None = None):
        """A state, as a SymPy symbol. [low, high] is where the plant can be, `sigma` the noise it is measured with,
        `process_sigma` what changes it unknown to the model [unit/s^0.5], `rest` up to where it counts as at rest, `scale`
        by how much it moves over a horizon. Where no state says sigma all are measured, exactly."""
        symbol = self._symbol("state", name, len(self.states), MOST_STATES)
        low, high = self._range(f"state '{name}'", low, high)
        start = self._number(f"start of state '{name}'", start, low, high)
        if sigma is not None:
            sigma = self._positive(f"sigma of state '{name}'", sigma)
        if scale is not None:
            scale = self._positive(f"scale of state '{name}'", scale)
        process_sigma = self._number(f"process_sigma of state '{name}'", process_sigma, 0.0)
        rest = math.inf if rest == math.inf else self._positive(f"rest of state '{name}'", rest)
        self.states.append(State(symbol, name, self._text("unit", unit), start, low, high, sigma, process_sigma, rest,
                                 self._text("meaning", meaning), scale))
        return symbol

    def parameter(self, name: str, value: float, unit: str = "", low: float = -math.inf, high: float = math.inf,
                  meaning: str = ""):
        """A number that variants (`model`) and scenarios (`plant`) may set within [low, high], as a SymPy symbol."""
        symbol = self._symbol("parameter", name, len(self.parameters), 100)
        low, high = self._range(f"parameter '{name}'", low, high)
        value = self._number(f"value of parameter '{name}'", value, low, high)
        self.parameters.append(Parameter(symbol, name, value, self._text("unit", unit), low, high,
                                         self._text("meaning", meaning)))
        return symbol

    def switch(self, name: str, min_dwell_s: float = 0.0, rise_delay_s: float = 0.0, fall_delay_s: float = 0.0):
        """A switched input, 0 or 1, with a switch of its own, as a SymPy symbol. Rates had best be affine in it: solvers
        that relax the problem put numbers between 0 and 1 there."""
        symbol = self._symbol("switch", name, len(self.switches), MOST_SWITCHES)
        times = [self._number(f"{what} of switch '{name}'", value, 0.0) for what, value in
                 (("min_dwell_s", min_dwell_s), ("rise_delay_s", rise_delay_s), ("fall_delay_s", fall_delay_s))]
        self.switches.append(Switch(symbol, name, *times))
        return symbol

    def input(self, name: str, most: float = 1.0, unit: str = "", weight: float = 0.0):
        """A continuous input of magnitude `most` at most, as a SymPy symbol; `weight` of its square in the cost."""
        symbol = self._symbol("input", name, len(self.inputs), MOST_INPUTS)
        most = self._positive(f"most of input '{name}'", most)
        weight = self._number(f"weight of input '{name}'", weight, 0.0)
        self.inputs.append(Input(symbol, name, most, self._text("unit", unit), weight))
        return symbol

    # What is said of it.

    def rate(self, state, expression):
        """The time derivative of a state."""
        of = self._state("rate", state)
        if of.symbol in self.rates:
            self._refuse(f"rate of state '{of.name}' is said twice", "once a state")
        said = self._expression(f"rate of state '{of.name}'", expression,
                                self.states + self.parameters + self.switches + self.inputs)
        self.said_rates[of.symbol] = said
        self.rates[of.symbol] = self._exact(said)

    def output(self, state, weight: float = 1.0, terminal: float = 0.0, target: float = 0.0, rate_of=None):
        """Has a state tracked: default weights of its squared error, at each step and at the last, and what is desired of
        it where a scenario has no motion for it. `rate_of`: an output whose rate this one is."""
        of = self._state("output", state)
        if any(o.state is of for o in self.outputs):
            self._refuse(f"output '{of.name}' is said twice", "once a state")
        first = None
        if rate_of is not None:
            first = self._state(f"rate_of of output '{of.name}'", rate_of)
            known = [o.state.name for o in self.outputs if o.rate_of is None]
            if first.name not in known:
                self._refuse(f"output '{of.name}' is the rate of '{first.name}', which is no output before it",
                             ", ".join(known) or "none yet")
        self.outputs.append(Output(of, self._number(f"weight of output '{of.name}'", weight, 0.0),
                                   self._number(f"terminal of output '{of.name}'", terminal, 0.0),
                                   self._number(f"target of output '{of.name}'", target), first))

    def consumption(self, name: str, unit: str, rate):
        """What is used up, as a rate [unit/s] of states, switched inputs and parameters."""
        if self.drawn:
            self._refuse("consumption is said twice", "once")
        self._check_name("consumption", name)
        self.drawn = Consumption(name, self._text("unit", unit),
                                 self._exact(self._expression(f"consumption '{name}'", rate,
                                                              self.states + self.parameters + self.switches)))

    def modes(self, name: str, modes, safe: str | None = None):
        """A mode set: a dictionary from a mode's name to the switches that are on in it, as {switch: 1} or a collection.
        `safe` is the mode that switches stand at before the first command (without it: all off, or the first)."""
        self._check_name("mode set", name)
        if any(m.name == name for m in self.mode_sets):
            self._refuse(f"mode set '{name}' is said twice", "once a name")
        if not isinstance(modes, dict) or not modes:
            self._refuse(f"mode set '{name}' has no modes", "a dictionary from names to switches that are on")
        patterns: dict[str, int] = {}
        for mode, on in modes.items():
            self._check_name(f"mode of '{name}'", mode)
            pattern = 0
            for switch in on:
                value = on[switch] if isinstance(on, dict) else 1
                if value not in (0, 1):
                    self._refuse(f"mode '{mode}' of '{name}' has a switch at {value}", "0, 1")
                pattern |= int(value) << self._switch(f"mode '{mode}' of '{name}'", switch)
            same = next((other for other, p in patterns.items() if p == pattern), None)
            if same is not None:
                self._refuse(f"modes '{same}' and '{mode}' of '{name}' are the same switches", "each once")
            patterns[mode] = pattern
        if safe is not None and safe not in patterns:
            self._refuse(f"mode set '{name}' has no mode '{safe}' to be safe", ", ".join(patterns))
        self.mode_sets.append(Modes(name, patterns, None if safe is None else patterns[safe]))

    def timing(self, tick_s: float, ticks_per_period: int = 1, duration_s: float | None = None):
        """The model step, how many of them a decision holds, and the duration of the system's own task (three horizons)."""
        self.tick_s = self._positive("tick_s", tick_s)
        self.ticks_per_period = self._whole("ticks_per_period", ticks_per_period, 1, 1000)
        self.duration_s = None if duration_s is None else self._positive("duration_s", duration_s)

    def horizon(self, blocks, steps: int | None = None, switching: float = 0.0):
        """The default horizon: blocks [periods] over each of which a mode is held; steps [ticks] for solvers without
        blocks, as many as those of the blocks. `switching`: default weight of a switch's change."""
        self.blocks = [self._whole("a block of the horizon", b, 1, 10000) for b in blocks]
        if not 1 <= len(self.blocks) <= MOST_BLOCKS:
            self._refuse(f"horizon has {len(self.blocks)} blocks", f"1 to {MOST_BLOCKS}")
        self.steps = None if steps is None else self._whole("steps of the horizon", steps, 1, 100000)
        self.switching = self._number("switching", switching, 0.0)

    # What becomes of it.

    def header(self) -> str:
        """The C++ header's text."""
        self.check()
        from . import _expressions, _header

        try:
            return _header.Header(self).text()
        except _expressions.Refused as problem:
            self._refuse_line(str(problem))

    def save(self, folder) -> pathlib.Path:
        """Writes the plug-in to keep: header, sources, campaign, CMakeLists.txt, test. The folder must not be there or be
        empty."""
        self.check()
        from . import _expressions, _kept

        try:
            return _kept.save(self, folder)
        except _expressions.Refused as problem:
            self._refuse_line(str(problem))

    def build(self):
        """Writes C++, compiles it where the same has not been compiled before, and loads it: a BuiltModel with `name`,
        `header`, `folder` and `library`. Throws RuntimeError where the compiler fails or is missing."""
        self.check()
        from . import _compiler

        return _compiler.build(self)

    def check(self):
        """Throws ConfigError where something is missing."""
        if self.integrator not in INTEGRATORS:
            self._refuse(f"integrator '{self.integrator}'", ", ".join(INTEGRATORS))
        if not set(self.relaxed) <= {"sqp", "ipopt"}:
            self._refuse(f"relaxed = {self.relaxed!r}", "of 'sqp' and 'ipopt' both, one or none")
        if not self.states:
            self._refuse("it has no state", f"1 to {MOST_STATES}")
        if not self.switches:
            self._refuse("it has no switch", f"1 to {MOST_SWITCHES}")
        for s in self.states:
            if s.symbol not in self.rates:
                self._refuse(f"state '{s.name}' has no rate", "one each: rate(state, expression)")
        if not self.outputs:
            self._refuse("it has no output: nothing is tracked", f"1 to {MOST_AXES}, and rates of them")
        axes = sum(o.rate_of is None for o in self.outputs)
        if axes > MOST_AXES:
            self._refuse(f"{axes} outputs are no rates", f"at most {MOST_AXES}")
        measured = self._measured()
        if len(measured) > MOST_MEASURED:
            self._refuse(f"{len(measured)} states are measured", f"at most {MOST_MEASURED}: say sigma of those that are")
        for o in self.outputs:
            if o.rate_of is None and not any(m is o.state for m in measured):
                self._refuse(f"output '{o.state.name}' is not measured", "outputs whose state says sigma")
        if self.drawn and self.drawn.name in self._names():
            self._refuse(f"consumption '{self.drawn.name}' has the name of another thing", "a name of its own")
        longest = max(max(s.min_dwell_s, s.rise_delay_s, s.fall_delay_s) for s in self.switches)
        if longest > 62.5 * self.tick_s:
            self._refuse(f"a dwell or delay of {longest:g} s is more than 62 ticks of {self.tick_s:g} s",
                         f"at most {62 * self.tick_s:g} s, or a longer tick")

    # Answers to who writes C++.

    def _measured(self) -> list[State]:
        said = [s for s in self.states if s.sigma is not None]
        return said or self.states

    def _sets(self) -> list[Modes]:
        """The mode sets; where none is said every combination of switches."""
        if self.mode_sets:
            return self.mode_sets
        if len(self.switches) == 1:
            return [Modes("all", {"off": 0, "on": 1}, None)]
        return [Modes("all", {"_".join(s.name for c, s in enumerate(self.switches) if p >> c & 1) or "none": p
                              for p in range(1 << len(self.switches))}, None)]

    @property
    def _class_name(self) -> str:
        name = "".join(part.capitalize() for part in self.name.split("_"))
        return f"{name}Model" if name in ("Vector", "Exact", "Series") else name  # what a header has beside it

    @property
    def _horizon_steps(self) -> int:
        return self.steps or sum(self.blocks) * self.ticks_per_period

    # Checks.

    def _refuse(self, what: str, allowed: str) -> NoReturn:
        self._refuse_line(f"{what} (allowed: {allowed})")

    def _refuse_line(self, line: str) -> NoReturn:
        raise ConfigError(f"model '{self.name}': {' '.join(line.split())}") from None

    def _names(self):
        return [v.name for v in [*self.states, *self.parameters, *self.switches, *self.inputs]]

    def _check_name(self, kind, name):
        if not isinstance(name, str) or not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,39}", name) or "__" in name or \
                name.endswith("_"):
            self._refuse(f"{kind} '{name}' is no name", "a letter, then letters, digits and single _, at most 40")

    def _symbol(self, kind, name, there, most):
        self._check_name(kind, name)
        if name in CPP_WORDS or keyword.iskeyword(name):
            self._refuse(f"{kind} '{name}' is a word of C++ or Python", "other names")
        if name in self._names():
            self._refuse(f"'{name}' is said twice", "each name once")
        if there >= most:
            self._refuse(f"{kind} '{name}' is one too many", f"at most {most}")
        return self.sympy.Symbol(name, real=True)

    def _number(self, what, value, low=-math.inf, high=math.inf):
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):
            number = math.nan
        if not math.isfinite(number) or not low <= number <= high:
            within = "a number" if (low, high) == (-math.inf, math.inf) else f"{low:g} to {high:g}"
            self._refuse(f"{what} is {value}", within)
        return number

    def _positive(self, what, value):
        number = self._number(what, value, 0.0)
        if number == 0.0:
            self._refuse(f"{what} is {value}", "more than 0")
        return number

    def _whole(self, what, value, low, high):
        number = self._number(what, value)
        if number != int(number) or not low <= number <= high:
            self._refuse(f"{what} is {value}", f"a whole number, {low} to {high}")
        return int(number)

    def _range(self, what, low, high):
        try:
            low, high = float(low), float(high)
        except (TypeError, ValueError):
            low = high = math.nan
        if not low < high:
            self._refuse(f"{what} is from {low} to {high}", "numbers, low below high")
        return low, high

    def _text(self, what, text):
        if not isinstance(text, str) or not text.isprintable() or len(text) > 200 or text.endswith("\\"):
            self._refuse(f"{what} {text!r}", "text of one line, at most 200 characters, not ending with \\")
        return text

    def _find(self, kind, things, thing):
        name = getattr(thing, "name", thing)
        for index, one in enumerate(things):
            if one.name == name:
                return index
        return None

    def _state(self, what, state) -> State:
        index = self._find("state", self.states, state)
        if index is None:
            self._refuse(f"{what}: '{state}' is no state", ", ".join(s.name for s in self.states) or "none yet")
        return self.states[index]

    def _switch(self, what, switch) -> int:
        index = self._find("switch", self.switches, switch)
        if index is None:
            self._refuse(f"{what}: '{switch}' is no switch", ", ".join(s.name for s in self.switches) or "none yet")
        return index

    def _expression(self, what, expression, things):
        """With this model's own symbols in the place of those of the same names."""
        sp = self.sympy
        try:
            expression = sp.sympify(expression)
        except (sp.SympifyError, TypeError, AttributeError):
            expression = None
        if not isinstance(expression, sp.Expr):
            self._refuse(f"{what} is no expression", "numbers and SymPy expressions")
        known = {t.name: t.symbol for t in things}
        for symbol in sorted(expression.free_symbols, key=str):
            if symbol.name not in known:
                self._refuse(f"{what} has '{symbol}', which it cannot depend on", ", ".join(known))
        expression = expression.xreplace({s: known[s.name] for s in expression.free_symbols})
        if expression.has(sp.nan, sp.zoo, sp.oo, -sp.oo, sp.I):
            self._refuse(f"{what} is '{expression}'", "finite real numbers")
        return expression

    def _exact(self, expression):
        """With fractions in the place of floating-point numbers: 0.1 is one tenth, and nothing is rounded on the way."""
        sp = self.sympy
        return expression.xreplace({f: sp.Rational(repr(float(f))) for f in expression.atoms(sp.Float)})
