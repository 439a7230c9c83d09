#!/usr/bin/env bash
# What ./polypic does around the program, with stand-ins for the commands that would change the machine. $1: the source tree.
set -euo pipefail
source_dir=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0
check() { # check NAME COMMAND...
  local name=$1; shift
  if "$@"; then echo "ok    $name"; else echo "FAIL  $name"; failures=$((failures + 1)); fi
}

# shellcheck disable=SC2016  # the stand-ins expand their own variables

# A checkout that holds nothing but the launcher; PATH begins with stand-ins that write down how they were called.
mkdir -p "$work/checkout/cmake" "$work/bin"
cp "$source_dir/polypic" "$work/checkout/"
cp "$source_dir/cmake/packages.txt" "$work/checkout/cmake/"
calls=$work/calls
stand_in() { printf '#!/bin/bash\necho "%s $*" >>%q\n%s\n' "$1" "$calls" "$2" >"$work/bin/$1"; chmod +x "$work/bin/$1"; }
reset() {
  : >"$calls"
  rm -rf "$work/checkout/build"
  stand_in apt-get 'exit 0'
  stand_in sudo 'exit 1'
  stand_in id 'echo 1000'
  stand_in cmake 'echo "cmake: no such preset"; exit 1'
  # dpkg-query: all is there but two.
  stand_in dpkg-query 'for p in "$@"; do case $p in -*|*Status*) ;; g++|ffmpeg) echo "not-installed $p" ;; *) echo "installed $p" ;; esac; done'
}
launch() { code=0; PATH=$work/bin:$PATH "$work/checkout/polypic" "$@" </dev/null >"$work/out" 2>"$work/err" || code=$?; }
said() { grep -qF -- "$1" "$work/err"; }
called() { grep -qE -- "$1" "$calls"; }
not() { ! "$@"; }

reset; launch --version
check "without root and sudo it exits 69" [ "$code" = 69 ]
check "... and prints the line to run" said "apt-get install -y --no-install-recommends -o DPkg::Lock::Timeout=300 ffmpeg g++"
check "... and calls no apt" not called '^apt-get'
check "... and says nothing on standard output" [ ! -s "$work/out" ]

reset; stand_in sudo 'exit 0'; launch --version
check "with sudo it installs the missing packages only" called '^sudo -n env DEBIAN_FRONTEND=noninteractive apt-get install .* ffmpeg g\+\+$'

reset; stand_in id 'echo 0'; launch --version
check "root needs no sudo" not called '^sudo'
check "... and installs" called '^apt-get install .* ffmpeg g\+\+$'
check "a build that fails exits 69" [ "$code" = 69 ]
check "... with the end of the log" said "cmake: no such preset"
check "... and its path" said "$work/checkout/build/release/build.log"

reset; stand_in id 'echo 0'; stand_in apt-get 'echo "no network"; exit 100'; launch --version
check "packages that cannot be had exit 69" [ "$code" = 69 ]
check "... with apt's reason" said "no network"

reset; stand_in dpkg-query 'for p in "$@"; do case $p in -*|*Status*) ;; *) echo "installed $p" ;; esac; done'; launch --version
check "no apt call when everything is there" not called '^(apt-get|sudo)'

reset; launch test --fast
check "an option that is none exits 2" [ "$code" = 2 ]

# A choice of tests goes to both suites as it is; this stand-in for ctest has tests called transfer, and one of films in release only.
builds() {
  reset; stand_in id 'echo 0'; stand_in cmake 'exit 0'
  stand_in ctest 'name=transfer.sums
    case "$PWD $*" in *release*film*) name=film.ends ;; *film*|*nothing*) echo "No tests were found!!!"; exit 8 ;; esac
    [[ "$*" == *breaks* ]] && { echo "1/1 Test #1: $name ...***Failed  0.10 sec"; exit 8; }
    echo "1/1 Test #1: $name ...   Passed  0.10 sec"'
}
printed() { grep -qxF -- "$1" "$work/out"; }

builds; launch test -R '^transfer.*(a|b)$'
check "-R chooses tests by name" called '^ctest .* -R \^transfer\.\*\(a\|b\)\$$'
check "... in release" printed "1 passed, 0 failed"
check "... and says what was left out" printed '  all that -R ^transfer.*(a|b)$ leaves out'
check "... and exits 0" [ "$code" = 0 ]
builds; launch test -L fast --full -R transfer
check "-L and -R go together, to the sanitized suite as well" [ "$(grep -cE '^ctest .* -L fast -R transfer$' "$calls")" = 2 ]
check "--full runs in release what no other call does" [ "$(grep -cE '^ctest .* -C full -L fast -R transfer$' "$calls")" = 1 ]
check "... and builds all, benchmarks too" called '^cmake .* --target all '
check "... and both count" printed "2 passed, 0 failed"
builds; stand_in ctest 'echo "1/2 Test  #1: Films/Film.Ends/a_b  # GetParam() = \"a_b\" ......   Passed    0.10 sec"
  echo "2/2 Test #12: Films/Film.Ends/c  # GetParam() = \"c\" ...***Failed    0.10 sec"; exit 8'; launch test
check "tests with a parameter count" printed "1 passed, 1 failed"
check "... and fail" [ "$code" = 1 ]
builds; stand_in ctest 'echo "1/1 Test #1: a ...   Passed  0.10 sec"; exit 8'; launch test
check "a suite that fails without saying so fails" printed "1 passed, 1 failed"
builds; launch test -R breaks
check "a chosen test that fails exits 1" [ "$code" = 1 ]
builds; launch test -R nothing
check "a choice of nothing exits 1" [ "$code" = 1 ]
check "... and says so" said "no test of release has run: is any chosen by -R nothing?"
builds; launch test --full -R film
check "a choice without a test under the sanitizers passes" printed "1 passed, 0 failed"
check "... and says so" printed "  anything under the sanitizers: no test there is chosen by -R film"
valgrind() { stand_in dpkg-query 'for p in "$@"; do case $p in -*|*Status*) ;; valgrind) echo "not-installed $p" ;; *) echo "installed $p" ;; esac; done'; }
builds; valgrind; launch test -R transfer
check "what --full alone needs is not installed for others" not called '^apt-get'
check "... whose tests are not run" not called '^ctest .* -C full'
check "... nor their benchmarks built" not called 'polypic_bench'
builds; valgrind; launch test --full -R transfer
check "... but for --full" called '^apt-get install .* valgrind$'

reset; launch test -R
check "-R without an expression exits 2" [ "$code" = 2 ]
reset; launch test -L ''
check "-L without a label exits 2" [ "$code" = 2 ]

# A program that is up to date is started without asking anything of the machine.
reset
mkdir -p "$work/checkout/build/release/app"
printf '#!/bin/bash\necho "program $*"; exit 6\n' >"$work/checkout/build/release/app/polypic"
chmod +x "$work/checkout/build/release/app/polypic"
touch "$work/checkout/build/release/.built"
start=$(date +%s%N); launch info "a b"; took=$((($(date +%s%N) - start) / 1000000))
check "a program that is up to date is started at once ($took ms)" [ "$took" -lt 300 ]
check "... with its arguments" grep -qx 'program info a b' "$work/out"
check "... and its exit code" [ "$code" = 6 ]
check "... and without other programs" [ ! -s "$calls" ]
stand_in id 'echo 0'; sleep 0.01; touch "$work/checkout/cmake/packages.txt"; launch info
check "a newer source is built first" called '^cmake'

[ "$failures" = 0 ]
