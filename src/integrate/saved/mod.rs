//! A render as a value: what an integrator has come to, which [`resume`](super::resume) goes on
//! from, and all that a file of it has to say.
//!
//! A [`State`] begins with whose it is. Then follows what the integrator writes: `auto` its
//! decision; chains what was before they marched, their budgets, the film and where they stand;
//! samples how many there are, and their film.

mod settings;

use self::settings::{load_shard, save_shard};
use super::state::{Made, State};
use super::{Run, Settings, Shard};
use crate::checkpoint::{self, CheckpointError, Malformed, Origin, Packed, Reader, Writer};
use std::io;
use std::path::Path;
use std::sync::atomic::Ordering::Relaxed;

/// All of a file: a state, and how it came about.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// What the scene was read from.
    pub origin: Origin,
    /// Size of the full picture in pixels, if it is not the scene's.
    pub resolution: Option<[u32; 2]>,
    /// Crop window `[x0, x1, y0, y1]` in fractions of the picture, if it is not the scene's.
    pub crop: Option<[f32; 4]>,
    /// Of the render.
    pub settings: Settings,
    /// Estimated relative error of the picture, if it is known.
    pub error: Option<f64>,
    /// Where it stands.
    pub state: State,
}

impl Checkpoint {
    /// Writes a file, whole or not at all.
    ///
    /// # Errors
    /// The system says no; what was there before is still there.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        checkpoint::write(path, &self.head(), &self.state.packed)
    }

    /// All but what a render goes on from.
    pub fn head(&self) -> Packed {
        let Self {
            origin,
            resolution,
            crop,
            settings,
            error,
            state: State { packed: _, made },
        } = self;
        let mut to = Writer::new();
        origin.save(&mut to);
        to.option(*resolution, Writer::value);
        to.option(*crop, Writer::value);
        settings.save(&mut to);
        to.option(*error, Writer::value);
        let Made {
            mutations,
            samples,
            part,
            seconds,
        } = *made;
        to.value([mutations, samples]);
        to.value([part, seconds]);
        to.finish()
    }

    /// Reads a file.
    ///
    /// # Errors
    /// It is no checkpoint, one of another version, or damaged.
    pub fn read(path: &Path) -> Result<Self, CheckpointError> {
        let (head, state) = checkpoint::read(path, true)?;
        Ok(Self::of(&head, state)?)
    }

    /// The same without what a render goes on from, which is large; all of the file is checked.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn look(path: &Path) -> Result<Self, CheckpointError> {
        let (head, state) = checkpoint::read(path, false)?;
        Ok(Self::of(&head, state)?)
    }

    /// Of a head and a state.
    ///
    /// # Errors
    /// It is no head.
    pub fn of(head: &Packed, packed: Packed) -> Result<Self, Malformed> {
        let mut from = Reader::new(head);
        let origin = Origin::load(&mut from)?;
        let resolution = from.option(Reader::value)?;
        let crop = from.option(Reader::value)?;
        let settings = Settings::load(&mut from)?;
        let error = from.option(Reader::value)?;
        let [mutations, samples] = from.value()?;
        let [part, seconds] = from.value()?;
        from.end()?;
        let right = (0.0..=1.0).contains(&part) && (0.0..1e12).contains(&seconds);
        Malformed::unless(right, "what has been made is out of range")?;
        let made = Made {
            mutations,
            samples,
            part,
            seconds,
        };
        Ok(Self {
            origin,
            resolution,
            crop,
            settings,
            error,
            state: State { packed, made },
        })
    }
}

impl Run<'_> {
    /// Whether its state is wanted. `last` says that it ends here.
    pub(super) fn is_kept(&self, last: bool) -> bool {
        self.keeps && self.observer.wants_state(last)
    }

    /// Hands the render, which is wanted, to the observer.
    pub(super) fn keep(&self, last: bool, save: impl FnOnce(&mut Writer) -> Made) {
        let (packed, mut made) = self.packed(save);
        made.seconds = self.elapsed().as_secs_f64();
        self.observer.state(State { packed, made }, last);
    }

    /// Has the other processes of its team begin where this one stands. What they are told is a
    /// state without sums.
    pub(super) fn lead(&self, save: impl FnOnce(&mut Writer)) {
        let team = self.team();
        if !team.is_alone() && team.leads() {
            let (packed, ()) = self.packed(save);
            self.crew.told.store(true, Relaxed);
            team.tell(packed.into_bytes());
        }
    }

    fn packed<T>(&self, save: impl FnOnce(&mut Writer) -> T) -> (Packed, T) {
        let mut to = Writer::new();
        self.save_whose(&mut to);
        (self.preface)(&mut to);
        let made = save(&mut to);
        (to.finish(), made)
    }

    fn whose(&self) -> (String, [u64; 8]) {
        let film = self.film;
        let [x0, x1, y0, y1] = film.crop;
        let settings = self.settings;
        let judged = u32::from(settings.estimate_error);
        let numbers = [film.width, film.height, x0, x1, y0, y1, judged].map(u64::from);
        let mut whose = [settings.seed; 8];
        whose[..7].copy_from_slice(&numbers);
        let depth = settings.max_depth;
        (format!("{} {depth}", settings.integrator.name()), whose)
    }

    fn save_whose(&self, to: &mut Writer) {
        let (name, numbers) = self.whose();
        to.text(&name);
        to.value(numbers);
        save_shard(self.settings.shard, to);
    }

    /// Whether a state is one of this render, and of which part of it.
    pub(super) fn check_whose(
        &self,
        shard: Option<Shard>,
        from: &mut Reader,
    ) -> Result<(), Malformed> {
        let same = (from.text()?, from.value()?) == self.whose();
        Malformed::unless(same, "its integrator, picture or seed is another")?;
        let same = load_shard(from)? == shard;
        Malformed::unless(same, "it is another shard")
    }
}
