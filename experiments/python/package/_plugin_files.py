"""The sources of a model's plug-in: header, what compiles its solvers, description, campaign."""

from __future__ import annotations

import itertools
import json
import math

from . import _expressions as ex
from ._header import Header, wrapped

RELAXED = ("sqp", "ipopt")
MOST_SIZES, MOST_WEIGHTS = 3, 8  # of relaxed problems that SQP and Ipopt are compiled in: each takes a compiler some seconds


def sources(model):
    """Texts by file name; each that ends with .cpp is compiled by itself."""
    header = Header(model)
    name = model.name
    files = {f"{name}.hpp": header.text(), f"{name}_solvers.hpp": _solvers_header(model, kernels(header)),
             f"{name}.cpp": _plugin(model), f"{name}.toml": campaign(model),
             f"{name}_search.cpp": _search(model, kernels(header))}
    for solver in relaxed(model):
        files[f"{name}_{solver}.cpp"] = _compiled(model, solver.upper(), "relaxed")
    for kernel in kernels(header):
        files[f"{name}_{kernel}.cpp"] = _kernel(model, kernel)
    return files


def kernels(header):
    """Instruction sets that the search's inner loop is compiled for beside the usual one. Lanes of AVX-512 would round some
    functions in another way (solvers/search/model_functions.hpp)."""
    return ["avx2"] if header.inexact else ["avx2", "avx512"]


# Sizes of relaxed problems (solvers/relaxed/mode_hull.hpp, transcription.hpp).


def hull_size(patterns, switches, timed):
    """Weights and rows of memory of a mode set; `timed`: with delays or a cost of switching."""

    def projected(onto):
        return sorted({p & onto for p in patterns})

    def smallest_factor(left):
        lowest, best = left & -left, left
        some = left
        while some:
            if some & lowest and bin(some).count("1") < bin(best).count("1") and \
                    len(projected(some)) * len(projected(left & ~some)) == len(projected(left)):
                best = some
            some = (some - 1) & left
        return best

    left, columns, groups = (1 << switches) - 1, [], []
    while left:
        factor = smallest_factor(left)
        corners = projected(factor)
        groups.append(range(len(columns), len(columns) + len(corners) - 1))
        columns += [[((c >> k) & 1) - ((corners[0] >> k) & 1) for k in range(switches)] for c in corners[1:]]
        left &= ~factor
    sums = [[int(j in group) for j in range(len(columns))] for group in groups if len(group) > 1]
    if not timed:
        return len(columns), len(sums)
    import sympy as sp

    rows = sums + [[column[k] for column in columns] for k in range(switches)]
    return len(columns), sp.Matrix(rows).rank() if columns else 0


def sizes(model):
    """Pairs of weights and memory that SQP and Ipopt are compiled in, with the mode sets that have them."""
    known = {}
    delayed = any(s.rise_delay_s or s.fall_delay_s for s in model.switches)
    for modes in model._sets():
        pairs = {hull_size(modes.modes.values(), len(model.switches), timed)
                 for timed in ((True,) if delayed else (False, True))}
        if any(not 1 <= weights <= MOST_WEIGHTS for weights, _ in pairs) or len({*known, *pairs}) > MOST_SIZES:
            continue
        for pair in pairs:
            known.setdefault(pair, []).append(modes.name)
    return known


def relaxed(model):
    """Those of `model.relaxed` that are compiled: all or none."""
    return [solver for solver in RELAXED if solver in model.relaxed] if sizes(model) else []


# C++.


def _model(model):
    return f"models::{model.name}::{model._class_name}"


def _solvers_header(model, sets):
    pairs = ", ".join(f"SqpSize<{w}, {m}>" for w, m in sorted(sizes(model)))
    of = {solver: pairs if solver in relaxed(model) else "" for solver in RELAXED}
    known = [] if not relaxed(model) else [
        "/// Weights of the modes and rows of memory of the relaxed problem, without and with a cost of switching.",
        "template <>", f"struct RelaxedSizes<{_model(model)}> {{", f"  using Sqp = std::tuple<{of['sqp']}>;",
        f"  using Ipopt = std::tuple<{of['ipopt']}>;", "};"]
    declared = [f"solenoid::RolloutKernel<{model._class_name}> {k}_kernel();" for k in sets]
    return "\n".join([
        "#pragma once", "", f'#include "{model.name}.hpp"', "", "#include <tuple>", "",
        "#include <solenoid/controllers/compiled_solvers.hpp>", "#include <solenoid/solvers/search/rollout_kernel.hpp>", "",
        f"namespace models::{model.name} {{", "",
        "/// The search's inner loop for further instruction sets; only a processor that has them may be asked.", *declared,
        "", f"}}  // namespace models::{model.name}", "", "namespace solenoid {", "",
        "/// The inner loop is chosen at run time.", "template <>",
        f"inline constexpr bool compiled_kernels<{_model(model)}> = true;", *known, "", "}  // namespace solenoid", ""])


def _search(model, sets):
    supports = {"avx2": '__builtin_cpu_supports("avx2")',
                "avx512": '__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") && '
                          '__builtin_cpu_supports("avx512vl")'}
    chosen = []
    for kernel in reversed(sets):
        chosen += [wrapped(f"if ({supports[kernel]})", 4), f"      return models::{model.name}::{kernel}_kernel();"]
    of = f"RolloutKernel<{_model(model)}>"
    absent = [wrapped(f"template <> RelaxedPtr<{_model(model)}> make_relaxed_{solver}<{_model(model)}>() {{ return nullptr; }}", 0)
              for solver in RELAXED if solver not in relaxed(model)]
    return "\n".join([
        f"// The solvers by search and rounding for {model.name}, and the choice of the search's inner loop.",
        f'#include "{model.name}_solvers.hpp"', "", "#include <solenoid/controllers/compiled_solvers.ipp>", "",
        "namespace solenoid {", "", "template <>", f"const {of}& compiled_kernel<{_model(model)}>() {{",
        f"  static const {of} kernel = [] {{", "#ifdef __x86_64__", *chosen, "#endif",
        f'    return make_rollout_kernel<{_model(model)}, xsimd::default_arch>("baseline");', "  }();", "  return kernel;",
        "}", *absent, "", f"SOLENOID_COMPILE_SOLVERS({_model(model)})", "", "}  // namespace solenoid", ""])


def _compiled(model, macro, file):
    return "\n".join([f'#include "{model.name}_solvers.hpp"', "", f"#include <solenoid/controllers/compiled_{file}.ipp>", "",
                      "namespace solenoid {", "", f"SOLENOID_COMPILE_{macro}({_model(model)})", "",
                      "}  // namespace solenoid", ""])


def _kernel(model, kernel):
    arch = {"avx2": "xsimd::avx2", "avx512": "xsimd::avx512f, xsimd::avx2"}[kernel]
    return "\n".join([
        "// Compiled with this instruction set's flags; nothing else may be defined here.", f'#include "{model.name}.hpp"', "",
        "#include <solenoid/solvers/search/rollout_kernel.hpp>", "", f"namespace models::{model.name} {{", "",
        f"solenoid::RolloutKernel<{model._class_name}> {kernel}_kernel();",
        f"solenoid::RolloutKernel<{model._class_name}> {kernel}_kernel() {{", "#ifdef __x86_64__",
        f'  return solenoid::make_rollout_kernel<{model._class_name}, {arch}>("{kernel}");', "#else", "  return {};", "#endif",
        "}", "", f"}}  // namespace models::{model.name}", ""])


def text(value):
    """A C++ string."""
    return json.dumps(value, ensure_ascii=False)


def _fields(pairs):
    return "{" + ", ".join(f".{k} = {v}" for k, v in pairs if v is not None) + "}"


def _finite(value):
    return ex.number_text(value) if math.isfinite(value) else None


def _listed(name, rows):
    if not rows:
        return []
    if len(rows) == 1:
        return [wrapped(f"d.{name} = {{{rows[0]}}};", 2)]
    return [f"  d.{name} = {{"] + [wrapped(r + ("," if k + 1 < len(rows) else "};"), 6) for k, r in enumerate(rows)]


def _range(p):
    return f"{{{ex.number_text(p.low) if math.isfinite(p.low) else '-any'}, " \
           f"{ex.number_text(p.high) if math.isfinite(p.high) else 'any'}}}"


def consumption_key(drawn):
    """Its name in records, with its unit (controllers/described_system.cpp)."""
    unit = "percent" if drawn.unit == "%" else drawn.unit.lower()
    return "".join(c if c.isalnum() and c.isascii() else "_" for c in drawn.name + ("_" + unit if unit else ""))


def _description(model):
    m = model
    lines = ["solenoid::ModelDescription description() {"]
    if any(not (math.isfinite(p.low) and math.isfinite(p.high)) for p in m.parameters):
        lines.append("  constexpr double any = solenoid::ModelDescription::infinity;")
    lines += ["  solenoid::ModelDescription d;", f"  d.name = {text(m.name)};", f"  d.summary = {text(m.summary)};"]
    lines += _listed("states", [_fields([
        ("name", text(s.name)), ("unit", text(s.unit) if s.unit else None),
        ("meaning", text(s.meaning) if s.meaning else None), ("start", ex.number_text(s.start)), ("low", _finite(s.low)),
        ("high", _finite(s.high)), ("process_sigma", ex.number_text(s.process_sigma)), ("rest", _finite(s.rest))])
        for s in m.states])
    lines += _listed("parameters", [
        "{" + ", ".join([text(p.name), ex.number_text(p.value), _range(p), text(p.unit), text(p.meaning)]) + "}"
        for p in m.parameters])
    lines += _listed("channels", [_fields([("state", text(s.name)), ("sigma", ex.number_text(s.sigma))])
                                  for s in m.states if s.sigma is not None])
    lines += _listed("outputs", [_fields([
        ("state", text(o.state.name)), ("weight", ex.number_text(o.weight)), ("terminal", ex.number_text(o.terminal)),
        ("target", ex.number_text(o.target)), ("rate_of", text(o.rate_of.name) if o.rate_of else None)]) for o in m.outputs])
    lines += _listed("inputs", [_fields([("name", text(u.name)), ("unit", text(u.unit) if u.unit else None),
                                         ("most", ex.number_text(u.most)), ("weight", ex.number_text(u.weight))])
                                for u in m.inputs])
    switches = ", ".join(_fields([("name", text(s.name)), *((k, ex.number_text(getattr(s, k))) for k in (
        "rise_delay_s", "fall_delay_s", "min_dwell_s") if getattr(s, k))]) for s in m.switches)
    n = len(m.switches)
    gain = ", ".join("{" + ", ".join("1.0" if i == j else "0.0" for j in range(n)) + "}" for i in range(n))
    lines += _listed("mode_sets", [_fields([
        ("name", text(s.name)), ("switches", f"{{{switches}}}"),
        ("modes", "{" + ", ".join(f"{{{text(mode)}, {p}}}" for mode, p in s.modes.items()) + "}"),
        ("offset", "{" + ", ".join(["0.0"] * n) + "}"), ("gain", f"{{{gain}}}"),
        ("safe", None if s.safe is None else str(s.safe))]) for s in m._sets()])
    if m.drawn:
        lines.append(f"  d.consumption = {{{text(m.drawn.name)}, {text(m.drawn.unit)}, {text(consumption_key(m.drawn))}, "
                     f"{text(m.drawn.name)}}};")
    lines += [f"  d.timing = {{{ex.number_text(m.tick_s)}, {m.ticks_per_period}}};", f"  d.steps = {m._horizon_steps};",
              wrapped(f"d.blocks = {{{', '.join(map(str, m.blocks))}}};", 2)]
    if m.switching:
        lines.append(f"  d.switching = {ex.number_text(m.switching)};")
    return lines + ["  return d;", "}"]


def _plugin(model):
    name, of = model.name, model._class_name
    compiled = sorted(set(itertools.chain.from_iterable(sizes(model).values()))) if relaxed(model) else []
    rows, add = [], []
    if compiled:
        modes = "{" + ", ".join(text(m) for m in compiled) + "}"
        rows = ["/// A relaxed solver whose plans are applied as pulses over each control period.",
                "template <class Make>",
                "solenoid::SolverRow relaxed_row(const char* name, const char* summary, bool real_time, Make make) {",
                "  return {.name = name,", "          .summary = summary,", "          .real_time = real_time,",
                '          .instead = real_time ? "" : "sqp",', "          .chooses_continuous = true,",
                "          .plans_whole_input = true,", "          .pulses = true,", '          .groups = {"planning"},',
                f"          .modes = {modes},", f"          .make = solenoid::SolverMakers::of<{of}>(make),",
                "          .check = solenoid::check_pulses};", "}", ""]
    said = {"sqp": ("relaxed by real-time SQP, applied as pulses over each control period", "true"),
            "ipopt": ("the same by Ipopt: a reference for simulations", "false")}
    for solver in relaxed(model):
        summary, real_time = said[solver]
        add += [f'  system.add(relaxed_row("{solver}", "{summary}", {real_time},',
                "                         []<solenoid::HybridModel M>(const solenoid::VariantConfig& v) {",
                f"                           return solenoid::make_pulses<M>(v, solenoid::make_relaxed_{solver}<M>());",
                "                         }));"]
    return "\n".join([
        f"// The plug-in {name}: what is said of the system beside its model, and its solvers.",
        f'#include "{name}_solvers.hpp"', "", "#include <solenoid/controllers/described_system.hpp>",
        "#include <solenoid/experiments/described/described_simulation.hpp>",
        "#include <solenoid/experiments/plugin/plugin.hpp>", "", f"namespace models::{name} {{", "namespace {", "",
        *_description(model), "", *rows, "}  // namespace",
        f"}}  // namespace models::{name}", "", f"extern const char {name}_toml[];", "",
        f"SOLENOID_PLUGIN({text(name)}, registry) {{", f"  using namespace models::{name};",
        f"  auto& system = *new solenoid::DescribedSystem<{of}>(description());  // for ever, as all that is registered",
        *add,
        f"  registry.add(system, *new solenoid::DescribedSimulation<{of}>(system));",
        f"  registry.add_campaign({text(name)}, {name}_toml);", "}", ""])


# TOML.


def _exhaustive_blocks(model):
    """Blocks of the same duration, joined from the end until every sequence is soon tried."""
    blocks, modes = list(model.blocks), len(model._sets()[0].modes)
    while len(blocks) > 1 and modes**len(blocks) > 20000:
        blocks[-2:] = [blocks[-2] + blocks[-1]]
    return blocks


def campaign(model):
    name, m = model.name, model
    duration = m.duration_s or 3 * sum(m.blocks) * m.ticks_per_period * m.tick_s
    own = _exhaustive_blocks(m)
    horizon = "" if own == m.blocks else f"horizon = {{ blocks = {own} }}\n"
    return f"""# The campaign of {name}: its variants are known everywhere once the plug-in is loaded.
variants = ["{name}_search", "{name}_exhaustive", "{name}_rounded"]

[variant.{name}_search]
system  = "{name}"
summary = "branch and bound"

[variant.{name}_exhaustive]
system  = "{name}"
summary = "every sequence"
solver  = "exhaustive"
{horizon}
[variant.{name}_rounded]
system  = "{name}"
summary = "relaxed and rounded by summing up"
solver  = "sum_up_rounding"

[[scenario]]
name       = "task"
system     = "{name}"
trajectory = {{}}
duration_s = {duration!r}
"""


def toml_source(model):
    """The campaign as C++: what CMake writes of a .toml file."""
    return (f"extern const char {model.name}_toml[];\n"
            f"const char {model.name}_toml[] = R\"_text_({campaign(model)})_text_\";\n")
