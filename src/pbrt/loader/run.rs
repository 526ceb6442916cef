//! From directive to directive.

use super::{Loader, Section};
use crate::pbrt::error::{SceneError, Site};
use crate::pbrt::lexer::{Token, TokenKind};
use crate::pbrt::state::Block;
use crate::pbrt::stream::Item;

impl Loader {
    /// Interprets the whole scene.
    pub(in crate::pbrt) fn run(&mut self, start: &Site) -> Result<(), SceneError> {
        while let Some(item) = self.stream.next()? {
            match item {
                Item::ImportEnd(pos) => self.end(Block::Import, &Site::new(pos, "Import"))?,
                Item::Token(token) if token.kind != TokenKind::Word => {
                    return Err(token.pos().error(format_args!(
                        "expected a directive, found {}",
                        token.shown()
                    )));
                }
                Item::Token(token) => {
                    if self.section == Section::End {
                        let site = Site::new(token.pos(), token.raw());
                        self.report.warn_at(
                            &site,
                            "what follows WorldEnd is ignored; a file holds one picture",
                        );
                        break;
                    }
                    self.directive(&token)?;
                }
            }
        }
        if let Some(open) = self.states.open_block() {
            self.report.warn_at(&open, "has no end");
        }
        if self.section == Section::Options {
            return Err(start.error("the scene has no WorldBegin"));
        }
        for material in std::mem::take(&mut self.failed_materials) {
            if let (Err(error), false) = (&material.built, material.used.get()) {
                self.report.warn(format!("{error} (not used by any shape)"));
            }
        }
        Ok(())
    }

    pub(super) fn directive(&mut self, token: &Token) -> Result<(), SceneError> {
        let name = token.raw();
        let site = Site::new(token.pos(), name);
        if self.skip_misplaced(name, &site)? {
            return Ok(());
        }
        match name {
            "Identity" | "Translate" | "Scale" | "Rotate" | "LookAt" | "Transform"
            | "ConcatTransform" | "CoordinateSystem" | "CoordSysTransform" | "ActiveTransform"
            | "TransformTimes" => self.transform(name, &site),
            "ReverseOrientation" => {
                self.in_world(&site)?;
                self.states.current.reverse = !self.states.current.reverse;
                Ok(())
            }
            "AttributeBegin" => self.begin(Block::Attribute, &site),
            "AttributeEnd" => self.end(Block::Attribute, &site),
            "TransformBegin" => self.begin(Block::Transform, &site),
            "TransformEnd" => self.end(Block::Transform, &site),
            "ObjectBegin" | "ObjectEnd" | "ObjectInstance" => self.object(name, &site),
            "Include" | "Import" => self.include(name, &site),
            "WorldBegin" | "WorldEnd" => self.section(name, &site),
            "Camera" | "Film" | "Sampler" | "PixelFilter" | "Integrator" | "Accelerator" => {
                self.option(name, &site)
            }
            "Material" | "MakeNamedMaterial" | "NamedMaterial" => self.material(name, &site),
            "Texture" => self.texture(&site),
            "LightSource" | "AreaLightSource" => self.light(name, &site),
            "Shape" => self.shape(&site),
            "ColorSpace" | "Option" | "Attribute" => self.v4_setting(name, &site),
            "MakeNamedMedium" | "MediumInterface" => self.medium(name, &site),
            "SurfaceIntegrator" | "VolumeIntegrator" | "Volume" | "Renderer" => {
                Err(site.error("is pbrt-v2; use a scene of pbrt-v3 or pbrt-v4"))
            }
            _ => {
                let shown = token.shown();
                Err(site.pos.error(format_args!(
                    "unknown directive {shown}; expected one of pbrt-v3 or pbrt-v4"
                )))
            }
        }
    }
}
