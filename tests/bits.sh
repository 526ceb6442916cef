#!/usr/bin/env bash
# Fingerprints of pictures, to show that a change of the code changes no bit of any of them:
#
#     cargo build --release
#     tests/bits.sh target/release/phalanx > before.txt      # ... change the code, build again ...
#     tests/bits.sh target/release/phalanx > after.txt
#     diff before.txt after.txt
#
# One line a render: scene, integrator, lanes, and the SHA-256 of its picture. All scenes of scenes/
# and tests/reference/ are rendered small, by every integrator, at 1 and 8 lanes. A failed render
# leaves its exit code in place of the hash.
set -euo pipefail

phalanx=$(realpath "${1:?usage: tests/bits.sh PHALANX}")
root=$(realpath "$(dirname "$0")/..")
room=$(mktemp -d)
trap 'rm -rf "$room"' EXIT

render() { # scene, name of the integrator, lanes, arguments
    local picture=$room/$3.pfm hash code=0
    "$phalanx" render "$1" --quiet --resolution 40x30 --max-depth 5 --seed 7 --chains 64 --bootstrap 400 \
        --lanes "$3" -o "$picture" "${@:4}" >/dev/null 2>&1 || code=$?
    if [ "$code" = 0 ]; then
        hash=$(sha256sum "$picture" | cut -c1-64)
    else
        hash="exit $code"
    fi
    printf '%s %s %s %s\n' "${1#"$root"/}" "$2" "$3" "$hash"
}

for scene in "$root"/scenes/*.pbrt "$root"/tests/reference/*.pbrt; do
    for lanes in 1 8; do
        render "$scene" pt "$lanes" --integrator pt --spp 4
        render "$scene" lt "$lanes" --integrator lt --spp 4
        render "$scene" bdpt "$lanes" --integrator bdpt --spp 4
        render "$scene" pssmlt-pt "$lanes" --integrator pssmlt --host pt --mutations 8
        render "$scene" pssmlt-bdpt "$lanes" --integrator pssmlt --host bdpt --mutations 8
        render "$scene" mmlt "$lanes" --integrator mmlt --mutations 8
        render "$scene" auto "$lanes" --integrator auto --mutations 8
        render "$scene" mmlt-auto "$lanes" --integrator mmlt --mutations 8 --sigma auto --large-step auto
    done
done
