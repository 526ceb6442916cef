//! Materials as kernels see them: a kind and a parameter row each.

use super::bssrdf::Bssrdf;
use super::bump::{self, Perturbation, PerturbedFrame};
use super::mixture::{self, Chosen};
use super::packing::{At, Evaluate, Shared};
use super::table::{self, Kind};
use super::tabulated::Tabulated;
use super::texture::{self, Place};
use crate::geometry::Derivatives;
use crate::scene::{Bump, Image, Material, MaterialKind, Param, Scene, Texture};
use crate::simd::Row;
use glam::DVec3;

/// One material of the scene.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Of a mixture that of one of its components.
    pub kind: Kind,
    /// Its row, its shading normal, or the weights of its components depend on where it is hit.
    pub textured: bool,
    /// It needs a tangent.
    pub anisotropic: bool,
    /// Its index of refraction depends on the wavelength. Never of a mixture: one of its
    /// components' may.
    pub dispersive: bool,
    /// Its row depends on the place or on the wavelength.
    varies: bool,
    /// Its hits have rows of their own: the row or the shading normal differs from hit to hit.
    pub per_hit: bool,
    /// It has no row: one of its components is chosen per hit ([`MaterialTable::choose`]).
    pub mixture: bool,
    /// Light that it refracts comes out elsewhere ([`MaterialTable::bssrdf`]).
    pub subsurface: bool,
}

/// The materials of a scene, in the order of [`Scene::materials`].
pub struct MaterialTable<'a> {
    /// One a material.
    pub entries: Vec<Entry>,
    /// Parameter rows; those evaluated per hit are unused.
    pub rows: Vec<Row>,
    /// What rows of tabulated BSDFs name.
    pub tables: Tabulated,
    materials: &'a [Material],
    /// Length of a unit of the scene file.
    unit: f64,
    brightest: f32,
    textures: &'a [Texture],
    images: &'a [Image],
    /// What makes rows; `None` of mixtures, and of what is not in [`table`].
    evaluators: Vec<Option<Box<dyn Evaluate + 'a>>>,
    /// What is below each, where that is the same everywhere; `None` of most.
    bssrdfs: Vec<Option<Bssrdf>>,
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
    /// Borrows the scene; rows that are the same everywhere are made here.
    pub fn new(scene: &'a Scene) -> Self {
        let mut table = Self {
            entries: Vec::new(),
            rows: Vec::new(),
            tables: Tabulated::default(),
            materials: &scene.materials,
            unit: scene.space.scale,
            brightest: scene.brightest,
            textures: &scene.textures,
            images: &scene.images,
            evaluators: Vec::new(),
            bssrdfs: Vec::new(),
            looked_up: Vec::new(),
            uses_uv: false,
            uses_point: false,
            own_rows: false,
        };
        let mut shared = Shared::default();
        for Material { kind, bump, .. } in &scene.materials {
            let described = kind.description();
            let prepared = described.and_then(|d| table::prepare(&**d, &mut shared));
            // Never asked for without one: a component takes the mixture's place, and interfaces
            // are left out of the tracer.
            let (bsdf, evaluator) = prepared.map_or((Kind::Diffuse, None), |(k, e)| (k, Some(e)));
            table.evaluators.push(evaluator);
            let mut list = kind.params();
            let textured = list.iter().any(|p| matches!(p, Param::Texture(_)));
            let textured = textured || kind.is_fibre();
            table.uses_uv |= kind.is_fibre();
            let dispersive = kind.dispersion().is_some();
            let mut entry = Entry {
                kind: bsdf,
                textured: textured || bump.is_some(),
                anisotropic: kind.is_anisotropic(),
                dispersive,
                varies: textured || dispersive,
                per_hit: textured || bump.is_some() || dispersive,
                mixture: false,
                subsurface: kind.is_subsurface(),
            };
            let mut images = Vec::new();
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
            let below = kind
                .is_subsurface()
                .then(|| table.bssrdf_at(table.rows.len() - 1, &Place::default()));
            table.bssrdfs.push(below.flatten());
        }
        table.tables = shared.tabulated;
        table.own_rows = (table.entries.iter()).any(|e| e.per_hit || e.mixture);
        table
    }

    /// Has every row evaluated per hit, as those of textured materials are.
    pub fn evaluate_per_hit(&mut self) {
        for (entry, material) in self.entries.iter_mut().zip(self.materials) {
            entry.varies = !material.kind.params().is_empty();
            entry.per_hit = true;
        }
        self.uses_uv = true;
        self.uses_point = true;
    }

    /// Asks for the texels that [`Self::evaluate`] will read.
    pub fn prefetch_texels(&self, material: usize, place: &Place) {
        for &texture in &self.looked_up[material] {
            texture::prefetch_texels(self.textures, self.images, texture, place);
        }
    }

    /// The component of a mixture that the primary sample `u` chooses at a place.
    pub fn choose(&self, material: usize, place: &Place, u: f32) -> Chosen {
        let at = |p: Param| texture::evaluate(self.textures, self.images, p, place);
        mixture::choose(self.materials, material as u32, &at, self.brightest, u)
    }

    /// What a surface of this material can turn out to be: itself, or the components of a mixture,
    /// those of mixtures within it included.
    pub fn components(&self, material: usize) -> Vec<usize> {
        let mut found = vec![material];
        let mut next = 0;
        // Shared components are looked at once.
        while next < found.len() {
            for component in self.materials[found[next]].kind.components() {
                let below = component.material as usize;
                if !found.contains(&below) {
                    found.push(below);
                }
            }
            next += 1;
        }
        found.retain(|i| !self.entries[*i].mixture);
        found
    }

    /// Whether shading normals of a material are other than those of its surfaces; never of a
    /// mixture, but of its components.
    pub fn is_bumped(&self, material: usize) -> bool {
        self.materials[material].bump.is_some()
    }

    /// What the bump or normal map of a material says at a place with shading normal `ns`.
    pub fn perturbation(
        &self,
        material: usize,
        place: &Place,
        d: &Derivatives,
        ns: DVec3,
    ) -> Option<Perturbation> {
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
    pub fn perturb(
        &self,
        material: usize,
        perturbation: &Perturbation,
        d: &Derivatives,
        normals: [DVec3; 2],
    ) -> Option<PerturbedFrame> {
        let bump = self.materials[material].bump.as_ref()?;
        Some(bump::perturb(bump, perturbation, d, normals, self.unit))
    }

    /// The parameter row of a material at a place, for light of the wavelength `nm` (of which only
    /// dispersive materials know); zero of a mixture.
    pub fn evaluate(&self, material: usize, place: &Place, nm: f32) -> Row {
        if self.entries[material].varies {
            self.row(material, place, nm)
        } else {
            self.rows[material]
        }
    }

    /// What is below a surface at a place, in internal lengths; `None` of most materials.
    pub fn bssrdf(&self, material: usize, place: &Place) -> Option<Bssrdf> {
        match self.entries[material].varies {
            true => self.bssrdf_at(material, place),
            false => self.bssrdfs[material].clone(),
        }
    }

    /// [`Self::bssrdf`] of a material that has the same everywhere.
    pub fn even_bssrdf(&self, material: usize) -> Option<&Bssrdf> {
        self.bssrdfs[material].as_ref()
    }

    fn bssrdf_at(&self, material: usize, place: &Place) -> Option<Bssrdf> {
        let at = At::new(self.textures, self.images, place, 0.0, self.brightest);
        let below = self.evaluators[material].as_ref()?.bssrdf(&at)?;
        Some(below.scaled(self.unit))
    }

    fn row(&self, material: usize, place: &Place, nm: f32) -> Row {
        let at = At::new(self.textures, self.images, place, nm, self.brightest);
        let evaluator = self.evaluators[material].as_ref();
        Row(evaluator.map_or([0.0; 8], |e| e.row(&at)))
    }
}
