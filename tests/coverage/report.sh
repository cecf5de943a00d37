#!/usr/bin/env bash
# What the tests of a coverage build ran: a table by folder, a page by file. Arguments: the repository, the build folder.
# Exit code 1 where the generic layer, the solvers or the executive have less than 95 % of their lines.
set -euo pipefail
root=$(cd -P -- "$1" && pwd)
build=$(cd -P -- "$2" && pwd)
least=95
info=$build/coverage.info

# An instruction set that this machine lacks is compiled and cannot be run.
excluded=()
grep -qw avx512dq /proc/cpuinfo || excluded+=("$root/solvers/qp/simd/kernels_avx512.cpp" "$root/solvers/search/kernels/avx512.cpp")
grep -qw avx2 /proc/cpuinfo || excluded+=("$root/solvers/qp/simd/kernels_avx2.cpp" "$root/solvers/search/kernels/avx2.cpp")

capture() {
  lcov --quiet --capture --directory "$build" --base-directory "$root" --no-external --output-file "$info.all"
  lcov --quiet --extract "$info.all" "$root/core/*" "$root/solvers/*" "$root/controllers/*" "$root/experiments/*" --output-file "$info"
  [[ ${#excluded[@]} -eq 0 ]] || lcov --quiet --remove "$info" "${excluded[@]}" --output-file "$info"
  genhtml --quiet --legend --prefix "$root" --output-directory "$build/html" "$info"
}

# "FOLDER LINES LINES_RUN" for each file.
files() { awk -F : -v root="$root/" '/^SF:/ { f = substr($2, length(root) + 1); sub("/[^/]*$", "", f) } /^LF:/ { n = $2 } /^LH:/ { h = $2 }
  /^end_of_record/ { print f, n, h; n = h = 0 }' "$info"; }

table() {
  files | awk '{ lines[$1] += $2; run[$1] += $3 } END { for (f in lines) printf "%-32s %6d %6d %7.1f %%\n", f, lines[f], run[f], 100 * run[f] / lines[f] }' |
    LC_ALL=C sort
}

# part NAME FOLDER: whether it has the lines it should.
part() {
  files | awk -v name="$1" -v folder="$2" -v least="$least" 'index($1 "/", folder "/") == 1 { n += $2; h += $3 }
    END { share = n ? 100 * h / n : 0; enough = share >= least
          printf "%-14s %-10s %5.1f %% of %d lines: %s %d %%\n", name, folder, share, n, enough ? "at least" : "LESS THAN", least
          exit !enough }'
}

capture
printf '%-32s %6s %6s %9s\n' folder lines run share
table
echo
[[ ${#excluded[@]} -eq 0 ]] || echo "left out, this machine cannot run them: ${excluded[*]#"$root"/}"
code=0
part 'generic layer' core/mpc || code=1
part solvers solvers || code=1
part executive core/rt || code=1
echo "every line: $build/html/index.html"
exit "$code"
