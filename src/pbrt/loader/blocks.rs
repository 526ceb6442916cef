//! Transforms, blocks and files within files.

use glam::{DAffine3, DMat4, DVec3};

use super::{Loader, Section};
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::{SceneError, Site};
use crate::pbrt::state::Block;
use crate::pbrt::textures::NAME_BYTES;
use crate::pbrt::transform;

impl Loader {
    pub(super) fn transform(&mut self, name: &str, site: &Site) -> Result<(), SceneError> {
        let change = match name {
            "Identity" => {
                return self.states.current.change(site, |_| DMat4::IDENTITY);
            }
            "Translate" => DMat4::from_translation(DVec3::from(self.numbers::<3>(site)?)),
            "Scale" => DMat4::from_scale(DVec3::from(self.numbers::<3>(site)?)),
            "Rotate" => {
                let [degrees, x, y, z] = self.numbers(site)?;
                transform::rotate(degrees, DVec3::new(x, y, z))
                    .ok_or_else(|| site.error("its axis is zero; use for instance 0 0 1"))?
                    .into()
            }
            "LookAt" => self.look_at(site)?.into(),
            "Transform" | "ConcatTransform" => {
                let m = transform::from_numbers(&self.numbers(site)?);
                if name == "Transform" {
                    return self.states.current.change(site, |_| m);
                }
                m
            }
            "CoordinateSystem" => {
                let name = self.quoted(site, "a name")?;
                if !self.coordinate_systems.contains_key(&name) {
                    let bytes = NAME_BYTES
                        + (name.len() + 2 * size_of_val(&self.states.current.ctm)) as u64;
                    self.budget.take(bytes).map_err(|e| site.error(e))?;
                }
                self.coordinate_systems
                    .insert(name, self.states.current.ctm);
                return Ok(());
            }
            "CoordSysTransform" => {
                let name = self.quoted(site, "a name")?;
                match self.coordinate_systems.get(&name) {
                    Some(ctm) => self.states.current.ctm = *ctm,
                    None => self.report.warn_at(
                        site,
                        format_args!("ignored: there is no coordinate system named \"{name}\""),
                    ),
                }
                return Ok(());
            }
            "ActiveTransform" => {
                let token = self.argument(site, "StartTime, EndTime or All")?;
                self.states.current.active = match token.raw() {
                    "StartTime" => [true, false],
                    "EndTime" => [false, true],
                    "All" => [true, true],
                    _ => {
                        return Err(site.error(format_args!(
                            "expected StartTime, EndTime or All, found {}",
                            token.shown()
                        )));
                    }
                };
                return Ok(());
            }
            _ => {
                // TransformTimes: of no consequence while nothing moves.
                self.in_options(site)?;
                self.numbers::<2>(site)?;
                return Ok(());
            }
        };
        self.states.current.change(site, |ctm| ctm * change)
    }

    pub(super) fn look_at(&mut self, site: &Site) -> Result<DAffine3, SceneError> {
        let n: [f64; 9] = self.numbers(site)?;
        let v = |i: usize| DVec3::new(n[i], n[i + 1], n[i + 2]);
        if let Some(view) = transform::look_at(v(0), v(3), v(6)) {
            return Ok(view);
        }
        let parallel = v(0) != v(3) && v(6) != DVec3::ZERO;
        if self.dialect == Dialect::V3 && parallel {
            self.report.warn_at(
                site,
                "ignored: its up vector is along the view, which tells nothing of what is up",
            );
            return Ok(DAffine3::IDENTITY);
        }
        Err(site
            .error("the eye is the point looked at, or the up vector is zero or along the view"))
    }

    pub(super) fn begin(&mut self, block: Block, site: &Site) -> Result<(), SceneError> {
        if block != Block::Transform {
            self.in_world(site)?;
        }
        self.states.begin(block, self.dialect, site)
    }

    pub(super) fn end(&mut self, block: Block, site: &Site) -> Result<(), SceneError> {
        self.states.end(block, self.dialect, site, &mut self.report)
    }

    pub(super) fn include(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        let name = self.quoted(site, "a file name")?;
        let path = self.dir.join(&name);
        let import = (directive == "Import").then(|| site.pos.clone());
        if import.is_some() {
            self.begin(Block::Import, site)?;
        }
        if self.dialect == Dialect::V3 && !path.exists() {
            self.report.warn_at(
                site,
                format_args!("ignored: there is no file {}", path.display()),
            );
            return Ok(());
        }
        self.stream
            .include(&path, import)
            .map_err(|e| site.error(e))
    }

    pub(super) fn section(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        if directive == "WorldEnd" {
            self.in_world(site)?;
            match self.dialect {
                Dialect::V3 => self.section = Section::End,
                Dialect::V4 => self
                    .report
                    .warn_at(site, "pbrt-v4 scenes have no WorldEnd; ignored"),
            }
            return Ok(());
        }
        self.in_options(site)?;
        self.section = Section::World;
        self.states.current.ctm = [DMat4::IDENTITY; 2];
        self.states.current.active = [true; 2];
        self.coordinate_systems
            .insert("world".to_owned(), self.states.current.ctm);
        Ok(())
    }
}
