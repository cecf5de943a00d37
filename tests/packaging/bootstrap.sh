#!/usr/bin/env bash
# The bootstrap script against a machine that lacks packages: dpkg-query, apt-get, sudo, id and cmake are stand-ins that
# record what they are asked. Arguments: the repository, a scratch folder.
# shellcheck disable=SC2016  # what single quotes keep is for the stand-ins to expand
set -euo pipefail
unset CI
work="$2/boot strap"
rm -rf -- "$work"
mkdir -p "$work/clone" "$work/bin"
cp "$1/solenoid" "$1/CMakePresets.json" "$work/clone/"
cd "$work"

stand_in() { printf '#!/bin/bash\n%s\n' "$2" >"bin/$1"; chmod +x "bin/$1"; }
fail() { printf 'FAILED: %s\n' "$*" >&2; cat "$work/err" >&2; exit 1; }
expect() { grep -qF -- "$1" "$work/$2" || fail "no '$1' in $2"; }
# Everything is installed but libfmt-dev, until apt-get install has run.
stand_in dpkg-query 'for p in "${@:4}"; do
  [[ $p == libfmt-dev && ! -e '"'$work/installed'"' ]] || echo "installed $p"; done'
stand_in nproc 'echo 1'
stand_in cmake 'echo "cmake $*" >>'"'$work/calls'"'; exit 3'

run() {  # runs the clone's script as a user or as root; leaves out, err, calls and the exit code in `code`
  rm -f calls; touch calls
  stand_in id "echo $1"; shift
  code=0
  (cd / && PATH="$work/bin:$PATH" "$work/clone/solenoid" "$@") >out 2>err </dev/null || code=$?
}

run 1000
[[ $code == 0 && ! -s calls ]] || fail "help needs nothing installed"
expect compare out

stand_in sudo 'exit 1'
run 1000 list
[[ $code == 2 ]] || fail "exit code $code without permission to install"
expect 'sudo apt-get install --no-install-recommends libfmt-dev' err
[[ ! -s calls && ! -s out ]] || fail "something ran after the refusal"

stand_in apt-get 'echo "apt-get $*" >>'"'$work/calls'"'
[[ $* != *install* || -e '"'$work/lists'"' ]] || exit 100
[[ $* != *update* ]] || touch '"'$work/lists'"'
[[ $* != *install* ]] || touch '"'$work/installed'"
run 0 list
[[ $(grep -c '^apt-get .*install.* libfmt-dev' calls) == 2 ]] || fail "one try, an update, another: $(cat calls)"
[[ $(grep -c '^apt-get .*update' calls) == 1 ]] || fail "no update of absent package lists"
expect 'cmake --preset release' calls
[[ $code == 1 ]] || fail "exit code $code when cmake fails"
expect 'configuring failed' err

run 0 list
! grep -q apt-get calls || fail "apt-get although all is installed"

# A build that fails shows its output; one that succeeds is silent on standard output and hands on the arguments.
stand_in cmake 'echo "cmake $*" >>'"'$work/calls'"'
case $1 in
  --preset) build='"'$work/clone/build'"'/$2; mkdir -p "$build"; touch "$build/build.ninja"
            printf "CMAKE_HOME_DIRECTORY:INTERNAL=%s\nSOLENOID_TESTS:BOOL=%s\n" "$PWD" "${3#*=}" >"$build/CMakeCache.txt" ;;
  --build) echo "[1/2] Building x.o"
           [[ -e '"'$work/sound'"' ]] || { echo "error: boom"; exit 1; }
           mkdir -p "$2/bin"
           printf "#!/bin/bash\nprintf \"%%s|\" \"\$PWD\" \"\$@\"; exit 7\n" >"$2/bin/solenoid"
           chmod +x "$2/bin/solenoid" ;;
esac'
run 0 list
[[ $code == 1 && ! -s out ]] || fail "exit code $code when the build fails"
expect 'error: boom' err
touch sound
run 0 compare 'my campaign.toml' --out ''
[[ $code == 7 ]] || fail "the program's exit code became $code"
[[ $(<out) == '/|compare|my campaign.toml|--out||' ]] || fail "arguments became $(<out)"

# A report needs uPlot from npm; without it the program is there all the same, and says so itself.
echo '{}' >clone/package.json
stand_in npm 'echo "npm $* in $PWD" >>'"'$work/calls'"'; exit 1'
run 0 list
! grep -q '^npm' calls || fail "npm although no report is asked for"
run 0 report results
[[ $code == 7 && $(<out) == '/|report|results|' ]] || fail "npm's failure became $code $(<out)"
expect 'npm ci --ignore-scripts' calls
expect 'reports need them: npm ci in' err
stand_in npm 'echo "npm $* in $PWD" >>'"'$work/calls'"'; mkdir -p node_modules/uplot/dist; touch node_modules/uplot/dist/uPlot.iife.min.js'
run 0 compare --live
[[ $(grep -c '^npm ci' calls) == 1 ]] || fail "no npm for a live page"
run 0 report results
! grep -q '^npm' calls || fail "npm although uPlot is there"

# The documentation asks for tools of its own and not for the program, and its path is all that is printed.
mkdir -p clone/docs/site
printf 'print("build/docs/site/index.html")\n' >clone/docs/site/build.py
stand_in dpkg-query 'for p in "${@:4}"; do
  [[ ( $p == furo || $p == libfmt-dev ) && ! -e '"'$work/installed'"' ]] || echo "installed $p"; done'
rm installed
run 0 docs
[[ $code == 0 && $(<out) == build/docs/site/index.html ]] || fail "docs became $code $(<out)"
grep -q '^apt-get .*install.* furo$' calls || fail "no theme for the documentation: $(cat calls)"
! grep -q '^cmake' calls || fail "the program is built for its documentation"
run 0 docs all
[[ $code == 2 && ! -s out ]] || fail "docs with an argument became $code"

# Packages: what is installed is built, then packed afresh; not without uPlot, and nothing is left of older ones.
stand_in cpack 'echo "cpack $*" >>'"'$work/calls'"'; mkdir -p "${!#}/_CPack_Packages"; touch "${!#}/solenoid_9_all.deb"
[[ ! -e '"'$work/unpackable'"' ]] || { echo "no shlibs"; exit 1; }'
mkdir -p clone/build/packages
touch clone/build/packages/solenoid_8_all.deb
run 0 package
[[ $code == 0 && $(<out) == "$work/clone/build/packages/solenoid_9_all.deb" ]] || fail "packages became $code $(<out)"
[[ $(ls clone/build/packages) == solenoid_9_all.deb ]] || fail "left in build/packages: $(ls clone/build/packages)"
expect "cpack --config $work/clone/build/release/CPackConfig.cmake -G DEB" calls
expect 'no python3-solenoid' err
touch unpackable
run 0 package
[[ $code == 1 && ! -s out ]] || fail "exit code $code when cpack fails"
expect 'no shlibs' err
run 0 package solenoid
[[ $code == 2 && ! -s calls ]] || fail "exit code $code with an argument too many"
rm -r clone/node_modules
stand_in npm 'exit 1'
run 0 package
[[ $code == 2 ]] || fail "exit code $code without uPlot"
expect 'without uPlot' err
! grep -q '^cpack' calls || fail "packed without uPlot"

# What nothing is compiled against is installed while the compiler works; without it the program runs all the same.
touch sound
sed -i 's/^late_packages=.*/late_packages=(drawer)/' clone/solenoid
stand_in dpkg-query 'for p in "${@:4}"; do [[ $p == drawer ]] || echo "installed $p"; done'
run 0 list
[[ $code == 7 && $(grep -c '^apt-get .*install.* drawer$' calls) == 1 ]] || fail "the drawer was not asked for: $(cat calls)"
stand_in apt-get 'exit 100'
run 0 list
[[ $code == 7 ]] || fail "exit code $code without the drawer"
expect 'without drawer nothing is plotted' err

# Completion builds nothing, and adds what the script alone knows.
touch sound
run 0 complete -- pack
[[ $code == 0 && ! -s calls && $(<out) == *package ]] || fail "completion became $code $(<out)"

# The tests of another build: configured, built and run as its preset says, with the other arguments for ctest.
stand_in ctest 'printf "%s|" "$PWD" "$@"; exit 8'
run 0 test -R core
[[ $code == 8 && $(<out) == "$work/clone|--preset|release|--parallel|1|-R|core|" ]] || fail "tests became $code $(<out)"
run 0 test -R core --preset ubsan --repeat until-pass:2
[[ $code == 8 && $(<out) == "$work/clone|--preset|ubsan|--parallel|1|-R|core|--repeat|until-pass:2|" ]] ||
  fail "tests of a preset became $code $(<out)"
expect 'cmake --preset ubsan -DSOLENOID_TESTS=ON' calls
expect "cmake --build $work/clone/build/ubsan --target all" calls
run 0 test --preset=ubsan
! grep -q -- --preset calls || fail "what is configured was configured again"
touch -d '1 minute' clone/CMakePresets.json
run 0 test --preset=ubsan
grep -q -- '--preset ubsan' calls || fail "presets that changed change no build"
for wrong in nonsense sanitizer a.an ''; do
  run 0 test --preset "$wrong"
  [[ $code == 2 && ! -s calls ]] || fail "exit code $code for --preset '$wrong'"
  expect "--preset $wrong: no such preset; there are: release dev asan ubsan tsan coverage noalloc fuzz" err
done

# Coverage: counters of earlier runs go, failing tests do not keep the table from being made, too few lines are a failure.
mkdir -p clone/tests/coverage clone/build/coverage
touch clone/build/coverage/old.gcda
printf '#!/bin/bash\necho "report $*"; exit 1\n' >clone/tests/coverage/report.sh
chmod +x clone/tests/coverage/report.sh
run 0 coverage
[[ $code == 1 && ! -e clone/build/coverage/old.gcda ]] || fail "coverage became $code"
expect 'clone|--preset|coverage|' out
expect "report $work/clone $work/clone/build/coverage" out
printf '#!/bin/bash\n' >clone/tests/coverage/report.sh
run 0 coverage
[[ $code == 8 ]] || fail "exit code $code of coverage with tests that fail"

# Where memory is laid out too much at random, a sanitizer's tests run without that.
stand_in cat '[[ $* == *mmap_rnd_bits* ]] && echo 32 || /bin/cat "$@"'
stand_in setarch 'echo "setarch $*" >>'"'$work/calls'"'; shift; exec "$@"'
run 0 test --preset tsan -R core
[[ $code == 8 && $(<out) == "$work/clone|--preset|tsan|--parallel|1|-R|core|" ]] || fail "under setarch: $code $(<out)"
expect "setarch -R $work/clone/solenoid test --preset tsan -R core" calls
run 0 test --preset dev
! grep -q setarch calls || fail "setarch for a build without sanitizers"
stand_in setarch 'exit 1'
run 0 test --preset asan
[[ $code == 8 ]] || fail "exit code $code without setarch"
expect 'setarch -R is not permitted' err
echo "bootstrap script: all as expected"
