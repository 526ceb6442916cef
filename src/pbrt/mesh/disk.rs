//! Disks and rings as triangles.

use std::f64::consts::TAU;

use super::MeshData;

/// Sectors of a full turn. Edges then stay within `radius * (1 - cos(pi / 256)) = 7.5e-5 radius` of
/// the circle.
const SECTORS: f64 = 256.0;

/// A disk, ring or sector in the plane `z = height`, its front towards `+z`. `(u, v)` are pbrt's:
/// the fraction of the angle, and 1 at the inner to 0 at the outer radius.
///
/// The corners lie slightly outside the circle, by the factor that gives the polygon exactly the
/// area of the disk, so that a disk light keeps its power.
pub fn disk(radius: f32, inner_radius: f32, height: f32, phi_max_deg: f32) -> MeshData {
    let mut mesh = MeshData {
        uvs: Some(Vec::new()),
        ..Default::default()
    };
    let phi_max = (phi_max_deg as f64).clamp(0.0, 360.0).to_radians();
    let inner = inner_radius.max(0.0) as f64;
    let outer = radius as f64;
    // Written so that NaN fails it.
    if !(outer > inner && outer.is_finite() && height.is_finite() && phi_max > 0.0) {
        mesh.warnings.push("the disk has no area".into());
        return mesh;
    }

    let sectors = (SECTORS * phi_max / TAU).ceil().max(1.0);
    let step = phi_max / sectors;
    // A triangle with the apex at the centre has sin(step) / step of the area of its sector.
    let stretch = (step / step.sin()).sqrt();
    let uvs = mesh.uvs.get_or_insert_default();
    let mut vertex = |r: f64, u: f64, v: f32| {
        let (sin, cos) = (u * phi_max).sin_cos();
        mesh.positions.push([
            (stretch * r * cos) as f32,
            (stretch * r * sin) as f32,
            height,
        ]);
        uvs.push([u as f32, v]);
        (mesh.positions.len() - 1) as u32
    };
    for i in 0..sectors as u32 {
        let (u0, u1) = (i as f64 / sectors, (i + 1) as f64 / sectors);
        let (b, c) = (vertex(outer, u0, 0.0), vertex(outer, u1, 0.0));
        if inner > 0.0 {
            let (a, d) = (vertex(inner, u0, 1.0), vertex(inner, u1, 1.0));
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        } else {
            // The centre has every u at once: each sector takes its own middle.
            let centre = vertex(0.0, 0.5 * (u0 + u1), 1.0);
            mesh.triangles.push([centre, b, c]);
        }
    }
    mesh
}

/// A whole disk of the same outline without `(u, v)`: of triangles that do not all meet in its
/// centre. Where one stands on a wide ground, the boxes of few of them are near.
pub fn whole_disk(radius: f32, height: f32) -> MeshData {
    let fan = disk(radius, 0.0, height, 360.0);
    // Every sector has the corners where it begins and ends, and the centre.
    let rim = fan.positions.chunks_exact(3).map(|sector| sector[0]);
    let mut mesh = MeshData {
        positions: rim.collect(),
        warnings: fan.warnings,
        ..Default::default()
    };
    let n = mesh.positions.len();
    let mut arcs = vec![[0, n / 3], [n / 3, 2 * n / 3], [2 * n / 3, n]];
    let mut add = |corners: [usize; 3]| {
        let triangle = corners.map(|i| (i % n) as u32);
        mesh.triangles.push(triangle);
    };
    if n >= 3 {
        add([0, n / 3, 2 * n / 3]);
    }
    while let Some([from, to]) = arcs.pop() {
        if to - from >= 2 {
            let middle = (from + to) / 2;
            add([from, middle, to]);
            arcs.extend([[from, middle], [middle, to]]);
        }
    }
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(mesh: &MeshData) -> f64 {
        let signed = mesh.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|v| glam::DVec3::from(mesh.positions[v as usize].map(f64::from)));
            let n = (b - a).cross(c - a) * 0.5;
            assert!(n.z > 0.0 && n.x == 0.0 && n.y == 0.0);
            n.z
        });
        signed.sum()
    }

    #[test]
    fn whole_disks_have_the_outline_of_fans() {
        let (fan, whole) = (disk(2.0, 0.0, 1.0, 360.0), whole_disk(2.0, 1.0));
        assert!((area(&fan) - area(&whole)).abs() < 1e-5);
        assert_eq!(whole.triangles.len(), fan.triangles.len() - 2);
        assert!(whole.uvs.is_none());
        // Boxes of triangles that hold the centre: that of the middle, and two that touch it.
        let holds = |t: &&[u32; 3]| {
            let [a, b, c] = t.map(|v| whole.positions[v as usize]);
            (0..2).all(|k| a[k].min(b[k]).min(c[k]) <= 0.0 && a[k].max(b[k]).max(c[k]) >= 0.0)
        };
        assert!(whole.triangles.iter().filter(holds).count() <= 3);
        assert!(whole_disk(0.0, 1.0).triangles.is_empty());
    }

    #[test]
    fn area_is_that_of_the_circle() {
        for (radius, inner, phi) in [
            (1.0f32, 0.0f32, 360.0f32),
            (3.0, 1.5, 360.0),
            (0.01, 0.0, 100.0),
            (5.0, 4.9, 1.0),
        ] {
            let mesh = disk(radius, inner, 2.0, phi);
            let exact = 0.5
                * (phi as f64).to_radians()
                * ((radius as f64).powi(2) - (inner as f64).powi(2));
            // Corners are rounded to f32: on a thin ring that is 1e-7 of the radius, not of the
            // ring.
            let tolerance = 1e-6 * 0.5 * (phi as f64).to_radians() * (radius as f64).powi(2);
            assert!(
                (area(&mesh) - exact).abs() < tolerance,
                "{radius} {inner} {phi}: {} {exact}",
                area(&mesh)
            );
        }
    }

    #[test]
    fn uv_runs_as_in_pbrt() {
        let mesh = disk(2.0, 1.0, 0.0, 90.0);
        let uvs = mesh.uvs.as_ref().unwrap();
        for (p, uv) in mesh.positions.iter().zip(uvs) {
            let phi = p[1].atan2(p[0]) / std::f32::consts::FRAC_PI_2;
            let r = p[0].hypot(p[1]);
            assert!(
                (uv[0] - phi).abs() < 1e-5 && (uv[1] - (2.0 - r)).abs() < 1e-3,
                "{p:?} {uv:?}"
            );
        }
    }

    #[test]
    fn nothing_to_draw() {
        for (r, i, h, phi) in [
            (0.0, 0.0, 0.0, 360.0),
            (1.0, 1.0, 0.0, 360.0),
            (1.0, 0.0, 0.0, 0.0),
            (f32::NAN, 0.0, 0.0, 360.0),
            (1.0, f32::INFINITY, 0.0, 360.0),
            (1.0, 0.0, f32::NAN, 360.0),
            (1.0, 0.0, 0.0, f32::NAN),
        ] {
            let mesh = disk(r, i, h, phi);
            assert!(mesh.triangles.is_empty() && mesh.warnings.len() == 1);
        }
    }
}
