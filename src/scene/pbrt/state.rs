//! The graphics state: what directives set and later directives use.

use std::cell::Cell;
use std::collections::HashMap;
use std::rc::Rc;

use glam::DAffine3;
use rpds::HashTrieMap;

use super::color::ColorSpace;
use super::dialect::Dialect;
use super::error::{Pos, SceneError, Site};
use super::lights::AreaLight;
use super::materials::Built;
use super::params::ParamSet;
use super::textures::{Deferred, TextureNames};
use crate::scene::Bump;
use crate::scene::budget::Charge;

/// Blocks open at once; no scene needs a hundredth of it.
const MAX_DEPTH: usize = 1 << 14;

/// A material as it was made. It enters the scene's table when a shape first uses it.
#[derive(Debug)]
pub(super) struct MaterialDef {
    /// Its name, or its type if it has none.
    pub name: String,
    pub kind: String,
    pub set: ParamSet,
    pub built: Deferred<(Built, Option<Bump>)>,
    pub index: Cell<Option<u32>>,
    pub used: Cell<bool>,
    pub _room: Charge,
}

/// By name, as a mixture finds its components. Copies share what they have in common: every block saves one.
pub(super) type MaterialNames = HashTrieMap<String, Rc<MaterialDef>>;

#[derive(Clone, Debug)]
pub(super) enum CurrentMaterial {
    /// None was ever set.
    Default,
    Made(Rc<MaterialDef>),
    Named(Rc<Site>, Rc<str>),
}

/// Everything `AttributeBegin` saves. What can be large shares its parts with its copies.
#[derive(Clone, Debug)]
pub(super) struct State {
    /// Current transform at the start and at the end of the shutter.
    pub ctm: [DAffine3; 2],
    /// Which of the two `ActiveTransform` lets transforms change.
    pub active: [bool; 2],
    pub reverse: bool,
    pub material: CurrentMaterial,
    pub light: Option<Rc<AreaLight>>,
    pub color_space: ColorSpace,
    pub textures: TextureNames,
    pub named_materials: MaterialNames,
    /// v4's `Attribute`: parameters added to later directives, by target.
    pub attributes: Rc<HashMap<String, ParamSet>>,
}

impl State {
    fn new() -> Self {
        Self {
            ctm: [DAffine3::IDENTITY; 2],
            active: [true; 2],
            reverse: false,
            material: CurrentMaterial::Default,
            light: None,
            color_space: ColorSpace::default(),
            textures: TextureNames::default(),
            named_materials: MaterialNames::default(),
            attributes: Rc::default(),
        }
    }

    /// Applies `f` to the active transforms.
    pub fn change(
        &mut self,
        site: &Site,
        f: impl Fn(DAffine3) -> DAffine3,
    ) -> Result<(), SceneError> {
        for (ctm, active) in self.ctm.iter_mut().zip(self.active) {
            if active {
                *ctm = f(*ctm);
                if !super::transform::is_finite(ctm) {
                    return Err(site.error("the current transform overflows"));
                }
            }
        }
        Ok(())
    }

    /// The current transform of something that must not move.
    pub fn fixed_ctm(&self, site: &Site) -> Result<DAffine3, SceneError> {
        if self.ctm[0] != self.ctm[1] {
            return Err(site.error(
                "motion blur is not supported; use the same transform for StartTime and EndTime of ActiveTransform",
            ));
        }
        Ok(self.ctm[0])
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Block {
    Attribute,
    Transform,
    Object,
    Import,
}

impl Block {
    fn begin(self) -> &'static str {
        match self {
            Self::Attribute => "AttributeBegin",
            Self::Transform => "TransformBegin",
            Self::Object => "ObjectBegin",
            Self::Import => "Import",
        }
    }
}

#[derive(Debug)]
struct Saved {
    block: Block,
    pos: Pos,
    state: State,
}

/// The current state and those that blocks saved.
#[derive(Debug)]
pub(super) struct StateStack {
    pub current: State,
    saved: Vec<Saved>,
}

impl StateStack {
    pub fn new() -> Self {
        Self {
            current: State::new(),
            saved: Vec::new(),
        }
    }

    pub fn begin(&mut self, block: Block, site: &Site) -> Result<(), SceneError> {
        if self.saved.len() >= MAX_DEPTH {
            return Err(site.error(format_args!("more than {MAX_DEPTH} blocks are open")));
        }
        self.saved.push(Saved {
            block,
            pos: site.pos.clone(),
            state: self.current.clone(),
        });
        Ok(())
    }

    pub fn end(&mut self, block: Block, dialect: Dialect, site: &Site) -> Result<(), SceneError> {
        match self.saved.pop() {
            Some(saved) if saved.block == block => {
                let inner = std::mem::replace(&mut self.current, saved.state);
                if block == Block::Transform {
                    self.current = State {
                        ctm: self.current.ctm,
                        active: self.current.active,
                        ..inner
                    };
                } else if dialect == Dialect::V4 {
                    // Names are global in v4; v3 forgets them at the end of the block.
                    self.current.textures = inner.textures;
                    self.current.named_materials = inner.named_materials;
                }
                Ok(())
            }
            Some(saved) => Err(site.error(format_args!(
                "closes the {} of {} instead",
                saved.block.begin(),
                saved.pos
            ))),
            None => Err(site.error(format_args!("there is no {} for it", block.begin()))),
        }
    }

    /// Where the innermost open block begins.
    pub fn open_block(&self) -> Option<Site> {
        self.saved
            .last()
            .map(|s| Site::new(s.pos.clone(), s.block.begin()))
    }
}
