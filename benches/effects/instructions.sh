#!/usr/bin/env bash
# Instructions per mutation in a scene that calls for no effect, of this program and of one in which
# no other effect exists (`plainest.sh` makes it), and the median speeds of both in turns:
# benches/effects/instructions.sh [SCENE]. Counts repeat exactly,
# speeds do not. ROUNDS=0 leaves speeds out. Needs valgrind and jq (apt install valgrind jq).
set -euo pipefail
cd "$(dirname "$0")/../.."
scene=${1:-benches/effects/none.pbrt}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

. benches/count.sh

# Mutations per second of a render of about a second.
speed() { # PROGRAM
    "$1" render "$scene" --integrator mmlt --threads 1 --resolution 100x100 --bootstrap 2000 \
        --mutations 400 -o "$folder/a.pfm" --stats "$folder/stats" --quiet 2>"$folder/log"
    jq .mutations_per_second "$folder/stats"
}
median() { sort -g | awk '{ v[NR] = $1 } END { print NR % 2 ? v[(NR + 1) / 2] : (v[NR / 2] + v[NR / 2 + 1]) / 2 }'; }

benches/effects/plainest.sh "$folder/plainest"
(cd "$folder/plainest" && cargo build --quiet --release --target-dir "$folder/target" 2>/dev/null)
cargo build --quiet --release
with=target/release/phalanx
without=$folder/target/release/phalanx
full=$(per_mutation "$with" "$scene" 100)
plainest=$(per_mutation "$without" "$scene" 100)
echo "with the plan: $full instructions per mutation"
echo "without other effects: $plainest"
echo "ratio: $(echo "scale=4; $full / $plainest" | bc)"

rounds=${ROUNDS:-31}
for ((i = 0; i < rounds; i++)); do
    f=$(speed "$with")
    b=$(speed "$without")
    echo "$f" >>"$folder/full"
    echo "$b" >>"$folder/plainest-speed"
    echo "scale=6; $f / $b" | bc >>"$folder/ratio"
done
[ "$rounds" = 0 ] && exit
echo "median of $rounds rounds in turns: $(median <"$folder/full") and $(median <"$folder/plainest-speed") mutations per second,"
echo "of the ratios of neighbours: $(median <"$folder/ratio")"
