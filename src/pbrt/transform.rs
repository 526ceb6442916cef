//! Transforms as pbrt defines them, in `f64`: scenes far from the origin lose what `f32` cannot
//! hold.

use glam::{DAffine3, DMat3, DMat4, DVec3, DVec4, Vec3};

/// World-to-camera transform of `LookAt`; `None` if the directions do not span a frame.
pub(super) fn look_at(eye: DVec3, look: DVec3, up: DVec3) -> Option<DAffine3> {
    let dir = (look - eye).try_normalize()?;
    let right = up.try_normalize()?.cross(dir).try_normalize()?;
    let up = dir.cross(right);
    let camera_to_world = DAffine3 {
        matrix3: DMat3::from_cols(right, up, dir),
        translation: eye,
    };
    Some(camera_to_world.inverse())
}

/// Rotation by `degrees` about `axis`, counter-clockwise where the axis points at the viewer.
pub(super) fn rotate(degrees: f64, axis: DVec3) -> Option<DAffine3> {
    Some(DAffine3::from_axis_angle(
        axis.try_normalize()?,
        degrees.to_radians(),
    ))
}

/// The 16 numbers of `Transform`, column by column.
pub(super) fn from_numbers(m: &[f64; 16]) -> DMat4 {
    DMat4::from_cols_array(m)
}

/// The matrix as an affine map, if it is one.
pub(super) fn affine(m: &DMat4) -> Option<DAffine3> {
    let w = m.w_axis.w;
    if w == 0.0 || [m.x_axis.w, m.y_axis.w, m.z_axis.w] != [0.0; 3] {
        return None;
    }
    let column = |v: DVec4| {
        if w == 1.0 {
            v.truncate()
        } else {
            v.truncate() / w
        }
    };
    Some(DAffine3 {
        matrix3: DMat3::from_cols(column(m.x_axis), column(m.y_axis), column(m.z_axis)),
        translation: column(m.w_axis),
    })
}

/// What a matrix does to things placed by it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Place {
    Affine(DAffine3),
    /// Points are divided by their fourth coordinate, as in pbrt.
    Projective(DMat4),
}

impl Place {
    pub fn of(m: &DMat4) -> Self {
        affine(m).map_or(Self::Projective(*m), Self::Affine)
    }

    /// Not finite where there is no such point.
    pub fn point(&self, p: DVec3) -> DVec3 {
        match self {
            Self::Affine(t) => t.transform_point3(p),
            Self::Projective(m) => m.project_point3(p),
        }
    }

    /// As in pbrt it does not depend on where the vector is.
    pub fn vector(&self, v: DVec3) -> DVec3 {
        match self {
            Self::Affine(t) => t.transform_vector3(v),
            Self::Projective(m) => DMat3::from_mat4(*m) * v,
        }
    }

    /// What normals are multiplied by: see [`normal_matrix`]. As in pbrt it does not depend on
    /// where they are.
    pub fn normals(&self) -> DMat3 {
        match self {
            Self::Affine(t) => normal_matrix(t),
            Self::Projective(m) => DMat3::from_mat4(m.inverse()).transpose(),
        }
    }

    pub fn mirrors(&self) -> bool {
        match self {
            Self::Affine(t) => swaps_handedness(t),
            Self::Projective(m) => DMat3::from_mat4(*m).determinant() < 0.0,
        }
    }

    /// The affine map that puts the origin where this one does and turns directions as its inverse
    /// does, which is all that lights and cameras see of it. `None` if it has no inverse.
    pub fn frame(&self) -> Option<DAffine3> {
        match self {
            Self::Affine(t) => Some(*t),
            Self::Projective(m) => {
                let back = DMat3::from_mat4(m.inverse());
                let frame = DAffine3 {
                    matrix3: back.inverse(),
                    translation: m.project_point3(DVec3::ZERO),
                };
                (back.determinant() != 0.0 && frame.is_finite()).then_some(frame)
            }
        }
    }

    pub fn affine(&self) -> Option<&DAffine3> {
        match self {
            Self::Affine(t) => Some(t),
            Self::Projective(_) => None,
        }
    }
}

/// The inverse, if there is one.
pub(super) fn inverse(t: &DAffine3) -> Option<DAffine3> {
    let inverse = t.inverse();
    (t.matrix3.determinant() != 0.0 && inverse.is_finite()).then_some(inverse)
}

/// Left-handed to right-handed or back.
pub(super) fn swaps_handedness(t: &DAffine3) -> bool {
    t.matrix3.determinant() < 0.0
}

/// What normals transform by: the inverse transpose up to a positive factor. As the matrix of
/// cofactors it exists for singular transforms too.
pub(super) fn normal_matrix(t: &DAffine3) -> DMat3 {
    let m = t.matrix3;
    let cofactors = DMat3::from_cols(
        m.y_axis.cross(m.z_axis),
        m.z_axis.cross(m.x_axis),
        m.x_axis.cross(m.y_axis),
    );
    if swaps_handedness(t) {
        -cofactors
    } else {
        cofactors
    }
}

/// A transform that keeps angles, taken apart: `x -> scale * (frame * x) + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Similarity {
    /// Orthonormal, perhaps mirrored.
    pub frame: DMat3,
    pub scale: f64,
    pub translation: DVec3,
}

/// How far from orthonormal a frame may be that was written with few digits.
const ORTHONORMAL_TOLERANCE: f64 = 2e-3;

/// `None` if the transform shears, stretches or collapses.
pub(super) fn similarity(t: &DAffine3) -> Option<Similarity> {
    let det = t.matrix3.determinant();
    let scale = det.abs().cbrt();
    if !(scale > 0.0 && scale.is_finite() && t.is_finite()) {
        return None;
    }
    let m = t.matrix3 * (1.0 / scale);
    let gram = m.transpose() * m - DMat3::IDENTITY;
    if gram
        .to_cols_array()
        .iter()
        .any(|x| x.is_nan() || x.abs() >= ORTHONORMAL_TOLERANCE)
    {
        return None;
    }
    // Gram-Schmidt, the viewing axis first.
    let z = m.z_axis.try_normalize()?;
    let y = (m.y_axis - z * z.dot(m.y_axis)).try_normalize()?;
    let x = y.cross(z) * det.signum();
    Some(Similarity {
        frame: DMat3::from_cols(x, y, z),
        scale,
        translation: t.translation,
    })
}

/// A point in internal space as `f32`. What lies further out than this is as good as infinitely
/// far, yet its square must stay finite.
pub(super) fn narrow_point(p: DVec3) -> Vec3 {
    const FAR: f64 = 1e15;
    p.clamp(DVec3::splat(-FAR), DVec3::splat(FAR)).as_vec3()
}

/// Three rows of a 3x4 matrix.
pub(super) fn rows(t: &DAffine3) -> [[f32; 4]; 3] {
    let (m, w) = (t.matrix3, t.translation);
    [0, 1, 2].map(|i| [m.x_axis[i], m.y_axis[i], m.z_axis[i], w[i]].map(|x| x as f32))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn close(a: DVec3, b: DVec3) {
        assert!((a - b).length() < 1e-12, "{a} is not {b}");
    }

    #[test]
    fn look_at_puts_the_target_on_z() {
        let t = look_at(
            DVec3::new(0.0, 1.0, 3.9),
            DVec3::new(0.0, 1.0, 0.0),
            DVec3::Y,
        )
        .expect("a frame");
        close(t.transform_point3(DVec3::new(0.0, 1.0, 3.9)), DVec3::ZERO);
        close(
            t.transform_point3(DVec3::new(0.0, 1.0, 0.0)),
            DVec3::new(0.0, 0.0, 3.9),
        );
        // Looking along -z with y up, the world's x is to the left: pbrt's camera space is
        // left-handed.
        close(t.transform_vector3(DVec3::X), DVec3::NEG_X);
        assert!(look_at(DVec3::ZERO, DVec3::Y, DVec3::Y).is_none());
        assert!(look_at(DVec3::ZERO, DVec3::ZERO, DVec3::Y).is_none());
    }

    #[test]
    fn rotation_is_right_handed() {
        let t = rotate(90.0, DVec3::new(0.0, 0.0, 2.0)).expect("an axis");
        close(t.transform_point3(DVec3::X), DVec3::Y);
        assert!(rotate(90.0, DVec3::ZERO).is_none());
    }

    #[test]
    fn sixteen_numbers_are_columns() {
        let m = [
            1., 0., 0., 0., 0., 2., 0., 0., 0., 0., 3., 0., 4., 5., 6., 1.,
        ];
        let t = affine(&from_numbers(&m)).expect("affine");
        close(t.transform_point3(DVec3::ONE), DVec3::new(5.0, 7.0, 9.0));
        let mut projective = m;
        projective[3] = 0.5;
        assert!(affine(&from_numbers(&projective)).is_none());
    }

    /// Of `(x, y, z) -> (x, y, z) / (1 + z / 2)` and a shift.
    #[test]
    fn projective_maps_divide() {
        let mut m = DMat4::IDENTITY;
        m.z_axis.w = 0.5;
        let moved = DMat4::from_translation(DVec3::new(4.0, 0.0, 0.0)) * m;
        let place = Place::of(&moved);
        close(
            place.point(DVec3::new(1.0, 2.0, 2.0)),
            DVec3::new(4.5, 1.0, 1.0),
        );
        assert!(!place.point(DVec3::new(0.0, 0.0, -2.0)).is_finite());
        // The shift is seen in the inverse, and so by directions.
        let frame = place.frame().expect("an inverse");
        close(frame.translation, DVec3::new(4.0, 0.0, 0.0));
        let back = DMat3::from_mat4(moved.inverse());
        close(back * frame.transform_vector3(DVec3::Z), DVec3::Z);
        assert!(Place::of(&DMat4::ZERO).frame().is_none());
    }

    #[test]
    fn normals_keep_to_their_side_under_mirrors() {
        let t = DAffine3::from_scale(DVec3::new(-1.0, 2.0, 1.0));
        close((normal_matrix(&t) * DVec3::Y).normalize(), DVec3::Y);
        close((normal_matrix(&t) * DVec3::X).normalize(), DVec3::NEG_X);
    }

    #[test]
    fn similarities() {
        let t = DAffine3::from_scale(DVec3::new(-2.0, 2.0, 2.0));
        let s = similarity(&t).expect("mirrored and scaled");
        assert!((s.scale - 2.0).abs() < 1e-12 && s.frame.determinant() < 0.0);
        close(s.frame * DVec3::X, DVec3::NEG_X);
        assert!(similarity(&DAffine3::from_scale(DVec3::new(1.0, 1.0, 1.1))).is_none());
        assert!(similarity(&DAffine3::from_scale(DVec3::ZERO)).is_none());
    }

    fn vector(most: f64) -> impl Strategy<Value = DVec3> {
        prop::array::uniform3(-most..most).prop_map(DVec3::from)
    }

    proptest! {
        #![proptest_config(crate::property::cases(500))]

        /// Turned, moved and scaled by factors of up to a million: there and back is where it was,
        /// and what it is made of is found again.
        #[test]
        fn transforms_are_undone(
            axis in vector(1.0),
            degrees in -720.0..720.0,
            shift in vector(1e6),
            exponent in -6.0..6.0,
            mirrored in any::<bool>(),
            p in vector(1e3),
        ) {
            let Some(turn) = rotate(degrees, axis) else {
                return Ok(());
            };
            let scale = 10f64.powf(exponent);
            let factors = DVec3::new(if mirrored { -scale } else { scale }, scale, scale);
            let t = DAffine3::from_translation(shift) * turn * DAffine3::from_scale(factors);
            let back = inverse(&t).expect("an inverse");
            let size = p.length() + shift.length() / scale;
            let apart = (back.transform_point3(t.transform_point3(p)) - p).length();
            prop_assert!(apart <= 1e-13 * (1.0 + size), "{} of {}", apart, size);
            let parts = similarity(&t).expect("a similarity");
            prop_assert!((parts.scale / scale - 1.0).abs() < 1e-12);
            prop_assert_eq!(parts.frame.determinant() < 0.0, mirrored);
            prop_assert_eq!(swaps_handedness(&t), mirrored);
        }

        /// Views of any sort, up vectors along them nearly: a frame that keeps lengths, with the
        /// target ahead, or none.
        #[test]
        fn views_keep_lengths(
            eye in vector(1e6),
            look in vector(1e6),
            up in vector(1.0),
            p in vector(1e6),
        ) {
            if let Some(t) = look_at(eye, look, up) {
                let seen = t.transform_point3(look);
                let distance = (look - eye).length();
                prop_assert!((seen - DVec3::new(0.0, 0.0, distance)).length() < 1e-8);
                let length = t.transform_vector3(p).length();
                prop_assert!((length - p.length()).abs() < 1e-8);
            }
        }

        /// Sixteen numbers of any bits: no inverse, or a finite one.
        #[test]
        fn inverses_are_finite(
            m in prop::array::uniform16(prop::num::f64::ANY),
            affine in any::<bool>(),
        ) {
            let mut m = m;
            if affine {
                (m[3], m[7], m[11], m[15]) = (0.0, 0.0, 0.0, 1.0);
            }
            let t = super::affine(&from_numbers(&m));
            prop_assert!(affine || t.is_none());
            if let Some(t) = t {
                prop_assert!(inverse(&t).is_none_or(|t| t.is_finite()));
                prop_assert!(similarity(&t).is_none_or(|s| s.frame.is_finite() && s.scale > 0.0));
            }
        }
    }
}
