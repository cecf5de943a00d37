from collections.abc import Sequence
from os import PathLike
from typing import Any, final, overload

import numpy as np
from numpy.typing import NDArray

from .control import (Comparison as Comparison, PythonController as PythonController, PythonSolver as PythonSolver,
                      compare as compare, simulate as simulate)
from .data import (Ledger as Ledger, Profile as Profile, Records as Records, Results as Results, Tuning as Tuning,
                   ledger as ledger, profile as profile, read_results as read_results, report as report,
                   report_figure as report_figure, run_campaign as run_campaign, table as table, tune as tune)
from .instances import (Instances as Instances, Motion as Motion, Solutions as Solutions,
                        VariantInstances as VariantInstances, read_instances as read_instances,
                        record_instances as record_instances, write_instances as write_instances)
from .model import BuiltModel as BuiltModel, Model as Model

__version__: str

class ConfigError(ValueError):
    """A key, value or file that is refused: one line with what is allowed."""

@final
class Variant:
    """A controller as data; the mode set also goes by the system's key for it (`valves`), and keys without a dot are
    attributes (`motor`)."""
    name: str
    system: str
    summary: str
    modes: str
    solver: str
    estimator: str
    real_time: bool
    """Whether it can run on hardware: nothing in Python, no solver that allocates."""
    toml: str
    """The table it was read from."""
    settings: dict[str, float | int | bool | str | list[int] | None]
    """Every key by its dotted name, as this variant has it: `./solenoid list keys --system NAME`."""
    def __getattr__(self, name: str) -> Any: ...

@final
class Scenario:
    """A task and the plant it is done on, as data."""
    name: str
    system: str
    conditions: dict[str, float]
    """Numbers of its plant that runs are recorded with, each also an attribute: `payload_kg`."""
    duration_s: float
    def reference(self, time_s: float, axis: int = 0) -> tuple[float, float, float]:
        """Desired value of an axis, its rate and acceleration, in the axis's unit."""
    def __getattr__(self, name: str) -> float: ...

@final
class Percentiles:
    p50: float
    p90: float
    p99: float
    p999: float
    max: float

@final
class Metrics:
    """How a run went: the system's metrics by their names, of the actuator rmse_mm, mae_mm, air_g, coil_switches and so
    on (docs/reference/configuration.md), and what the solver did."""
    def __getattr__(self, name: str) -> float: ...
    solve_us: Percentiles
    deadline_misses: int
    proven_optimal_fraction: float
    finite: bool

@final
class Run:
    """A finished run, one row a tick. Arrays are read-only views of its memory and keep it alive.

    By the system's names: measured channels (`measured_position_m`), references (`reference_m`), the pattern of switches
    (`coils`), continuous inputs (`motor_n`), what the estimator believes beyond the state (`payload_kg`); `dir(run)` has
    all of them."""
    system: str
    metrics: Metrics
    time_s: NDArray[np.float64]
    truth: NDArray[np.float64]  # the true states, in the system's order
    estimate: NDArray[np.float64]  # the same, as the controller believes
    switches: NDArray[np.uint32]  # bit c: switch c on
    continuous: NDArray[np.float64]  # written, after the limits
    def __getattr__(self, name: str) -> NDArray[Any]: ...
    solved: NDArray[np.bool_]  # whether cost, solve_us and nodes belong to this tick
    cost: NDArray[np.float64]
    solve_us: NDArray[np.float64]
    nodes: NDArray[np.int64]
    def __len__(self) -> int: ...

@final
class Sensors:
    """Values of the measured channels, each also by its name (`position_m`)."""
    time_s: float
    value: list[float]
    truth: list[float]
    ideal: bool
    def __init__(self) -> None: ...
    def __getattr__(self, name: str) -> float: ...
    def __setattr__(self, name: str, value: Any) -> None: ...

@final
class Command:
    switches: int  # also `coils`
    continuous: list[float]
    coils: int
    motor_force_n: float
    def __init__(self, coils: int = 0, motor_force_n: float = 0.0) -> None: ...

@final
class Decision:
    """References and beliefs are there by their names too (`reference_m`, `payload_kg`)."""
    command: Command
    estimate: list[float]
    solved: bool
    cost: float
    solve_us: float
    def __getattr__(self, name: str) -> float: ...

@final
class Controller:
    """Sensors in, commands out, once a tick."""
    def __init__(self, variant: Variant, scenario: Scenario) -> None: ...
    def step(self, sensors: Sensors) -> Decision: ...
    def applied(self, command: Command) -> None:
        """What left in the tick just stepped; not told, it assumes its own command."""

@final
class Plant:
    """The scenario's simulated plant."""
    consumed: float  # of what its models consume, also by name: `air_used_kg`
    air_used_kg: float
    def __init__(self, variant: Variant, scenario: Scenario, seed: int = 1) -> None: ...
    def read(self, time_s: float) -> Sensors: ...
    def write(self, command: Command) -> None: ...

@final
class Measurement:
    """What a controller in Python sees of a tick. Each number is there by its name in logs, too: measured channels
    (`position_m`), estimates (`estimate_m`), desired values and rates (`reference_m`); `dir(measurement)` has all of
    them. Arrays are copies, in the order and SI units of the system's description (`./solenoid list systems`)."""
    time_s: float
    tick: int  # since the start
    commanded: int  # the pattern of switches commanded last; bit c: switch c on
    value: NDArray[np.float64]  # measured channels, shape (channels,); NaN: missing
    estimate: NDArray[np.float64]  # the state as the variant's estimator believes, shape (states,)
    reference: NDArray[np.float64]  # desired values, shape (axes,)
    reference_rate: NDArray[np.float64]
    reference_acceleration: NDArray[np.float64]
    def reference_at(self, time_s: float) -> NDArray[np.float64]:
        """What is desired at another time: value, rate and acceleration of each axis, shape (axes, 3). During the run
        alone."""
    def __getattr__(self, name: str) -> float: ...

@final
class PeriodProblem:
    """The problem that a solver in Python gets: N steps of dt_s in B blocks, over each of which a mode is held. It is
    there while solve() runs. Arrays are copies, in SI units."""
    dt_s: float
    blocks: NDArray[np.int32]  # steps of each block, shape (B,)
    modes: list[str]  # names; a plan's numbers are indices into this
    patterns: NDArray[np.uint32]  # of the modes; bit c: switch c on
    points: NDArray[np.float64]  # the model's switched inputs in each mode, shape (modes, switched inputs)
    initial: NDArray[np.float64]  # state, shape (states,)
    reference: NDArray[np.float64]  # desired outputs after each step, shape (N, outputs)
    commanded: int  # the pattern of switches commanded last
    input_lower: NDArray[np.float64]  # of the continuous inputs, shape (inputs,)
    input_upper: NDArray[np.float64]
    warm_start: NDArray[np.int32]  # the last plan as it goes on, shape (B,)
    warm_inputs: NDArray[np.float64]  # its continuous inputs, shape (B, inputs)
    seconds_left: float  # to the deadline; infinity without one
    @overload
    def cost(self, modes: Sequence[int] | Sequence[str], continuous: Any = None) -> float: ...
    @overload
    def cost(self, modes: NDArray[Any], continuous: Any = None) -> Any:
        """What plans cost as the model and the weights have it, infinity where a dwell or bound forbids: of one plan,
        modes of shape (B,), a number; of several, shape (plans, B), an array (plans,). continuous: (..., B, inputs);
        none: zeros."""

@final
class Plan:
    """What a solver found for a Problem of B blocks, and how. Arrays are copies."""
    modes: NDArray[np.int32]  # numbers of the problem's modes, shape (B,)
    inputs: NDArray[np.float64]  # continuous inputs, shape (B, inputs)
    weights: NDArray[np.float64] | None  # of a relaxation that rides in the plan, rows of sum 1, shape (B, modes)
    status: str  # "optimal", "feasible", "deadline_reached", "iteration_limit", "infeasible", "numerical_failure"
    cost: float  # by the model's own prediction
    bound: float  # no plan costs less
    switches: int  # changes of a switch, the first against the safe pattern
    nodes: int
    time_s: float

@final
class Problem:
    """The problem that a variant poses, to be solved once and by itself: N steps of dt_s in B blocks, of each of which a
    mode is held. Switches are free to change. Arrays are copies; what is set is of SI units."""
    dt_s: float
    blocks: NDArray[np.int32]  # steps of each block, shape (B,)
    modes: list[str]  # names; a plan's numbers are indices into this
    points: NDArray[np.float64]  # the model's switched inputs in each mode, shape (modes, switched inputs)
    def __init__(self, variant: Variant) -> None: ...
    @property
    def initial(self) -> NDArray[np.float64]:
        """The state that it begins at, shape (states,); zero until it is set."""
    @initial.setter
    def initial(self, values: Any) -> None: ...
    @property
    def reference(self) -> NDArray[np.float64]:
        """Desired outputs after each step, shape (N, outputs); zero until it is set, as a whole or as a row for all."""
    @reference.setter
    def reference(self, values: Any) -> None: ...
    def solve(self, start: Plan | None = None, deadline_s: float | None = None) -> Plan:
        """Has the variant's solver find a plan, from a plan of the same shape on; by a deadline, or to the end."""
    def plan(self, modes: Sequence[int], inputs: Any = None) -> Plan:
        """A plan by hand, shape (B,) and (B, inputs) or one row for all, with what it costs."""

@final
class Plugin:
    """A shared object that was loaded."""
    name: str
    path: str

def load_plugin(path: str | PathLike[str]) -> None: ...
def loaded_plugins() -> list[Plugin]: ...
def variants() -> list[str]: ...
def campaigns() -> list[str]: ...
def variant(name: str, /, base: str | None = None, campaign: str | PathLike[str] | None = None, **changes: Any) -> Variant: ...
def scenario(name: str = "scenario", /, trajectory: str | dict[str, Any] | None = None, **keys: Any) -> Scenario: ...
def configuration(campaign: str | PathLike[str] = "default", variants: Sequence[str] = (),
                  scenarios: Sequence[str] = ()) -> dict[str, Any]: ...
