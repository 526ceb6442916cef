# For scripts that source this: instructions of a mutation, by callgrind. Two renders of different
# lengths, so that loading and the bootstrap cancel. Needs valgrind (apt install valgrind).

# Instructions of the whole program at a number of mutations per pixel.
count() { # MUTATIONS PROGRAM SCENE FLAGS...
    local mutations=$1 program=$2 scene=$3 room
    shift 3
    room=$(mktemp -d)
    valgrind --tool=callgrind --callgrind-out-file="$room/out" "$program" render "$scene" \
        --integrator mmlt --threads 1 --bootstrap 2000 --mutations "$mutations" "$@" \
        -o "$room/a.pfm" --quiet 2>"$room/log"
    sed -n 's/.*Collected : //p' "$room/log"
    rm -rf "$room"
}

# Of a picture of SIDE by SIDE pixels.
per_mutation() { # PROGRAM SCENE SIDE FLAGS...
    local program=$1 scene=$2 side=$3 few many
    shift 3
    few=$(count 10 "$program" "$scene" --resolution "${side}x$side" "$@")
    many=$(count 30 "$program" "$scene" --resolution "${side}x$side" "$@")
    echo "scale=1; ($many - $few) / (20 * $side * $side)" | bc
}
