#!/bin/sh
# How fast is Embree on the same rays, on this machine? Needs g++ and Embree 3 or 4 (Debian: apt-get install g++ libembree-dev).
# Usage: benches/embree/compare.sh [DIR]   (DIR is where the rays are written; a temporary directory unless given)
set -eu
cd "$(dirname "$0")/../.."
dir=${1:-$(mktemp -d)}
cargo bench --bench rays -- --dump "$dir"
library=embree3
[ -e /usr/include/embree4 ] && library=embree4
g++ -std=c++17 -O3 -march=native benches/embree/compare.cpp -o "$dir/compare" -l"$library"
"$dir/compare" "$dir"
