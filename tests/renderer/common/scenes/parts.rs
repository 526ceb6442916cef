//! What the scenes are put together from.

/// A bilinear quad as two triangles; its front is where `a b c` turns counterclockwise.
fn quad(corners: [[f32; 3]; 4]) -> String {
    let p: Vec<String> = corners.iter().flatten().map(f32::to_string).collect();
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] \"point P\" [{}]\n",
        p.join(" ")
    )
}

/// A patch of a wavy surface around the origin, `n` by `n` quads, with smooth vertex normals.
pub fn wave(n: usize) -> String {
    let (mut p, mut normals, mut uv, mut index) = (vec![], vec![], vec![], vec![]);
    for j in 0..=n {
        for i in 0..=n {
            let (u, v) = (i as f32 / n as f32, j as f32 / n as f32);
            let (x, z) = (2.0 * u - 1.0, 2.0 * v - 1.0);
            let y = 0.15 * (4.0 * x).sin() * (3.0 * z).cos();
            let dx = 0.6 * (4.0 * x).cos() * (3.0 * z).cos();
            let dz = -0.45 * (4.0 * x).sin() * (3.0 * z).sin();
            p.extend([x, y, z]);
            normals.extend([-dx, 1.0, -dz]);
            uv.extend([u, v]);
            if i < n && j < n {
                let a = j * (n + 1) + i;
                let (b, c, d) = (a + n + 1, a + n + 2, a + 1);
                index.extend([a, b, c, a, c, d]);
            }
        }
    }
    let text = |v: &[f32]| v.iter().map(f32::to_string).collect::<Vec<_>>().join(" ");
    let index: Vec<String> = index.iter().map(usize::to_string).collect();
    format!(
        "Shape \"trianglemesh\" \"integer indices\" [{}] \"point P\" [{}] \"normal N\" [{}] \"float uv\" [{}]\n",
        index.join(" "),
        text(&p),
        text(&normals),
        text(&uv)
    )
}

/// A quad whose vertex normals are not its own.
pub fn crooked(corners: [[f32; 3]; 4], normals: [[f32; 3]; 4]) -> String {
    let n: Vec<String> = normals.iter().flatten().map(f32::to_string).collect();
    format!("{}\"normal N\" [{}]\n", quad(corners), n.join(" "))
}

/// A floor, a wall and a screen between them, of normals that are tilted far and across their
/// faces.
pub fn crooked_walls([floor, wall, screen]: [&str; 3]) -> String {
    [
        floor.to_string(),
        crooked(
            [
                [-1., -1., -1.],
                [-1., -1., 1.],
                [1., -1., 1.],
                [1., -1., -1.],
            ],
            [
                [0.9, 0.3, 0.],
                [0., 0.2, -1.],
                [-0.8, 0.5, 0.2],
                [0.3, 0.1, 1.],
            ],
        ),
        wall.to_string(),
        crooked(
            [[-1., -1., 1.], [-1., 1., 1.], [1., 1., 1.], [1., -1., 1.]],
            [
                [0., 1., -0.1],
                [0.5, 0., -0.5],
                [-2., 0., -1.],
                [0., -1., 0.1],
            ],
        ),
        screen.to_string(),
        crooked(
            [
                [-0.6, -0.7, 0.1],
                [-0.6, 0.2, 0.3],
                [0.5, 0.2, 0.3],
                [0.5, -0.7, 0.1],
            ],
            [
                [1., 0., -0.5],
                [0.2, 1., -0.3],
                [-1., 0., -0.2],
                [0., -0.7, -0.3],
            ],
        ),
    ]
    .join("\n")
}

/// Walls of the box `[-1, 1]^3` without its front (`z = -1`): floor, ceiling, back, left, right;
/// all face inwards.
pub fn walls(materials: [&str; 5]) -> String {
    let faces = [
        [
            [-1., -1., -1.],
            [-1., -1., 1.],
            [1., -1., 1.],
            [1., -1., -1.],
        ],
        [[-1., 1., -1.], [1., 1., -1.], [1., 1., 1.], [-1., 1., 1.]],
        [[-1., -1., 1.], [-1., 1., 1.], [1., 1., 1.], [1., -1., 1.]],
        [
            [-1., -1., -1.],
            [-1., 1., -1.],
            [-1., 1., 1.],
            [-1., -1., 1.],
        ],
        [[1., -1., -1.], [1., -1., 1.], [1., 1., 1.], [1., 1., -1.]],
    ];
    (materials.iter().zip(faces))
        .map(|(m, f)| format!("{m}\n{}", quad(f)))
        .collect()
}

/// The side of the box `[-1, 1]^3` that [`walls`] leaves open.
pub fn front(material: &str) -> String {
    let face = [
        [-1., -1., -1.],
        [1., -1., -1.],
        [1., 1., -1.],
        [-1., 1., -1.],
    ];
    format!("{material}\n{}", quad(face))
}

pub fn area(l: &str, two_sided: bool, shape: &str) -> String {
    format!(
        "AttributeBegin\nAreaLightSource \"diffuse\" \"rgb L\" [{l}] \"bool twosided\" \"{two_sided}\"\n{shape}AttributeEnd\n"
    )
}

pub fn sphere(x: f32, y: f32, z: f32, r: f32, material: &str) -> String {
    format!(
        "AttributeBegin\n{material}\nTranslate {x} {y} {z}\nShape \"sphere\" \"float radius\" {r}\nAttributeEnd\n"
    )
}

/// Under the ceiling, facing down.
pub fn lamp() -> String {
    quad([
        [-0.5, 0.95, -0.5],
        [0.5, 0.95, -0.5],
        [0.5, 0.95, 0.5],
        [-0.5, 0.95, 0.5],
    ])
}

/// A glass wedge: its faces are not parallel, so that what refraction does to densities on the way
/// in is not undone on the way out.
pub fn wedge() -> String {
    "Shape \"trianglemesh\" \"integer indices\" [0 2 1 3 4 5 0 1 4 0 4 3 1 2 5 1 5 4 2 0 3 2 3 5] \"point P\" [-0.6 0 -0.5  0.6 0 -0.5  0 0.5 -0.3  -0.6 0 0.5  0.6 0 0.5  0 0.5 0.3]\n"
        .into()
}
