# shellcheck shell=bash
# What the style checks share. The tests run them with the repository as first argument; exit code 77 means skipped.

fail() { printf 'FAILED: %s\n' "$*" >&2; exit 1; }

# missing COMMAND PACKAGE: without its tool a check fails in CI, and is skipped elsewhere.
missing() {
  printf '%s is not installed: apt-get install %s\n' "$1" "$2" >&2
  [[ -z ${CI:-} ]] || exit 1
  exit 77
}

# clang_tool NAME: the program of LLVM 14, Debian 12's. Other releases lay out and find otherwise.
clang_tool() {
  local name
  for name in "$1-14" "$1"; do
    if "$name" --version 2>/dev/null | grep -q 'version 14\.'; then
      printf '%s\n' "$name"
      return
    fi
  done
  return 1
}

# The C++ files of the current folder, one a line.
cpp_files() { find core solvers controllers experiments tests -name '*.[chi]pp' | LC_ALL=C sort; }
