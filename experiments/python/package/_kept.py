"""A model's plug-in as a folder to keep: beside its sources CMakeLists.txt, a campaign to compare, a test."""

from __future__ import annotations

import pathlib
import random

from . import _expressions as ex
from . import _plugin_files


def save(model, folder):
    folder = pathlib.Path(folder)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        model._refuse(f"{folder} is there already", "a folder that is not there, or empty")
    files = _plugin_files.sources(model)
    name = model.name
    files["CMakeLists.txt"] = _cmake(model, files)
    files["compare.toml"] = f'# solenoid compare compare.toml\nplugins = ["build/{name}.so"]\ninclude = ["{name}"]\n'
    files[f"{name}_test.cpp"] = _test(model)
    folder.mkdir(parents=True, exist_ok=True)
    for file, content in files.items():
        (folder / file).write_text(content)
    return folder


def _cmake(model, files):
    name = model.name
    compiled = " ".join(f for f in files if f.endswith((".cpp", ".toml")))
    flags = {"avx2": "-mavx2", "avx512": "-mavx512f;-mavx512dq;-mavx512vl;-mprefer-vector-width=512;-Wno-uninitialized;"
                                         "-Wno-maybe-uninitialized"}
    special = "\n".join(f'  set_source_files_properties({name}_{k}.cpp PROPERTIES COMPILE_OPTIONS "{flags[k]}")'
                        for k in flags if f"{name}_{k}.cpp" in files)
    return f"""cmake_minimum_required(VERSION 3.25)
project({name} LANGUAGES CXX)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()
find_package(solenoid REQUIRED)
find_program(SOLENOID solenoid REQUIRED)
solenoid_add_plugin({name} {compiled})
if(CMAKE_SYSTEM_PROCESSOR MATCHES "x86_64|AMD64")  # inner loops of the search, chosen at run time
{special}
endif()

enable_testing()
add_executable({name}_test {name}_test.cpp)
target_link_libraries({name}_test PRIVATE solenoid::controllers)
add_test(NAME model COMMAND {name}_test)
add_test(NAME compare COMMAND ${{SOLENOID}} compare ${{CMAKE_CURRENT_SOURCE_DIR}}/compare.toml --out results --format json)
"""


def samples(model, count=5):
    """Random points (states, switched and continuous inputs) and the rates that SymPy finds there."""
    import sympy as sp

    draw = random.Random(1)
    found = []
    for _ in range(200):
        at = {p.symbol: sp.Float(p.value, 30) for p in model.parameters}
        x = [s.start + draw.uniform(0, 1) * max(1.0, abs(s.start)) for s in model.states]
        x = [min(max(v, s.low), s.high) for v, s in zip(x, model.states)]
        w = [float(draw.randrange(2)) for _ in model.switches]
        u = [draw.uniform(-i.most, i.most) for i in model.inputs]
        for things, values in ((model.states, x), (model.switches, w), (model.inputs, u)):
            at.update({t.symbol: sp.Float(v, 30) for t, v in zip(things, values)})
        rates = [sp.N(model.rates[s.symbol].xreplace(at), 25) for s in model.states]
        if all(r.is_Float or r.is_Integer or r.is_zero for r in rates):
            found.append((x, w, u, [float(r) for r in rates]))
            if len(found) == count:
                break
    return found


def _test(model):
    name, of = model.name, model._class_name
    n, s, u = len(model.states), len(model.switches), len(model.inputs)

    def row(values):
        return "{" + ", ".join(ex.number_text(v) for v in values) + "}"

    points = ",\n      ".join("{" + ", ".join(row(v) for v in sample) + "}" for sample in samples(model))
    usual = ", ".join(ex.number_text(p.value) for p in model.parameters)
    return f"""// Properties of the model itself.
#include "{name}.hpp"

#include <array>
#include <cmath>
#include <cstdio>

namespace {{

/// A point and the rates that SymPy finds there.
struct Sample {{
  solenoid::Vector<double, {n}> state;
  solenoid::Vector<double, {s}> switched;
  solenoid::Vector<double, {u}> continuous;
  solenoid::Vector<double, {n}> rates;
}};

}}  // namespace

int main() {{
  const std::array<double, {len(model.parameters)}> parameters = {{{usual}}};
  const models::{name}::{of} model(parameters);
  const Sample samples[] = {{
      {points}}};
  int failed = 0;
  // The slope of a step at 0, by Richardson's extrapolation of two of them.
  for (const Sample& at : samples)
    for (std::size_t i = 0; i < {n}; ++i) {{
      const auto slope = [&](double dt) {{
        const double after = model.step<double>(at.state, at.switched, at.continuous, dt)[i];
        return (after - at.state[i]) / dt;
      }};
      const double dt = {ex.number_text(model.tick_s * 1e-4)};
      const double found = 2.0 * slope(dt) - slope(2.0 * dt), size = std::abs(at.state[i]) / dt;
      if (!(std::abs(found - at.rates[i]) <= 1e-5 * std::abs(at.rates[i]) + 1e-14 * size + 1e-5))
        std::printf("failed: rate of state %zu is %g and not %g\\n", i, found, at.rates[i]), ++failed;
    }}
  return failed;
}}
"""
