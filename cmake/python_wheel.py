"""What pip calls (PEP 517, PEP 660): a wheel of the Python package, built by CMake, made of the standard library alone.

    pip install .                                            builds the package below build/pip, then installs it
    pip install . --config-settings build-dir=build/release  takes what lies built there, and compiles nothing
    SOLENOID_BUILD_DIR=build/release pip install .           the same
    pip install -e .                                         points to the build folder instead of copying

Further config settings: cmake-args, what CMake is configured with; jobs, how many compilers run at a time.

A wheel is a zip of what `cmake --install --component python` installs and the library's headers, with its metadata.
"""
import base64
import hashlib
import os
import re
import shlex
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import tomllib
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
INSTALLED = "lib/python3/dist-packages"  # where CMake puts the package, below a prefix
NEEDED = "apt-get install cmake g++ pybind11-dev python3-dev python3-numpy, and what ./solenoid installs"


class UnsupportedOperation(Exception):
    """What pip is told where a hook does not do what it asks."""


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    build = built(config_settings or {})
    with tempfile.TemporaryDirectory(prefix="solenoid-wheel-") as prefix:
        run("cmake", "--install", str(build), "--component", "python", "--prefix", prefix, "--strip")
        folder = Path(prefix, INSTALLED)
        files = below(folder, "")
    files.update(below(build / "include", "solenoid/include/"))  # for models, which are compiled where they are made
    return written(Path(wheel_directory), files)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    folder = built(config_settings or {}) / "python"
    return written(Path(wheel_directory), {"solenoid.pth": f"{folder}\n".encode()})


def build_sdist(sdist_directory, config_settings=None):
    raise UnsupportedOperation("no source distribution (allowed: a clone, or a wheel)")


def built(settings):
    """The build folder with the package in it, built there unless it is said which one has it."""
    given = settings.get("build-dir") or os.environ.get("SOLENOID_BUILD_DIR")
    build = (ROOT / given if given else ROOT / "build" / "pip").resolve()
    extension = build / "python" / "solenoid" / f"_core{sysconfig.get_config_var('EXT_SUFFIX')}"
    if not given:
        configure(build, settings)
        run("cmake", "--build", str(build), "--target", "solenoid_python", "--parallel",
            settings.get("jobs") or str(os.cpu_count()))
    if not extension.is_file():
        raise SystemExit(
            f"solenoid: {extension} is not there (allowed: a build folder with the package for this Python; {NEEDED})")
    return build


def configure(build, settings):
    arguments = [
        "-DCMAKE_BUILD_TYPE=Release", "-DSOLENOID_UNITY=ON", "-DSOLENOID_TESTS=OFF",
        f"-DPython3_EXECUTABLE={sys.executable}"
    ]
    if shutil.which("ninja") and not (build / "CMakeCache.txt").exists():
        arguments += ["-G", "Ninja"]
    run("cmake", "-S", str(ROOT), "-B", str(build), *arguments, *shlex.split(settings.get("cmake-args", "")))


def run(*command):
    if shutil.which(command[0]) is None:
        raise SystemExit(f"solenoid: {command[0]} is missing (allowed: {NEEDED})")
    if (code := subprocess.run(command).returncode) != 0:
        raise SystemExit(f"solenoid: {' '.join(command)}: exit code {code} ({NEEDED})")


def written(directory, files):
    """Writes a wheel of these files, by their names, and returns its own."""
    name, python = f"solenoid-{version()}", f"cp{sys.version_info.major}{sys.version_info.minor}"
    tag = f"{python}-{python}-{re.sub('[-.]', '_', sysconfig.get_platform())}"
    info = f"{name}.dist-info"
    files = {
        **files, f"{info}/METADATA": metadata().encode(),
        f"{info}/LICENSE": (ROOT / "LICENSE").read_bytes(),
        f"{info}/WHEEL": f"Wheel-Version: 1.0\nGenerator: solenoid\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
    }
    record = "".join(f"{file},sha256={digest(content)},{len(content)}\n" for file, content in sorted(files.items()))
    files[f"{info}/RECORD"] = f"{record}{info}/RECORD,,\n".encode()
    with zipfile.ZipFile(directory / f"{name}-{tag}.whl", "w", zipfile.ZIP_DEFLATED) as wheel:
        for file, content in files.items():
            entry = zipfile.ZipInfo(file)  # of one date: the same build gives the same wheel
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, (0o755
                                                                              if file.endswith(".so") else 0o644) << 16
            wheel.writestr(entry, content)
    return f"{name}-{tag}.whl"


def below(folder, name):
    """The files of a folder by their names in the wheel."""
    paths = [path for path in sorted(folder.rglob("*")) if path.is_file()]
    return {name + path.relative_to(folder).as_posix(): path.read_bytes() for path in paths}


def digest(content):
    return base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()


def version():
    return re.search(r"project\(solenoid VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


def metadata():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    lines = [
        "Metadata-Version: 2.1", f"Name: {project['name']}", f"Version: {version()}",
        f"Summary: {project['description']}", "License: BSD-3-Clause", f"Requires-Python: {project['requires-python']}",
        *(f"Requires-Dist: {one}" for one in project["dependencies"])
    ]
    for extra, wanted in project["optional-dependencies"].items():
        lines += [f"Provides-Extra: {extra}", *(f"Requires-Dist: {one}; extra == '{extra}'" for one in wanted)]
    return "\n".join([*lines, "Description-Content-Type: text/markdown", "", (ROOT / project["readme"]).read_text()])
