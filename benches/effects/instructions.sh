#!/usr/bin/env bash
# Instructions per mutation in a scene that calls for no effect, of this program and of one in which no other effect exists (the feature
# `bare`): benches/effects/instructions.sh [SCENE]. Needs valgrind (apt install valgrind). Counts repeat exactly.
set -euo pipefail
cd "$(dirname "$0")/../.."
scene=${1:-benches/effects/none.pbrt}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

# Instructions of the whole program at a number of mutations per pixel of 100 x 100.
count() { # PROGRAM MUTATIONS
    valgrind --tool=callgrind --callgrind-out-file="$folder/out" "$1" render "$scene" --threads 1 --resolution 100x100 \
        --bootstrap 2000 --mutations "$2" -o "$folder/a.pfm" --quiet 2>"$folder/log"
    sed -n 's/.*Collected : //p' "$folder/log"
}

# Two lengths, so that loading and the bootstrap cancel.
per_mutation() { # PROGRAM
    local few many
    few=$(count "$1" 10)
    many=$(count "$1" 30)
    echo "scale=1; ($many - $few) / (20 * 100 * 100)" | bc
}

cargo build --release --features bare --target-dir "$folder/bare" 2>/dev/null
cargo build --release 2>/dev/null
full=$(per_mutation target/release/phalanx)
bare=$(per_mutation "$folder/bare/release/phalanx")
echo "with the plan: $full instructions per mutation"
echo "without other effects: $bare"
echo "ratio: $(echo "scale=4; $full / $bare" | bc)"
