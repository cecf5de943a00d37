"""Model predictive control of actuators whose inputs switch: variants, scenarios, runs and campaigns from Python.

    import solenoid

    run = solenoid.simulate(solenoid.variant("nine_robust"), solenoid.scenario(plant="twin", noise=True))
    run.metrics.rmse_mm          # the same number, to the last digit, as the command line's
    run.time_s, run.truth[:, 0]  # NumPy arrays that look into the run's memory, read-only

Keys and values are those of the TOML files (docs/reference/configuration.md); what they refuse is a ConfigError here.
"""

from __future__ import annotations

import os
import sys
import tomllib

_flags = sys.getdlopenflags()
sys.setdlopenflags(_flags | os.RTLD_GLOBAL)  # plug-ins find the library in it
try:
    from . import _core
finally:
    sys.setdlopenflags(_flags)
from ._core import (Command, ConfigError, Controller, Decision, Measurement, Metrics, Percentiles, PeriodProblem, Plan,
                    Plant, Plugin, Problem, Run, Scenario, Sensors, Variant, campaigns, loaded_plugins, variants)
from ._text import toml as _toml
from .control import Comparison, PythonController, PythonSolver, compare, simulate
from .data import (Ledger, Profile, Records, Results, Tuning, ledger, profile, read_results, report, report_figure,
                   run_campaign, table, tune)
from .instances import (Instances, Motion, Solutions, VariantInstances, read_instances, record_instances,
                        write_instances)
from .model import BuiltModel, Model

__version__ = _core.__version__
__all__ = [
    "BuiltModel", "Command", "Comparison", "ConfigError", "Controller", "Decision", "Instances", "Ledger",
    "Measurement", "Metrics", "Model", "Motion", "Percentiles", "PeriodProblem", "Plan", "Plant", "Plugin",
    "Problem", "Profile", "PythonController", "PythonSolver", "Records", "Results", "Run", "Scenario", "Sensors",
    "Solutions", "Tuning", "Variant", "VariantInstances", "campaigns", "compare", "configuration", "ledger",
    "load_plugin", "loaded_plugins", "profile", "read_instances", "read_results", "record_instances", "report",
    "report_figure", "run_campaign", "scenario", "simulate", "table", "tune", "variant", "variants",
    "write_instances"
]


def load_plugin(path):
    """Loads a plug-in, a shared object of one's own, with all that it registers: systems, solvers, laws, estimators.
    ConfigError where it is not made for this version, or fails while it is loaded. One that is loaded is left alone."""
    _core.load_plugin(os.fspath(path))


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
    with several axes (`system="thrusters"`) it is a table each by their names. Another system's outputs rest without one."""
    if trajectory is None:
        trajectory = {} if "system" in keys else "cycloidal"
    if not isinstance(trajectory, dict):
        trajectory = {"kind": trajectory}
    return _core.scenario_from(_toml({"name": name, "trajectory": trajectory, **keys}))


def configuration(campaign="default", variants=(), scenarios=()):
    """A campaign with everything it names in it, as a dictionary."""
    return tomllib.loads(_core.resolve(str(campaign), list(variants), list(scenarios)))


def _merged(table, changes):
    merged = dict(table)
    for key, value in changes.items():
        both = isinstance(value, dict) and isinstance(merged.get(key), dict)
        merged[key] = _merged(merged[key], value) if both else value
    return merged
