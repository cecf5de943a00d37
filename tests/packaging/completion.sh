#!/usr/bin/env bash
# What bash completes: the function that `solenoid completion bash` prints, called as bash calls it. Arguments: the program, the
# repository, a scratch folder.
set -euo pipefail
program=$1
root=$2
work="$3/completion test"
rm -rf -- "$work"
mkdir -p "$work/a folder" "$work/clone"
cd -- "$work"
touch mine.toml 'my other.toml' rig.mcap notes.txt

# shellcheck disable=SC1090  # what the program prints
source <("$program" completion bash)

compopt() { :; }  # bash allows it only while it completes

failed=no
fail() { printf 'FAILED: %s\n' "$*" >&2; failed=yes; }
# expect WORDS => REPLIES: what bash has split the line into, the last word begun, completes to exactly these, in any order.
expect() {
  local typed=() found wanted
  while [[ $1 != '=>' ]]; do typed+=("$1"); shift; done
  shift
  COMP_WORDS=("$program" "${typed[@]}") COMP_CWORD=${#typed[@]} COMPREPLY=()
  _solenoid "$program" "${typed[-1]}" ''
  found=$(printf '%s\n' "${COMPREPLY[@]}" | sort) wanted=$(printf '%s\n' "$@" | sort)
  [[ $found == "$wanted" ]] || fail "'${typed[*]}' completes to '${found//$'\n'/ }', not to '${wanted//$'\n'/ }'"
}
options_of() {  # those that --help knows, each on its line
  "$program" "$@" --help | sed -n 's/^ \{2,4\}\(-[a-zA-Z],\)\{0,1\}\(--[a-z-]\+\).*/\2/p'
}

complete -p solenoid | grep -q -- '-F _solenoid' || fail "no completion is registered"

# Commands and options: those of --help, all of them and nothing else.
mapfile -t commands < <("$program" --help | sed -n '/^Subcommands:/,$ s/^  \([a-z]\+\) .*/\1/p')
[[ ${#commands[@]} -ge 18 ]] || fail "--help names ${#commands[@]} commands"
expect '' '=>' "${commands[@]}"
expect compa '=>' compare
expect nonsens '=>'
expect study for '=>' forgetting force-ratio
expect study swe '=>' sweep
for command in "${commands[@]}" 'study sweep'; do
  read -ra words <<<"$command"
  mapfile -t options < <(options_of "${words[@]}")
  [[ ${#options[@]} -ge 1 ]] || fail "'$command --help' names no options"
  expect "${words[@]}" -- '=>' "${options[@]}"
done
expect run nine_state --live '=>' --live --live-port
mapfile -t options < <(options_of run)
expect run nine_state '' '=>' "${options[@]}"

# Values of a known set, also where bash splits at "=".
expect run --plant '' '=>' sim emulator comedi
expect run --plant e '=>' emulator
expect run --plant = '=>' sim emulator comedi
expect run --plant = c '=>' comedi
expect compare --format '' '=>' table json csv
expect list --format '' '=>' table json markdown
expect list est '=>' estimators
expect completion '' '=>' bash
expect run --seed '' '=>'

# Names that the program knows.
mapfile -t variants < <("$program" list variants --format json | sed -n 's/^ *"name": "\(.*\)",\{0,1\}$/\1/p')
[[ ${#variants[@]} -ge 20 ]] || fail "list names ${#variants[@]} variants"
expect run '' '=>' "${variants[@]}"
expect compare --variant thesis_pd_e '=>' thesis_pd_ekf thesis_pd_ekf_short
expect compare --variant nine_state,nine_state_sh '=>' nine_state,nine_state_short
expect compare --variant nine_state nine_state_sh '=>' nine_state_short
expect compare --variant=nine_state --variant = nine_state_sh '=>' nine_state_short
expect compare default --scenario sine '=>' sine_0 sine_015 sine_046
expect compare robustness --scenario '' '=>' cycloidal sine
expect run nine_state --campaign rig --scenario cyc '=>' cycloidal
expect tune nine_state --campaign tun '=>' tuning
expect reproduce table-6-1 table-6-2 '=>' table-6-2
expect identify --base pri '=>' printed
cat >own.toml <<'END'
variants = ["mine"]
[variant.mine]
valves = "two_way"
solver = "branch_and_bound"
[[scenario]]
name       = "a_scenario_of_mine"
trajectory = { kind = "cycloidal", move_s = 0.5, dwell_s = 0.25 }
END
expect compare own.toml --variant mi '=>' mine
expect compare --scenario a_scen '=>'
expect run --campaign = own.toml --scenario a_scen '=>' a_scenario_of_mine
rm own.toml

# Files with the right ending, and folders; names with spaces are one word.
expect compare m '=>' mine.toml 'my other.toml'
expect compare profi '=>' profile
expect run nine_state --rig '' '=>' mine.toml 'my other.toml' 'a folder' clone
expect replay '' '=>' rig.mcap 'a folder' clone
expect profile ri '=>' rig rig.mcap
expect report '' '=>' 'a folder' clone
expect ledger --instances no '=>' notes.txt

# A program that is not there, and a clone where nothing is built yet: silence, and its own commands.
program=./nowhere
expect comp '=>' 2>err
[[ ! -s err ]] || fail "a program that is not there: $(<err)"
cp "$root/solenoid" clone/
program=./clone/solenoid
expect te '=>' test
expect list '' '=>'
[[ ! -e clone/build ]] || fail "something was built for a completion"

[[ $failed == no ]] || exit 1
echo "completion: all as expected"
