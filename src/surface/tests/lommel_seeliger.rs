//! Lommel and Seeliger's law of dusty bodies such as the moon (Seeliger 1887): light is scattered
//! once, in all directions alike, and is weakened on its way in and out.

use crate::integrate::{self, Settings};
use crate::pbrt;
use crate::scene::{Description, Dialect, Param, Parameters};
use crate::simd::{Lanes, Vec3};
use crate::surface::bsdf::{Bsdf, BsdfSample, BsdfValue, Kernel, Mode};
use crate::surface::diffuse::{cosine_sample, same_side};
use crate::surface::packing::{At, BsdfMaterial, Shared};
use std::f32::consts::{FRAC_1_PI, PI};

/// Row: single-scattering albedo.
pub struct LommelSeeliger;

impl Bsdf for LommelSeeliger {
    const NAME: &'static str = "Lommel-Seeliger";
    const DELTA: bool = false;
    const LOBES: bool = false;

    fn sample<L: Lanes>(row: &[L; 8], wo: Vec3<L>, u: [L; 3], mode: Mode) -> BsdfSample<L> {
        let (wi, _) = cosine_sample(wo, u);
        let value = Self::eval(row, wo, wi, mode);
        BsdfSample {
            wi,
            throughput: (value.f * L::splat(PI)).or_zero(value.pdf.gt(L::zero())),
            pdf: value.pdf,
            pdf_reverse: value.pdf_reverse,
        }
    }

    fn eval<L: Lanes>(row: &[L; 8], wo: Vec3<L>, wi: Vec3<L>, _: Mode) -> BsdfValue<L> {
        let valid = same_side(wo, wi);
        let (o, i) = (wo.z.abs(), wi.z.abs());
        let scattered = L::splat(0.25 * FRAC_1_PI) / (o + i).max(L::splat(f32::MIN_POSITIVE));
        let inv_pi = L::splat(FRAC_1_PI).or_zero(valid);
        BsdfValue {
            f: (Vec3::new(row[0], row[1], row[2]) * scattered).or_zero(valid),
            pdf: i * inv_pi,
            pdf_reverse: o * inv_pi,
        }
    }
}

/// `lommel-seeliger`.
#[derive(Clone, Debug, PartialEq)]
pub struct LommelSeeligerMaterial {
    pub albedo: Param,
}

impl Description for LommelSeeligerMaterial {
    fn params(&self) -> Vec<Param> {
        vec![self.albedo]
    }

    fn is_black(&self) -> bool {
        self.albedo.is_black()
    }
}

impl BsdfMaterial for LommelSeeligerMaterial {
    const NAMES: &'static [(Dialect, &'static str)] = &[
        (Dialect::V3, "lommel-seeliger"),
        (Dialect::V4, "lommel-seeliger"),
    ];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        Ok(Self {
            albedo: set.albedo_or("albedo", 0.5)?,
        })
    }

    type Tables = ();

    fn tables(&self, _: &mut Shared) {}

    fn kernel(&self) -> Kernel {
        Kernel::of::<LommelSeeliger>()
    }

    fn row(&self, _: &(), at: &At) -> [f32; 8] {
        let [r, g, b] = at.albedo(self.albedo);
        [r, g, b, 0.0, 0.0, 0.0, 0.0, 0.0]
    }
}

/// Under a white sky such a plane is as bright as its albedo `(1 - m ln(1 + 1 / m)) w / 2`, `m` the
/// cosine that it is seen at; path tracing finds that, whether the albedo is given or looked up.
#[test]
fn one_file_and_one_line_make_pictures() {
    for (material, w) in [
        ("\"rgb albedo\" [.8 .8 .8]", 0.8),
        ("\"texture albedo\" \"t\"", 0.4),
    ] {
        for (from, m) in [("0 0 2", 1.0f64), ("0 1.7320508 1", 0.5)] {
            let text = format!(
                "LookAt {from} 0 0 0 1 0 0
                Camera \"orthographic\" \"float screenwindow\" [-.1 .1 -.1 .1]
                Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 8
                PixelFilter \"box\" Integrator \"path\"
                Sampler \"independent\" \"integer pixelsamples\" 64
                WorldBegin
                LightSource \"infinite\" \"rgb L\" [1 1 1]
                Texture \"t\" \"spectrum\" \"constant\" \"rgb value\" [.4 .4 .4]
                Material \"lommel-seeliger\" {material}
                Shape \"trianglemesh\" \"point3 P\" [-9 -9 0 9 -9 0 0 9 0]"
            );
            let scene = pbrt::load_str(&text, "moon.pbrt", ".".as_ref());
            let scene = scene.unwrap_or_else(|e| panic!("{e}"));
            assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
            let settings = Settings {
                seed: 7,
                ..Settings::of(&scene)
            };
            let picture = integrate::trace_paths(&scene, &settings);
            let picture = picture.unwrap_or_else(|e| panic!("{e}"));
            let expected = 0.5 * w * (1.0 - m * (1.0 + 1.0 / m).ln());
            // Pixels are independent of each other.
            let n = picture.pixels.len() as f64;
            let greens = picture.pixels.iter().map(|p| f64::from(p[1]));
            let mean = greens.clone().sum::<f64>() / n;
            let square = greens.map(|g| (g - mean).powi(2)).sum::<f64>() / (n - 1.0);
            let error = (square / n).sqrt().max(1e-6);
            assert!(
                (mean - expected).abs() < 4.5 * error,
                "{material} {m}: {mean} is not {expected}, by {error}"
            );
        }
    }
}
