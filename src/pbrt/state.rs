//! The graphics state: what directives set and later directives use.

use std::collections::HashMap;
use std::rc::Rc;

use glam::DMat4;

use super::built::{MaterialDef, MaterialNames};
use super::color_space::ColorSpace;
use super::dialect::Dialect;
use super::error::{Pos, Report, SceneError, Site};
use super::lights::AreaLight;
use super::params::ParamSet;
use super::textures::TextureNames;
use super::transform::Place;
use crate::scene::NONE;

/// Blocks open at once; no scene needs a hundredth of it.
const MAX_DEPTH: usize = 1 << 14;

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
    pub ctm: [DMat4; 2],
    /// Which of the two `ActiveTransform` lets transforms change.
    pub active: [bool; 2],
    pub reverse: bool,
    pub material: CurrentMaterial,
    pub light: Option<Rc<AreaLight>>,
    /// Numbers of media, `[outside, inside]`.
    pub media: [u32; 2],
    pub color_space: ColorSpace,
    pub textures: TextureNames,
    pub named_materials: MaterialNames,
    /// v4's `Attribute`: parameters added to later directives, by target.
    pub attributes: Rc<HashMap<String, ParamSet>>,
}

impl State {
    fn new() -> Self {
        Self {
            ctm: [DMat4::IDENTITY; 2],
            active: [true; 2],
            reverse: false,
            material: CurrentMaterial::Default,
            light: None,
            media: [NONE; 2],
            color_space: ColorSpace::default(),
            textures: TextureNames::default(),
            named_materials: MaterialNames::default(),
            attributes: Rc::default(),
        }
    }

    /// Applies `f` to the active transforms.
    pub fn change(&mut self, site: &Site, f: impl Fn(DMat4) -> DMat4) -> Result<(), SceneError> {
        for (ctm, active) in self.ctm.iter_mut().zip(self.active) {
            if active {
                *ctm = f(*ctm);
                if !ctm.is_finite() {
                    return Err(site.error("the current transform overflows"));
                }
            }
        }
        Ok(())
    }

    /// The current transform of something that must not move.
    pub fn fixed_ctm(&self, site: &Site) -> Result<Place, SceneError> {
        if self.ctm[0] != self.ctm[1] {
            return Err(site.error(
                "motion blur is not supported; use the same transform for StartTime and EndTime of ActiveTransform",
            ));
        }
        Ok(Place::of(&self.ctm[0]))
    }

    /// The current transform of something that does not move in pbrt either, which takes the one at
    /// the start of the shutter.
    pub fn start_ctm(&self, site: &Site, report: &mut Report) -> Place {
        if self.ctm[0] != self.ctm[1] {
            report.warn_at(site, "does not move: the transform of StartTime is used");
        }
        Place::of(&self.ctm[0])
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

/// What v3 keeps of a transform, apart from everything else.
#[derive(Debug)]
struct SavedTransform {
    block: Block,
    pos: Pos,
    ctm: [DMat4; 2],
    active: [bool; 2],
}

/// The current state and those that blocks saved.
#[derive(Debug)]
pub(super) struct StateStack {
    pub current: State,
    saved: Vec<Saved>,
    /// Of v3, where each block saves the transform here, and all but transform blocks the state in
    /// `saved`. An end takes what is on top, whichever block put it there: blocks may cross.
    transforms: Vec<SavedTransform>,
}

impl StateStack {
    pub fn new() -> Self {
        Self {
            current: State::new(),
            saved: Vec::new(),
            transforms: Vec::new(),
        }
    }

    pub fn begin(&mut self, block: Block, dialect: Dialect, site: &Site) -> Result<(), SceneError> {
        if self.saved.len().max(self.transforms.len()) >= MAX_DEPTH {
            return Err(site.error(format_args!("more than {MAX_DEPTH} blocks are open")));
        }
        if dialect == Dialect::V3 {
            self.transforms.push(SavedTransform {
                block,
                pos: site.pos.clone(),
                ctm: self.current.ctm,
                active: self.current.active,
            });
            if block == Block::Transform {
                return Ok(());
            }
        }
        self.saved.push(Saved {
            block,
            pos: site.pos.clone(),
            state: self.current.clone(),
        });
        Ok(())
    }

    pub fn end(
        &mut self,
        block: Block,
        dialect: Dialect,
        site: &Site,
        report: &mut Report,
    ) -> Result<(), SceneError> {
        match dialect {
            Dialect::V3 => self.end_v3(block, site, report),
            Dialect::V4 => return self.end_v4(block, site, report),
        }
        Ok(())
    }

    fn end_v3(&mut self, block: Block, site: &Site, report: &mut Report) {
        let mut crossed = |opened: Block, pos: &Pos| {
            if opened != block {
                let opened = opened.begin();
                let what = format_args!("closes the {opened} of {pos} instead, as in pbrt");
                report.warn_once("crossed blocks", site, what);
            }
        };
        if block != Block::Transform {
            let Some(saved) = self.saved.pop() else {
                unmatched(block, site, report);
                return;
            };
            crossed(saved.block, &saved.pos);
            let inner = std::mem::replace(&mut self.current, saved.state);
            (self.current.ctm, self.current.active) = (inner.ctm, inner.active);
        }
        match self.transforms.pop() {
            Some(saved) => {
                if block == Block::Transform {
                    crossed(saved.block, &saved.pos);
                }
                (self.current.ctm, self.current.active) = (saved.ctm, saved.active);
            }
            None => unmatched(block, site, report),
        }
    }

    /// Transform blocks are attribute blocks here.
    fn end_v4(&mut self, block: Block, site: &Site, report: &mut Report) -> Result<(), SceneError> {
        let plain = |b: Block| {
            if b == Block::Transform {
                Block::Attribute
            } else {
                b
            }
        };
        let ends = |saved: &mut Saved| plain(saved.block) == plain(block);
        if let Some(saved) = self.saved.pop_if(ends) {
            let inner = std::mem::replace(&mut self.current, saved.state);
            // Names are global; v3 forgets them at the end of the block.
            self.current.textures = inner.textures;
            self.current.named_materials = inner.named_materials;
            return Ok(());
        }
        match self.saved.last() {
            // An imported file has a stack of its own.
            Some(saved) if saved.block != Block::Import || plain(block) != Block::Attribute => {
                Err(site.error(format_args!(
                    "closes the {} of {} instead",
                    saved.block.begin(),
                    saved.pos
                )))
            }
            _ if plain(block) == Block::Attribute => {
                unmatched(block, site, report);
                Ok(())
            }
            _ => Err(site.error(format_args!("there is no {} for it", block.begin()))),
        }
    }

    /// Where the innermost open block begins.
    pub fn open_block(&self) -> Option<Site> {
        let saved = self.saved.last().map(|s| (s.block, &s.pos));
        let (block, pos) = saved.or(self.transforms.last().map(|s| (s.block, &s.pos)))?;
        Some(Site::new(pos.clone(), block.begin()))
    }
}

fn unmatched(block: Block, site: &Site, report: &mut Report) {
    report.warn_at(
        site,
        format_args!("ignored: there is no {} for it", block.begin()),
    );
}
