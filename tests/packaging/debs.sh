#!/usr/bin/env bash
# Debian packages as cpack makes them of a build: control fields, contents, and that what is unpacked works.
# Arguments: the build folder, the project's version, a scratch folder.
set -euo pipefail
build=$1
version=$2
work=$3
rm -rf -- "$work"
mkdir -p "$work"
fail() { printf 'FAILED: %s\n' "$*" >&2; exit 1; }
for tool in dpkg-deb:dpkg dpkg-shlibdeps:dpkg-dev lexgrog:man-db readelf:binutils; do
  command -v "${tool%%:*}" >/dev/null || fail "${tool%%:*} is missing: apt-get install ${tool#*:}"
done

cpack --config "$build/CPackConfig.cmake" -G DEB -B "$work/packed" >"$work/log" 2>&1 || { cat "$work/log" >&2; fail "cpack"; }
architecture=$(dpkg --print-architecture)
names=(libsolenoid-dev solenoid)
[[ ! -e $build/python/solenoid ]] || names+=(python3-solenoid)
wanted=$(printf "%s_${version}_${architecture}.deb\n" "${names[@]}" | sort)
found=$(cd "$work/packed" && printf '%s\n' *.deb | sort)
[[ $found == "$wanted" ]] || fail "packages are $found, not $wanted"

field() { dpkg-deb --field "$work/packed/$1_${version}_${architecture}.deb" "$2"; }
expect_field() { [[ $(field "$1" "$2") =~ $3 ]] || fail "$1: $2 is '$(field "$1" "$2")', not $3"; }
# says PATTERN COMMAND...: whether its whole output has a line like that; a pipe would end the command early.
says() { local pattern=$1; shift; "$@" >"$work/said" || fail "$*: exit code $?"; grep -qE -- "$pattern" "$work/said"; }
has() { [[ -s $work/$1/usr/$2 ]] || fail "$1 has no /usr/$2"; }

for name in "${names[@]}"; do
  deb=$work/packed/${name}_${version}_${architecture}.deb
  expect_field "$name" Version "^$version\$"
  expect_field "$name" Architecture "^$architecture\$"
  expect_field "$name" Priority '^optional$'
  expect_field "$name" Maintainer '^The Solenoid developers <.+>$'
  expect_field "$name" Description $'^Model predictive control[^\n]*\n [^ ][^\n]*\n [^ ][^\n]*\n [^ ]'
  dpkg-deb --contents "$deb" >"$work/contents"
  ! grep -v ' root/root ' "$work/contents" || fail "$name: not root's"
  ! grep -vE ' \./(usr/.*)?$' "$work/contents" || fail "$name: outside /usr"
  dpkg-deb --extract "$deb" "$work/$name"
  for doc in copyright notices changelog.gz; do has "$name" "share/doc/$name/$doc"; done
  grep -q 'Redistribution and use in source and binary forms' "$work/$name/usr/share/doc/$name/copyright" || fail "$name: no licence"
  says "^$name \\($version\\)" gzip -dc "$work/$name/usr/share/doc/$name/changelog.gz" || fail "$name: changelog"
done

# The program: it depends on shared libraries alone, has been stripped, finds nothing in the build folder, and runs.
expect_field solenoid Section '^science$'
expect_field solenoid Depends 'libc6 \(>= '
expect_field solenoid Depends 'libstdc\+\+6'
expect_field solenoid Depends 'coinor-libipopt'
expect_field solenoid Depends 'libnlopt'
[[ $(field solenoid Depends) != *-dev* ]] || fail "the program depends on a development package"
expect_field solenoid Recommends '^gnuplot-nox$'
expect_field solenoid Suggests 'libcomedi0'
program=$work/solenoid/usr/bin/solenoid
says '\.dynsym' readelf --wide --sections "$program" || fail "readelf cannot read the program"
! says '\.symtab' readelf --wide --sections "$program" || fail "the program is not stripped"
! says 'RPATH|RUNPATH' readelf --wide --dynamic "$program" || fail "the program looks for libraries in a folder of its own"
! grep -qF -- "$build" "$program" || fail "the build folder stands in the program"
[[ $("$program" --version) =~ ^"solenoid $version"( |$) ]] || fail "--version is $("$program" --version)"
[[ $("$program" list variants) == $("$build/bin/solenoid" list variants) ]] || fail "list variants"
says '^ *nine_state ' "$program" list variants || fail "list variants names no nine_state"
gzip -dc "$work/solenoid/usr/share/man/man1/solenoid.1.gz" | cmp - <("$program" man) || fail "the manual page is another program's"
lexgrog "$work/solenoid/usr/share/man/man1/solenoid.1.gz" >/dev/null || fail "no manual page"
cmp "$work/solenoid/usr/share/bash-completion/completions/solenoid" <("$program" completion bash) || fail "completion"
has solenoid share/doc/solenoid/docs/reference/configuration.md
# It runs on every processor of its architecture: kernels for newer ones are chosen at run time.
! grep -qE -- '-m(arch|cpu|tune)=' "$build/compile_commands.json" || fail "a file is compiled for one processor"

# The library: what find_package(solenoid) asks for is depended on, and nothing names the machine that built it.
expect_field libsolenoid-dev Section '^libdevel$'
for package in libeigen3-dev libfmt-dev libsuitesparse-dev coinor-libipopt-dev libxsimd-dev libtomlplusplus-dev; do
  expect_field libsolenoid-dev Depends "(^|, )$package(,|\$)"
done
if grep -q '^BONMIN_FOUND:INTERNAL=1' "$build/CMakeCache.txt"; then expect_field libsolenoid-dev Depends coinor-libbonmin-dev; fi
for library in core solvers controllers; do has libsolenoid-dev "lib/libsolenoid_$library.a"; done
has libsolenoid-dev include/solenoid/core/mpc/solver.hpp
has libsolenoid-dev lib/cmake/solenoid/solenoidConfig.cmake
[[ ! -e $work/libsolenoid-dev/usr/bin && ! -e $work/solenoid/usr/include ]] || fail "packages are mixed up"
! grep -rF -- "$build" "$work/libsolenoid-dev/usr/lib/cmake" || fail "the build folder stands in the CMake package"

if [[ ${names[*]} == *python* ]]; then
  expect_field python3-solenoid Section '^python$'
  expect_field python3-solenoid Depends 'python3-numpy'
  expect_field python3-solenoid Depends 'python3 \(<< 3'
  python=$(PYTHONDONTWRITEBYTECODE=1 PYTHONPATH=$work/python3-solenoid/usr/lib/python3/dist-packages /usr/bin/python3 -c \
    'import solenoid; print(solenoid.__version__, solenoid.__file__, "nine_state" in solenoid.variants())')
  [[ $python == "$version $work/"*" True" ]] || fail "Python says $python"
fi
(cd "$work/packed" && du -k -- *.deb | sed 's/\t/ KiB /')
rm -rf -- "$work"
