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
    """A controller as data."""
    name: str
    summary: str
    valves: str
    solver: str
    motor: str
    estimator: str
    settings: dict[str, float | int | bool | None]
    """Every numeric key by its dotted name, as this variant has it: `./solenoid list keys`."""

@final
class Scenario:
    """A task and the plant it is done on, as data."""
    name: str
    plant: str
    payload_kg: float
    duration_s: float
    def reference(self, time_s: float) -> tuple[float, float, float]:
        """Desired position [m], velocity [m/s] and acceleration [m/s2]."""

@final
class Percentiles:
    p50: float
    p90: float
    p99: float
    p999: float
    max: float

@final
class Metrics:
    """How a run went; errors are desired minus true position [mm] unless they say `measured`."""
    rmse_mm: float
    mae_mm: float
    rmse_measured_mm: float
    mae_measured_mm: float
    sse_mean_abs_mm: float
    sse_abs_mean_mm: float
    sse_max_abs_mm: float
    ssa_mm: float
    itae: float
    overshoot_percent: float
    coil_switches: int
    switches_per_s: float
    steady_switches_per_s: float
    air_g: float
    air_nl: float
    steady_air_g_per_s: float
    motor_rms_n: float
    solve_us: Percentiles
    deadline_misses: int
    proven_optimal_fraction: float
    finite: bool

@final
class Run:
    """A finished run, one row a tick of 1 ms. Arrays are read-only views of its memory and keep it alive."""
    metrics: Metrics
    time_s: NDArray[np.float64]
    truth: NDArray[np.float64]  # position [m], velocity [m/s], pressures A and B [Pa]
    estimate: NDArray[np.float64]  # the same, as the controller believes
    measured_position_m: NDArray[np.float64]
    measured_pressure_a_pa: NDArray[np.float64]
    measured_pressure_b_pa: NDArray[np.float64]
    reference_m: NDArray[np.float64]
    reference_m_s: NDArray[np.float64]
    coils: NDArray[np.uint32]  # bit c: coil c on
    motor_force_n: NDArray[np.float64]
    payload_kg: NDArray[np.float64]  # estimated
    disturbance_n: NDArray[np.float64]  # estimated
    solved: NDArray[np.bool_]  # whether cost, solve_us and nodes belong to this tick
    cost: NDArray[np.float64]
    solve_us: NDArray[np.float64]
    nodes: NDArray[np.int64]
    def __len__(self) -> int: ...

@final
class Sensors:
    time_s: float
    position_m: float
    pressure_a_pa: float
    pressure_b_pa: float
    truth: list[float]
    ideal: bool
    def __init__(self) -> None: ...

@final
class Command:
    coils: int
    motor_force_n: float
    def __init__(self, coils: int = 0, motor_force_n: float = 0.0) -> None: ...

@final
class Decision:
    command: Command
    estimate: list[float]
    reference_m: float
    payload_kg: float
    solved: bool
    cost: float
    solve_us: float

@final
class Controller:
    """Sensors in, commands out, once a millisecond."""
    def __init__(self, variant: Variant, scenario: Scenario) -> None: ...
    def step(self, sensors: Sensors) -> Decision: ...
    def applied(self, command: Command) -> None:
        """What left in the tick just stepped; not told, it assumes its own command."""

@final
class Plant:
    """The scenario's simulated plant."""
    air_used_kg: float
    def __init__(self, variant: Variant, scenario: Scenario, seed: int = 1) -> None: ...
    def read(self, time_s: float) -> Sensors: ...
    def write(self, command: Command) -> None: ...

def variants() -> list[str]: ...
def campaigns() -> list[str]: ...
def simulate(variant: Variant, scenario: Scenario, seed: int = 1) -> Run: ...
def variant(name: str, /, base: str | None = None, campaign: str | PathLike[str] = "default", **changes: Any) -> Variant: ...
def scenario(name: str = "scenario", /, trajectory: str | dict[str, Any] | None = None, **keys: Any) -> Scenario: ...
def configuration(campaign: str | PathLike[str] = "default", variants: Sequence[str] = (),
                  scenarios: Sequence[str] = ()) -> dict[str, Any]: ...
def run_campaign(campaign: str | PathLike[str] = "default", *, variants: Sequence[str] = (),
                 scenarios: Sequence[str] = (), jobs: int = 0) -> list[dict[str, Any]]: ...
def table(records: list[dict[str, Any]]) -> NDArray[np.void]: ...
