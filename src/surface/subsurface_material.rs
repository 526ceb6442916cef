//! What scene files say of surfaces below which light is scattered: v3 `subsurface` and
//! `kdsubsurface`, v4 `subsurface`.

use std::sync::Arc;

use super::bsdf::Kernel;
use super::bssrdf::Bssrdf;
use super::dielectric::{DielectricMaterial, Smooth};
use super::diffusion_table::DiffusionTable;
use super::packing::{At, BsdfMaterial, Shared};
use super::subsurface::RoughInterface;
use crate::scene::{Description, Dialect, Param, Parameters, Rgb};

/// What pbrt takes if nothing is said: whole milk.
const MILK: [Rgb; 2] = [[0.0011, 0.0024, 0.014], [2.55, 3.21, 3.77]];

/// A mean cosine beyond this is as good as a delta.
const MOST_G: f64 = 0.9999;

/// What is below the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Below {
    /// Absorption and scattering, per length.
    Medium([Param; 2]),
    /// What a thick slab reflects without an interface, and the mean free path.
    Diffuse([Param; 2]),
}

/// An interface as of glass, and a medium below that only its surface shows.
#[derive(Clone, Debug, PartialEq)]
pub struct SubsurfaceMaterial {
    /// Its index of refraction is a number.
    pub interface: DielectricMaterial,
    /// The same number.
    pub eta: f32,
    /// The medium.
    pub below: Below,
    /// Multiplies coefficients or free paths.
    pub scale: f32,
    /// Mean cosine of scattering.
    pub g: f32,
}

impl SubsurfaceMaterial {
    fn coefficients(&self, table: &DiffusionTable, at: &At) -> [Rgb; 2] {
        match self.below {
            Below::Medium(coefficients) => {
                coefficients.map(|c| at.color(c).map(|v| v.max(0.0) * self.scale))
            }
            Below::Diffuse([reflectance, free_path]) => {
                let path = at.color(free_path).map(|v| v.max(0.0) * self.scale);
                let albedo = at
                    .color(reflectance)
                    .map(|v| table.albedo_of(f64::from(v)) as f32);
                [
                    [0, 1, 2].map(|c| (1.0 - albedo[c]) / path[c]),
                    [0, 1, 2].map(|c| albedo[c] / path[c]),
                ]
            }
        }
    }
}

impl Description for SubsurfaceMaterial {
    fn params(&self) -> Vec<Param> {
        let (Below::Medium(below) | Below::Diffuse(below)) = self.below;
        let mut params = self.interface.params();
        params.extend(below);
        params
    }

    fn is_anisotropic(&self) -> bool {
        self.interface.is_anisotropic()
    }

    fn is_subsurface(&self) -> bool {
        true
    }
}

/// The medium of v3's or v4's `subsurface`, and the mean cosine.
fn read_medium<P: Parameters>(set: &P) -> Result<(Below, f64), P::Error> {
    let g = set.constant("g", 0.0, -1.0, 1.0)?;
    let name = set.text("name")?.filter(|name| !name.is_empty());
    let known = name.as_ref().and_then(|name| set.medium(name));
    if let (Some(name), None) = (&name, known) {
        let what = format_args!("there is no medium named \"{name}\"");
        match set.dialect() {
            Dialect::V3 => set.note(format_args!("{what}: whole milk is taken")),
            Dialect::V4 => return Err(set.error(what)),
        }
    }
    if known.is_some() && g != 0.0 {
        set.note(
            "its \"g\" is ignored beside a \"name\": these media are measured as if it were 0",
        );
    }
    let g = if known.is_some() { 0.0 } else { g };
    let constant = |medium: [Rgb; 2]| Below::Medium(medium.map(Param::Constant));
    if set.dialect() == Dialect::V4 {
        if let Some(known) = known {
            return Ok((constant(known), g));
        }
        return match [set.coefficient("sigma_a")?, set.coefficient("sigma_s")?] {
            [Some(a), Some(s)] => Ok((Below::Medium([a, s]), g)),
            [None, None] => Ok((read_reflectance(set)?.unwrap_or(constant(MILK)), g)),
            _ => Err(set.error("needs both \"sigma_a\" and \"sigma_s\", or none of them")),
        };
    }
    let [a, s] = known.unwrap_or(MILK).map(Param::Constant);
    let a = set.coefficient("sigma_a")?.unwrap_or(a);
    let s = set.coefficient("sigma_s")?.unwrap_or(s);
    Ok((Below::Medium([a, s]), g))
}

/// v4's other way to say what is below.
fn read_reflectance<P: Parameters>(set: &P) -> Result<Option<Below>, P::Error> {
    let Some(reflectance) = set.albedo("reflectance")? else {
        return Ok(None);
    };
    let path = set.coefficient("mfp")?;
    let path = path.unwrap_or(Param::Constant([1.0; 3]));
    Ok(Some(Below::Diffuse([reflectance, path])))
}

impl BsdfMaterial for SubsurfaceMaterial {
    const NAMES: &'static [(Dialect, &'static str)] = &[
        (Dialect::V3, "subsurface"),
        (Dialect::V3, "kdsubsurface"),
        (Dialect::V4, "subsurface"),
    ];

    fn read<P: Parameters>(set: &P) -> Result<Self, P::Error> {
        let (below, g) = if set.kind() == "kdsubsurface" {
            let path = set.coefficient("mfp")?;
            let path = path.unwrap_or(Param::Constant([1.0; 3]));
            let below = Below::Diffuse([set.albedo_or("Kd", 0.5)?, path]);
            (below, set.constant("g", 0.0, -1.0, 1.0)?)
        } else {
            read_medium(set)?
        };
        let eta = set.constant("eta", 1.33, 1.0, 100.0)? as f32;
        let one = Param::Constant([1.0; 3]);
        let (reflectance, transmittance, roughness) = match set.dialect() {
            Dialect::V3 => (
                set.albedo_or("Kr", 1.0)?,
                set.albedo_or("Kt", 1.0)?,
                set.roughness_or(Param::Constant([0.0; 3]))?,
            ),
            Dialect::V4 => (one, one, set.roughness(0.0)?),
        };
        Ok(Self {
            interface: DielectricMaterial {
                reflectance,
                transmittance,
                eta: Param::Constant([eta; 3]),
                dispersion: None,
                roughness,
            },
            eta,
            below,
            scale: set.constant("scale", 1.0, 0.0, f64::INFINITY)? as f32,
            g: g.clamp(-MOST_G, MOST_G) as f32,
        })
    }

    /// Whether the interface is rough, and the profiles of the medium.
    type Tables = (bool, Arc<DiffusionTable>);

    fn tables(&self, shared: &mut Shared) -> Self::Tables {
        let make =
            |&(g, eta): &(f32, f32)| Arc::new(DiffusionTable::new(f64::from(g), f64::from(eta)));
        let table = shared.table((self.g, self.eta), make);
        (self.interface.tables(shared), table)
    }

    fn kernel(&self) -> Kernel {
        let smooth = Kernel::of::<Smooth>();
        match self.interface.kernel() == smooth {
            true => smooth,
            false => Kernel::of::<RoughInterface>(),
        }
    }

    fn row(&self, (rough, _): &Self::Tables, at: &At) -> [f32; 8] {
        self.interface.row(rough, at)
    }

    fn bssrdf(&self, (_, table): &Self::Tables, at: &At) -> Option<Bssrdf> {
        let coefficients = self.coefficients(table, at);
        Some(Bssrdf::new(table, self.eta, coefficients))
    }
}
