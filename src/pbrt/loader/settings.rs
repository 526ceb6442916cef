//! What is rendered how.

use std::rc::Rc;

use glam::DAffine3;

use super::{Loader, Pending};
use crate::pbrt::color_space::ColorSpace;
use crate::pbrt::error::{SceneError, Site};
use crate::pbrt::lexer::TokenKind;
use crate::pbrt::transform::Place;
use crate::pbrt::{options, transform};

impl Loader {
    pub(super) fn option(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        self.in_options(site)?;
        let (kind, set) = self.kind_and_params(site, "option")?;
        let mut ctm = DAffine3::IDENTITY;
        if directive == "Camera" {
            let collapsed =
                || set.error("the current transform collapses space, so there is no view of it");
            let place = self.states.current.fixed_ctm(&set.site)?;
            let to_world = match place {
                Place::Affine(t) => transform::inverse(&t).ok_or_else(collapsed)?.into(),
                Place::Projective(m) => m.inverse(),
            };
            ctm = match place {
                Place::Affine(t) => t,
                Place::Projective(_) => {
                    let view = Place::of(&to_world).frame();
                    view.and_then(|t| transform::inverse(&t))
                        .ok_or_else(collapsed)?
                }
            };
            self.coordinate_systems
                .insert("camera".to_owned(), [to_world; 2]);
        }
        let media = self.states.current.media;
        let pending = Some(Pending {
            kind,
            set,
            ctm,
            media,
        });
        match directive {
            "Camera" => self.view.camera = pending,
            "Film" => self.view.film = pending,
            "Sampler" => self.view.sampler = pending,
            "PixelFilter" => self.view.filter = pending,
            "Integrator" => self.view.integrator = pending,
            // How rays are traced is our own affair.
            _ => {}
        }
        Ok(())
    }

    pub(super) fn v4_setting(&mut self, directive: &str, site: &Site) -> Result<(), SceneError> {
        match directive {
            "ColorSpace" => {
                let name = self.quoted(site, "a name")?;
                let Some(space) = ColorSpace::parse(&name) else {
                    self.report.warn_at(
                        site,
                        format_args!(
                            "ignored: \"{name}\" is unknown; use srgb, dci-p3, rec2020 or aces2065-1"
                        ),
                    );
                    return Ok(());
                };
                self.states.current.color_space = space;
                Ok(())
            }
            "Option" => self.global_option(site),
            _ => {
                let (target, mut set) = self.kind_and_params(site, "")?;
                if !["shape", "light", "material", "medium", "texture"].contains(&target.as_str()) {
                    return Err(site.error(format_args!(
                        "\"{target}\" is unknown; use shape, light, material, medium or texture"
                    )));
                }
                let attributes = Rc::make_mut(&mut self.states.current.attributes);
                if let Some(earlier) = attributes.get(&target) {
                    set.add_defaults(earlier)?;
                }
                attributes.insert(target, set);
                Ok(())
            }
        }
    }

    /// `Option "name" value`; also `"type name"`, and with brackets.
    pub(super) fn global_option(&mut self, site: &Site) -> Result<(), SceneError> {
        let name = self.quoted(site, "the name of an option")?;
        let mut token = self.argument(site, "the value of an option")?;
        if token.kind == TokenKind::Open {
            token = self.argument(site, "the value of an option")?;
            let close = self.argument(site, "']'")?;
            if close.kind != TokenKind::Close {
                return Err(site.error(format_args!("expected ']', found {}", close.shown())));
            }
        }
        let seed = options::set(&name, &token, site, &mut self.report)?;
        self.seed = seed.or(self.seed);
        Ok(())
    }
}
