"""Model predictive control of actuators whose inputs switch: variants, scenarios, runs and campaigns from Python.

    import solenoid

    run = solenoid.simulate(solenoid.variant("nine_robust"), solenoid.scenario(plant="twin", noise=True))
    run.metrics.rmse_mm          # the same number, to the last digit, as the command line's
    run.time_s, run.truth[:, 0]  # NumPy arrays that look into the run's memory, read-only

Keys and values are those of the TOML files (docs/reference/configuration.md); what they refuse is a ConfigError here.
"""

from __future__ import annotations

import json
import tomllib

from . import _core
from ._core import (Command, ConfigError, Controller, Decision, Metrics, Percentiles, Plant, Run, Scenario, Sensors,
                    Variant, campaigns, simulate, variants)

__version__ = _core.__version__
__all__ = [
    "Command", "ConfigError", "Controller", "Decision", "Metrics", "Percentiles", "Plant", "Run", "Scenario", "Sensors",
    "Variant", "campaigns", "configuration", "run_campaign", "scenario", "simulate", "table", "variant", "variants"
]


def variant(name, /, base=None, campaign=None, **changes):
    """A variant by name, with some of its keys set to other values.

    `variant("nine_robust")` is the shipped one; `variant("mine", base="nine_robust", cost={"switching": 1e-8})` a new one
    like it; `variant("mine", valves="two_way", solver="branch_and_bound")` one of its own. Tables are merged key by key.
    `campaign` may be a TOML file that defines more variants.
    """
    if base is None and changes and name not in variants():
        table = {}
    else:
        table = configuration(campaign or _core.home(base or name), [base or name])["variant"][base or name]
    return _core.variant_from(name, _toml(_merged(table, changes)))


def scenario(name="scenario", /, trajectory=None, **keys):
    """A task and its plant; `trajectory` is a kind ("cycloidal", "sine", ...) or a table. Default: the cycloid. Of a system
    with several axes (`system="thrusters"`) it is a table each by their names."""
    if not isinstance(trajectory, dict):
        trajectory = {"kind": trajectory or "cycloidal"}
    return _core.scenario_from(_toml({"name": name, "trajectory": trajectory, **keys}))


def configuration(campaign="default", variants=(), scenarios=()):
    """A campaign with everything it names in it, as a dictionary."""
    return tomllib.loads(_core.resolve(str(campaign), list(variants), list(scenarios)))


def run_campaign(campaign="default", *, variants=(), scenarios=(), jobs=0):
    """Every run of a campaign, file or shipped name, in processes (0: one a core). A list of dictionaries, the objects of
    `solenoid compare --format json`. Nothing is written."""
    return json.loads(_core.run_campaign(str(campaign), list(variants), list(scenarios), jobs))["runs"]


def table(records):
    """The records of run_campaign as one structured NumPy array; a run that did not end well has NaN."""
    import numpy

    texts = ("variant", "scenario", "trajectory", "status")
    numbers = sorted({key for record in records for key, value in record.items() if _is_number(value)})
    columns = [(key, numpy.array([record[key] for record in records])) for key in texts]
    columns += [(key, numpy.array([_number(record.get(key)) for record in records])) for key in numbers]
    rows = numpy.empty(len(records), dtype=[(key, column.dtype) for key, column in columns])
    for key, column in columns:
        rows[key] = column
    return rows


def _is_number(value):
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _number(value):
    return float(value) if _is_number(value) else float("nan")


def _merged(table, changes):
    merged = dict(table)
    for key, value in changes.items():
        both = isinstance(value, dict) and isinstance(merged.get(key), dict)
        merged[key] = _merged(merged[key], value) if both else value
    return merged


def _toml(table):
    return "".join(f"{key} = {_toml_value(value)}\n" for key, value in table.items())


def _toml_value(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {_toml_value(inner)}" for key, inner in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml_value(inner) for inner in value) + "]"
    if isinstance(value, (bool, str)):
        return json.dumps(value)
    return repr(value.item() if hasattr(value, "item") else value)
