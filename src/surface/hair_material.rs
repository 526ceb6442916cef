//! What scene files say of hair: its pigment, roughness and scales.

use super::bsdf::Kernel;
use super::hair::{Hair, row};
use super::packing::{At, BsdfMaterial, Shared};
use crate::scene::{Description, Dialect, Param, Parameters};

/// Where hair has its colour from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pigment {
    /// Absorption per radius of the fibre.
    Absorption(Param),
    /// Colour of much hair of this kind, by which absorption is found.
    Reflectance(Param),
    /// Concentrations of eumelanin and pheomelanin.
    Melanin([Param; 2]),
}

/// `hair` of both dialects.
#[derive(Clone, Debug, PartialEq)]
pub struct HairMaterial {
    /// Its colour.
    pub pigment: Pigment,
    /// Index of refraction.
    pub eta: Param,
    /// Longitudinal roughness, 0.01 to 1.
    pub beta_m: Param,
    /// Azimuthal roughness, 0.01 to 1.
    pub beta_n: Param,
    /// Tilt of the scales, degrees.
    pub alpha: Param,
}

/// Absorption of eumelanin and pheomelanin of concentration 1 (d'Eon et al. 2011; pbrt-v3).
const MELANIN: [[f32; 3]; 2] = [[0.419, 0.697, 1.37], [0.187, 0.4, 1.05]];

/// What pbrt takes if nothing is said: brown hair.
const BROWN: f32 = 1.3;

impl HairMaterial {
    fn absorption(&self, at: &At, beta_n: f32) -> [f32; 3] {
        match self.pigment {
            Pigment::Absorption(sigma) => at.color(sigma),
            Pigment::Reflectance(color) => {
                let [a, b, c] = [[5.574f32, 0.245], [2.532, -10.73], [5.969, -0.215]];
                // Chiang et al. 2016, equation 9.
                let x = beta_n;
                let fit = c[0] + x * (c[1] + x * (b[0] + x * (b[1] + x * (a[0] + x * a[1]))));
                at.color(color).map(|c| {
                    let ln = c.max(f32::MIN_POSITIVE).ln();
                    (ln / fit).powi(2)
                })
            }
            Pigment::Melanin(kinds) => {
                let [e, p] = kinds.map(|kind| at.number(kind).max(0.0));
                std::array::from_fn(|c| e * MELANIN[0][c] + p * MELANIN[1][c])
            }
        }
    }
}

impl Description for HairMaterial {
    fn params(&self) -> Vec<Param> {
        let own = [self.eta, self.beta_m, self.beta_n, self.alpha];
        let color = match self.pigment {
            Pigment::Absorption(color) | Pigment::Reflectance(color) => vec![color],
            Pigment::Melanin(kinds) => kinds.to_vec(),
        };
        [&color[..], &own].concat()
    }

    fn is_anisotropic(&self) -> bool {
        true
    }

    fn is_fibre(&self) -> bool {
        true
    }
}

impl BsdfMaterial for HairMaterial {
    const NAMES: &'static [(Dialect, &'static str)] =
        &[(Dialect::V3, "hair"), (Dialect::V4, "hair")];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        // All are looked up: pbrt takes the first that there is.
        let sigma = set.coefficient("sigma_a")?;
        let color = set.albedo("color")?;
        let color = match set.dialect() {
            Dialect::V3 => color,
            Dialect::V4 => set.albedo("reflectance")?.or(color),
        };
        let melanin = [set.float("eumelanin")?, set.float("pheomelanin")?];
        let none = Param::Constant([0.0; 3]);
        let pigment = match (sigma, color, melanin) {
            (Some(sigma), ..) => Pigment::Absorption(sigma),
            (_, Some(color), _) => Pigment::Reflectance(color),
            (_, _, [None, None]) => Pigment::Melanin([Param::Constant([BROWN; 3]), none]),
            (_, _, kinds) => Pigment::Melanin(kinds.map(|kind| kind.unwrap_or(none))),
        };
        Ok(Self {
            pigment,
            eta: set.float_or("eta", 1.55)?,
            beta_m: set.float_or("beta_m", 0.3)?,
            beta_n: set.float_or("beta_n", 0.3)?,
            alpha: set.float_or("alpha", 2.0)?,
        })
    }

    type Tables = ();

    fn tables(&self, _: &mut Shared) {}

    fn kernel(&self) -> Kernel {
        Kernel::of::<Hair>()
    }

    fn row(&self, _: &(), at: &At) -> [f32; 8] {
        let [m, n] = [self.beta_m, self.beta_n].map(|beta| at.number(beta).clamp(0.01, 1.0));
        let h = 2.0 * at.uv()[1] - 1.0;
        let sigma = self.absorption(at, n);
        row(sigma, h, at.number(self.eta), [m, n], at.number(self.alpha))
    }
}
