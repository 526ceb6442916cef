#!/usr/bin/env python3
"""Writes a scene of about so many million triangles, hills under a sky: benches/large.py MILLIONS FOLDER."""

import array
import math
import pathlib
import sys

millions, folder = float(sys.argv[1]), pathlib.Path(sys.argv[2])
folder.mkdir(parents=True, exist_ok=True)
n = math.ceil(math.sqrt(millions * 1e6 / 2))


def height(x, y):
    return 0.1 * math.sin(7 * x) * math.cos(5 * y) + 0.01 * math.sin(61 * x + 17 * y) + 0.002 * math.sin(331 * x) * math.sin(401 * y)


with open(folder / "hills.ply", "wb") as ply:
    ply.write(
        b"ply\nformat binary_little_endian 1.0\n"
        b"element vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
        b"element face %d\nproperty list uchar int vertex_indices\nend_header\n" % ((n + 1) ** 2, 2 * n * n)
    )
    for j in range(n + 1):
        row = array.array("f")
        for i in range(n + 1):
            x, y = 2 * i / n - 1, 2 * j / n - 1
            row.extend((x, height(x, y), y))
        row.tofile(ply)
    for j in range(n):
        row = bytearray()
        for i in range(n):
            a = j * (n + 1) + i
            b, c, d = a + 1, a + n + 1, a + n + 2
            for face in ((a, c, b), (b, c, d)):
                row += b"\x03" + array.array("i", face).tobytes()
        ply.write(row)

(folder / "hills.pbrt").write_text(
    """LookAt 0 0.6 -1.3  0 0 0  0 1 0
Camera "perspective" "float fov" [ 60 ]
Film "image" "integer xresolution" [ 640 ] "integer yresolution" [ 360 ] "string filename" "hills.exr"
Integrator "mlt" "integer maxdepth" [ 4 ]
WorldBegin
LightSource "infinite" "rgb L" [ 0.4 0.6 1 ]
LightSource "distant" "rgb L" [ 3 2.6 2 ] "point from" [ 1 0.7 -0.4 ] "point to" [ 0 0 0 ]
Material "matte" "rgb Kd" [ 0.5 0.45 0.3 ]
Shape "plymesh" "string filename" "hills.ply"
WorldEnd
"""
)
