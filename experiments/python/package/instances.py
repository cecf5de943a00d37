"""Recorded problems as arrays: what a controller asked of its solver in closed loop, and the plan it was answered.

    recorded = solenoid.read_instances()                  # those that ship; or a file of `solenoid profile --record`
    nine = recorded["nine_state"]
    nine.states[:, 0] += 0.001                            # other initial states
    found = nine.solve()                                  # by the variant they are of; solve("nine_robust") by another
    found.costs, found.modes, found.times_us, found.statuses
    solenoid.write_instances("mine.instances", recorded)

docs/reference/instances.md has the file's bytes. A set that was only read is written to the same bytes, in
the present version of the format.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._common import Names, Path, Tasks, number, source, whole
from .control import AnyVariant, ready

if TYPE_CHECKING:
    from . import Variant

_FIXED = ("blocks", "motion", "start", "offsets", "own_rows")
_OF_RECORDS = ("motion", "start", "offsets", "own_rows", "states", "references", "setpoints", "loads", "commanded",
               "lines", "ages", "warm_modes", "warm_inputs", "warm_weights", "warm_owed", "plan_modes", "plan_inputs",
               "plan_costs", "plan_statuses")
_ABOUT = ("name", "toml", "system", "tick_s", "blocks", "state_names", "output_names", "mode_names", "switch_names")


@dataclass(frozen=True)
class Motion:
    """A reference that instances were recorded along: desired outputs at whole ticks."""
    name: str
    setting: str  # what its task told the controllers, a text of the system's own
    rows: NDArray[np.float64]  # steps x outputs


@dataclass(frozen=True)
class Solutions:
    """What a solver answered, an entry or row an instance."""
    statuses: NDArray[np.str_]  # "optimal", "feasible", "deadline_reached", "iteration_limit"; others have no plan
    costs: NDArray[np.float64]  # as the problem defines it; infinite without a plan
    bounds: NDArray[np.float64]  # proven lower bounds
    modes: NDArray[np.int64]  # instances x blocks, each an index into mode_names
    inputs: NDArray[np.float64]  # instances x blocks x continuous inputs
    switches: NDArray[np.int64]  # changes of switches in the plan
    nodes: NDArray[np.int64]  # blocks rolled out, or iterations
    times_us: NDArray[np.float64]  # wall time [us]
    mode_names: list[str]

    def __len__(self) -> int:
        return len(self.costs)


class VariantInstances:
    """The instances of one variant. N of them; X states, Y outputs, U continuous inputs, L numbers of a load, B blocks
    in S steps, M modes, C switches. In SI units, as the system's signals are (`solenoid list systems`).

    name, toml, system      the variant, its table, whose it is; variant() makes it
    tick_s, blocks          a model step [s]; the steps of each block (B)
    state_names, output_names, mode_names, switch_names

    states                  N x X    where the prediction begins
    references              N x S x Y   desired outputs after each step
    setpoints               N x S x Y, or N x 0 x Y   what a law inside the prediction tracks
    loads                   N x L    what the prediction takes from an estimator; NaN: the variant's own
    commanded               N        the pattern of switches commanded last, bit c is switch c
    lines                   N x C    edges in flight: bit i is the switch's state i steps from now, bit 63 from then on
    ages                    N x C    steps since the switch's command last changed
    warm_modes, warm_inputs    N x B, N x B x U   the warm start
    warm_weights, warm_owed    N x B x M (NaN: none), N x C   what it keeps of a relaxed plan
    plan_modes, plan_inputs    N x B, N x B x U   the recorded plan
    plan_costs, plan_statuses  N     what it cost, how its solve ended

    All of these may be changed, in place or as a whole; what no file can hold is refused when they are solved or
    written. Read-only are motion, start, offsets, own_rows (N, N, N x Y, N): where in which motion a reference comes
    from. A file keeps a reference that is no longer its motion's row by row.
    """

    name: str
    toml: str
    system: str
    tick_s: float
    state_names: list[str]
    output_names: list[str]
    mode_names: list[str]
    switch_names: list[str]
    blocks: NDArray[np.int64]
    motion: NDArray[np.int64]
    start: NDArray[np.int64]
    offsets: NDArray[np.float64]
    own_rows: NDArray[np.bool_]
    states: NDArray[np.float64]
    references: NDArray[np.float64]
    setpoints: NDArray[np.float64]
    loads: NDArray[np.float64]
    commanded: NDArray[np.int64]
    lines: NDArray[np.int64]
    ages: NDArray[np.int64]
    warm_modes: NDArray[np.int64]
    warm_inputs: NDArray[np.float64]
    warm_weights: NDArray[np.float64]
    warm_owed: NDArray[np.float64]
    plan_modes: NDArray[np.int64]
    plan_inputs: NDArray[np.float64]
    plan_costs: NDArray[np.float64]
    plan_statuses: NDArray[np.str_]

    __slots__ = (*_ABOUT, *_OF_RECORDS[:-1], "plan_statuses", "motions")

    def __init__(self, arrays: Mapping[str, Any], motions: Sequence[Motion]) -> None:
        self.motions = list(motions)
        for key in dict.fromkeys((*_ABOUT, *_OF_RECORDS)):
            value = np.array(arrays[key], dtype="U20") if key == "plan_statuses" else arrays[key]
            if key in _FIXED:
                value.flags.writeable = False
            object.__setattr__(self, key, value)

    def __setattr__(self, key: str, value: Any) -> None:
        if key in _OF_RECORDS and key not in _FIXED:
            value = np.asarray(value)
        elif key != "motions":
            changeable = ", ".join(one for one in _OF_RECORDS if one not in _FIXED)
            raise AttributeError(f"{key} of instances cannot be set (allowed: {changeable})")
        object.__setattr__(self, key, value)

    def __len__(self) -> int:
        return len(self.states)

    def __getitem__(self, chosen: Any) -> VariantInstances:
        """Some of them: a slice, or an array of numbers or truth values. Arrays are copied."""
        if isinstance(chosen, (int, np.integer)):
            chosen = [chosen]
        arrays = {key: getattr(self, key) for key in _ABOUT}
        arrays.update({key: np.array(getattr(self, key)[chosen]) for key in _OF_RECORDS})
        arrays["blocks"] = self.blocks.copy()
        return VariantInstances(arrays, self.motions)

    def __repr__(self) -> str:
        return f"<solenoid.VariantInstances {self.name}: {len(self)} instances, {len(self.blocks)} blocks>"

    def variant(self) -> Variant:
        """The variant they were recorded of."""
        made: Variant = _core.variant_from(self.name, self.toml)
        return made

    def solve(self, variant: AnyVariant | None = None, *, deadline_ms: float | None = None) -> Solutions:
        """Solves each from its warm start, to its end or until a deadline.

        variant   by whom: a shipped variant's name, a variant, a PythonSolver, or None: by the variant they are of.
                  Another must be of the same system, switches and tick; where its horizon is longer, references go on
                  along their motions, and where its blocks or modes differ, mode 0 throughout is the warm start.
        """
        from . import variant as variant_named

        given = None if variant is None else ready(variant)
        chosen = variant_named(given) if isinstance(given, str) else given
        deadline_s = None if deadline_ms is None else 1e-3 * number("deadline_ms", deadline_ms, 1e-6, 1e9)
        found = _core.solve_instances(_motions(self.motions), _arrays(self), chosen, deadline_s)
        found["statuses"] = np.array(found["statuses"], dtype="U20")
        return Solutions(**found)

    def keep(self, solutions: Solutions) -> None:
        """Makes solutions the recorded plans: of changed instances the ones recorded before are no answer."""
        if solutions.modes.shape != self.plan_modes.shape or solutions.inputs.shape != self.plan_inputs.shape:
            raise _core.ConfigError(f"instances of '{self.name}': plans of shape {solutions.modes.shape} "
                                    f"(allowed: {self.plan_modes.shape})")
        if solutions.mode_names != self.mode_names:
            raise _core.ConfigError(f"instances of '{self.name}': plans of modes {', '.join(solutions.mode_names)} "
                                    f"(allowed: {', '.join(self.mode_names)})")
        self.plan_modes, self.plan_inputs = solutions.modes.copy(), solutions.inputs.copy()
        self.plan_costs, self.plan_statuses = solutions.costs.copy(), solutions.statuses.copy()


class Instances(Mapping[str, VariantInstances]):
    """A set of recorded problems: `set["nine_state"]` are a variant's, `list(set)` the variants' names. A set with one
    variant has its attributes too: `set.states`, `set.solve()`."""

    motions: list[Motion]
    _variants: dict[str, VariantInstances]
    __slots__ = ("motions", "_variants")

    def __init__(self, motions: Iterable[Motion], variants: Iterable[VariantInstances]) -> None:
        object.__setattr__(self, "motions", list(motions))
        object.__setattr__(self, "_variants", {one.name: one for one in variants})

    def __getitem__(self, name: str) -> VariantInstances:
        if name not in self._variants:
            raise _core.ConfigError(f"no instances of '{name}' (allowed: {', '.join(self._variants)})")
        return self._variants[name]

    def __contains__(self, name: object) -> bool:
        return name in self._variants

    def __iter__(self) -> Iterator[str]:
        return iter(self._variants)

    def __len__(self) -> int:
        return len(self._variants)

    def _only(self, key: str) -> VariantInstances:
        if len(self._variants) != 1:
            raise AttributeError(f"{key} of several variants (allowed: of one of {', '.join(self._variants)})")
        return next(iter(self._variants.values()))

    def __getattr__(self, key: str) -> Any:
        if key.startswith("_"):
            raise AttributeError(key)
        return getattr(self._only(key), key)

    def __setattr__(self, key: str, value: Any) -> None:
        setattr(self._only(key), key, value)

    def __repr__(self) -> str:
        counts = ", ".join(f"{name} {len(one)}" for name, one in self._variants.items())
        return f"<solenoid.Instances {counts}>"


def read_instances(path: Path | None = None) -> Instances:
    """A file of problems, or those that ship with the program, as arrays. ConfigError names file, byte and what is
    allowed where it is damaged."""
    return _set(_core.read_instances("" if path is None else os.fspath(path)))


def record_instances(variants: Names = (),
                     scenarios: Tasks = (),
                     *,
                     campaign: Path | None = None,
                     seeds: Sequence[int] | None = None,
                     per_variant: int = 700) -> Instances:
    """The problems that variants pose in the closed loops of scenarios, about `per_variant` each, with the plans of
    their own solvers: what `solenoid profile CAMPAIGN --record FILE` writes. Names or objects; the campaign is
    "profile" if none is said."""
    path, text, names, tasks = source(campaign, variants, scenarios, seeds, "profile")
    return _set(_core.record_instances(path, text, names, tasks, whole("per_variant", per_variant, 1, 1000000)))


def write_instances(path: Path, instances: Instances | VariantInstances) -> None:
    """Writes a set as a file that read_instances, `solenoid profile --instances` and the C++ library read. ConfigError
    names variant, array and what is allowed where they are none."""
    _core.write_instances(os.fspath(path), _dictionary(instances))


def as_bytes(instances: Instances | VariantInstances) -> bytes:
    """The bytes of that file."""
    made: bytes = _core.instance_bytes(_dictionary(instances))
    return made


def _set(found: Mapping[str, Any]) -> Instances:
    motions = [Motion(one["name"], one["setting"], one["rows"]) for one in found["motions"]]
    return Instances(motions, [VariantInstances(arrays, motions) for arrays in found["variants"]])


def _motions(motions: Iterable[Motion]) -> list[dict[str, Any]]:
    return [{"name": one.name, "setting": one.setting, "rows": one.rows} for one in motions]


def _arrays(instances: VariantInstances) -> dict[str, Any]:
    arrays = {key: getattr(instances, key) for key in ("name", "toml", *_OF_RECORDS)}
    arrays["plan_statuses"] = [str(status) for status in instances.plan_statuses]
    return arrays


def _dictionary(instances: Instances | VariantInstances) -> dict[str, Any]:
    if not isinstance(instances, (Instances, VariantInstances)):
        raise _core.ConfigError(f"{type(instances).__name__}: no instances (allowed: what read_instances returns)")
    variants = [instances] if isinstance(instances, VariantInstances) else list(instances.values())
    return {"motions": _motions(instances.motions), "variants": [_arrays(one) for one in variants]}
