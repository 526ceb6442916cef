#!/usr/bin/env bash
# A render by processes that MPI has started has the bits of one by a single process, however many
# there are and whatever ends it:
#
#     tests/mpi.sh target/release/phalanx
#
# The program must be built with the feature `mpi`.
set -euo pipefail
phalanx=$(realpath "${1:?which phalanx?}")
scenes=$(realpath "$(dirname "$0")/../scenes")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"

# Where the test runs it may be root, and there may be fewer cores than processes.
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
# Containers often forbid one process to read the memory of another.
export OMPI_MCA_btl_vader_single_copy_mechanism=none
start=(mpirun --oversubscribe --bind-to none)
team() { "${start[@]}" -n "$1" "$phalanx" "${@:2}" --threads 1 -q; }
fail() { echo "mpi.sh: $*" >&2; exit 1; }
same() { cmp "$1" "$2" || fail "$3: the pictures differ"; }

# Chains, samples, and both; files have pictures and figures.
small="--resolution 96x72 --no-png"
cornell="$scenes/cornell.pbrt $small"
chains="render $cornell --integrator mmlt --bootstrap 20000 --mutations 60"
samples="render $cornell --integrator bdpt --spp 6"
both="render $scenes/slit.pbrt $small --mutations 300 --integrator auto"
for what in chains samples both; do
    "$phalanx" ${!what} -o $what.exr --threads 2 -q
done
for n in 1 2 3 4; do
    team $n $chains -o $n.exr
    same chains.exr $n.exr "chains of $n processes"
done
team 3 $samples -o 3.exr
same samples.exr 3.exr "samples of 3 processes"
team 2 $both -o 2.exr
same both.exr 2.exr "samples and chains of 2 processes"

# Time ends it; others go on, as many as there are.
long="render $cornell --integrator mmlt --bootstrap 20000 --mutations 400"
team 2 $long -o part.exr --checkpoint kept --time 1
[ -s part.exr ] || fail "no picture of a render that time has ended"
cp kept again
team 3 resume kept -o 3.exr --no-png --mutations 400
"$phalanx" resume again -o 1.exr --no-png -q --mutations 400
same 1.exr 3.exr "resumed by 3 processes"

# A signal, and a process that is lost: the checkpoint is there.
endless="render $cornell --integrator mmlt --bootstrap 20000 --mutations 4000000 --checkpoint kept --every 1"
wait_for() {
    for _ in $(seq 600); do
        [ ! -e "$1" ] || return 0
        sleep 0.1
    done
    fail "no $1 after a minute"
}
children() { awk -v of="$1" '/^Pid:/ { pid = $2 } /^PPid:/ && $2 == of { print pid }' \
    /proc/[0-9]*/status 2>/dev/null || true; }
for how in USR1 KILL; do
    rm -f kept part.exr
    "${start[@]}" -n 3 "$phalanx" $endless -o part.exr --threads 1 2>messages &
    job=$!
    wait_for kept
    if [ $how = USR1 ]; then
        kill -USR1 $job
    else
        kill -KILL "$(children $job | tail -1)"
    fi
    code=0
    wait $job || code=$?
    [ $code -ne 0 ] || fail "$how: success"
    [ $how = KILL ] || [ -s part.exr ] || { cat messages >&2; fail "$how: no picture"; }
    "$phalanx" info kept >/dev/null || fail "$how: no checkpoint"
    "$phalanx" resume kept --time 0.1 -o 1.exr --no-png -q || fail "$how: not resumed"
done

# What one process cannot do ends all of them, and so does what all of them cannot.
for wrong in "render missing.pbrt" "render $cornell --integrator bdpt --strategies" "resume part.exr"; do
    code=0
    timeout 60 "${start[@]}" -n 2 "$phalanx" $wrong 2>messages || code=$?
    [ $code = 2 ] || { cat messages >&2; fail "$wrong: exit code $code"; }
    [ "$(grep -c '^error: ' messages)" = 1 ] || { cat messages >&2; fail "$wrong: not one message"; }
done
echo "mpi.sh: all is well"
