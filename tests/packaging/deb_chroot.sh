#!/usr/bin/env bash
# The packages where a user has nothing: Debian 12 and no compiler, in a chroot. By hand, as root, with debootstrap:
#
#   tests/packaging/deb_chroot.sh FOLDER [MIRROR]     FOLDER has the .debs of ./solenoid package
#
# The chroot is a temporary folder, some 600 MB, gone afterwards; CHROOT=DIR keeps it there, and uses it again.
set -euo pipefail
die() { printf 'deb_chroot: %s\n' "$*" >&2; exit 2; }
[[ $# -ge 1 && $# -le 2 ]] || die "arguments: FOLDER [MIRROR]"
compgen -G "$1/solenoid_*.deb" >/dev/null || die "$1: no solenoid_*.deb in it (./solenoid package makes them)"
[[ $(id -u) == 0 ]] || die "only root may make a chroot"
command -v debootstrap >/dev/null || die "debootstrap is missing: apt-get install debootstrap"
debs=$(cd -- "$1" && pwd)
mirror=${2:-}
if [[ -n ${CHROOT:-} ]]; then
  chroot=$CHROOT
else
  chroot=$(mktemp -d)
fi
leave() {
  ! mountpoint -q "$chroot/proc" || umount "$chroot/proc"
  [[ -n ${CHROOT:-} ]] || rm -rf --one-file-system -- "$chroot"
}
trap leave EXIT

[[ -e $chroot/etc/debian_version ]] || debootstrap --variant=minbase bookworm "$chroot" ${mirror:+"$mirror"}
cp --remove-destination /etc/resolv.conf "$chroot/etc/"
mkdir -p "$chroot/debs"
rm -f -- "$chroot"/debs/*
cp -- "$debs"/*.deb "$chroot/debs/"
mountpoint -q "$chroot/proc" || mount -t proc proc "$chroot/proc"

inside() {
  chroot "$chroot" /usr/bin/env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin LC_ALL=C.UTF-8 HOME=/root \
    DEBIAN_FRONTEND=noninteractive ${http_proxy:+http_proxy="$http_proxy"} "$@"
}
step() {  # step WHAT COMMAND...: silent if it succeeds
  local what=$1 began=$SECONDS
  shift
  if ! inside "$@" >"$chroot/tmp/log" 2>&1; then
    cat "$chroot/tmp/log" >&2
    printf 'FAILED: %s\n' "$what" >&2
    exit 1
  fi
  printf '%4d s  %s\n' "$((SECONDS - began))" "$what"
}
names=(solenoid)
[[ -z $(compgen -G "$debs/python3-solenoid_*.deb") ]] || names+=(python3-solenoid)

step "the package lists" apt-get -q update
step "solenoid and its Python package from their .debs" sh -c "apt-get -q -y install$(printf ' /debs/%s_*.deb' "${names[@]}")"
step "no compiler is there" sh -c '! command -v g++ && ! command -v gcc && ! command -v c++ && ! command -v cmake'
step "nothing is missing of the program's libraries" sh -c '! ldd /usr/bin/solenoid | grep "not found"'
step "solenoid --help" solenoid --help
step "solenoid list variants" sh -c 'solenoid list variants | grep -q "^nine_state "'
step "solenoid check" solenoid check
step "solenoid compare" sh -c 'cd /root && rm -rf results && solenoid compare --out results/mine >ranking && grep -q "^ *1  " ranking'
head -n 4 "$chroot/root/ranking"
step "solenoid report" sh -c 'cd /root && solenoid report results/mine && grep -q uPlot results/mine/report.html'
step "solenoid plot, by gnuplot" sh -c 'cd /root && solenoid plot --variant nine_state --scenario sine_0 --svg plot.svg && grep -q "<svg" plot.svg'
# A busy machine ends the run in SAFE, with exit code 1; it is logged all the same.
# shellcheck disable=SC2016  # the shell inside expands it
step "solenoid run on the twin" sh -c 'cd /root && rm -rf run && { solenoid run nine_state --duration 0.5 --no-realtime --quiet --out run || [ $? = 1 ]; } &&
  solenoid export run/*.mcap --csv ticks.csv && [ "$(wc -l <ticks.csv)" -gt 100 ]'
step "the manual page" sh -c 'apt-get -q -y install man-db && man -w solenoid && man solenoid | grep -q "solenoid compare"'
# shellcheck disable=SC2016  # the shell inside expands it
step "completion" bash -c '. /usr/share/bash-completion/completions/solenoid; COMP_WORDS=(solenoid run nine_state_sh) COMP_CWORD=2
  _solenoid solenoid nine_state_sh run; [[ ${COMPREPLY[*]} == nine_state_short ]]'
if [[ ${#names[@]} -gt 1 ]]; then
  step "Python" python3 -c 'import solenoid; print(solenoid.simulate(solenoid.variant("nine_state"), solenoid.scenario(), seed=1).metrics.rmse_mm)'
fi
step "what was installed goes again" sh -c "apt-get -q -y purge ${names[*]} && [ ! -e /usr/bin/solenoid ] && [ ! -e /usr/lib/python3/dist-packages/solenoid ]"
inside du -sh / 2>/dev/null | sed 's/^/the chroot: /'
