"""What a model is made of (model.py)."""

from __future__ import annotations

import dataclasses
from typing import Any


@dataclasses.dataclass
class State:
    symbol: Any
    name: str
    unit: str
    start: float
    low: float
    high: float
    sigma: float | None
    process_sigma: float
    rest: float
    meaning: str
    scale: float | None


@dataclasses.dataclass
class Parameter:
    symbol: Any
    name: str
    value: float
    unit: str
    low: float
    high: float
    meaning: str


@dataclasses.dataclass
class Switch:
    symbol: Any
    name: str
    min_dwell_s: float
    rise_delay_s: float
    fall_delay_s: float


@dataclasses.dataclass
class Input:
    symbol: Any
    name: str
    most: float
    unit: str
    weight: float


@dataclasses.dataclass
class Output:
    state: State
    weight: float
    terminal: float
    target: float
    rate_of: State | None


@dataclasses.dataclass
class Consumption:
    name: str
    unit: str
    rate: Any


@dataclasses.dataclass
class Modes:
    name: str
    modes: dict[str, int]  # patterns: bit c is switch c
    safe: int | None
