//! The state of a scene that is being read, and how directives read their arguments. Each group of
//! directives has a file of its own here.

mod blocks;
mod materials;
mod media;
mod objects;
mod run;
mod settings;
mod shapes;

use std::collections::HashMap;
use std::rc::Rc;

use glam::{DAffine3, DMat4};

use super::built::MaterialDef;
use super::dialect::Dialect;
use super::error::{Report, SceneError, Site};
use super::folder::Folder;
use super::geometry::Geometry;
use super::instances::Placements;
use super::lexer::{Token, TokenKind};
use super::lights::WorldLight;
use super::media::Media;
use super::params::ParamSet;
use super::state::StateStack;
use super::stream::TokenStream;
use super::textures::Tables;
use crate::pbrt::budget::Budget;
use crate::scene::MaterialKind;

/// A directive whose meaning depends on others that may follow it.
#[derive(Debug)]
pub(super) struct Pending {
    pub kind: String,
    pub set: ParamSet,
    pub ctm: DAffine3,
    /// The media in force, `[outside, inside]`.
    pub media: [u32; 2],
}

/// The directives of which the last one counts.
#[derive(Debug, Default)]
pub(super) struct View {
    pub camera: Option<Pending>,
    pub film: Option<Pending>,
    pub filter: Option<Pending>,
    pub sampler: Option<Pending>,
    pub integrator: Option<Pending>,
}

#[derive(Debug)]
struct Object {
    name: String,
    geometry: Geometry,
    warned_of_light: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Section {
    Options,
    World,
    End,
}

#[derive(Debug)]
pub(super) struct Loader {
    pub(super) stream: TokenStream,
    pub dialect: Dialect,
    pub dir: Rc<Folder>,
    states: StateStack,
    pub(super) section: Section,
    coordinate_systems: HashMap<String, [DMat4; 2]>,
    pub media: Media,
    /// Numbers of objects by name.
    objects: HashMap<String, u32>,
    pub placements: Placements,
    open_object: Option<Object>,
    default_material: Option<u32>,
    bare_materials: Vec<(MaterialKind, u32)>,
    /// Of each material in the table, whether it depends on texture coordinates.
    needs_uv: Vec<bool>,
    /// Materials that could not be made, to be mentioned if nothing ever uses them.
    failed_materials: Vec<Rc<MaterialDef>>,
    pub view: View,
    pub geometry: Geometry,
    pub lights: Vec<WorldLight>,
    /// Number of the medium that each of them is in.
    pub light_media: Vec<u32>,
    pub tables: Tables,
    pub report: Report,
    /// Of the random numbers, by `Option`.
    pub seed: Option<u64>,
    budget: Rc<Budget>,
}

impl Loader {
    pub fn new(stream: TokenStream, dialect: Dialect, dir: Rc<Folder>, budget: Rc<Budget>) -> Self {
        Self {
            stream,
            dialect,
            dir,
            states: StateStack::new(),
            section: Section::Options,
            coordinate_systems: HashMap::new(),
            media: Media::default(),
            objects: HashMap::new(),
            placements: Placements::new(&budget),
            open_object: None,
            default_material: None,
            bare_materials: Vec::new(),
            needs_uv: Vec::new(),
            failed_materials: Vec::new(),
            view: View::default(),
            geometry: Geometry::new(&budget),
            lights: Vec::new(),
            light_media: Vec::new(),
            tables: Tables::new(Rc::clone(&budget)),
            report: Report::default(),
            seed: None,
            budget,
        }
    }

    fn argument(&mut self, site: &Site, what: &str) -> Result<Token, SceneError> {
        match self.stream.next_token()? {
            Some(token) => Ok(token),
            None => Err(site.error(format_args!("the file ends where {what} was expected"))),
        }
    }

    fn quoted(&mut self, site: &Site, what: &str) -> Result<String, SceneError> {
        let token = self.argument(site, what)?;
        if token.kind != TokenKind::Quoted {
            let site = Site::new(token.pos(), &site.label);
            return Err(site.error(format_args!(
                "expected {what} in quotes, found {}",
                token.shown()
            )));
        }
        Ok(token.text().into_owned())
    }

    /// `N` numbers, with or without brackets.
    fn numbers<const N: usize>(&mut self, site: &Site) -> Result<[f64; N], SceneError> {
        let bracketed = self
            .stream
            .peek()?
            .is_some_and(|t| t.kind == TokenKind::Open);
        if bracketed {
            self.stream.next_token()?;
        }
        let mut out = [0.0; N];
        for x in &mut out {
            let token = self.argument(site, "a number")?;
            *x = token.number().map_err(|_| {
                let site = Site::new(token.pos(), &site.label);
                site.error(format_args!(
                    "expected {N} numbers, found {}",
                    token.shown()
                ))
            })?;
        }
        if bracketed {
            let token = self.argument(site, "']'")?;
            if token.kind != TokenKind::Close {
                let site = Site::new(token.pos(), &site.label);
                return Err(site.error(format_args!(
                    "expected ']' after {N} numbers, found {}",
                    token.shown()
                )));
            }
        }
        Ok(out)
    }

    fn params(&mut self, site: Site) -> Result<ParamSet, SceneError> {
        let color_space = self.states.current.color_space;
        ParamSet::read(
            &mut self.stream,
            site,
            self.dialect,
            Rc::clone(&self.dir),
            color_space,
            &mut self.report,
        )
    }

    /// `"kind"` and its parameters, with the defaults that `Attribute` set for `target`.
    fn kind_and_params(
        &mut self,
        site: &Site,
        target: &str,
    ) -> Result<(String, ParamSet), SceneError> {
        let kind = self.quoted(site, "a type")?;
        let mut set = self.params(Site::new(
            site.pos.clone(),
            format!("{} \"{kind}\"", site.label),
        ))?;
        if let Some(defaults) = self.states.current.attributes.get(target) {
            set.add_defaults(defaults)?;
        }
        Ok((kind, set))
    }

    /// An error in v4; v3 ignores the directive.
    fn tolerate(&mut self, site: &Site, what: &str) -> Result<(), SceneError> {
        if self.dialect == Dialect::V4 {
            return Err(site.error(what));
        }
        self.report.warn_at(site, format_args!("ignored: {what}"));
        Ok(())
    }

    fn in_world(&self, site: &Site) -> Result<(), SceneError> {
        match self.section {
            Section::Options => Err(site.error("belongs after WorldBegin")),
            _ => Ok(()),
        }
    }

    fn in_options(&self, site: &Site) -> Result<(), SceneError> {
        match self.section {
            Section::Options => Ok(()),
            _ => Err(site.error("belongs before WorldBegin")),
        }
    }
}
