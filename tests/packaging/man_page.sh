#!/usr/bin/env bash
# The manual page: its roff is clean, and it has every command and every option of --help. Argument: the program.
set -euo pipefail
program=$1
page=$(mktemp)
trap 'rm -f -- "$page" "$page".*' EXIT
fail() { printf 'FAILED: %s\n' "$*" >&2; exit 1; }
for tool in groff:groff-base lexgrog:man-db; do
  command -v "${tool%%:*}" >/dev/null || fail "${tool%%:*} is missing: apt-get install ${tool#*:}"
done

"$program" man >"$page"
groff -man -ww -Tascii -P-cbou -rLL=1000n "$page" >"$page.text" 2>"$page.warnings"
[[ ! -s $page.warnings ]] || fail "groff warns: $(<"$page.warnings")"
[[ $(lexgrog "$page") == *'"solenoid - model predictive control'* ]] || fail "lexgrog does not understand NAME"
version=$("$program" --version)
grep -q "^${version%% (*} " "$page.text" || fail "the page's last line does not name ${version%% (*}"

# section WORDS: the part of the page about a command, up to the next heading.
section() { awk -v head="   solenoid $*" 'index($0, head) == 1 { on = 1; print; next } /^ {0,3}[^ ]/ { on = 0 } on' "$page.text"; }
entries=0
check_command() {
  local found option
  found=$(section "$@")
  [[ -n $found ]] || fail "no section about '$*'"
  while IFS= read -r option; do
    grep -qE "^ +(-[a-zA-Z], )?$option( |\$)" <<<"$found" || fail "'$*' has no $option in the page"
    entries=$((entries + 1))
  done < <("$program" "$@" --help | sed -n 's/^ \{2,4\}\(-[a-zA-Z],\)\{0,1\}\(--[a-z-]\+\).*/\2/p' | grep -vx -- --help)
}
subcommands() { "$program" "$@" --help | sed -n '/^Subcommands:/,$ s/^  \([a-z-]\+\) .*/\1/p'; }
for command in $(subcommands); do
  check_command "$command"
  for inner in $(subcommands "$command"); do check_command "$command" "$inner"; done
done
[[ $entries -ge 100 ]] || fail "only $entries options were compared"

# What an option allows, needs and excludes is said; exit codes are all there.
expect() { tr -s ' \n' ' ' <"$page.text" | grep -qF -- "$1" || fail "no '$1' in the page"; }
expect 'Allowed: sim, emulator, comedi.'
expect 'Allowed: 1 to 65535. Only with --live.'
expect 'Not with --svg.'
expect 'One of --png, --svg is required.'
for code in 0 1 2 130; do grep -qE "^ +$code( |\$)" "$page.text" || fail "exit status $code is not in the page"; done
echo "manual page: $entries options as in --help"
