"""mypy on the package's stubs: they are what the package is (stubtest), a program with types passes, and one with
errors does not. Arguments: the folder of the programs, one for mypy's cache. PYTHONPATH names the package."""

import importlib.util
import os
import pathlib
import re
import subprocess
import sys

programs, cache = map(pathlib.Path, sys.argv[1:])
if importlib.util.find_spec("mypy") is None:
    print("mypy is not installed: apt-get install mypy", file=sys.stderr)
    sys.exit(1 if os.environ.get("CI") else 77)

package = next(path for path in sys.path if (pathlib.Path(path) / "solenoid" / "py.typed").exists())
environment = {**os.environ, "MYPYPATH": package, "MYPY_CACHE_DIR": str(cache)}


def run(*command, folder=programs):
    done = subprocess.run([sys.executable, "-m", *command],
                          capture_output=True,
                          text=True,
                          env=environment,
                          cwd=folder)
    return done.returncode, done.stdout + done.stderr


code, said = run("mypy", "--strict", "typed_program.py")
print(said)
assert code == 0, "typed_program.py does not pass"

code, said = run("mypy", "--strict", "wrong_program.py")
found = {(int(line), kind)
         for line, kind in re.findall(r"^wrong_program\.py:(\d+): error: .*\[([a-z-]+)\]$", said, re.M)}
lines = (programs / "wrong_program.py").read_text().splitlines()
wanted = {(number, line.split("# error: ")[1]) for number, line in enumerate(lines, 1) if "# error: " in line}
assert wanted <= found and len(wanted) > 3, said

# Modules that are typed themselves have no stub, and classes of pybind11 properties where the stub has attributes.
allowed = cache.with_suffix(".allowed")
cache.mkdir(parents=True, exist_ok=True)
allowed.write_text(r"solenoid\.(_\w+|control|data|instances|model)\..*" + "\n")
code, said = run("mypy.stubtest", "solenoid", "--concise", "--ignore-unused-allowlist", "--allowlist", str(allowed),
                 folder=cache)  # where it leaves a cache of its own
of_pybind11 = re.compile(
    r"metaclass differs|is read-only at runtime but not in the stub|__init__ .*stub does not have \*args argument")
assert code == 0 or said.startswith("solenoid."), said
differs = [line for line in said.splitlines() if line.startswith("solenoid.") and not of_pybind11.search(line)]
print("\n".join(differs))
assert not differs, "the stubs are not what the package is"
