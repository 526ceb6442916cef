#!/usr/bin/env bash
# What release profiles cost and bring: CPU time of a build of Phalanx alone, size of the program,
# and instructions per mutation: benches/profiles.sh [SCENE ...]. Needs valgrind.
# PROFILES names others, each the settings of one: PROFILES='LTO=fat CODEGEN_UNITS=1,LTO=thin'.
set -euo pipefail
cd "$(dirname "$0")/.."
scenes=("$@")
[ $# -gt 0 ] || scenes=(benches/effects/none.pbrt tests/reference/cornell-glass.pbrt)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export CARGO_INCREMENTAL=0 CARGO_PROFILE_RELEASE_DEBUG=none
TIMEFORMAT=%U

build() { cargo build --quiet --locked --release --target-dir "$folder/target" 2>/dev/null; }
. benches/count.sh

for profile in ${PROFILES:-DEFAULT=1 CODEGEN_UNITS=1 LTO=off}; do
    for setting in ${profile//,/ }; do export "CARGO_PROFILE_RELEASE_$setting"; done
    target=$folder/target
    build
    touch src/lib.rs
    seconds=$({ time build; } 2>&1)
    program=$target/release/phalanx
    printf '%s: %s s of CPU, %s bytes' "$profile" "$seconds" "$(stat -c %s "$program")"
    for scene in "${scenes[@]}"; do
        instructions=$(per_mutation "$program" "$scene" 40 --chains 512 --max-depth 5)
        printf ', %s %s' "$(basename "$scene")" "$instructions"
    done
    echo
    for setting in ${profile//,/ }; do unset "CARGO_PROFILE_RELEASE_${setting%%=*}"; done
    rm -rf "$target"
done
