//! `MakeNamedMedium` and `MediumInterface`: media in world space, until it is known which of them
//! fill anything.

mod cloud;
mod coefficients;
mod grids;
mod nanovdb;
mod presets;
mod read;
mod world;

use std::collections::HashMap;
use std::rc::Rc;

use super::dialect::Dialect;
use super::error::{Report, SceneError, Site};
use super::geometry::WorldShape;
use super::textures::Deferred;
use crate::scene::{self, NONE, Space};

pub(super) use self::presets::preset;
pub(super) use self::world::WorldMedium;

/// The media that a file names.
#[derive(Debug, Default)]
pub(super) struct Media {
    /// Numbers of what has a name.
    names: HashMap<String, u32>,
    /// By number; `None` if it has only been named so far (v4).
    made: Vec<Option<Deferred<WorldMedium>>>,
    /// By number: where something is filled with it, and what it is called.
    used: Vec<Option<(Rc<Site>, String)>>,
}

impl Media {
    /// Whether there is a medium of this name.
    pub fn has(&self, name: &str) -> bool {
        self.names.contains_key(name)
    }

    /// The number of a name, [`NONE`] for the empty one.
    pub fn number(&mut self, name: &str) -> u32 {
        if name.is_empty() {
            return NONE;
        }
        if let Some(&number) = self.names.get(name) {
            return number;
        }
        let number = self.made.len() as u32;
        self.names.insert(name.to_owned(), number);
        self.made.push(None);
        self.used.push(None);
        number
    }

    /// What is called `name` from now on.
    pub fn make(&mut self, name: &str, made: Deferred<WorldMedium>, dialect: Dialect) {
        // What v3 has named already stays what it was.
        if dialect == Dialect::V3 {
            self.names.remove(name);
        }
        let number = self.number(name) as usize;
        self.made[number] = Some(made);
    }

    /// Whether something of this name was made, not just named.
    pub fn is_made(&self, name: &str) -> bool {
        let number = self.names.get(name);
        number.is_some_and(|number| self.made[*number as usize].is_some())
    }

    /// Something is filled with these.
    pub fn fill(&mut self, numbers: [u32; 2], site: &Rc<Site>) {
        for number in numbers.into_iter().filter(|number| *number != NONE) {
            let used = &mut self.used[number as usize];
            if used.is_none() {
                let name = self.names.iter().find(|(_, n)| **n == number);
                let name = name.map(|(name, _)| name.clone()).unwrap_or_default();
                *used = Some((Rc::clone(site), name));
            }
        }
    }

    /// The media that fill something, in internal space, and where each number went; those without
    /// any effect are a vacuum.
    pub fn finish(
        self,
        space: &Space,
        report: &mut Report,
    ) -> Result<(Vec<scene::Medium>, Vec<u32>), SceneError> {
        let (mut list, mut index) = (Vec::new(), vec![NONE; self.made.len()]);
        for (number, (made, used)) in self.made.into_iter().zip(self.used).enumerate() {
            match (made, used) {
                (Some(made), Some(_)) => {
                    let medium = made?.to_internal(space);
                    if medium.extinction != [0.0; 3] {
                        index[number] = list.len() as u32;
                        list.push(medium);
                    }
                }
                (None, Some((site, name))) => {
                    return Err(site.error(format_args!("there is no medium named \"{name}\"")));
                }
                (Some(Err(error)), None) => {
                    report.warn(format!("{error} (nothing is filled with it)"));
                }
                (_, None) => {}
            }
        }
        Ok((list, index))
    }
}

/// The media of a scene, as its tables are made.
pub(super) struct Fillings {
    /// What the tables hold so far.
    pub media: scene::Media,
    /// Of each number, the index of its medium.
    index: Vec<u32>,
}

impl Fillings {
    /// Of all that is filled: the shapes' sides, the surroundings of the camera, those of lights
    /// that are no shapes.
    pub fn new<'a>(
        mut media: Media,
        shapes: impl Iterator<Item = &'a WorldShape>,
        (camera, lights): (u32, &[u32]),
        space: &Space,
        report: &mut Report,
    ) -> Result<Self, SceneError> {
        for shape in shapes {
            media.fill(shape.media, &shape.site);
        }
        let (list, index) = media.finish(space, report)?;
        let mut fillings = Self {
            media: scene::Media {
                list,
                ..scene::Media::default()
            },
            index,
        };
        fillings.media.camera = fillings.of(camera);
        if !fillings.media.list.is_empty() {
            fillings.media.lights = lights.iter().map(|l| [fillings.of(*l); 2]).collect();
        }
        Ok(fillings)
    }

    fn of(&self, number: u32) -> u32 {
        self.index.get(number as usize).copied().unwrap_or(NONE)
    }

    /// Index of the boundary between two media; [`NONE`] if they are one.
    pub fn boundary(&mut self, numbers: [u32; 2]) -> u32 {
        let sides = numbers.map(|n| self.of(n));
        if sides[0] == sides[1] {
            return NONE;
        }
        let known = self.media.boundaries.iter().position(|b| *b == sides);
        known.unwrap_or_else(|| {
            self.media.boundaries.push(sides);
            self.media.boundaries.len() - 1
        }) as u32
    }

    /// A further light, which shines into these.
    pub fn add_light(&mut self, numbers: [u32; 2]) {
        if !self.media.list.is_empty() {
            self.media.lights.push(numbers.map(|n| self.of(n)));
        }
    }
}
