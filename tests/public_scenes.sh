#!/usr/bin/env bash
# How scene files written for pbrt load, unedited:
#
#     cargo build --release
#     tests/public_scenes.sh target/release/phalanx FOLDER... > table.txt
#
# One line for every file under the folders that has a WorldBegin (others are parts of scenes): time
# (s) and peak memory (MB) of `phalanx inspect`, the number of warnings, and `loads` or the message.
# Lines begin with a word to sort by: `loads`, `old` (written for pbrt-v1 or v2), `absent` (needs a
# file that is not there), `refused`. Counts of each, and of kinds of messages, are at the end.
# Needs GNU time.
set -euo pipefail

phalanx=$(realpath "${1:?usage: tests/public_scenes.sh PHALANX FOLDER...}")
shift
room=$(mktemp -d)
trap 'rm -rf "$room"' EXIT

# What only pbrt-v1 and v2 have.
old='^[[:space:]]*(SurfaceIntegrator|VolumeIntegrator|Renderer|Volume|SearchPath)\b'
absent='No such file|does not exist|not found|cannot (open|read)|Is a directory'

file() {
    local code=0 kind message figures warnings
    command time -q -f '%e %M' -o "$room/figures" \
        timeout 300 "$phalanx" inspect "$1" >"$room/out" 2>"$room/err" || code=$?
    figures=$(awk '{ printf "%7.2f s %6.0f MB", $1, $2 / 1024 }' "$room/figures")
    warnings=$(grep -c '^warning' "$room/err" || true)
    message=
    kind=loads
    if [ "$code" != 0 ]; then
        message=$(grep -m1 '^error' "$room/err" || echo "exit code $code")
        kind=refused
        if grep -Eq "$absent" <<<"$message"; then kind=absent; fi
        if grep -aEq "$old" "$1"; then kind=old; fi
    fi
    printf '%-7s %s %4d warnings  %s  %s\n' "$kind" "$figures" "$warnings" "${1#"$PWD"/}" "$message"
}

find "$@" -name '*.pbrt' -print0 | sort -z | while IFS= read -r -d '' scene; do
    if grep -aq '^[[:space:]]*WorldBegin' "$scene"; then file "$scene"; fi
done | tee "$room/table"

echo
cut -d' ' -f1 "$room/table" | sort | uniq -c
echo
# A message without its place and the names and numbers in it is a kind.
grep '^refused' "$room/table" | sed -E 's/.*error: //; s/^[^ ]*:[0-9]+(:[0-9]+)?: //; s/[0-9.]+/#/g' |
    sort | uniq -c | sort -rn || true
