//! Focusing, in `f64`: the thick lens that a system of lenses nearly is (pbrt-v3, section 6.4.3).

use crate::scene::lenses::LensElement;

/// Origin and direction in the plane of the axis, `[x, z]` each; `z` grows towards the scene.
type Ray = ([f64; 2], [f64; 2]);

/// Why lenses cannot be put in focus.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum FocusError {
    /// Rays near the axis are blocked.
    #[error("no ray along the axis comes through: is the aperture, or a lens, too small?")]
    Blocked,
    /// Nothing bends the light together.
    #[error("its lenses have no focal point")]
    Afocal,
    /// No place of the film is in focus.
    #[error("focus distance {0} is too short for its lenses")]
    TooShort(f64),
}

/// How far the film is from the rear vertex of `elements` (from the scene to the film), if points
/// at `distance` before it are to be in focus; `diagonal` is the film's.
///
/// # Errors
/// Where there is no such place.
pub fn film_distance(
    elements: &[LensElement],
    diagonal: f64,
    distance: f64,
) -> Result<f64, FocusError> {
    let x = 0.001 * diagonal;
    let front: f64 = elements.iter().map(|e| e.thickness).sum();
    let rear = elements.last().map_or(0.0, |e| e.thickness);
    let into = ([x, front + 1.0], [0.0, -1.0]);
    let out = ([x, rear - 1.0], [0.0, 1.0]);
    let film = from_scene(elements, into).ok_or(FocusError::Blocked)?;
    let scene = from_film(elements, out).ok_or(FocusError::Blocked)?;
    // pbrt counts z towards the film here.
    let [film, scene] = [(into, film), (out, scene)].map(|(into, out)| cardinal(into, out));
    let ([p_film, f_film], [p_scene, _]) = (film, scene);
    let f = f_film - p_film;
    let z = -distance;
    if ![p_film, f, p_scene].iter().all(|v| v.is_finite()) {
        return Err(FocusError::Afocal);
    }
    let square = (p_scene - z - p_film) * (p_scene - z - 4.0 * f - p_film);
    if square.is_nan() || square <= 0.0 {
        return Err(FocusError::TooShort(distance));
    }
    let moved = 0.5 * (p_scene - z + p_film - square.sqrt());
    match rear + moved {
        found if found > 0.0 && found.is_finite() => Ok(found),
        _ => Err(FocusError::TooShort(distance)),
    }
}

/// Where the principal plane and the focal point are, of a ray that went in along the axis.
fn cardinal(into: Ray, out: Ray) -> [f64; 2] {
    let ([x, z], [dx, dz]) = out;
    [-(z + dz * (into.0[0] - x) / dx), -(z - dz * x / dx)]
}

/// Through all elements, from the film; `None` if something is in the way.
fn from_film(elements: &[LensElement], mut ray: Ray) -> Option<Ray> {
    let mut vertex = 0.0;
    for (i, e) in elements.iter().enumerate().rev() {
        vertex += e.thickness;
        let before = i.checked_sub(1).map_or(1.0, |i| index(elements[i].eta));
        ray = refract(ray, vertex, e, index(e.eta) / before)?;
    }
    Some(ray)
}

/// The other way.
fn from_scene(elements: &[LensElement], mut ray: Ray) -> Option<Ray> {
    let mut vertex: f64 = elements.iter().map(|e| e.thickness).sum();
    for (i, e) in elements.iter().enumerate() {
        let before = i.checked_sub(1).map_or(1.0, |i| index(elements[i].eta));
        ray = refract(ray, vertex, e, before / index(e.eta))?;
        vertex -= e.thickness;
    }
    Some(ray)
}

fn index(eta: f64) -> f64 {
    if eta == 0.0 { 1.0 } else { eta }
}

/// One surface at `vertex`; `ratio` is the index it comes from over that it goes to.
fn refract(([x, z], [dx, dz]): Ray, vertex: f64, e: &LensElement, ratio: f64) -> Option<Ray> {
    let along = if e.curvature_radius == 0.0 {
        (vertex - z) / dz
    } else {
        let centre = vertex - e.curvature_radius;
        let (oz, b) = (z - centre, x * dx + (z - centre) * dz);
        let root = (b * b - (x * x + oz * oz - e.curvature_radius * e.curvature_radius)).sqrt();
        // The half of the sphere with the vertex.
        let far = (dz > 0.0) == (e.curvature_radius > 0.0);
        if far { -b + root } else { -b - root }
    };
    let hit = [x + along * dx, z + along * dz];
    let open = along >= 0.0 && hit[0].abs() <= e.aperture_radius;
    if !open {
        return None;
    }
    if e.curvature_radius == 0.0 {
        return Some((hit, [dx, dz]));
    }
    let mut n = [hit[0], hit[1] - vertex + e.curvature_radius].map(|v| v / e.curvature_radius);
    if n[0] * dx + n[1] * dz > 0.0 {
        n = n.map(|v| -v);
    }
    let cos = -(n[0] * dx + n[1] * dz);
    let sin2 = ratio * ratio * (1.0 - cos * cos);
    let bent = ratio * cos - (1.0 - sin2).sqrt();
    let d = [ratio * dx + bent * n[0], ratio * dz + bent * n[1]];
    let size = d[0].hypot(d[1]);
    (size.is_finite() && size > 0.0).then(|| (hit, d.map(|v| v / size)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two surfaces of radius `r`, nearly in one place: a lens of the focal length that the
    /// lensmaker's equation gives.
    #[test]
    fn a_thin_lens_is_in_focus_by_its_equation() {
        let (r, eta, thickness) = (0.1, 1.5, 1e-6);
        let element = |curvature_radius, thickness, eta| LensElement {
            curvature_radius,
            thickness,
            eta,
            aperture_radius: 0.01,
        };
        let elements = [element(r, thickness, eta), element(-r, 0.1, 1.0)];
        let f = r / (2.0 * (eta - 1.0));
        for distance in [0.5, 1.0, 20.0] {
            let film = film_distance(&elements, 0.035, distance).unwrap();
            // The distance is measured from the film.
            let object = distance - film;
            let expected = 1.0 / (1.0 / f - 1.0 / object);
            assert!((film / expected - 1.0).abs() < 1e-4, "{film} {expected}");
        }
        let short = film_distance(&elements, 0.035, 0.3);
        assert_eq!(short, Err(FocusError::TooShort(0.3)));
        let closed = elements.map(|e| LensElement {
            aperture_radius: 1e-6,
            ..e
        });
        let blocked = film_distance(&closed, 0.035, 1.0);
        assert_eq!(blocked, Err(FocusError::Blocked));
    }
}
