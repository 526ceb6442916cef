#!/usr/bin/env python3
"""Writes a field of so many instances of a bush of so many triangles: benches/instances.py COUNT TRIANGLES FOLDER.

With `--copies` after it, the same field as one mesh: what the instances are measured against.
"""

import array
import math
import pathlib
import random
import sys

count, triangles, folder = int(sys.argv[1]), int(sys.argv[2]), pathlib.Path(sys.argv[3])
copies = sys.argv[4:] == ["--copies"]
folder.mkdir(parents=True, exist_ok=True)
side = math.ceil(math.sqrt(count))

# Leaves on a ball, two triangles each.
chance = random.Random(1)
bush = []
while 2 * len(bush) < triangles:
    d = [chance.gauss(0, 1) for _ in range(3)]
    r = math.sqrt(sum(x * x for x in d))
    at = [x / r * (0.5 + 0.5 * chance.random()) for x in d]
    e = [chance.uniform(-1, 1) * 0.05 for _ in range(3)]
    f = [chance.uniform(-1, 1) * 0.05 for _ in range(3)]
    bush.append([[at[k] + i * e[k] + j * f[k] for k in range(3)] for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))])


def write(path, placed):
    """One mesh of the bush in places (angle, size, x, z)."""
    faces = 2 * len(bush) * len(placed)
    with open(path, "wb") as ply:
        ply.write(
            b"ply\nformat binary_little_endian 1.0\n"
            b"element vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
            b"element face %d\nproperty list uchar int vertex_indices\nend_header\n" % (2 * faces, faces)
        )
        for c, s, size, x, z in placed:
            row = array.array("f")
            for leaf in bush:
                for p in leaf:
                    row.extend((x + size * (c * p[0] - s * p[2]), size * p[1], z + size * (s * p[0] + c * p[2])))
            row.tofile(ply)
        for i in range(faces // 2):
            a = 4 * i
            for face in ((a, a + 1, a + 2), (a, a + 2, a + 3)):
                ply.write(b"\x03" + array.array("i", face).tobytes())


places = []
for i in range(count):
    angle = chance.uniform(0, 2 * math.pi)
    size = chance.uniform(0.5, 1)
    x = 2.5 * (i % side - side / 2) + chance.uniform(-0.5, 0.5)
    z = 2.5 * (i // side - side / 2) + chance.uniform(-0.5, 0.5)
    places.append((math.cos(angle), math.sin(angle), size, x, z))

reach = 1.3 * side
with open(folder / "field.pbrt", "w") as scene:
    scene.write(
        f"""LookAt 0 {0.3 * reach} {-1.1 * reach}  0 0 0  0 1 0
Camera "perspective" "float fov" [ 60 ]
Film "image" "integer xresolution" [ 640 ] "integer yresolution" [ 360 ] "string filename" "field.exr"
Integrator "mlt" "integer maxdepth" [ 4 ]
WorldBegin
LightSource "infinite" "rgb L" [ 0.4 0.6 1 ]
LightSource "distant" "rgb L" [ 3 2.6 2 ] "point from" [ 1 0.7 -0.4 ] "point to" [ 0 0 0 ]
Material "matte" "rgb Kd" [ 0.5 0.45 0.3 ]
Shape "trianglemesh" "integer indices" [ 0 1 2 0 2 3 ]
  "point P" [ {-reach} -1 {-reach}  {reach} -1 {-reach}  {reach} -1 {reach}  {-reach} -1 {reach} ]
Material "matte" "rgb Kd" [ 0.2 0.5 0.15 ]
"""
    )
    if copies:
        write(folder / "field.ply", places)
        scene.write('Shape "plymesh" "string filename" "field.ply"\n')
    else:
        write(folder / "bush.ply", [(1, 0, 1, 0, 0)])
        scene.write('ObjectBegin "bush"\nShape "plymesh" "string filename" "bush.ply"\nObjectEnd\n')
        for c, s, size, x, z in places:
            m = [size * c, 0, size * s, 0, 0, size, 0, 0, -size * s, 0, size * c, 0, x, 0, z, 1]
            numbers = " ".join(f"{v:.6g}" for v in m)
            scene.write(f'AttributeBegin\nConcatTransform [ {numbers} ]\nObjectInstance "bush"\nAttributeEnd\n')
    scene.write("WorldEnd\n")
