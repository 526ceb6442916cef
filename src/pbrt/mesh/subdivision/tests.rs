//! Subdivision against known limits.

use super::*;

const OCTAHEDRON: [[f32; 3]; 6] = [
    [1.0, 0.0, 0.0],
    [-1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [0.0, 0.0, -1.0],
];
const OCTAHEDRON_FACES: [u32; 24] = [
    0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5,
];

fn vectors(values: &[[f32; 3]]) -> Vec<DVec3> {
    values
        .iter()
        .map(|p| DVec3::from(p.map(f64::from)))
        .collect()
}

#[test]
fn an_octahedron_becomes_round() {
    let mut last_change = f64::INFINITY;
    let mut last_volume = 0.0;
    for levels in 0..6 {
        let data = loop_subdivide(levels, &OCTAHEDRON, &OCTAHEDRON_FACES).unwrap();
        assert_eq!(data.triangles.len(), 8 << (2 * levels));
        // Euler: V - E + F = 2 with E = 3 F / 2.
        assert_eq!(data.positions.len(), 2 + data.triangles.len() / 2);
        let p = vectors(&data.positions);
        let volume: f64 = data
            .triangles
            .iter()
            .map(|t| t.map(|v| p[v as usize]))
            .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
            .sum();
        let change = (volume - last_volume).abs();
        assert!(
            change < last_change,
            "level {levels}: {last_volume} to {volume}"
        );
        (last_change, last_volume) = (change, volume);

        let radius = p.iter().map(|p| p.length());
        let (least, most) = (
            radius.clone().fold(9.0, f64::min),
            radius.fold(0.0, f64::max),
        );
        assert!(most / least < 1.25, "{least} {most}");
        for (p, n) in p.iter().zip(vectors(data.normals.as_ref().unwrap())) {
            assert!(
                n.normalize().dot(p.normalize()) < -0.9,
                "normals point inwards as pbrt's"
            );
        }
    }
    assert!(last_change < 0.01 * last_volume);
}

#[test]
fn limit_points_do_not_depend_on_the_level() {
    let coarse = loop_subdivide(1, &OCTAHEDRON, &OCTAHEDRON_FACES).unwrap();
    let fine = loop_subdivide(3, &OCTAHEDRON, &OCTAHEDRON_FACES).unwrap();
    // Old vertices keep their numbers.
    let pairs = vectors(&coarse.positions)
        .into_iter()
        .zip(vectors(&fine.positions));
    assert!(pairs.into_iter().all(|(a, b)| a.distance(b) < 1e-6));
}

/// A flat square of `n` by `n` cells.
fn sheet(n: u32) -> (Vec<[f32; 3]>, Vec<u32>) {
    let p = (0..=n)
        .flat_map(|y| (0..=n).map(move |x| [x as f32, y as f32, 0.0]))
        .collect();
    let cell = |x, y| {
        let a = y * (n + 1) + x;
        [a, a + 1, a + n + 2, a, a + n + 2, a + n + 1]
    };
    (
        p,
        (0..n)
            .flat_map(|y| (0..n).flat_map(move |x| cell(x, y)))
            .collect(),
    )
}

#[test]
fn a_sheet_keeps_its_straight_boundary() {
    let (p, indices) = sheet(3);
    let data = loop_subdivide(2, &p, &indices).unwrap();
    assert_eq!(data.triangles.len(), 18 * 16);
    for p in &data.positions {
        assert!(
            p[2] == 0.0
                && (-1e-6..=3.000_001).contains(&p[0])
                && (-1e-6..=3.000_001).contains(&p[1])
        );
    }
    let corner = data
        .positions
        .iter()
        .map(|p| p[0].hypot(p[1]))
        .fold(9.0, f32::min);
    assert!(
        corner < 0.5
            && data
                .positions
                .iter()
                .any(|p| p[1].abs() < 1e-6 && (p[0] - 1.5).abs() < 0.2)
    );
    // The faces run counter-clockwise seen from +z; pbrt's normals look the other way, inside and
    // along the boundary.
    let normals = data.normals.unwrap();
    assert!(
        normals
            .iter()
            .all(|n| DVec3::from(n.map(f64::from)).normalize().z < -0.999)
    );
}

#[test]
fn broken_input_is_an_error() {
    let p = [[0.0; 3]; 7];
    let fails = |levels, indices: &[u32]| loop_subdivide(levels, &p, indices).unwrap_err();
    assert!(fails(1, &[]).contains("not triangles"));
    assert!(fails(1, &[0, 1]).contains("not triangles"));
    assert!(fails(1, &[0, 1, 9]).contains("out of range"));
    assert!(fails(1, &[0, 1, 1]).contains("twice"));
    assert!(fails(1, &[0, 1, 2, 0, 1, 3]).contains("edge"));
    assert!(fails(1, &[0, 1, 2, 1, 0, 3, 0, 1, 4]).contains("edge"));
    assert!(fails(1, &[0, 1, 2, 0, 3, 4]).contains("single vertex"));
    assert!(fails(15, &[0, 1, 2]).contains("levels"));
    assert!(fails(u32::MAX, &[0, 1, 2]).contains("levels"));
}

#[test]
fn unused_and_infinite_vertices() {
    let p = [[9.0; 3], [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let data = loop_subdivide(0, &p, &[1, 2, 3]).unwrap();
    assert_eq!(data.positions.len(), 3);
    let p = [[f32::NAN; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let data = loop_subdivide(2, &p, &[0, 1, 2]).unwrap();
    assert!(data.triangles.is_empty() && !data.warnings.is_empty());
}
