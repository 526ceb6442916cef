#!/usr/bin/env bash
# Renders the pictures of gallery.md and prints the page:
#     docs/gallery.sh PHALANX VEACH-AJAR.pbrt > docs/gallery.md
# Runs for some six minutes on two cores. Pictures go to docs/pictures.
set -euo pipefail
cd "$(dirname "$0")/.."
phalanx=$(realpath "$1") ajar=$2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

cat <<'PAGE'
# Gallery

Ten scenes, rendered by what Phalanx chooses, on two cores of a virtual machine, which had other
work, too. The errors are what Phalanx says of its pictures ([error.md](error.md)): the last line in
the terminal begins as the line below each picture does. `docs/gallery.sh` renders all of them again.
PAGE

# Name of the picture, scene, command's flags, words.
picture() {
    local name=$1 scene=$2 flags=$3 words=$4
    local shown=${scene/$ajar/veach-ajar.pbrt}
    # shellcheck disable=SC2086 # flags are words
    "$phalanx" render $scene $flags -o "docs/pictures/$name.png" 2>"$work/said" || { cat "$work/said" >&2; exit 1; }
    printf '\n## %s\n\n%s\n\n    phalanx render %s\n\n' "$(basename "${shown:-studio}" .pbrt)" "$words" \
        "$(echo $shown $flags)"
    printf '![%s](pictures/%s.png)\n\n' "$name" "$name"
    # What the last lines say of its error, and who rendered it.
    local who error
    error=$(grep -E '^relative error' "$work/said" | sed -E 's/;.*//' || true)
    who=$(grep -oE '(paths from the camera|samples and chains|samples|chains) for depths?[^:]*' "$work/said" |
        tail -1 || true)
    [ -n "$who" ] || who="paths from the camera, which the scene asks for"
    printf '%s; %s.\n' "${error:-no error is known}" "$who" | sed 's/^./\u&/' | fold -s -w 100 | sed 's/ *$//'
}

picture studio "" "--time 60" "The built-in scene: copper, glass, lacquer and a ring of gold under a softbox."
picture cornell scenes/cornell.pbrt "--time 30" "The Cornell box with a sphere of glass and its caustic."
picture slit scenes/slit.pbrt "--time 30" "A lamp in the room behind, of which this room sees a gap of ten centimetres."
picture bulb scenes/bulb.pbrt "--time 30" "A lamp in a bulb of clear glass: all of its light is a caustic."
picture mirror-caustic scenes/mirror-caustic.pbrt "--time 30" "A glass ball gathers the light of a small lamp on the floor, seen in a mirror:
specular, diffuse, specular."
picture prism scenes/prism.pbrt "--time 30" "White light through a slit and a prism of flint glass."
picture fog scenes/fog.pbrt "--integrator auto --time 30" "A spotlight in fog, a ball of milk in glass, and a ball of coloured smoke."
picture wax scenes/wax.pbrt "--time 30" "A candle, a ball of milk and a block of marble: light below surfaces."
picture hair scenes/hair.pbrt "--time 30" "Three tassels of hair, blond, red and brown."
picture veach-ajar "$ajar" "--time 60 --exposure auto" "'Veach, Ajar', by Benedikt Bitterli (public domain): all light comes
through a door ajar."
