//! Textures and materials.

use std::cell::Cell;
use std::rc::Rc;

use super::Loader;
use crate::pbrt::budget::Charge;
use crate::pbrt::built::{Built, MaterialDef, PartMaterial};
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::{SceneError, Site};
use crate::pbrt::params::ParamSet;
use crate::pbrt::state::CurrentMaterial;
use crate::pbrt::textures::{self, Class, NAME_BYTES};
use crate::pbrt::tolerance::{knows_material, makes_texture};
use crate::pbrt::{coats, materials};
use crate::scene::{Bump, Component, Material, MaterialKind};

/// Memory of a material in the scene's table, which grows by doubling, with the parts that a
/// mixture has.
const MATERIAL_BYTES: u64 = 2 * size_of::<Material>() as u64 + 4 * size_of::<Component>() as u64;

impl Loader {
    pub(super) fn texture(&mut self, site: &Site) -> Result<(), SceneError> {
        let name = self.quoted(site, "a name")?;
        let class = self.quoted(site, "a type, \"float\" or \"spectrum\"")?;
        let (kind, set) = self.kind_and_params(site, "texture")?;
        let class = match class.as_str() {
            "float" => Class::Float,
            "spectrum" | "color" => Class::Color,
            other => {
                let what = format!("texture type \"{other}\" is unknown; use float or spectrum");
                return self.tolerate(site, &what);
            }
        };
        if self.dialect == Dialect::V3 && !makes_texture(&kind, class == Class::Float) {
            let what = format_args!("left out: pbrt-v3 has no such texture; it is undefined");
            self.report.warn_at(&set.site, what);
            return Ok(());
        }
        let place = self.states.current.start_ctm(&set.site, &mut self.report);
        let ctm = place.affine().copied().ok_or_else(|| {
            set.error("the current transform is projective, which no texture in space can be")
        });
        let names = &mut self.states.current.textures;
        let built = textures::build(
            &kind,
            class,
            &set,
            &ctm,
            names,
            &mut self.tables,
            &mut self.report,
        );
        let known = names.insert(name.clone(), class, built, &self.budget);
        if known.map_err(|e| set.error(e))? {
            self.report.warn_at(
                &set.site,
                format_args!("texture \"{name}\" replaces an earlier one"),
            );
        }
        Ok(())
    }

    pub(super) fn material(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        match directive {
            "NamedMaterial" => {
                let name = self.quoted(site, "a name")?;
                // v3 looks for it now, v4 where a shape needs it.
                self.states.current.material = match self.dialect {
                    Dialect::V4 => CurrentMaterial::Named(Rc::new(site.clone()), name.into()),
                    Dialect::V3 => match self.states.current.named_materials.get(&name) {
                        Some(made) => CurrentMaterial::Made(Rc::clone(made)),
                        None => {
                            let what = format_args!(
                                "ignored: there is no material named \"{name}\" yet; the one before stays"
                            );
                            self.report.warn_at(site, what);
                            return Ok(());
                        }
                    },
                };
            }
            "Material" => {
                let (kind, set) = self.kind_and_params(site, "material")?;
                let name = kind.clone();
                let made = self.make_material(name, kind, set)?;
                self.states.current.material = CurrentMaterial::Made(made);
            }
            _ => {
                let (name, mut set) = self.kind_and_params(site, "material")?;
                let kind = match set.string("type")?.map(str::to_owned) {
                    Some(kind) => kind,
                    None if self.dialect == Dialect::V3 => {
                        let what = "has no \"string type\": rays pass through, as of \"none\"";
                        self.report.warn_at(&set.site, what);
                        String::new()
                    }
                    None => return Err(set.error("needs a \"string type\"")),
                };
                let label = format!("{} of type \"{kind}\"", set.site.label);
                set.site = Site::new(set.site.pos, label);
                let made = self.make_material(name.clone(), kind, set)?;
                let names = &mut self.states.current.named_materials;
                let known = names.contains_key(&name);
                names.insert_mut(name.clone(), made);
                if known {
                    self.report.warn_at(
                        site,
                        format_args!("material \"{name}\" replaces an earlier one"),
                    );
                }
            }
        }
        Ok(())
    }

    pub(super) fn make_material(
        &mut self,
        name: String,
        mut kind: String,
        set: ParamSet,
    ) -> Result<Rc<MaterialDef>, SceneError> {
        if self.dialect == Dialect::V3 && !knows_material(&kind) {
            self.report.warn_at(
                &set.site,
                format_args!("material \"{kind}\" is unknown: \"matte\" is used"),
            );
            kind = "matte".to_owned();
        }
        let built = self.build_material(&kind, &set);
        let own = match &built {
            Ok((built, _)) => built.bytes(),
            Err(error) => error.0.len(),
        };
        let texts = 2 * name.len() + kind.len() + set.site.label.len() + own;
        let bytes = NAME_BYTES + (size_of::<MaterialDef>() + texts) as u64;
        let room = Charge::of(&self.budget, bytes).map_err(|e| set.error(e))?;
        if built.is_ok() {
            set.finish(&mut self.report);
        }
        let failed = built.is_err();
        let made = Rc::new(MaterialDef {
            name,
            kind,
            set,
            built,
            index: Cell::new(None),
            used: Cell::new(false),
            _room: room,
        });
        if failed {
            self.failed_materials.push(Rc::clone(&made));
        }
        Ok(made)
    }

    pub(super) fn build_material(
        &mut self,
        kind: &str,
        set: &ParamSet,
    ) -> Result<(Built, Option<Bump>), SceneError> {
        let state = &self.states.current;
        let names = &state.textures;
        let built = materials::build(kind, set, names, &state.named_materials)?;
        if let Some(site) = coats::undispersed(kind, set)? {
            self.report.warn_at(
                &site,
                "coats do not disperse light: its index of refraction is that of 587.6 nm throughout",
            );
        }
        let bump = match built.first_named() {
            None => materials::bump(kind, set, names, &mut self.tables, &mut self.report)?,
            // v3 adds the lobes of the second material to the BSDF of the first, which has the
            // frame (`MixMaterial`).
            Some(first) if set.dialect == Dialect::V3 => {
                (first.built.as_ref().ok()).and_then(|(_, bump)| *bump)
            }
            // v4 chooses a material, and shades as that one does.
            Some(_) => None,
        };
        Ok((built, bump))
    }

    /// Index of the current material for a shape with these parameters.
    pub(super) fn material_for(&mut self, shape: &ParamSet) -> Result<u32, SceneError> {
        let made = match &self.states.current.material {
            CurrentMaterial::Default => {
                if let (Some(index), false) = (self.default_material, materials::overrides(shape)) {
                    return Ok(index);
                }
                let kind = if self.dialect == Dialect::V3 {
                    "matte"
                } else {
                    "diffuse"
                };
                let set = ParamSet::empty(shape.site.clone(), self.dialect, Rc::clone(&self.dir));
                let made = self.make_material("default".to_owned(), kind.to_owned(), set)?;
                if !(self.dialect == Dialect::V3 && materials::overrides(shape)) {
                    let index = self.add_material(&made, &made.built.clone()?)?;
                    self.default_material = Some(index);
                    return Ok(index);
                }
                made
            }
            CurrentMaterial::Made(made) => Rc::clone(made),
            CurrentMaterial::Named(site, name) => {
                match self.states.current.named_materials.get(&**name) {
                    Some(made) => Rc::clone(made),
                    None => {
                        return Err(site.error(format_args!(
                            "there is no material named \"{name}\"; make it with MakeNamedMaterial"
                        )));
                    }
                }
            }
        };
        made.used.set(true);
        if self.dialect == Dialect::V3 && materials::overrides(shape) {
            let built = self.build_material(&made.kind, &shape.over(&made.set))?;
            if made.built.as_ref() != Ok(&built) {
                return self.add_material(&made, &built);
            }
        }
        self.material_index(&made)
    }

    /// The place of a material in the scene's table, which it takes when it is first asked for.
    pub(super) fn material_index(&mut self, made: &MaterialDef) -> Result<u32, SceneError> {
        if let Some(index) = made.index.get() {
            return Ok(index);
        }
        made.used.set(true);
        let index = self.add_material(made, &made.built.clone()?)?;
        made.index.set(Some(index));
        Ok(index)
    }

    /// A material of emissive shapes alone: what rays pass straight through, yet meet, or what they
    /// do not meet.
    pub(super) fn bare_material(&mut self, kind: MaterialKind) -> Result<u32, SceneError> {
        let known = self.bare_materials.iter().find(|(k, _)| *k == kind);
        if let Some(&(_, index)) = known {
            return Ok(index);
        }
        let index = self.push_material(Material {
            name: "none".to_owned(),
            origin: "emissive shapes".to_owned(),
            kind: kind.clone(),
            bump: None,
        })?;
        self.bare_materials.push((kind, index));
        Ok(index)
    }

    /// Appends a material to the scene's table, after its components, so that the table has no
    /// cycles.
    pub(super) fn add_material(
        &mut self,
        made: &MaterialDef,
        (built, bump): &(Built, Option<Bump>),
    ) -> Result<u32, SceneError> {
        let material = |kind, bump| Material {
            name: made.name.clone(),
            origin: made.set.site.origin(),
            kind,
            bump,
        };
        let parts = match built {
            Built::One(kind) => {
                return self.push_material(material(kind.clone(), *bump));
            }
            Built::Mixture(parts) => parts,
        };
        let components = parts.iter().map(|part| {
            let index = match &part.material {
                PartMaterial::Own(kind) => self.push_material(material(kind.clone(), *bump))?,
                PartMaterial::Named(named) => match &named.built {
                    // All of v3's mixture is in one shading frame.
                    Ok((built, own)) if self.dialect == Dialect::V3 && own != bump => {
                        named.used.set(true);
                        self.add_material(named, &(built.clone(), *bump))?
                    }
                    _ => self.material_index(named)?,
                },
            };
            let below = &self.tables.materials[index as usize].kind;
            if below.is_subsurface() {
                return Err(made.set.error(
                    "subsurface scattering is not supported within a mixture; use the material alone",
                ));
            }
            Ok(Component {
                material: index,
                weight: part.weight,
                albedo: part.albedo.clone(),
            })
        });
        let components = components.collect::<Result<_, SceneError>>()?;
        self.push_material(material(MaterialKind::Mixture { components }, None))
    }

    pub(super) fn push_material(&mut self, material: Material) -> Result<u32, SceneError> {
        let own = material.name.len() + material.origin.len() + material.kind.bytes();
        let bytes = MATERIAL_BYTES + own as u64;
        let room = self.budget.take(bytes);
        room.map_err(|e| {
            SceneError::plain(format_args!(
                "{}: material \"{}\": {e}",
                material.origin, material.name
            ))
        })?;
        let below = |i: u32| self.needs_uv[i as usize];
        let needs_uv = material.kind.needs_uv(self.tables.textures(), &below);
        self.needs_uv.push(needs_uv || material.bump.is_some());
        self.tables.materials.push(material);
        Ok(self.tables.materials.len() as u32 - 1)
    }

    /// Whether it is a fibre, or some of its components are.
    pub(super) fn is_fibre(&self, material: u32) -> bool {
        let kind = &self.tables.materials[material as usize].kind;
        let mut below = kind.components().iter().map(|c| c.material);
        kind.is_fibre() || below.any(|part| self.is_fibre(part))
    }

    /// Whether turning the tangents of a surface around its normal changes what it looks like.
    pub(super) fn sees_tangents(&self, material: u32) -> bool {
        let made = &self.tables.materials[material as usize];
        let below = || made.kind.components().iter().map(|c| c.material);
        made.bump.is_some()
            || made.kind.is_anisotropic()
            || below().any(|part| self.sees_tangents(part))
    }
}
