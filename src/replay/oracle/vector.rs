//! `f64` vectors: what is computed in double precision stays apart from the renderer's own types.

/// Three numbers: a point, a direction or a colour.
pub type V = [f64; 3];

/// To `f64`, exactly.
pub fn wide(v: [f32; 3]) -> V {
    v.map(f64::from)
}
/// To the nearest `f32`.
pub fn narrow(v: V) -> [f32; 3] {
    v.map(|x| x as f32)
}
/// `a + b`.
pub fn add(a: V, b: V) -> V {
    std::array::from_fn(|i| a[i] + b[i])
}
/// `a - b`.
pub fn sub(a: V, b: V) -> V {
    std::array::from_fn(|i| a[i] - b[i])
}
/// `s a`.
pub fn scale(a: V, s: f64) -> V {
    a.map(|x| x * s)
}
/// Inner product.
pub fn dot(a: V, b: V) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
/// Vector product.
pub fn cross(a: V, b: V) -> V {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}
/// Euclidean.
pub fn length(a: V) -> f64 {
    dot(a, a).sqrt()
}
/// Of length 1; not a number for a zero vector.
pub fn unit(a: V) -> V {
    scale(a, 1.0 / length(a))
}
/// Mean of the channels of a colour.
pub fn mean(a: V) -> f64 {
    (a[0] + a[1] + a[2]) / 3.0
}
/// Rows `m` of a 3x4 affine map applied to a point.
pub fn transform_point(m: &[[f32; 4]; 3], p: V) -> V {
    m.map(|r| dot(wide([r[0], r[1], r[2]]), p) + f64::from(r[3]))
}
/// Its linear part applied to a vector.
pub fn transform_vector(m: &[[f32; 4]; 3], v: V) -> V {
    m.map(|r| dot(wide([r[0], r[1], r[2]]), v))
}
