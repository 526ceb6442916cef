//! Objects and their instances.

use super::{Loader, Object};
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::{SceneError, Site};
use crate::pbrt::geometry::Geometry;
use crate::pbrt::state::Block;
use crate::pbrt::textures::NAME_BYTES;

impl Loader {
    pub(super) fn begin_object(&mut self, site: &Site) -> Result<(), SceneError> {
        let name = self.quoted(site, "a name")?;
        if let Some(open) = &self.open_object {
            let what = format!(
                "object \"{}\" is still open; objects do not nest",
                open.name
            );
            if self.dialect == Dialect::V4 {
                return Err(site.error(what));
            }
            self.report
                .warn_at(site, format_args!("{what}: it ends here"));
            self.close_object(site);
        }
        self.begin(Block::Object, site)?;
        let bytes = NAME_BYTES + 2 * name.len() as u64;
        self.budget.take(bytes).map_err(|e| site.error(e))?;
        self.open_object = Some(Object {
            name,
            geometry: Geometry::new(&self.budget),
            warned_of_light: false,
        });
        Ok(())
    }

    /// The object that is open can be placed from here on.
    pub(super) fn close_object(&mut self, site: &Site) {
        let Some(object) = self.open_object.take() else {
            return;
        };
        let number = self.placements.add_object(object.geometry);
        if self.objects.insert(object.name.clone(), number).is_some() {
            self.report.warn_at(
                site,
                format_args!("object \"{}\" replaces an earlier one", object.name),
            );
        }
    }

    pub(super) fn place_object(&mut self, site: &Site) -> Result<(), SceneError> {
        let name = self.quoted(site, "a name")?;
        let known = self.objects.get(&name);
        let what = match known {
            _ if self.open_object.is_some() => {
                "objects cannot hold instances; repeat the shapes".to_owned()
            }
            None => format!("there is no object named \"{name}\""),
            Some(&object) => {
                let place = self.states.current.fixed_ctm(site)?;
                let Some(by) = place.affine() else {
                    return Err(site.error(
                        "the current transform is projective; place the shapes themselves",
                    ));
                };
                let shapes = self.geometry.shapes.len();
                return self.placements.place(site, object, by, shapes);
            }
        };
        self.tolerate(site, &what)
    }

    pub(super) fn object(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        self.in_world(site)?;
        match directive {
            "ObjectBegin" => self.begin_object(site),
            "ObjectEnd" => {
                if self.dialect == Dialect::V3 && self.open_object.is_none() {
                    self.report
                        .warn_at(site, "there is no object that ends here");
                }
                self.end(Block::Object, site)?;
                self.close_object(site);
                Ok(())
            }
            _ => self.place_object(site),
        }
    }
}
