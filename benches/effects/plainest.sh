#!/usr/bin/env bash
# Makes of a copy of the sources a program that has no effects but those of `none.pbrt` (triangles, diffuse, one light, a pinhole): the
# code of all others is never reached, and the compiler leaves it out. benches/effects/plainest.sh FOLDER
#
# Each edit names what it replaces. Where that is no longer found, the kernels have changed and the edit must follow them.
set -euo pipefail
cd "$(dirname "$0")/../.."
to=$1
mkdir -p "$to"
tar -c --exclude=./target --exclude=./.git --exclude=./fuzz . | tar -x -C "$to"
cd "$to"

edit() { # FILE OLD NEW
    local text
    text=$(<"$1")
    [[ $text == *"$2"* ]] || { echo "$1 has no longer: $2" >&2; exit 1; }
    printf '%s\n' "${text//"$2"/"$3"}" >"$1"
}

# One kind of BSDF, one row of parameters for all hits of a material.
edit src/surface/table.rs 'match $value {' 'match $value {
            _ => $crate::surface::table::call!(
                $self, $f, $crate::surface::diffuse::Diffuse, $generics, $args
            ),'
edit src/transport/arrive.rs 'if OWN && ' 'if false && OWN && '
# One kind of light, and one light.
edit src/light/mod.rs 'for &kind in &self.present {' 'for _ in &self.present {
            let kind = Kind::Triangle;'
for file in connect start; do
    edit src/transport/$file.rs 'if self.plan.light_choice' 'if false && self.plan.light_choice'
done
# Nothing but places and geometric normals of triangles, none of them large.
edit src/geometry/mod.rs 'if wanted.large && ' 'let wanted = Wanted::default();
        if wanted.large && '
edit src/geometry/mod.rs 'let point = self.triangle_point(prim, b1, b2, wanted);' \
    'let point = self.triangle_point(prim, b1, b2, Wanted::default());'
edit src/geometry/mod.rs 'if !self.large.is_empty()' 'if false && !self.large.is_empty()'
# A pinhole.
edit src/camera/mod.rs 'self.lens_radius > 0.0 || self.optics.is_some()' 'false'
edit src/camera/mod.rs 'Projection::Sphere(map) => Some(map)' 'Projection::Sphere(map) if false => Some(map)'
edit src/camera/mod.rs 'self.projection == Projection::Orthographic' 'false'
# Nothing between surfaces, and nothing below them.
for file in connect bidirectional subsurface start evaluate scatter arrive; do
    edit src/transport/$file.rs 'if self.plan.media' 'if false && self.plan.media'
done
for file in connect evaluate; do
    edit src/transport/$file.rs 'late: self.plan.media' 'late: false'
done
edit src/transport/bidirectional.rs 'late: world.plan.media' 'late: false'
for file in evaluate arrive; do
    edit src/transport/$file.rs 'if self.plan.subsurface' 'if false && self.plan.subsurface'
done
