//! Lights and shapes.

use std::rc::Rc;

use super::Loader;
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::{SceneError, Site};
use crate::pbrt::geometry::{Geometry, Setting};
use crate::pbrt::lights::{self, AreaLight};
use crate::pbrt::shape::{self, Cut};
use crate::pbrt::tolerance::{knows_light, knows_shape};
use crate::scene::{Alpha, MaterialKind, NONE, Param};
use crate::surface::ThinDielectricMaterial;

impl Loader {
    /// Index of an alpha mask; shapes that follow each other mostly share one.
    pub(super) fn add_alpha(&mut self, alpha: Alpha) -> u32 {
        let alphas = &mut self.tables.alphas;
        if alphas.last() != Some(&alpha) {
            alphas.push(alpha);
        }
        alphas.len() as u32 - 1
    }

    pub(super) fn light(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        self.in_world(site)?;
        let (kind, set) = self.kind_and_params(site, "light")?;
        let area = directive == "AreaLightSource";
        let known = match directive {
            "AreaLightSource" => matches!(kind.as_str(), "area" | "diffuse"),
            _ => knows_light(&kind),
        };
        if self.dialect == Dialect::V3 && !known {
            self.report
                .warn_at(&set.site, "left out: there is no such light");
            if area {
                self.states.current.light = None;
            }
            return Ok(());
        }
        if area {
            let light = AreaLight::build(&kind, set, &mut self.tables, &mut self.report)?;
            self.states.current.light = Some(Rc::new(light));
            return Ok(());
        }
        let place = self.states.current.start_ctm(&set.site, &mut self.report);
        let ctm = place
            .frame()
            .ok_or_else(|| set.error("the current transform collapses space"))?;
        if let Some(light) = lights::build(&kind, &set, &ctm, &mut self.tables, &mut self.report)? {
            let room = self.budget.take(light.bytes());
            room.map_err(|e| set.error(e))?;
            self.lights.push(light);
            let [outside, _] = self.states.current.media;
            self.media.fill([outside, NONE], &Rc::new(set.site.clone()));
            self.light_media.push(outside);
        }
        Ok(())
    }

    pub(super) fn shape(&mut self, site: &Site) -> Result<(), SceneError> {
        self.in_world(site)?;
        let (kind, set) = self.kind_and_params(site, "shape")?;
        if self.dialect == Dialect::V3 && !knows_shape(&kind) {
            self.report
                .warn_at(&set.site, "left out: there is no such shape");
            return Ok(());
        }
        let place = self.states.current.fixed_ctm(&set.site)?;
        let mut material = self.material_for(&set)?;
        let mut light = self.states.current.light.clone().filter(|l| !l.is_black());
        let interface = self.tables.materials[material as usize].kind == MaterialKind::Interface;
        if light.is_some() && interface && self.dialect == Dialect::V4 {
            self.report.warn_at(
                &set.site,
                "its area light is ignored, as its material is \"interface\"",
            );
            light = None;
        }
        if let (Some(object), Some(_)) = (&mut self.open_object, &light) {
            light = None;
            if !object.warned_of_light {
                object.warned_of_light = true;
                self.report.warn_at(
                    &set.site,
                    "area lights in objects are ignored, as in pbrt; place the shape itself",
                );
            }
        }
        let cut = shape::alpha(&kind, &set, &self.states.current.textures)?;
        let (visible, alpha) = match cut {
            Cut::Nothing => (true, None),
            Cut::Partly(alpha) => (true, Some(alpha)),
            // It still shines.
            Cut::Everything => (light.is_some(), None),
        };
        if light.is_some() && cut == Cut::Everything {
            material = self.bare_material(MaterialKind::Interface)?;
        } else if light.is_some() && interface {
            // v3 lets rays through such a shape, yet not shadow rays: as a pane that does not
            // reflect.
            self.report.warn_at(
                &set.site,
                "emits although its material is \"none\": a ray that passes through it scatters once for \"maxdepth\"",
            );
            let pane = ThinDielectricMaterial {
                eta: Param::Constant([1.0; 3]),
                dispersion: None,
            };
            material = self.bare_material(pane.into())?;
        }
        let textures = self.tables.textures();
        let textured = |alpha: Alpha| {
            let mut values = [Some(alpha.value), alpha.shadow].into_iter().flatten();
            values.any(|value| value.uses_uv(textures))
        };
        let needs_uv = self.needs_uv[material as usize]
            || alpha.is_some_and(textured)
            || light.as_ref().is_some_and(|l| l.image.is_some());
        let setting = Setting {
            site: Rc::new(set.site.clone()),
            place,
            reverse: self.states.current.reverse,
            material,
            alpha: alpha.map_or(NONE, |a| self.add_alpha(a)),
            needs_uv,
            sees_tangents: self.sees_tangents(material),
            fibre: self.is_fibre(material),
            light,
            media: match (cut, self.states.current.media) {
                // No ray meets it.
                (Cut::Everything, [outside, _]) => [outside; 2],
                (_, media) => media,
            },
        };
        // What is invisible is checked, and left out.
        let mut nowhere = Geometry::new(&self.budget);
        let geometry = match &mut self.open_object {
            _ if !visible => &mut nowhere,
            Some(object) => &mut object.geometry,
            None => &mut self.geometry,
        };
        shape::build(&kind, &set, &setting, geometry, &mut self.report)?;
        set.finish(&mut self.report);
        Ok(())
    }
}
