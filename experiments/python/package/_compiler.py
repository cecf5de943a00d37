"""Compiles a model's plug-in, once for its content, compiler and headers, and loads it.

What is compiled stays in $XDG_CACHE_HOME/solenoid/models (~/.cache/solenoid/models), a folder each. Compiler and flags are
those of the library: _build.json, which CMake writes beside this file.
"""

from __future__ import annotations

import contextlib
import dataclasses
import fcntl
import hashlib
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

from . import _core, _plugin_files
from .model import BuiltModel

_HERE = pathlib.Path(__file__).absolute().parent
_built: dict[str, str] = {}  # what this process has loaded: names and keys


@dataclasses.dataclass(frozen=True)
class Toolchain:
    compiler: list[str]
    flags: list[str]
    kernels: dict[str, list[str]]  # flags of further instruction sets
    version: str  # of compiler and headers


def toolchain() -> Toolchain:
    """Throws RuntimeError, naming packages, where compiler or headers are missing."""
    try:
        said = json.loads((_HERE / "_build.json").read_text())
    except (OSError, ValueError):
        raise RuntimeError("the package does not say how it was compiled: _build.json is missing "
                           "(apt-get install --reinstall python3-solenoid)") from None
    compiler = next((c for c in said["compilers"] if shutil.which(c)), None)
    if compiler is None:
        raise RuntimeError(f"no C++ compiler: {', '.join(said['compilers'])} (apt-get install g++ libsolenoid-dev)")
    includes = [str((_HERE / path).resolve()) for path in said["own_includes"]]
    own = next((path for path in includes if os.path.exists(path + "/solenoid/abi_hash.hpp")), None)
    if own is None:
        raise RuntimeError(f"no headers of solenoid in {', '.join(includes)} (apt-get install libsolenoid-dev)")
    missing = [path for path in said["includes"] if not os.path.isdir(path)]
    if missing:
        raise RuntimeError(f"no headers in {', '.join(missing)} (apt-get install libsolenoid-dev)")
    about = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=True).stdout
    flags = said["flags"] + [f for path in [own, *said["includes"]] for f in ("-isystem", path)]
    return Toolchain([compiler], flags, said["kernels"], about + pathlib.Path(own, "solenoid/abi_hash.hpp").read_text())


def cache() -> pathlib.Path:
    base = os.environ.get("XDG_CACHE_HOME", "")
    root = pathlib.Path(base if os.path.isabs(base) else pathlib.Path.home() / ".cache", "solenoid", "models")
    root.mkdir(mode=0o700, parents=True, exist_ok=True)
    return root


def build(model) -> BuiltModel:
    from . import _expressions

    try:
        files = _plugin_files.sources(model)
    except _expressions.Refused as problem:
        model._refuse_line(str(problem))
    tools = toolchain()
    name = model.name
    key = hashlib.sha256(json.dumps([sorted(files.items()), dataclasses.astuple(tools)]).encode()).hexdigest()[:24]
    if _built.get(name, key) != key:
        model._refuse("another model of this name has been built in this process", "another name, or a new process")
    root = cache()
    folder = root / f"{name}-{key}"
    library = folder / f"{name}.so"
    if not library.exists():
        with _lock(root / f"{name}-{key}.lock"):
            if not library.exists():  # who held the lock may have made it
                _make(model, files, tools, root, folder)
    _core.load_plugin(str(library))
    _built[name] = key
    return BuiltModel(name, files[f"{name}.hpp"], folder, library)


@contextlib.contextmanager
def _lock(path):
    """One process at a time; the lock ends with its process."""
    with open(path, "w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _make(model, files, tools, root, folder):
    """Compiles into a folder of its own, which gets its name when all is there."""
    name = model.name
    work = pathlib.Path(tempfile.mkdtemp(prefix=f".{name}-", dir=root))
    try:
        for file, content in files.items():
            (work / file).write_text(content)
        (work / f"{name}_toml.cpp").write_text(_plugin_files.toml_source(model))
        commands = {}
        for unit in _units(name, files):
            special = next((flags for k, flags in tools.kernels.items() if unit == f"{name}_{k}"), [])
            if unit == name and "-O2" in tools.flags:
                special = ["-O1"]  # no solver is in it, and it compiles in two thirds of the time
            commands[unit] = tools.compiler + tools.flags + special + ["-c", f"{unit}.cpp", "-o", f"{unit}.o"]
        _run(name, commands, work)
        # Inline functions that several objects have are the first's: those for further instruction sets come last.
        objects = sorted((f"{unit}.o" for unit in commands), key=lambda o: any(o == f"{name}_{k}.o" for k in tools.kernels))
        _run(name, {"link": tools.compiler + ["-shared", "-o", f"{name}.so", *objects]}, work)
        for unit in commands:
            (work / f"{unit}.o").unlink()
        for log in work.glob("*.log"):
            log.unlink()
        shutil.rmtree(folder, ignore_errors=True)  # what an interrupted removal left
        os.rename(work, folder)
    finally:
        shutil.rmtree(work, ignore_errors=True)


def _units(name, files):
    """What is compiled, longest first."""
    order = [f"{name}_sqp", name, f"{name}_search", f"{name}_ipopt"]
    units = [file[:-4] for file in files if file.endswith(".cpp")] + [f"{name}_toml"]
    return sorted(units, key=lambda u: order.index(u) if u in order else len(order))


def _run(name, commands, work):
    """Runs commands side by side, one a core; throws RuntimeError with the first error's line and the log's path."""
    waiting, running, done = list(commands), {}, 0
    cores = min(8, len(os.sched_getaffinity(0)))
    begin, shown = time.monotonic(), sys.stderr.isatty()
    try:
        while waiting or running:
            while waiting and len(running) < cores:
                unit = waiting.pop(0)
                with open(work / f"{unit}.log", "w") as log:
                    running[unit] = subprocess.Popen(commands[unit], cwd=work, stdout=log, stderr=log,
                                                     stdin=subprocess.DEVNULL)
            time.sleep(0.05)
            for unit in [u for u, process in running.items() if process.poll() is not None]:
                if running.pop(unit).returncode != 0:
                    raise RuntimeError(_problem(name, unit, commands[unit], work))
                done += 1
            if shown:
                print(f"\r\033[Ksolenoid: compiling {name}: {done} of {len(commands)}, {time.monotonic() - begin:.0f} s",
                      end="", file=sys.stderr, flush=True)
    finally:
        for process in running.values():
            process.terminate()
            process.wait()
        if shown:
            print("\r\033[K", end="", file=sys.stderr, flush=True)


def _problem(name, unit, command, work):
    """Keeps the log, and the sources that it speaks of."""
    kept = pathlib.Path(tempfile.mkdtemp(prefix=f"solenoid-{name}-"))
    shutil.copytree(work, kept, dirs_exist_ok=True, ignore=shutil.ignore_patterns("*.o"))
    log = kept / f"{unit}.log"
    lines = log.read_text(errors="replace").splitlines()
    with log.open("a") as file:
        file.write("\n" + " ".join(command) + "\n")
    first = next((line for line in lines if "error" in line), lines[0] if lines else "the compiler ended without a word")
    return f"model '{name}' does not compile: {first.strip()} (log: {log})"
