"""Controllers and solvers of one's own, and variants against each other.

    class Fisher:
        def step(self, measurement):
            return "on" if measurement.prey > 1.0 else "off"

    mine = solenoid.PythonController("mine", Fisher, system="fishing")  # a system of solenoid.Model
    print(solenoid.compare(["fishing_search", mine], "task", baseline="fishing_search"))

They are there in the Python process that made them, and are not real time: no rig, `solenoid run` or background thread
has them. A run's object is made in the run's own process, so that what one does to itself no other run sees.
"""

from __future__ import annotations

import inspect
import json
import os
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Union

from . import _core
from ._text import toml

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from . import Run, Scenario, Variant

Maker = Callable[..., Any]
Path = Union[str, "os.PathLike[str]"]


class _InPython:
    """A variant whose law or solver is an object of Python."""
    _row = ""
    _method = ""

    def __init__(self, name: str, make: Maker, /, system: Any = None, **keys: Any) -> None:
        if not callable(make):
            raise _core.ConfigError(
                f"variant '{name}': {make!r} makes nothing (allowed: a class, or a function that returns "
                f"an object with {self._method}())")
        _core.add_python_rows()
        table = {"solver": self._row, "summary": _summary(make), **keys}
        if system is not None:
            table["system"] = system if isinstance(system, str) else system.name
        self.name = name
        self.make = make
        self.variant: Variant = _core.variant_from(name, toml(table))
        self._register()

    @property
    def system(self) -> str:
        """Whose variant it is."""
        return self.variant.system

    def _register(self) -> Variant:
        make = self.make
        _core.register_python(self.name, lambda variant, scenario: _made(make, variant, scenario))
        return self.variant

    def __repr__(self) -> str:
        return f"<solenoid.{type(self).__name__} {self.name}, not real time>"


class PythonController(_InPython):
    """A variant whose law is written in Python.

    name     of the variant
    make     a class, or a function that returns an object: called once a run, in the run's process, without arguments
             or with (variant, scenario)
    system   its name, or a system that Model.build() made; default: the actuator
    keys     of the variant as in `variant()`, for instance the mode set and `estimator`

    The object has

    step(measurement)   called each tick; returns the pattern of a mode (bit c: switch c on), a mode's name, a Command,
                        or a pair of one of these and the continuous inputs, shape (inputs,), in SI units
    reset()             where it is there: called before the first tick, and when the task begins anew

    `measurement` (Measurement) has what is measured, estimated and desired. The estimator, limits, logs and metrics are
    those of every controller. What step raises ends its run, which has failed with the traceback; other runs go on. Its
    computing time is in no metric.
    """
    _row = "python_law"
    _method = "step"


class PythonSolver(_InPython):
    """A variant whose solver is written in Python, inside the predictive controller that shipped solvers have.

    name, make, system   as of PythonController
    keys                 of the variant: `horizon`, `cost`, `timing`, `deadline_ms` and so on

    The object has

    solve(problem)   called each control period; returns a mode for each block, by number or name, or a pair of these and
                     the continuous inputs, shape (blocks, inputs), which are cut at their bounds. None: there is no
                     plan, and the last one goes on
    reset()          where it is there: called before the first period

    `problem` is a PeriodProblem: `problem.cost(modes)` asks the model what plans cost.
    """
    _row = "python_solver"
    _method = "solve"


AnyVariant = Union[str, "Variant", PythonController, PythonSolver]


class Comparison:
    """Runs of variants in scenarios, and how the variants rank. Printed it is the table of `solenoid compare`."""

    def __init__(self, found: Any) -> None:
        self._found = found
        data: dict[str, Any] = json.loads(found.json())
        self.runs: list[dict[str, Any]] = data["runs"]
        """A dictionary each, as `solenoid compare --format json` has them; by scenario, then variant, then seed."""
        self.paired: dict[str, Any] | None = (data.get("paired") or [None])[0]
        """Variants against the baseline, task by task, as `solenoid compare --format json` has them; None of one variant."""
        self.folder: str = found.folder
        """Of the results, for `solenoid report` and `solenoid plot`; empty: none was written."""

    @property
    def failed(self) -> list[dict[str, Any]]:
        """The runs that failed: variant, scenario, seed and `message`, of a run in Python with its traceback."""
        start = "failed: "
        return [{key: run[key]
                 for key in ("variant", "scenario", "seed")} | {
                     "message": run["status"][len(start):]
                 } for run in self.runs if run["status"].startswith(start)]

    def table(self) -> NDArray[np.void]:
        """The runs as a structured array, shape (runs,); numbers of a run that did not end well are NaN."""
        from . import table
        return table(self.runs)

    def __str__(self) -> str:
        return str(self._found.text())

    def __repr__(self) -> str:
        return str(self._found.text())

    def _repr_html_(self) -> str:
        return str(self._found.html())


def compare(variants: AnyVariant | Iterable[AnyVariant],
            scenarios: str | Scenario | Iterable[str | Scenario] | None = None,
            *,
            seeds: int | Sequence[int] = 1,
            jobs: int = 0,
            baseline: str | None = None,
            out: Path | None = None,
            details: bool = False,
            tick_limit_s: float = 600.0) -> Comparison:
    """Runs variants in scenarios, each run in a process of its own, and ranks the variants.

    variants      shipped ones by name, Variant, PythonController and PythonSolver objects: all of one system
    scenarios     objects, or names of those of the system's shipped campaign; none: all of that
    seeds         how many, 1 to that, or which
    jobs          processes at a time; 0: one a core. The numbers are the same whatever it is
    baseline      the variant whose errors the others' are divided by, run by run; the best ranked, if none is said
    out           a results folder as `solenoid compare` writes it; runs that are there are not done again, but for
                  those in Python
    details       every run in the printed table
    tick_limit_s  a run that computes longer at a tick is stuck, and fails; 0: none is

    A run that fails is in `failed`, and harms no other. What is no variant or scenario is a ConfigError.
    """
    from . import configuration
    chosen = [variants] if isinstance(variants, (str, _core.Variant, _InPython)) else list(variants)
    single: Any = scenarios
    tasks = [single] if single is None or isinstance(single, (str, _core.Scenario)) else list(single)
    if not chosen:
        raise _core.ConfigError("variants: empty (allowed: at least one)")
    names, text = [], ""
    for one in chosen:
        made = ready(one)
        if isinstance(made, str):
            names.append(made)
        else:
            names.append(made.name)
            text += f"[variant.{json.dumps(made.name)}]\n{_text_of(made)}"
    if baseline is not None and baseline not in names:
        raise _core.ConfigError(f"baseline: '{baseline}' is not compared (allowed: {', '.join(names)})")
    first = ready(chosen[0])
    home = _core.home(first) if isinstance(first, str) else _core.campaign_of(first.system)
    for task in tasks:
        if task is None or isinstance(task, str):
            found = configuration(home, scenarios=() if task is None else [task])
            text += "".join("[[scenario]]\n" + toml(one) for one in found["scenario"])
        else:
            text += "[[scenario]]\n" + _text_of(task)
    which = list(range(1, seeds + 1)) if isinstance(seeds, int) else [int(seed) for seed in seeds]
    head = toml({"name": "compare", "variants": names, "seeds": which, **loaded()})
    folder = "" if out is None else os.fspath(out)
    return Comparison(_core.compare(head + text, folder, jobs, tick_limit_s, baseline or "", details))


def loaded() -> dict[str, list[str]]:
    """The key by which a campaign asks for the plug-ins of this process; nothing where there are none."""
    plugins = [plugin.name for plugin in _core.loaded_plugins()]
    return {"plugins": plugins} if plugins else {}


def simulate(variant: AnyVariant, scenario: Scenario, seed: int = 1) -> Run:
    """One run in this process. What a law or solver in Python raises is raised here."""
    made = ready(variant)
    if isinstance(made, str):
        from . import variant as variant_of
        made = variant_of(made)
    return _core.simulate(made, scenario, seed)  # type: ignore[no-any-return]


def ready(variant: AnyVariant) -> str | Variant:
    """A variant, or a shipped one's name; of those in Python the object is from now on the one of its name."""
    if isinstance(variant, _InPython):
        return variant._register()
    if isinstance(variant, (str, _core.Variant)):
        return variant
    raise _core.ConfigError(
        f"variants: {variant!r} is none (allowed: names, Variant, PythonController and PythonSolver)")


def _text_of(made: Any) -> str:
    text = getattr(made, "toml", None)
    if text is None:
        raise _core.ConfigError(f"{made!r} has no table (allowed: what variant() and scenario() made)")
    return str(text)


def _made(make: Maker, variant: Variant, scenario: Scenario | None) -> Any:
    try:
        inspect.signature(make).bind(variant, scenario)
    except (TypeError, ValueError):  # takes no two arguments, or does not tell
        return make()
    return make(variant, scenario)


def _summary(make: Maker) -> str:
    said = (inspect.getdoc(make) if inspect.isclass(make) or inspect.isroutine(make) else None) or ""
    return said.split("\n")[0].strip() or f"in Python: {getattr(make, '__qualname__', type(make).__qualname__)}"
