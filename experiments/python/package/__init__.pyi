from collections.abc import Sequence
from os import PathLike
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

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

def variants() -> list[str]: ...
def campaigns() -> list[str]: ...
def simulate(variant: Variant, scenario: Scenario, seed: int = 1) -> Run: ...
def variant(name: str, /, base: str | None = None, campaign: str | PathLike[str] | None = None, **changes: Any) -> Variant: ...
def scenario(name: str = "scenario", /, trajectory: str | dict[str, Any] | None = None, **keys: Any) -> Scenario: ...
def configuration(campaign: str | PathLike[str] = "default", variants: Sequence[str] = (),
                  scenarios: Sequence[str] = ()) -> dict[str, Any]: ...
def run_campaign(campaign: str | PathLike[str] = "default", *, variants: Sequence[str] = (),
                 scenarios: Sequence[str] = (), jobs: int = 0) -> list[dict[str, Any]]: ...
def table(records: list[dict[str, Any]]) -> NDArray[np.void]: ...
