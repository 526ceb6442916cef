//! Media: what they are, and what is filled with them.

use std::rc::Rc;

use super::Loader;
use crate::pbrt::dialect::Dialect;
use crate::pbrt::error::{SceneError, Site};
use crate::pbrt::lexer::TokenKind;
use crate::pbrt::media::WorldMedium;
use crate::scene::NONE;

impl Loader {
    pub(super) fn medium(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        if directive == "MakeNamedMedium" {
            return self.make_medium(site);
        }
        let inside = self.quoted(site, "a name")?;
        // Of one name alone, it is that of both.
        let mut outside = inside.clone();
        if self
            .stream
            .peek()?
            .is_some_and(|t| t.kind == TokenKind::Quoted)
        {
            outside = self.quoted(site, "a name")?;
        }
        let mut names = [inside, outside];
        if self.dialect == Dialect::V3 {
            let mut told = String::new();
            for name in &mut names {
                if name.is_empty() || self.media.has(name) {
                    continue;
                }
                if told != *name {
                    self.report.warn_at(
                        site,
                        format_args!("there is no medium named \"{name}\": none is used"),
                    );
                }
                told = std::mem::take(name);
            }
        }
        let [inside, outside] = names.map(|name| self.media.number(&name));
        self.states.current.media = [outside, inside];
        Ok(())
    }

    /// The medium that the camera is in. That of v3 is the one in force at the end, as its camera
    /// is made there.
    pub(in crate::pbrt) fn camera_medium(&mut self) -> u32 {
        let current = self.states.current.media;
        let (site, [outside, _]) = match &self.view.camera {
            Some(camera) if self.dialect == Dialect::V4 => (camera.set.site.clone(), camera.media),
            Some(camera) => (camera.set.site.clone(), current),
            None => return NONE,
        };
        self.media.fill([outside, NONE], &Rc::new(site));
        outside
    }

    fn make_medium(&mut self, site: &Site) -> Result<(), SceneError> {
        let name = self.quoted(site, "a name")?;
        let label = format!("{} \"{name}\"", site.label);
        let mut set = self.params(Site::new(site.pos.clone(), label))?;
        if let Some(defaults) = self.states.current.attributes.get("medium") {
            set.add_defaults(defaults)?;
        }
        if self.dialect == Dialect::V4 && self.media.is_made(&name) {
            return Err(set.error("is made for the second time"));
        }
        let place = self.states.current.start_ctm(&set.site, &mut self.report);
        let made = match place.frame() {
            Some(ctm) => WorldMedium::read(&name, &set, &ctm, &self.budget),
            None => Err(set.error("the current transform collapses space")),
        };
        if let Ok(medium) = &made {
            let room = self.budget.take(medium.bytes());
            room.map_err(|e| set.error(e))?;
        }
        set.finish(&mut self.report);
        if let (Err(error), Dialect::V3) = (&made, self.dialect) {
            // pbrt-v3 leaves out what it cannot make.
            self.report.warn(error.to_string());
            return Ok(());
        }
        self.media.make(&name, made, self.dialect);
        Ok(())
    }
}
