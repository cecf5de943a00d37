#!/usr/bin/env bash
# Every C++ file is laid out as .clang-format says. Argument: the repository.
set -euo pipefail
cd -- "$1"
# shellcheck source=tests/style/common.sh
. tests/style/common.sh

tool=$(clang_tool clang-format) || missing 'clang-format 14' clang-format-14
mapfile -t files < <(cpp_files)
"$tool" --dry-run --Werror --ferror-limit=3 "${files[@]}" || fail "$tool -i FILE lays a file out"
echo "${#files[@]} files are laid out as .clang-format says"
