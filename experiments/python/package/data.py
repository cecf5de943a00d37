"""What the commands do to data, with NumPy in and out: campaigns, profiles, tuning, ledgers, reports.

Each function is the command of its name: the same defaults, the same files, the same numbers. What the command prints
with `--format json` is the `json` of what is returned. Where a command takes names of variants and scenarios, these
functions also take `Variant` and `Scenario` objects. Long work leaves other threads alone; Ctrl-C ends it with
KeyboardInterrupt.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._common import (Names, Path, Tasks, has_objects, is_number, listed, names_of, number, or_nan, path_text, rows,
                      source, structured, warn, whole)
from .control import AnyVariant

if TYPE_CHECKING:
    from . import Scenario, Variant
    from .instances import Instances, VariantInstances

Range = Union["tuple[float, float]", "tuple[float, float, str]"]


class Records(list[dict[str, Any]]):
    """The runs of a campaign, a dictionary each, as `solenoid compare --format json` has them.

    folder   where everything about them was written; None: nowhere
    table    the same as one structured array, a row a run: solenoid.table
    """

    folder: str | None = None

    @property
    def table(self) -> NDArray[np.void]:
        return table(self)


def run_campaign(campaign: Path | None = None,
                 *,
                 variants: Names = (),
                 scenarios: Tasks = (),
                 seeds: Sequence[int] | None = None,
                 jobs: int = 0,
                 out: Path | bool | None = None,
                 model: str = "",
                 tick_limit_s: float = 600.0) -> Records:
    """Every run of a campaign, a file or a shipped name ("default" if none is said), in processes (0 jobs: one a core).

    variants, scenarios   of the campaign, if not all: names, or objects, which need not be known to it
    seeds                 in place of the campaign's
    out                   the folder that results are written into as by `solenoid compare --out`, to be read by
                          read_results and report; one with finished runs is gone on with. True: a new one below
                          results/. None: nothing is written
    model                 every variant believes this parameter set or file, in place of its own
    tick_limit_s          a run that computes longer at one tick fails
    """
    path, text, names, tasks = source(campaign, variants, scenarios, seeds, "default")
    folder = None if out is None or out is False else "" if out is True else os.fspath(out)
    found, where = _core.campaign(path, text, names, tasks, str(model), folder, whole("jobs", jobs, 0, 4096),
                                  number("tick_limit_s", tick_limit_s, 0.0, 1e6))
    records = Records(json.loads(found)["runs"])
    records.folder = where
    return records


def table(records: Iterable[Mapping[str, Any]]) -> NDArray[np.void]:
    """Records of run_campaign or Results as one structured array, shape (runs,); what a run that did not end well lacks
    is NaN. Columns: variant, scenario, trajectory and status as text, every number in float64."""
    records = list(records)
    texts = ("variant", "scenario", "trajectory", "status")
    keys = sorted({key for record in records for key, value in record.items() if is_number(value)})
    columns = [(key, np.array([record[key] for record in records], dtype=np.str_)) for key in texts]
    columns += [(key, np.array([or_nan(record.get(key)) for record in records], dtype=float)) for key in keys]
    return structured(columns, len(records))


class Profile:
    """Solver times, as profile() measured them.

    variants    structured, a row a variant: name, instances, p50_us, p90_us, p99_us, p999_us, max_us [us], misses of
                the period, limit_misses, passes, the means rollout_us, derivatives_us, ... of the phases, and so on
    solves      structured, a row an instance: variant, record (its number among the variant's), time_us (the least of
                its passes), timed_us (the least of those with phase timing), which is the sum of rollout_us,
                derivatives_us, factorisation_us, bound_us and other_us; nodes
    quality     structured, a row a variant and budget, of the closed loops with every solve cut; none: no rows
    against     the comparison with an earlier profile, or None
    json        what the command prints
    """

    def __init__(self, found: str, solves: list[dict[str, Any]]) -> None:
        self.json: dict[str, Any] = json.loads(found)
        self.variants = rows(self.json["variants"])
        self.quality = rows(self.json.get("quality", []))
        self.against: dict[str, Any] | None = self.json.get("against")
        self.solves = structured(_solve_columns(solves), sum(len(one["time_us"]) for one in solves))

    def __repr__(self) -> str:
        return f"<solenoid.Profile of {len(self.solves)} instances of {', '.join(self.variants['name'])}>"


def profile(variants: Names = (),
            scenarios: Tasks = (),
            *,
            campaign: Path | None = None,
            instances: Path | Instances | VariantInstances | None = None,
            seeds: Sequence[int] | None = None,
            per_variant: int = 700,
            core: int | None = None,
            passes: int | None = None,
            limit_ms: float = 1.0,
            budgets_ms: Iterable[float] = (),
            record: Path | None = None,
            save: Path | None = None,
            against: Path | None = None,
            threshold: float = 1.2) -> Profile:
    """Solver time on recorded problems, and where it goes: `solenoid profile`.

    variants, scenarios   names or objects. With objects, scenarios or a campaign, closed loops are run and about
                          `per_variant` of their problems kept; otherwise the shipped problems are those
    campaign              file, shipped name, or a run's log.mcap
    instances             a file of problems, or problems in memory
    core, passes          the core to run on (the last this process may use); passes over the problems (until figures
                          settle)
    limit_ms              misses are counted at this, too
    budgets_ms            closed loops with every solve cut at these times
    record, save          files for the recorded problems, and for this profile
    against, threshold    an earlier profile, and the ratio that counts as slower
    """
    from .instances import as_bytes

    recorded = campaign is not None or record is not None or bool(listed(scenarios)) or has_objects(variants)
    if instances is not None and recorded:
        raise _core.ConfigError("instances: beside campaign, scenarios, record or a Variant (allowed: one of them)")
    path, text, names, tasks = source(campaign, variants, scenarios, seeds,
                                      "profile") if recorded else ("", "", names_of(variants), [])
    from_file = instances is None or isinstance(instances, (str, os.PathLike))
    file = os.fspath(instances) if instances is not None and from_file else ""  # type: ignore[arg-type]
    found, solves, problems = _core.profile(
        path,
        text,
        names,
        tasks,
        file,
        None if from_file else as_bytes(instances),  # type: ignore[arg-type]
        path_text(record),
        whole("per_variant", per_variant, 1, 1000000),
        -1 if core is None else whole("core", core, 0, 1023),
        0 if passes is None else whole("passes", passes, 1, 10000),
        number("limit_ms", limit_ms, 1e-4, 6e4),
        [number("budgets_ms", budget, 1e-4, 6e4) for budget in budgets_ms],
        path_text(save),
        path_text(against),
        number("threshold", threshold, 1.0, 1000.0))
    warn(problems)
    return Profile(found, solves)


class Tuning:
    """What tune() found.

    best, before   the values of the free keys: of the step chosen by the held-out scenarios, and before
    trials         structured, a row a step: each free key, then objective, the judged metric, efforts and so on of the
                   training scenarios, and the same with held_out_ before it, NaN where they were not looked at
    chosen         which step
    limits         of efforts, by their metrics' keys
    ended          "evaluations", "patience" or "converged"
    folder         of history.csv, history.svg and tuned.toml, a campaign of the variant before and after
    json           what the command prints
    """

    def __init__(self, found: str, folder: str) -> None:
        self.json: dict[str, Any] = json.loads(found)
        self.folder = folder
        self.variant: str = self.json["variant"]
        self.chosen: int = self.json["chosen"]
        self.limits: dict[str, float] = self.json["limits"]
        self.ended: str = self.json["ended"]
        steps = self.json["steps"]
        self.before: dict[str, float] = steps[0]["values"]
        self.best: dict[str, float] = steps[self.chosen]["values"]
        held_out = {f"held_out_{key}" for step in steps for key in step.get("held_out", {})}
        self.trials = rows([{
            **step["values"],
            **step["training"],
            **dict.fromkeys(sorted(held_out)),
            **{f"held_out_{key}": value
               for key, value in step.get("held_out", {}).items()}
        } for step in steps])

    def tuned(self) -> Variant:
        """The variant with the values found."""
        from . import variant

        return variant(f"{self.variant}_tuned", campaign=os.path.join(self.folder, "tuned.toml"))

    def __repr__(self) -> str:
        return f"<solenoid.Tuning of {self.variant}: {self.best} after {len(self.trials)} steps>"


def tune(variant: AnyVariant,
         free: Mapping[str, Range] | Iterable[str],
         *,
         campaign: Path | None = None,
         scenarios: Iterable[Scenario] = (),
         objective: str = "rmse",
         algorithm: str = "subplex",
         evaluations: int = 60,
         patience: int = 25,
         limits: Mapping[str, float] | None = None,
         jobs: int = 0,
         out: Path | None = None,
         progress: Callable[[str], object] | None = None) -> Tuning:
    """Searches a variant's numbers on training plants and judges them on held-out ones: `solenoid tune`.

    free         the keys and their ranges, {"cost.switching": (1e-9, 1e-6, "log"), "horizon.blocks.0": (1, 4, "whole")}
                 or texts as of --free
    campaign     file or shipped name ("tuning"); scenarios named held_out... judge, the others train
    scenarios    objects in their place
    objective    "rmse" or "step"
    evaluations  on the training scenarios, at most; patience: ends after so many without a better one
    limits       efforts that cost nothing, by key; none: what the variant needs as it is
    out          the folder; one with an interrupted run of the same settings is gone on with. None: a new one below
                 results/
    progress     is called with a line after each step (print)
    """
    path, text, names, _ = source(campaign, [variant], list(scenarios), None, "tuning")
    allowed = dict(limits or {})
    for key, limit in allowed.items():
        if not (limit > 0 and math.isfinite(limit)):
            raise _core.ConfigError(f"limits: {key} = {limit} (allowed: above 0)")
    found, folder = _core.tune(path, text, names[0], _free(free), str(objective), str(algorithm),
                               whole("evaluations", evaluations, 1, 100000), whole("patience", patience, 1, 100000),
                               allowed, whole("jobs", jobs, 0, 4096), path_text(out), progress)
    return Tuning(found, folder)


class Ledger:
    """How every kind of solver did on the same recorded problems, as ledger() kept it.

    entries      structured, a row a problem and method: variant, record, method, status, cost, bound (proven by branch
                 and bound), gap ((cost - bound) / bound), time_us; the cost of what is infeasible is infinite
    methods      structured, a row a variant and method: what the command's tables show
    violations   [(variant, record, what)] of the chain relaxed <= branch and bound = exhaustive <= every plan
    json         what the command prints
    """

    def __init__(self, found: str, entries: dict[str, Any]) -> None:
        self.json: dict[str, Any] = json.loads(found)
        self.entries = structured([(key, np.asarray(column) if len(column) else np.empty(0, dtype=np.str_))
                                   for key, column in entries.items()], len(entries["record"]))
        self.methods = rows([{
            "variant": one["name"],
            **method
        } for one in self.json["variants"] for method in one["methods"]])
        self.violations = [(one["name"], each["record"], each["what"]) for one in self.json["variants"]
                           for each in one["violations"]]


def ledger(variants: str | Iterable[str] = ("nine_state", "nine_state_4"),
           *,
           instances: Path | Instances | VariantInstances | None = None,
           states: int = 200,
           bonmin: int = 20,
           bonmin_limit_s: float = 5.0) -> Ledger:
    """Optimality gaps of every kind of solver on the same recorded problems: `solenoid ledger`.

    variants     whose problems; none: all there are
    instances    a file of problems, or problems in memory; none: the shipped ones
    states       problems a variant, spread evenly; bonmin: of these, how many Bonmin gets, bonmin_limit_s each
    """
    from .instances import as_bytes

    from_file = instances is None or isinstance(instances, (str, os.PathLike))
    file = os.fspath(instances) if instances is not None and from_file else ""  # type: ignore[arg-type]
    found, entries = _core.ledger(
        file,
        None if from_file else as_bytes(instances),  # type: ignore[arg-type]
        names_of(variants),
        whole("states", states, 1, 100000),
        whole("bonmin", bonmin, 0, 100000),
        number("bonmin_limit_s", bonmin_limit_s, 1e-3, 86400.0))
    return Ledger(found, entries)


class Results:
    """A results folder, read back.

    records         the runs that are there whole: Records
    table           the same as a structured array, a row a run
    ids             of the runs, in the same order: SCENARIO--VARIANT--sSEED
    configuration   the campaign, with everything it names in it, as a dictionary
    manifest        program, machine, times, status
    left_out        a line for each run whose files are damaged or missing
    """

    def __init__(self, folder: Path) -> None:
        import tomllib

        self._read = _core.ResultsFolder(os.fspath(folder))
        self.folder = os.fspath(folder)
        self.records = Records(json.loads(self._read.records)["runs"])
        self.records.folder = self.folder
        self.ids: list[str] = self._read.ids
        self.manifest: dict[str, Any] = json.loads(self._read.manifest)
        self.configuration: dict[str, Any] = tomllib.loads(self._read.configuration)

    @property
    def table(self) -> NDArray[np.void]:
        return table(self.records)

    @property
    def left_out(self) -> list[str]:
        lines: list[str] = self._read.left_out
        return lines

    def curves(self, id: str) -> NDArray[np.void]:
        """A run over time, structured, a row a sample: time_s [s] and each signal that its system keeps, in the units
        that units(id) says; numbers are rounded to what a report draws. ConfigError where there are none."""
        return structured(list(self._curves(id)[0].items()), len(self._curves(id)[0]["time_s"]))

    def units(self, id: str) -> dict[str, str]:
        """The unit of each signal of curves(id)."""
        units: dict[str, str] = self._curves(id)[1]
        return units

    def _curves(self, id: str) -> tuple[dict[str, Any], dict[str, str]]:
        found: tuple[dict[str, Any], dict[str, str]] | None = self._read.curves(id)
        if found is None:
            raise _core.ConfigError(f"{self.folder}: no curves of '{id}' (allowed: runs with a trace or a log)")
        return found

    def __repr__(self) -> str:
        return f"<solenoid.Results {self.folder}: {len(self.records)} runs>"


def read_results(folder: Path) -> Results:
    """A results folder of `solenoid compare`, `solenoid merge`, `solenoid run` or run_campaign(out=...). Every run becomes
    a dictionary, some kilobytes each: of a million of them read FOLDER/runs.csv."""
    results = Results(folder)
    warn(results.left_out)
    return results


def report(folder: Path, out: Path | None = None, *, overview_only: bool = False) -> str:
    """Writes a results folder as one HTML file, FOLDER/report.html if `out` does not say otherwise, and returns its
    path. overview_only: without every tick of every run. Runs that are damaged are left out, with a warning."""
    path = os.path.join(os.fspath(folder), "report.html") if out is None else os.fspath(out)
    warn(_core.write_report(os.fspath(folder), path, bool(overview_only)))
    return path


def report_figure(folder: Path, path: Path, figure: str = "pareto") -> str:
    """Draws a figure of a results folder into an .svg or .png: "pareto", "solve_time" or a run's ID."""
    warn(_core.write_figure(os.fspath(folder), figure, os.fspath(path)))
    return os.fspath(path)


def _solve_columns(solves: list[dict[str, Any]]) -> list[tuple[str, Any]]:

    def joined(of: Callable[[dict[str, Any]], Any], empty: Any) -> Any:
        return np.concatenate([of(one) for one in solves]) if solves else np.empty(0, dtype=empty)

    columns = [("variant", joined(lambda one: np.full(len(one["time_us"]), one["variant"]), "U1")),
               ("record", joined(lambda one: np.arange(len(one["time_us"])), np.int64))]
    columns += [(key, joined(lambda one: one[key], float)) for key in ("time_us", "timed_us")]
    for p, phase in enumerate(_core.phases):
        columns.append((f"{phase}_us", joined(lambda one: one["phases_us"][:, p], float)))
    columns.append(("other_us", joined(lambda one: one["timed_us"] - one["phases_us"].sum(axis=1), float)))
    columns.append(("nodes", joined(lambda one: one["nodes"], np.int64)))
    return columns


def _free(free: Mapping[str, Range] | Iterable[str]) -> list[str]:
    if not isinstance(free, Mapping):
        return [str(text) for text in ([free] if isinstance(free, str) else free)]
    texts = []
    for key, given in free.items():
        if not (isinstance(given, tuple) and len(given) in (2, 3)):
            raise _core.ConfigError(f"free: {key} = {given!r} (allowed: (low, high), and 'log' or 'whole' behind them)")
        texts.append(f"{key}={float(given[0])!r}..{float(given[1])!r}" + "".join(f":{scale}" for scale in given[2:]))
    return texts
