#!/usr/bin/env bash
# `pip install .` from a clone, offline, into a virtual environment: what is installed is the build's package, imports, has the
# project's version and solves a problem, and goes without a trace. The package is taken from a build folder, not built again.
# Arguments: the source folder, the build folder, the project's version, the build's Python, a scratch folder.
set -euo pipefail
source=$1
build=$2
version=$3
python=$4
work=$5
rm -rf -- "$work"
mkdir -p "$work"
fail() { printf 'FAILED: %s\n' "$*" >&2; exit 1; }
unset PYTHONPATH PIP_TARGET PIP_PREFIX
export PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_NO_INDEX=1 PIP_CACHE_DIR=$work/cache

if ! "$python" -m venv --system-site-packages "$work/venv" >"$work/log" 2>&1; then
  cat "$work/log" >&2
  [[ -n ${CI:-} ]] && fail "no virtual environment: apt-get install python3-venv"
  exit 77
fi
pip=("$work/venv/bin/python" -m pip -q)

# A build folder without the package is refused, in words.
mkdir "$work/empty"
! SOLENOID_BUILD_DIR=$work/empty "${pip[@]}" install "$source" >"$work/log" 2>&1 || fail "an empty build folder is taken"
grep -q 'allowed: a build folder with the package for this Python' "$work/log" || { cat "$work/log" >&2; fail "no reason"; }

"${pip[@]}" install "$source" --config-settings build-dir="$build" >"$work/log" 2>&1 || { cat "$work/log" >&2; fail "pip install"; }
cd "$work"
said=$("$work/venv/bin/python" - <<'END'
import solenoid
nine = solenoid.read_instances()["nine_state"][:3]
print(solenoid.__version__, solenoid.__file__, (nine.solve().costs == nine.plan_costs).all())
END
)
[[ $said == "$version $work/venv/"*" True" ]] || fail "Python says $said"
"$work/venv/bin/python" -m pip show -f solenoid >"$work/shown" 2>/dev/null
grep -qx "Version: $version" "$work/shown" || fail "pip calls it $(grep ^Version "$work/shown")"
grep -qx 'Requires: numpy' "$work/shown" || fail "it does not require numpy"
for file in "$build"/python/solenoid/*; do
  [[ -d $file ]] || grep -qE "^ *solenoid/$(basename "$file")\$" "$work/shown" || fail "$(basename "$file") is not installed"
done
# Models are compiled with the headers that came with it.
flags=$("$work/venv/bin/python" -c 'import solenoid._compiler as c; print(*c.toolchain().flags)')
[[ $flags == *" $work/venv/"*"/solenoid/include "* ]] || fail "models are compiled with $flags"
"${pip[@]}" uninstall -y solenoid >"$work/log" 2>&1
! "$work/venv/bin/python" -c 'import solenoid' 2>/dev/null || fail "it is still there"

# Installed as a pointer, it is the build folder's own.
SOLENOID_BUILD_DIR=$build "${pip[@]}" install -e "$source" >"$work/log" 2>&1 || { cat "$work/log" >&2; fail "pip install -e"; }
where=$("$work/venv/bin/python" -c 'import solenoid; print(solenoid.__file__)')
[[ $where == "$(realpath "$build")/python/solenoid/__init__.py" ]] || fail "it points to $where"
rm -rf -- "$work"
