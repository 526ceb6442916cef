//! Scene text in the words of pbrt-v4.

/// Turns the words of pbrt-v3 that the scenes of the tests are made of into those of v4.
pub fn to_v4(text: &str) -> String {
    let words = [
        ("Film \"image\"", "Film \"rgb\""),
        ("\"point P\"", "\"point3 P\""),
        ("\"float uv\"", "\"point2 uv\""),
        ("\"matte\" \"rgb Kd\"", "\"diffuse\" \"rgb reflectance\""),
        ("\"true\"", "true"),
        ("\"false\"", "false"),
        ("WorldEnd\n", ""),
    ];
    (words.into_iter()).fold(text.to_string(), |text, (v3, v4)| text.replace(v3, v4))
}
