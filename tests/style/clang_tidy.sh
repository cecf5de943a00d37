#!/usr/bin/env bash
# clang-tidy finds nothing in the files that changed: on a branch since it left origin/main, else in the last commit;
# changes that are not committed count. A header is read through a file that includes it.
#
# Arguments: the repository, a folder for compile_commands.json. SOLENOID_TIDY_FILES is how many files it reads at most
# (8, up to a minute each); those with the most changed lines come first.
set -euo pipefail
cd -- "$1"
folder=$2
# shellcheck source=tests/style/common.sh
. tests/style/common.sh

tool=$(clang_tool clang-tidy) || missing 'clang-tidy 14' clang-tidy-14
most=${SOLENOID_TIDY_FILES:-8}

base_commit() {
  local base
  if base=$(git merge-base HEAD origin/main 2>/dev/null) && [[ $base != "$(git rev-parse HEAD)" ]]; then
    printf '%s\n' "$base"
  else
    git rev-parse --verify --quiet 'HEAD^'
  fi
}

# "LINES FILE" for each changed C++ file that is still there, the most lines first.
changed_files() {
  git diff --numstat --diff-filter=d --no-renames "$1" -- '*.cpp' '*.hpp' '*.ipp' |
    awk -F '\t' '{ print $1 + $2, $3 }' | sort -k1,1nr -k2
}

# The file to compile for a source or a header: itself; of those that include it the one of its name, or the first.
translation_unit() {
  local includers
  [[ $1 != *.cpp ]] || { printf '%s\n' "$1"; return; }
  includers=$(grep -rlF --include='*.cpp' "#include \"$1\"" core solvers controllers experiments tests | LC_ALL=C sort || true)
  grep -m1 "/$(basename "${1%.*}")\(_test\)\?\.cpp$" <<<"$includers" || head -n 1 <<<"$includers"
}

# Whether the build has this file: optional parts may be missing here, and tests/packaging/outside is another project.
compiled() { grep -qF "\"file\": \"$PWD/$1\"" "$folder/compile_commands.json"; }

git rev-parse --git-dir >/dev/null 2>&1 || { echo "not a git repository: what changed is not known" >&2; exit 77; }
if ! base=$(base_commit); then
  echo "a clone of one commit: what changed is not known; every file counts as changed" >&2
  base=$(git hash-object -t tree /dev/null)
fi

# clang-tidy reads every file alone, not in groups. In a fresh clone there is no folder yet.
mkdir -p "$folder"
cmake -S . -B "$folder" -G Ninja -DSOLENOID_UNITY=OFF -DCMAKE_BUILD_TYPE=Release >"$folder.log" 2>&1 || { cat "$folder.log" >&2; fail "configuring $folder"; }

units=() left_out=() not_compiled=() only=
while read -r _ file; do
  only+="${only:+,}{\"name\":\"$file\"}"  # what an unchanged header has is not this change's
  unit=$(translation_unit "$file")
  if [[ -z $unit ]] || ! compiled "$unit"; then
    not_compiled+=("$file")
  elif [[ " ${units[*]} " == *" $unit "* ]]; then
    continue
  elif [[ ${#units[@]} -lt $most ]]; then
    units+=("$unit")
  else
    left_out+=("$file")
  fi
done < <(changed_files "$base")

echo "changed since $(git rev-parse --short "$base"): ${#units[@]} files to read"
[[ ${#not_compiled[@]} -eq 0 ]] || echo "no part of this build, and not read: ${not_compiled[*]}"
[[ ${#left_out[@]} -eq 0 ]] || echo "more than $most, and not read (SOLENOID_TIDY_FILES=N reads more): ${left_out[*]}"
[[ ${#units[@]} -eq 0 ]] || printf '%s\0' "${units[@]}" |
  xargs -0 -n 1 -P "${SOLENOID_TIDY_JOBS:-1}" "$tool" -p "$folder" --quiet --warnings-as-errors='*' --line-filter="[$only]" ||
  fail "clang-tidy has findings"
echo "clang-tidy finds nothing in ${units[*]:-no file}"
