//! What scene files say of pbrt-v3's `disney` material.

use super::bsdf::Kernel;
use super::disney::{Disney, DisneyThin};
use super::disney_row::{GREATEST_WEIGHT, Values};
use super::packing::{At, BsdfMaterial, Shared};
use super::rough_dielectric::resolved_eta;
use crate::scene::{Description, Dialect, Param, Parameters};

/// v3 `disney`, without scattering below the surface.
#[derive(Clone, Debug, PartialEq)]
pub struct DisneyMaterial {
    /// Its colour, of which each lobe has its part.
    pub color: Param,
    /// How much of it is metal.
    pub metallic: Param,
    /// Index of refraction.
    pub eta: Param,
    /// Its square is the alpha of the lobes.
    pub roughness: Param,
    /// How much the colour tints the reflection of what is no metal.
    pub specular_tint: Param,
    /// How much longer the highlight is along the tangent.
    pub anisotropic: Param,
    /// Light at grazing angles, as of cloth.
    pub sheen: Param,
    /// How much of that has the colour.
    pub sheen_tint: Param,
    /// A second highlight, of a coat.
    pub clearcoat: Param,
    /// How narrow that is.
    pub clearcoat_gloss: Param,
    /// How much light is refracted.
    pub specular_transmission: Param,
    /// It is a sheet without a volume.
    pub thin: bool,
    /// Of a sheet: how flat its shading is.
    pub flatness: Param,
    /// Of a sheet: how much diffuse light it lets through; 1 is a half.
    pub diffuse_transmission: Param,
}

/// Parameters that are shares, or more than 0.
const SHARES: [(&str, f32); 9] = [
    ("metallic", 1.0),
    ("roughness", 1.0),
    ("speculartint", 1.0),
    ("anisotropic", 1.0),
    ("sheentint", 1.0),
    ("clearcoatgloss", 1.0),
    ("spectrans", 1.0),
    ("flatness", 1.0),
    ("difftrans", 2.0),
];

impl Description for DisneyMaterial {
    fn params(&self) -> Vec<Param> {
        vec![
            self.color,
            self.metallic,
            self.eta,
            self.roughness,
            self.specular_tint,
            self.anisotropic,
            self.sheen,
            self.sheen_tint,
            self.clearcoat,
            self.clearcoat_gloss,
            self.specular_transmission,
            self.flatness,
            self.diffuse_transmission,
        ]
    }

    fn is_anisotropic(&self) -> bool {
        !self.anisotropic.is_black()
    }
}

impl BsdfMaterial for DisneyMaterial {
    const NAMES: &'static [(Dialect, &'static str)] = &[(Dialect::V3, "disney")];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        let thin = set.flag("thin", false)?;
        let scatters = set.albedo("scatterdistance")?;
        if !thin && scatters.is_some_and(|distance| !distance.is_black()) {
            return Err(set.error(
                "its \"scatterdistance\" is not supported, but 0; use subsurface, or \
                 \"bool thin\" with a \"flatness\"",
            ));
        }
        let bounds = SHARES
            .into_iter()
            .chain([("sheen", GREATEST_WEIGHT), ("clearcoat", GREATEST_WEIGHT)]);
        for (name, most) in bounds {
            if let Some(Param::Constant([value, ..])) = set.float(name)?
                && !(0.0..=most).contains(&value)
            {
                set.note(format_args!(
                    "its \"{name}\" of {value} is taken as {}",
                    value.clamp(0.0, most)
                ));
            }
        }
        Ok(Self {
            color: set.albedo_or("color", 0.5)?,
            metallic: set.float_or("metallic", 0.0)?,
            eta: set.float_or("eta", 1.5)?,
            roughness: set.float_or("roughness", 0.5)?,
            specular_tint: set.float_or("speculartint", 0.0)?,
            anisotropic: set.float_or("anisotropic", 0.0)?,
            sheen: set.float_or("sheen", 0.0)?,
            sheen_tint: set.float_or("sheentint", 0.5)?,
            clearcoat: set.float_or("clearcoat", 0.0)?,
            clearcoat_gloss: set.float_or("clearcoatgloss", 1.0)?,
            specular_transmission: set.float_or("spectrans", 0.0)?,
            thin,
            flatness: set.float_or("flatness", 0.0)?,
            diffuse_transmission: set.float_or("difftrans", 1.0)?,
        })
    }

    type Tables = ();

    fn tables(&self, _: &mut Shared) {}

    fn kernel(&self) -> Kernel {
        match self.thin {
            true => Kernel::of::<DisneyThin>(),
            false => Kernel::of::<Disney>(),
        }
    }

    fn row(&self, _: &(), at: &At) -> [f32; 8] {
        let roughness = at.number(self.roughness).clamp(0.0, 1.0);
        let values = Values {
            colour: at.albedo(self.color),
            eta: resolved_eta(at.number(self.eta), (roughness * roughness).max(1e-3)),
            roughness,
            metallic: at.number(self.metallic),
            transmission: at.number(self.specular_transmission),
            specular_tint: at.number(self.specular_tint),
            anisotropic: at.number(self.anisotropic),
            sheen: at.number(self.sheen),
            sheen_tint: at.number(self.sheen_tint),
            clearcoat: at.number(self.clearcoat),
            gloss: at.number(self.clearcoat_gloss),
            flatness: at.number(self.flatness),
            through: 0.5 * at.number(self.diffuse_transmission),
        };
        values.row()
    }
}
