//! Materials as kernels see them: a kind and a parameter row each.

use super::bump::{self, Relief, Tilted};
use super::coat::Interface;
use super::coat_table::{Base, CoatTable};
use super::coated_conductor::{Layers, pack_bounces};
use super::coated_diffuse::base_of;
use super::diffuse::oren_nayar_coefficients;
use super::microfacet::{SMOOTH_ALPHA, pack_alphas};
use super::mixture::{self, Chosen};
use super::rough_dielectric::{LEAST_LOBE, resolved_eta};
use super::table::Kind;
use super::texture::{self, Place};
use crate::geometry::Derivatives;
use crate::scene::spectrum::IndexCurve;
use crate::scene::{
    Bump, Coat, CoatedBase, ConductorFresnel, Image, Material, MaterialKind, Param, Remap,
    Roughness, Scene, Texture, is_smooth,
};
use crate::simd::Row;
use glam::DVec3;
use std::sync::Arc;

/// One material of the scene.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Of a mixture that of one of its components.
    pub kind: Kind,
    /// Its row, its shading normal, or the weights of its components depend on where it is hit.
    pub textured: bool,
    /// It needs a tangent.
    pub anisotropic: bool,
    /// Its index of refraction depends on the wavelength. Never of a mixture: one of its components' may.
    pub dispersive: bool,
    /// Its row depends on the place or on the wavelength.
    varies: bool,
    /// Its hits have rows of their own: the row or the shading normal differs from hit to hit.
    pub per_hit: bool,
    /// It has no row: one of its components is chosen per hit ([`MaterialTable::choose`]).
    pub mixture: bool,
}

/// The materials of a scene, in the order of [`Scene::materials`].
pub struct MaterialTable<'a> {
    pub entries: Vec<Entry>,
    /// Parameter rows; those evaluated per hit are unused.
    pub rows: Vec<Row>,
    materials: &'a [Material],
    /// Length of a unit of the scene file.
    unit: f64,
    textures: &'a [Texture],
    images: &'a [Image],
    /// Of coated diffuse materials.
    interfaces: Vec<Option<Interface>>,
    /// Of textured coats.
    tables: Vec<Option<Arc<CoatTable>>>,
    /// Image textures of each material.
    looked_up: Vec<Vec<u32>>,
    /// Some texture looks at texture coordinates.
    pub uses_uv: bool,
    /// Some texture looks at the point or the normal.
    pub uses_point: bool,
    /// Some hits have rows of their own, or none until a component is chosen.
    pub own_rows: bool,
}

impl<'a> MaterialTable<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let mut table = Self {
            entries: Vec::new(),
            rows: Vec::new(),
            materials: &scene.materials,
            unit: scene.space.scale,
            textures: &scene.textures,
            images: &scene.images,
            interfaces: Vec::new(),
            tables: Vec::new(),
            looked_up: Vec::new(),
            uses_uv: false,
            uses_point: false,
            own_rows: false,
        };
        for Material { kind, bump, .. } in &scene.materials {
            let textured = params(kind).iter().any(|p| matches!(p, Param::Texture(_)));
            let mut entry = Entry {
                kind: kernel(kind),
                textured: textured || bump.is_some(),
                anisotropic: is_anisotropic(kind),
                dispersive: kind.dispersion().is_some(),
                varies: textured || kind.dispersion().is_some(),
                per_hit: textured || bump.is_some() || kind.dispersion().is_some(),
                mixture: false,
            };
            table
                .interfaces
                .push(table.interface(&scene.materials, kind));
            let of_coat = table.table(kind);
            table.tables.push(of_coat);
            let mut images = Vec::new();
            let mut list = params(kind);
            match bump {
                Some(Bump::Height { height, .. }) => list.push(*height),
                Some(Bump::Normal { .. }) => table.uses_uv = true,
                None => {}
            }
            for param in list {
                param.visit(&scene.textures, &mut |index, texture| {
                    table.uses_uv |= texture.uses_uv();
                    table.uses_point |= texture.uses_point();
                    if matches!(texture, Texture::Image { .. }) {
                        images.push(index);
                    }
                });
            }
            if let MaterialKind::Mixture { components } = kind {
                entry.mixture = true;
                for component in components {
                    let below = component.material as usize;
                    entry.kind = table.entries[below].kind;
                    entry.textured |= table.entries[below].textured;
                    images.extend(&table.looked_up[below]);
                }
            }
            table.entries.push(entry);
            images.sort();
            images.dedup();
            table.looked_up.push(images);
            let row = table.row(table.entries.len() - 1, &Place::default(), 0.0);
            table.rows.push(row);
        }
        table.own_rows = (table.entries.iter()).any(|e| e.per_hit || e.mixture);
        table
    }

    /// Has every row evaluated per hit, as those of textured materials are.
    pub fn evaluate_per_hit(&mut self) {
        for (entry, material) in self.entries.iter_mut().zip(self.materials) {
            entry.varies = !params(&material.kind).is_empty();
            entry.per_hit = true;
        }
        self.uses_uv = true;
        self.uses_point = true;
    }

    /// The interface of a coat over a diffuse base; that of an earlier material if it has the same.
    fn interface(&self, materials: &[Material], kind: &MaterialKind) -> Option<Interface> {
        let MaterialKind::CoatedDiffuse { coat, .. } = kind else {
            return None;
        };
        let same = |(i, interface): (usize, &Option<Interface>)| match materials[i].kind {
            MaterialKind::CoatedDiffuse { coat: other, .. } if other == *coat => *interface,
            _ => None,
        };
        let earlier = self.interfaces.iter().enumerate().find_map(same);
        Some(earlier.unwrap_or_else(|| match coat.is_smooth() {
            true => Interface::smooth(coat.eta, coat.thickness),
            false => Interface::of(coat.alphas.map(resolved), coat.eta, coat.thickness),
        }))
    }

    /// What is tabulated of a textured coat; shared among those of which it is the same.
    fn table(&self, kind: &MaterialKind) -> Option<Arc<CoatTable>> {
        let MaterialKind::TexturedCoat {
            base,
            interface,
            coat,
        } = kind
        else {
            return None;
        };
        let base = match base {
            CoatedBase::Diffuse(_) => Base::Diffuse,
            CoatedBase::Conductor { roughness, .. } => Base::Conductor(constant_alphas(roughness)),
        };
        let fixed = constant_alphas(interface).is_some();
        let same = |table: &&Arc<CoatTable>| table.is_of(coat, base, fixed);
        let earlier = self.tables.iter().flatten().find(same).cloned();
        Some(earlier.unwrap_or_else(|| Arc::new(CoatTable::new(*coat, base, fixed))))
    }

    /// The row of a textured coat with these parameters, at a place.
    fn textured_coat(
        &self,
        material: usize,
        (base, interface, coat): (&CoatedBase, &Roughness, &Coat),
        at: &dyn Fn(Param) -> [f32; 3],
    ) -> [f32; 8] {
        let Some(table) = &self.tables[material] else {
            return [0.0; 8];
        };
        let alphas = |r: &Roughness| [r.u, r.v].map(|p| alpha(at(p)[0], r.remap));
        match *base {
            CoatedBase::Diffuse(reflectance) => {
                let alphas = alphas(interface);
                let Interface {
                    packed,
                    scale,
                    internal,
                } = table.interface(alphas);
                let [t, u, v] = packed;
                let [r, g, b] = at(reflectance).map(|r| {
                    let r = r.clamp(0.0, 1.0);
                    scale * scale * base_of(r, coat.eta, internal, coat.visits())
                });
                [
                    r,
                    g,
                    b,
                    coat.eta,
                    pack_alphas(alphas[0], alphas[1]),
                    t,
                    u,
                    v,
                ]
            }
            CoatedBase::Conductor { fresnel, roughness } => {
                let index = match fresnel {
                    ConductorFresnel::EtaK { eta, k } => [at(eta), at(k)],
                    ConductorFresnel::Reflectance(r) => {
                        [[1.0; 3], at(r).map(|r| k_of_reflectance(r.clamp(0.0, 1.0)))]
                    }
                };
                // The conductor is what the coat ends at.
                let [eta, k] = index.map(|c| c.map(|x| x.max(0.0) / coat.eta));
                if self.entries[material].kind == Kind::CoatedMirror {
                    let bounces = pack_bounces(coat.thickness, coat.visits());
                    return [eta[0], eta[1], eta[2], k[0], k[1], k[2], coat.eta, bounces];
                }
                table.conductor([eta, k], alphas(interface), alphas(&roughness))
            }
        }
    }

    /// Asks for the texels that [`Self::evaluate`] will read.
    pub fn announce(&self, material: usize, place: &Place) {
        for &texture in &self.looked_up[material] {
            texture::announce(self.textures, self.images, texture, place);
        }
    }

    /// The component of a mixture that the primary sample `u` chooses at a place.
    pub fn choose(&self, material: usize, place: &Place, u: f32) -> Chosen {
        let at = |p: Param| texture::evaluate(self.textures, self.images, p, place);
        mixture::choose(self.materials, material as u32, &at, u)
    }

    /// What a surface of this material can turn out to be: itself, or the components of a mixture, those of mixtures within it included.
    pub fn components(&self, material: usize) -> Vec<usize> {
        let mut found = vec![material];
        let mut next = 0;
        // Shared components are looked at once.
        while next < found.len() {
            if let MaterialKind::Mixture { components } = &self.materials[found[next]].kind {
                for component in components {
                    let below = component.material as usize;
                    if !found.contains(&below) {
                        found.push(below);
                    }
                }
            }
            next += 1;
        }
        found.retain(|i| !self.entries[*i].mixture);
        found
    }

    /// Whether shading normals of a material are other than those of its surfaces; never of a mixture, but of its components.
    pub fn is_bumped(&self, material: usize) -> bool {
        self.materials[material].bump.is_some()
    }

    /// What the bump or normal map of a material says at a place with shading normal `ns`.
    pub fn relief(
        &self,
        material: usize,
        place: &Place,
        d: &Derivatives,
        ns: DVec3,
    ) -> Option<Relief> {
        let bump = self.materials[material].bump.as_ref()?;
        Some(bump::look_up(
            self.textures,
            self.images,
            bump,
            place,
            d,
            ns,
            self.unit,
        ))
    }

    /// The shading frame that follows from it, for shading and geometric normal `[ns, ng]`.
    pub fn tilt(
        &self,
        material: usize,
        relief: &Relief,
        d: &Derivatives,
        normals: [DVec3; 2],
    ) -> Option<Tilted> {
        let bump = self.materials[material].bump.as_ref()?;
        Some(bump::tilt(bump, relief, d, normals, self.unit))
    }

    /// The parameter row of a material at a place, for light of the wavelength `nm` (of which only dispersive materials know); zero of a
    /// mixture.
    pub fn evaluate(&self, material: usize, place: &Place, nm: f32) -> Row {
        if self.entries[material].varies {
            self.row(material, place, nm)
        } else {
            self.rows[material]
        }
    }

    fn row(&self, material: usize, place: &Place, nm: f32) -> Row {
        let index = |eta: Param, curve: &Option<Arc<IndexCurve>>| match curve {
            Some(curve) => curve.at(nm),
            None => texture::evaluate(self.textures, self.images, eta, place)[0],
        };
        let at = |p: Param| texture::evaluate(self.textures, self.images, p, place);
        // Reflectances are those of passive surfaces, as in pbrt; interpolation and scaling can leave [0, 1].
        let unit = |p: Param| at(p).map(|v| v.clamp(0.0, 1.0));
        let mut row = [0.0; 8];
        match &self.materials[material].kind {
            MaterialKind::Diffuse { reflectance, sigma } => {
                row[..3].copy_from_slice(&unit(*reflectance));
                (row[3], row[4]) = oren_nayar_coefficients(at(*sigma)[0].clamp(0.0, 90.0));
            }
            MaterialKind::Mirror { reflectance } => {
                row[..3].copy_from_slice(&unit(*reflectance));
            }
            MaterialKind::Conductor { fresnel, roughness } => {
                let (eta, k) = match *fresnel {
                    ConductorFresnel::EtaK { eta, k } => (at(eta), at(k)),
                    ConductorFresnel::Reflectance(r) => ([1.0; 3], unit(r).map(k_of_reflectance)),
                };
                row[..3].copy_from_slice(&eta.map(|v| v.max(0.0)));
                row[3..6].copy_from_slice(&k.map(|v| v.max(0.0)));
                row[6] = alpha(at(roughness.u)[0], roughness.remap);
                row[7] = alpha(at(roughness.v)[0], roughness.remap);
            }
            MaterialKind::Dielectric {
                reflectance,
                transmittance,
                eta,
                dispersion,
                roughness,
            } => {
                row[..3].copy_from_slice(&unit(*reflectance));
                row[3..6].copy_from_slice(&unit(*transmittance));
                row[6] = index(*eta, dispersion).max(f32::MIN_POSITIVE);
                if self.entries[material].kind == Kind::RoughDielectric {
                    let (u, v) = (at(roughness.u)[0], at(roughness.v)[0]);
                    let [ax, ay] = glass_alphas(u, v, roughness.remap);
                    row[6] = resolved_eta(row[6], ax.min(ay));
                    row[7] = pack_alphas(ax, ay);
                }
            }
            MaterialKind::Plastic {
                diffuse,
                specular,
                roughness,
            }
            | MaterialKind::Substrate {
                diffuse,
                specular,
                roughness,
            } => {
                row[..3].copy_from_slice(&unit(*diffuse));
                row[3..6].copy_from_slice(&unit(*specular));
                row[6] = alpha(at(roughness.u)[0], roughness.remap);
                row[7] = alpha(at(roughness.v)[0], roughness.remap);
            }
            MaterialKind::ThinDielectric { eta, dispersion } => {
                row[0] = index(*eta, dispersion).max(f32::MIN_POSITIVE);
            }
            MaterialKind::DiffuseTransmission {
                reflectance,
                transmittance,
                scale,
            } => {
                let product = |[a, b]: [Param; 2]| {
                    let (a, b) = (unit(a), unit(b));
                    std::array::from_fn::<f32, 3, _>(|c| (scale * a[c] * b[c]).clamp(0.0, 1.0))
                };
                row[..3].copy_from_slice(&product(*reflectance));
                row[3..6].copy_from_slice(&product(*transmittance));
            }
            MaterialKind::CoatedDiffuse { reflectance, coat } => {
                if let Some(Interface {
                    packed,
                    scale,
                    internal,
                }) = self.interfaces[material]
                {
                    let base = |r| scale * scale * base_of(r, coat.eta, internal, coat.visits());
                    row[..3].copy_from_slice(&unit(*reflectance).map(base));
                    row[3] = coat.eta;
                    if coat.is_smooth() {
                        row[4] = coat.thickness;
                    } else {
                        row[4] = pack_alphas(coat.alphas[0], coat.alphas[1]);
                        row[5..].copy_from_slice(&packed);
                    }
                }
            }
            MaterialKind::CoatedConductor {
                eta,
                k,
                alphas,
                coat,
            } => {
                if self.entries[material].kind == Kind::CoatedMirror {
                    row[..3].copy_from_slice(eta);
                    row[3..6].copy_from_slice(k);
                    row[6] = coat.eta;
                    row[7] = pack_bounces(coat.thickness, coat.visits());
                } else {
                    let layers = Layers {
                        eta: *eta,
                        k: *k,
                        coat_eta: coat.eta,
                        coat: (!coat.is_smooth()).then_some(coat.alphas.map(resolved)),
                        conductor: alphas.map(resolved),
                        thickness: coat.thickness,
                        bounces: coat.visits(),
                    };
                    row = layers.row();
                }
            }
            MaterialKind::TexturedCoat {
                base,
                interface,
                coat,
            } => row = self.textured_coat(material, (base, interface, coat), &at),
            MaterialKind::Coat { eta } => row[0] = *eta,
            MaterialKind::Mixture { .. } | MaterialKind::Interface => {}
        }
        Row(row)
    }
}

/// Whether lobes have different widths along `u` and `v`.
fn is_anisotropic(kind: &MaterialKind) -> bool {
    let differ = |alphas: &[f32; 2]| alphas[0] != alphas[1];
    match kind {
        MaterialKind::Conductor { roughness, .. }
        | MaterialKind::Substrate { roughness, .. }
        | MaterialKind::Plastic { roughness, .. }
        | MaterialKind::Dielectric { roughness, .. } => roughness.u != roughness.v,
        MaterialKind::CoatedDiffuse { coat, .. } => differ(&coat.alphas),
        MaterialKind::CoatedConductor { coat, alphas, .. } => {
            differ(&coat.alphas) || differ(alphas)
        }
        MaterialKind::TexturedCoat {
            base, interface, ..
        } => {
            let below = match base {
                CoatedBase::Conductor { roughness, .. } => roughness.u != roughness.v,
                CoatedBase::Diffuse(_) => false,
            };
            below || interface.u != interface.v
        }
        _ => false,
    }
}

/// The kernel of a material. A constant roughness decides between smooth and rough; a textured one is rough throughout.
fn kernel(kind: &MaterialKind) -> Kind {
    match kind {
        MaterialKind::Diffuse { sigma, .. } => match sigma {
            Param::Constant([0.0, ..]) => Kind::Diffuse,
            _ => Kind::OrenNayar,
        },
        MaterialKind::Mirror { .. } => Kind::Mirror,
        MaterialKind::Conductor { roughness, .. } => match (roughness.u, roughness.v) {
            (Param::Constant(u), Param::Constant(v))
                if raw_alpha(u[0], roughness.remap).max(raw_alpha(v[0], roughness.remap))
                    < SMOOTH_ALPHA =>
            {
                Kind::SmoothConductor
            }
            _ => Kind::RoughConductor,
        },
        MaterialKind::Dielectric { eta, roughness, .. } => dielectric_kernel(*eta, roughness),
        MaterialKind::Plastic { .. } => Kind::Plastic,
        MaterialKind::ThinDielectric { .. } => Kind::ThinDielectric,
        MaterialKind::DiffuseTransmission { .. } => Kind::DiffuseTransmission,
        MaterialKind::Substrate { .. } => Kind::Substrate,
        MaterialKind::CoatedDiffuse { coat, .. } => match coat.is_smooth() {
            true => Kind::CoatedDiffuseBase,
            false => Kind::CoatedDiffuse,
        },
        MaterialKind::CoatedConductor { alphas, coat, .. } => {
            match (coat.is_smooth(), is_smooth(*alphas)) {
                (true, true) => Kind::CoatedMirror,
                (true, false) => Kind::CoatedConductorBase,
                (false, _) => Kind::CoatedConductor,
            }
        }
        MaterialKind::TexturedCoat { base, coat, .. } => match base {
            CoatedBase::Diffuse(_) => Kind::CoatedDiffuse,
            CoatedBase::Conductor { roughness, .. } => {
                let smooth = constant_alphas(roughness).is_some_and(is_smooth);
                match (coat.is_smooth(), smooth) {
                    (true, true) => Kind::CoatedMirror,
                    (true, false) => Kind::CoatedConductorBase,
                    (false, _) => Kind::CoatedConductor,
                }
            }
        },
        MaterialKind::Coat { .. } => Kind::Coat,
        // Never asked for: a component takes the mixture's place, and interfaces are left out of the tracer.
        MaterialKind::Mixture { .. } | MaterialKind::Interface => Kind::Diffuse,
    }
}

/// Rough glass is smooth where its roughness is that of a smooth surface, and where its refracted lobe would be too narrow: at an index of 1
/// rays pass straight through, as in pbrt-v4 (`DielectricBxDF`).
fn dielectric_kernel(eta: Param, roughness: &Roughness) -> Kind {
    let (Param::Constant(u), Param::Constant(v)) = (roughness.u, roughness.v) else {
        return match eta {
            Param::Constant([1.0, ..]) => Kind::SmoothDielectric,
            _ => Kind::RoughDielectric,
        };
    };
    let [ax, ay] = glass_alphas(u[0], v[0], roughness.remap);
    let narrow = |eta: f32| (eta - 1.0).abs() * ax.min(ay) < LEAST_LOBE;
    match eta {
        _ if ax.max(ay) <= SMOOTH_ALPHA => Kind::SmoothDielectric,
        Param::Constant([eta, ..]) if narrow(eta) => Kind::SmoothDielectric,
        _ => Kind::RoughDielectric,
    }
}

/// The alphas of glass. v3 takes a roughness of 0 both ways for smooth before it remaps it (`GlassMaterial`).
fn glass_alphas(u: f32, v: f32, remap: Remap) -> [f32; 2] {
    if u == 0.0 && v == 0.0 {
        [SMOOTH_ALPHA; 2]
    } else {
        [alpha(u, remap), alpha(v, remap)]
    }
}

fn params(kind: &MaterialKind) -> Vec<Param> {
    let rough = |r: &Roughness| [r.u, r.v];
    match kind {
        MaterialKind::Diffuse { reflectance, sigma } => vec![*reflectance, *sigma],
        MaterialKind::Mirror { reflectance } => vec![*reflectance],
        MaterialKind::Conductor { fresnel, roughness } => {
            let mut list = rough(roughness).to_vec();
            match fresnel {
                ConductorFresnel::EtaK { eta, k } => list.extend([*eta, *k]),
                ConductorFresnel::Reflectance(r) => list.push(*r),
            }
            list
        }
        MaterialKind::Dielectric {
            reflectance,
            transmittance,
            eta,
            dispersion: _,
            roughness,
        } => {
            let mut list = rough(roughness).to_vec();
            list.extend([*reflectance, *transmittance, *eta]);
            list
        }
        MaterialKind::Plastic {
            diffuse,
            specular,
            roughness,
        }
        | MaterialKind::Substrate {
            diffuse,
            specular,
            roughness,
        } => {
            let mut list = rough(roughness).to_vec();
            list.extend([*diffuse, *specular]);
            list
        }
        MaterialKind::ThinDielectric { eta, .. } => vec![*eta],
        MaterialKind::DiffuseTransmission {
            reflectance,
            transmittance,
            ..
        } => [*reflectance, *transmittance].concat(),
        MaterialKind::CoatedDiffuse { reflectance, .. } => vec![*reflectance],
        MaterialKind::TexturedCoat {
            base, interface, ..
        } => {
            let mut list = rough(interface).to_vec();
            match base {
                CoatedBase::Diffuse(reflectance) => list.push(*reflectance),
                CoatedBase::Conductor { fresnel, roughness } => {
                    list.extend(rough(roughness));
                    match fresnel {
                        ConductorFresnel::EtaK { eta, k } => list.extend([*eta, *k]),
                        ConductorFresnel::Reflectance(r) => list.push(*r),
                    }
                }
            }
            list
        }
        MaterialKind::CoatedConductor { .. } | MaterialKind::Coat { .. } => Vec::new(),
        MaterialKind::Mixture { components } => (components.iter())
            .flat_map(|c| [&[c.weight.param()], &c.albedo[..]].concat())
            .collect(),
        MaterialKind::Interface => Vec::new(),
    }
}

/// Alphas, if they are the same everywhere.
fn constant_alphas(roughness: &Roughness) -> Option<[f32; 2]> {
    match (roughness.u, roughness.v) {
        (Param::Constant([u, ..]), Param::Constant([v, ..])) => {
            Some([u, v].map(|x| raw_alpha(x, roughness.remap).min(1e3)))
        }
        _ => None,
    }
}

/// An alpha, kept in what `f32` evaluates well.
fn resolved(alpha: f32) -> f32 {
    alpha.clamp(SMOOTH_ALPHA, 1e3)
}

fn raw_alpha(roughness: f32, remap: Remap) -> f32 {
    match remap {
        Remap::None => roughness,
        Remap::V3 => {
            let x = roughness.max(1e-3).ln();
            1.62142
                + 0.819955 * x
                + 0.1734 * x * x
                + 0.0171201 * x.powi(3)
                + 0.000640711 * x.powi(4)
        }
        Remap::V4 => roughness.max(0.0).sqrt(),
    }
}

/// Trowbridge-Reitz alpha of a roughness, kept in what `f32` evaluates well.
fn alpha(roughness: f32, remap: Remap) -> f32 {
    let a = raw_alpha(roughness, remap);
    if a.is_nan() {
        1.0
    } else {
        a.clamp(SMOOTH_ALPHA, 1e3)
    }
}

/// The extinction with `eta = 1` whose reflectance at normal incidence is `r` (pbrt-v4, `ConductorMaterial`).
fn k_of_reflectance(r: f32) -> f32 {
    let r = r.clamp(0.0, 0.9999);
    2.0 * r.sqrt() / (1.0 - r).sqrt()
}
