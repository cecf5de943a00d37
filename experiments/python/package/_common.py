"""What the package's functions share: what they may be given, and structured arrays."""

from __future__ import annotations

import json
import math
import os
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Union

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._text import toml
from .control import AnyVariant, loaded, ready

if TYPE_CHECKING:
    from . import Scenario

Path = Union[str, "os.PathLike[str]"]
Names = Union[AnyVariant, Iterable[AnyVariant]]
Tasks = Union[str, "Scenario", Iterable[Union[str, "Scenario"]]]


def source(campaign: Path | None, variants: Names, scenarios: Tasks, seeds: Sequence[int] | None,
           default: str) -> tuple[str, str, list[str], list[str]]:
    """A campaign as the core takes it: path or shipped name, its text where objects or seeds make it one of its own,
    and the names of what is selected from it."""
    chosen, wanted = [ready(one) for one in listed(variants)], [_task(one) for one in listed(scenarios)]
    names, tasks = names_of(chosen), names_of(wanted)
    own_variants = [one for one in chosen if not isinstance(one, str)]
    own_tasks = [one for one in wanted if not isinstance(one, str)]
    if campaign is None and len(own_tasks) < max(1, len(wanted)):
        first = own_variants[0].system if own_variants else _core.first_system()
        campaign = default if first == _core.first_system() else _core.campaign_of(first)
    if not own_variants and not own_tasks and seeds is None:
        return os.fspath(campaign) if campaign is not None else "", "", names, tasks
    text = ""
    if campaign is not None:
        file = os.fspath(campaign)
        text += f"include = [{json.dumps(os.path.abspath(file) if os.path.exists(file) else file)}]\n"
        text += f"name = {json.dumps(os.path.splitext(os.path.basename(file))[0])}\n"
    if names:
        text += f"variants = {json.dumps(names)}\n"
    if seeds is not None:
        text += f"seeds = {json.dumps([whole('seeds', seed, 0, 2147483647) for seed in seeds])}\n"
    text += toml(loaded())
    for one in own_variants:
        text += f"[variant.{json.dumps(one.name)}]\n{one.toml}"
    for task in own_tasks:
        text += f"[[scenario]]\n{task.toml}"
    return "python", text, names, tasks


def rows(records: Iterable[Mapping[str, Any]]) -> NDArray[np.void]:
    """Dictionaries as a structured array, a row each; tables in them are flattened, KEY_INNER, and lists left out."""
    flat = [_flat(record) for record in records]
    columns = []
    for key in dict.fromkeys(key for record in flat for key in record):
        values = [record.get(key) for record in flat]
        if any(isinstance(value, str) for value in values):
            columns.append((key, np.array(["" if value is None else str(value) for value in values])))
        elif all(isinstance(value, bool) for value in values):
            columns.append((key, np.array(values, dtype=bool)))
        elif all(isinstance(value, int) for value in values):
            columns.append((key, np.array(values, dtype=np.int64)))
        else:
            columns.append((key, np.array([or_nan(value) for value in values], dtype=float)))
    return structured(columns, len(flat))


def _flat(record: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for key, value in record.items():
        if isinstance(value, Mapping):
            flat.update(_flat(value, f"{before}{key}_"))
        elif not isinstance(value, list):
            flat[before + key] = value
    return flat


def structured(columns: Sequence[tuple[str, Any]], count: int) -> NDArray[np.void]:
    made: NDArray[np.void] = np.empty(count, dtype=[(key, column.dtype) for key, column in columns])
    for key, column in columns:
        made[key] = column
    return made


def _task(given: Any) -> str | Scenario:
    if not isinstance(given, (str, _core.Scenario)):
        raise _core.ConfigError(f"scenarios: {given!r} is none (allowed: names and Scenario)")
    return given  # type: ignore[no-any-return]


def listed(given: Any) -> list[Any]:
    return [given] if isinstance(given, str) or not isinstance(given, Iterable) else list(given)


def names_of(given: Any) -> list[str]:
    names = [one if isinstance(one, str) else getattr(one, "name", None) for one in listed(given)]
    if None in names:
        raise _core.ConfigError(f"{given!r} has no name (allowed: names, Variant and Scenario)")
    return [str(name) for name in names]


def has_objects(given: Any) -> bool:
    return any(not isinstance(one, str) for one in listed(given))


def path_text(given: Path | None) -> str:
    return "" if given is None else os.fspath(given)


def whole(key: str, value: Any, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not low <= value <= high:
        raise _core.ConfigError(f"{key}: {value!r} (allowed: a whole number from {low} to {high})")
    return int(value)


def number(key: str, value: Any, low: float, high: float) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not low <= value <= high:
        raise _core.ConfigError(f"{key}: {value!r} (allowed: a number from {low:g} to {high:g})")
    return float(value)


def warn(lines: Iterable[str]) -> None:
    for line in lines:
        warnings.warn(line, stacklevel=3)


def is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def or_nan(value: Any) -> float:
    return float(value) if is_number(value) else math.nan
