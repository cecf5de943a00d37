#!/usr/bin/env bash
# No shell script has anything that shellcheck finds. Argument: the repository.
set -euo pipefail
cd -- "$1"
# shellcheck source=tests/style/common.sh
. tests/style/common.sh

command -v shellcheck >/dev/null || missing shellcheck shellcheck
shell_scripts() {
  local file first
  while IFS= read -r file; do
    IFS= read -r first <"$file" || true
    [[ $file == *.sh || $file == *.bash || $first =~ ^'#!'.*[/\ ](ba|da)?sh$ ]] && printf '%s\n' "$file"
  done < <(find . \( -path ./build -o -path ./node_modules -o -path ./.git \) -prune -o \
             -type f \( -perm -u+x -o -name '*.sh' -o -name '*.bash' \) -print)
}
mapfile -t files < <(shell_scripts)
[[ ${#files[@]} -ge 5 ]] || fail "there are more scripts than ${files[*]}"
shellcheck --external-sources "${files[@]}"
echo "shellcheck finds nothing in ${files[*]}"
