#!/usr/bin/env bash
# What release profiles cost and bring: CPU time of a build of Phalanx alone, size of the program, and
# instructions per mutation: benches/profiles.sh [SCENE ...]. Needs valgrind (apt install valgrind).
# PROFILES names others, each the settings of one: PROFILES='LTO=fat CODEGEN_UNITS=1,LTO=thin'.
set -euo pipefail
cd "$(dirname "$0")/.."
scenes=("$@")
[ $# -gt 0 ] || scenes=(benches/effects/none.pbrt tests/reference/cornell-glass.pbrt)
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
export CARGO_INCREMENTAL=0 CARGO_PROFILE_RELEASE_DEBUG=none
TIMEFORMAT=%U

# Instructions of a whole render at a number of mutations per pixel of 40 x 40.
count() { # PROGRAM SCENE MUTATIONS
    valgrind --tool=callgrind --callgrind-out-file="$folder/out" "$1" render "$2" --integrator mmlt \
        --threads 1 --resolution 40x40 --bootstrap 2000 --chains 512 --max-depth 5 \
        --mutations "$3" -o "$folder/a.pfm" --quiet 2>"$folder/log"
    sed -n 's/.*Collected : //p' "$folder/log"
}

for profile in ${PROFILES:-DEFAULT=1 CODEGEN_UNITS=1 LTO=off}; do
    for setting in ${profile//,/ }; do export "CARGO_PROFILE_RELEASE_$setting"; done
    target=$folder/target
    cargo build --quiet --locked --release --target-dir "$target"
    touch src/lib.rs
    seconds=$({ time cargo build --quiet --locked --release --target-dir "$target" 2>/dev/null; } 2>&1)
    program=$target/release/phalanx
    printf '%s: %s s of CPU, %s bytes' "$profile" "$seconds" "$(stat -c %s "$program")"
    for scene in "${scenes[@]}"; do
        few=$(count "$program" "$scene" 10)
        many=$(count "$program" "$scene" 20)
        printf ', %s %s' "$(basename "$scene")" "$(((many - few) / 16000))"
    done
    echo
    for setting in ${profile//,/ }; do unset "CARGO_PROFILE_RELEASE_${setting%%=*}"; done
    rm -rf "$target"
done
