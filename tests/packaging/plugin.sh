#!/usr/bin/env bash
# Plug-ins made outside of the project, against what it installs: what `solenoid new` writes builds, passes its tests and takes
# part in every command; what is wrong with one is said, and costs no other run.
# Arguments: the build folder, the folder with faulty plug-ins, a scratch folder, the sanitizer that all is built with or nothing.
set -euo pipefail
build=$(realpath "$1")
source=$(realpath "$2")
work=$(realpath -m "$3")
sanitize=${4:-}
rm -rf -- "$work"
mkdir -p "$work"
fail() { printf 'FAILED: %s\n' "$*" >&2; [[ ! -s $work/said ]] || cat "$work/said" >&2; exit 1; }
quietly() { "$@" >"$work/said" 2>&1 || fail "$*"; }
# exits CODE COMMAND...: with this code, what it says kept; then says PATTERN, whether a line of that is like it.
exits() { local code=0 wanted=$1; shift; "$@" >"$work/said" 2>&1 || code=$?; [[ $code == "$wanted" ]] || fail "$*: exit code $code, not $wanted"; }
says() { grep -qE -- "$1" "$work/said" || fail "nothing like: $1"; }

quietly cmake --install "$build" --prefix "$work/prefix"
export PATH=$work/prefix/bin:$PATH CMAKE_PREFIX_PATH=$work/prefix CMAKE_GENERATOR=Ninja
[[ -z $sanitize ]] || export CXXFLAGS="-fsanitize=$sanitize -fno-omit-frame-pointer" LDFLAGS="-fsanitize=$sanitize"
make() { quietly cmake -S "$1" -B "$1/build"; quietly cmake --build "$1/build"; }
cd "$work"

# What `solenoid new` writes.
exits 2 solenoid new system Class; says "'Class' is no name \(allowed: "
exits 2 solenoid new system thrusters; says 'is a system already'
exits 2 solenoid new system while; says "'while' is no name"
exits 2 solenoid new solver cia; says "'cia' is known already"
for kind in system controller solver; do
  quietly solenoid new "$kind" "my_$kind"
  exits 2 solenoid new "$kind" "my_$kind"; says 'is there already'
  make "my_$kind"
  quietly ctest --test-dir "my_$kind/build" --output-on-failure
done

# The system takes part in everything.
plugin=my_system/build/my_system.so
exits 0 solenoid compare my_system/compare.toml --out all; says '^ +1 +my_system_(search|exhaustive) .*0 of 1$'
exits 0 solenoid --plugin $plugin list variants; says '^my_system_search +my_system '
exits 0 solenoid --plugin=$plugin list keys --system my_system; says '^estimation.plate_sigma '
exits 0 solenoid --plugin $plugin profile my_system --variant my_system_search --passes 2 --save profile.json; says 'my_system_search'
exits 0 solenoid --plugin $plugin run my_system_search --plant sim --duration 5 --out run; says 'my_system_search'
log=run/warm_up--my_system_search--s1.mcap
exits 0 solenoid --plugin $plugin replay "$log"
exits 2 solenoid replay "$log"; says "my_system"
# Results say what they came from, and load no file.
grep -q '^plugins = \[ .my_system. \]' all/resolved.toml || fail "results do not name the plug-in"
solenoid --plugin $plugin report all >said 2>&1 || says 'uPlot.* was not there'
exits 2 solenoid report all; says "'my_system' is not loaded \(allowed: "
# The same again: nothing is done twice. Another build of it: everything is.
done_now() { grep -coE '^[0-9]+/[0-9]+, ' "$work/said" || true; }
exits 0 solenoid compare my_controller/compare.toml --out twice
first=$(cat twice/runs.csv)
exits 0 solenoid compare my_controller/compare.toml --out twice
[[ $(cat twice/runs.csv) == "$first" && $(done_now) == 0 ]] || fail "finished runs were done again"
sed -i 's/"my_controller.dead_zone_m", 0.02/"my_controller.dead_zone_m", 0.05/' my_controller/my_controller.cpp
make my_controller
exits 0 solenoid compare my_controller/compare.toml --out twice
[[ $(cat twice/runs.csv) != "$first" ]] || fail "another build of a plug-in changed nothing"

# What cannot be loaded.
cp -r "$source" faulty
make faulty
refused() { exits 1 solenoid --plugin "$1" list variants; says "^solenoid: $1: .*$2"; [[ $(wc -l <"$work/said") == 1 ]] || fail "$1: more than a line"; }
refused faulty/build/missing.so 'needs faulty::nobody_has_this\(int\), which is not there'
refused faulty/build/refuses.so 'refuses to be loaded: not on a Sunday'
refused faulty/build/hangs.so 'not loaded within 20 s'
refused faulty/build/campaign.so 'refuses to be loaded: .*faulty_campaign'
refused faulty/build/crashes.so 'fails while it is loaded: worker ended by (signal 11|exit code)'
old=$(solenoid --version | sed -E 's/^solenoid ([0-9.]+).*/\1/')
LC_ALL=C sed "s/abi=${old//./\\.} /abi=${old//[0-9]/0} /" my_solver/build/my_solver.so >old.so
refused old.so "plug-in 'my_solver' was made with solenoid ${old//[0-9]/0} .*\(allowed: $old .*; build it again\)"
printf '\x7fELF' >empty.so
refused empty.so 'no plug-in'
refused my_system/compare.toml 'no shared object'
refused nowhere.so 'cannot be read'
cp $plugin copied.so
exits 0 solenoid --plugin $plugin --plugin copied.so list variants
printf 'x' >>copied.so
exits 1 solenoid --plugin $plugin --plugin copied.so list variants; says "is loaded from $plugin already"

# What fails while it runs, and what does not even load, beside runs that go on.
cat >faults.toml <<'TOML'
plugins  = ["faulty/build/steps.so", "my_solver/build/my_solver.so", "old.so"]
variants = ["flyer_pairs", "fine", "aborts", "hangs", "leaves", "refuses", "unknown"]
include  = ["faulty_scenario.toml"]
variant.fine    = { system = "thrusters", thrusters = "pairs", solver = "faulty", summary = "no fault" }
variant.aborts  = { system = "thrusters", thrusters = "pairs", solver = "faulty", summary = "aborts", faulty = { kind = 1 } }
variant.hangs   = { system = "thrusters", thrusters = "pairs", solver = "faulty", summary = "hangs", faulty = { kind = 2 } }
variant.leaves  = { system = "thrusters", thrusters = "pairs", solver = "faulty", summary = "leaves", faulty = { kind = 3 } }
variant.refuses = { system = "thrusters", thrusters = "pairs", solver = "faulty", summary = "refuses", faulty = { kind = 4 } }
variant.unknown = { system = "thrusters", thrusters = "pairs", solver = "of_a_plugin_that_is_old", summary = "needs another" }
TOML
cat >faulty_scenario.toml <<'TOML'
[[scenario]]
name       = "station"
system     = "thrusters"
trajectory = {}
duration_s = 20.0
TOML
exits 1 solenoid compare faults.toml --out faults --tick-limit 2
says '^solenoid: .*old.so: plug-in .my_solver. was made with'
says '^solenoid: left out without it: unknown$'
says 'aborts .*signal 6|aborts .*exit code'
says 'hangs .*stuck'
says 'leaves .*exit code 3'
says 'refuses .*this law refuses'
for variant in flyer_pairs fine; do grep -qE "^ +[0-9]+ +$variant .*0 of 1" "$work/said" || fail "$variant did not end well"; done
says '^solenoid: 4 runs failed$'
printf 'plug-ins: made, loaded, ranked, refused\n'
rm -rf -- "$work"
