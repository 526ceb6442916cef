//! What all integrators work on, and whom they tell.

use std::ops::Range;
use std::time::{Duration, Instant};

use super::chance::Hidden;
use super::settings::Settings;
use super::shard::Shard;
use super::so_far::{SoFar, Wanted};
use super::state::State;
use super::team::{ALONE, Crew, Team};
use crate::checkpoint::Writer;
use crate::scene::{Film, Scene};
use crate::transport::World;

/// What a render is doing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Phase {
    /// The tree that rays are traced through: 0 of its primitives, then all of them (at least 1).
    Build,
    /// Bootstrap paths, and the mutations of tuning.
    Bootstrap,
    /// Mutations or samples.
    Render,
}

/// Told how a render goes, and asked whether to go on. Called from the thread that called
/// [`render`](super::render()), except [`Observer::stop`], which any worker may call.
pub trait Observer: Sync {
    /// `done` of `total` mutations, samples or bootstrap paths.
    fn progress(&self, phase: Phase, done: u64, total: u64) {
        let _ = (phase, done, total);
    }
    /// The picture's estimated relative error
    /// ([`Stats::relative_error`](super::Stats::relative_error)); told now and then, as
    /// often as costs next to nothing.
    fn error(&self, relative: f64) {
        let _ = relative;
    }
    /// Something that the user should know before the render.
    fn warning(&self, text: &str) {
        let _ = text;
    }
    /// What is wanted of the picture so far; asked between rounds of work, and once more when all
    /// work is done (`last`), however it ended.
    fn wants_picture(&self, last: bool) -> Wanted {
        let _ = last;
        Wanted::Nothing
    }
    /// The picture so far, if it was wanted; but for what chains still hold, unless it is the last.
    fn picture(&self, so_far: SoFar) {
        let _ = so_far;
    }
    /// Whether the render's state is wanted, to [`resume`](super::resume) it some day; asked
    /// between rounds of work, and once more when it ends (`last`), however it does. Not asked
    /// where a stop has come so early that nothing could be gone on with.
    fn wants_state(&self, last: bool) -> bool {
        let _ = last;
        false
    }
    /// The state, if it was wanted.
    fn state(&self, state: State, last: bool) {
        let _ = (state, last);
    }
    /// True ends the render early, with a correctly normalised picture.
    fn stop(&self) -> bool {
        false
    }
}

/// What somebody wants to see between two rounds; the same at all processes of a team.
#[derive(Clone, Copy)]
pub(super) struct Wants {
    pub picture: Wanted,
    pub state: bool,
    pub error: bool,
}

impl Wants {
    /// `error` says that it is time to look at it. The wishes of the first process count.
    pub fn ask(run: &Run, error: bool) -> Self {
        let own = match run.team().leads() {
            true => {
                let [state, error] = [run.is_kept(false), error].map(u8::from);
                [run.observer.wants_picture(false) as u8, state, error]
            }
            false => [0; 3],
        };
        let [picture, state, error] = run.team().agree(own);
        Self {
            picture: match picture {
                0 => Wanted::Nothing,
                1 => Wanted::Picture,
                _ => Wanted::Judged,
            },
            state: state == 1,
            error: error == 1,
        }
    }

    pub fn is_nothing(self) -> bool {
        self.picture == Wanted::Nothing && !self.state && !self.error
    }
}

/// Sees nothing, stops nothing.
pub struct Silent;

impl Observer for Silent {}

/// What ended a render.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndedBy {
    /// All mutations or samples are made.
    Effort,
    /// [`Settings::time`] is over.
    Time,
    /// The estimated error has reached its target.
    Target,
    /// [`Observer::stop`] said so.
    Observer,
}

/// Why a picture is black, of which `searched` have found no light.
pub(super) fn black_reason(run: &Run, searched: &str) -> String {
    if run.world.is_unlit() {
        return "the scene has no lights: the picture is black".into();
    }
    format!("{searched} carries light to the camera: the picture is black")
}

/// Mean radiance below which the epsilon of relative errors rules the picture.
pub(super) const DARK: f64 = 0.02;

/// Length of a round of work: progress and stops are prompt, the barrier costs little.
pub(super) const ROUND: Duration = Duration::from_millis(250);

/// What an integrator works on.
pub(super) struct Run<'a> {
    pub(super) scene: &'a Scene,
    pub(super) world: &'a World<'a>,
    /// The scene's, but for pictures that only their maker sees.
    pub(super) film: &'a Film,
    pub(super) settings: &'a Settings,
    pub(super) observer: &'a dyn Observer,
    pub(super) start: Instant,
    /// What an earlier process has spent on it.
    pub(super) spent: Duration,
    /// Light that only chance finds.
    pub(super) hidden: &'a [Hidden],
    /// Its state can be kept.
    pub(super) keeps: bool,
    /// What states begin with.
    pub(super) preface: &'a (dyn Fn(&mut Writer) + Sync),
    /// The processes that make it.
    pub(super) crew: &'a Crew<'a>,
}

impl<'a> Run<'a> {
    /// A render that begins.
    pub(super) fn begin(
        scene: &'a Scene,
        world: &'a World<'a>,
        settings: &'a Settings,
        observer: &'a dyn Observer,
    ) -> Self {
        Self {
            scene,
            world,
            film: &scene.film,
            settings,
            observer,
            start: Instant::now(),
            spent: Duration::ZERO,
            hidden: &[],
            keeps: true,
            preface: &|_| {},
            crew: &ALONE,
        }
    }

    /// Time since it began, without what was between stops.
    pub(super) fn elapsed(&self) -> Duration {
        self.spent + self.start.elapsed()
    }

    /// The part of `count` things that is this render's, if it is a part of one; groups of `grain`
    /// stay together.
    pub(super) fn share(&self, count: u64, grain: u64) -> Range<u64> {
        let whole = Shard { index: 0, of: 1 };
        self.settings.shard.unwrap_or(whole).share(count, grain)
    }

    /// Width and height of the crop window.
    pub(super) fn size(&self) -> (u32, u32) {
        let [x0, x1, y0, y1] = self.film.crop;
        (x1 - x0, y1 - y0)
    }

    /// Where the crop window is, and the size of the whole picture.
    pub(super) fn window(&self) -> [[u32; 2]; 2] {
        let film = self.film;
        [[film.crop[0], film.crop[2]], [film.width, film.height]]
    }

    /// The processes that make it.
    pub(super) fn team(&self) -> &'a dyn Team {
        self.crew.team
    }

    /// How much longer the next round should be than one that took so long: [`ROUND`], or the time
    /// that is left.
    pub(super) fn pace(&self, taken: Duration) -> f64 {
        let next = match self.settings.time {
            Some(limit) => ROUND.min(limit.saturating_sub(self.start.elapsed())),
            None => ROUND,
        };
        let ratio = next.as_secs_f64() / taken.as_secs_f64().max(1e-6);
        ratio.clamp(0.01, 4.0)
    }

    /// Time is up, or the observer has had enough; that of any process, after a round that all of
    /// them have made. All come to the same. The first says whether it `may` end.
    pub(super) fn ended(&self, may: bool) -> Option<EndedBy> {
        let late = (self.settings.time).is_some_and(|limit| self.start.elapsed() >= limit);
        let team = self.team();
        let stops = team.sum(f64::from(u8::from(self.observer.stop())));
        let ended = match (stops > 0.0, late) {
            (true, _) => 1u8,
            (false, true) => 2,
            (false, false) => 0,
        };
        match team.agree(if may { ended } else { 0 }) {
            0 => None,
            1 => Some(EndedBy::Observer),
            _ => Some(EndedBy::Time),
        }
    }
}

pub(super) fn per_second(count: u64, seconds: f64) -> f64 {
    if seconds > 0.0 {
        count as f64 / seconds
    } else {
        0.0
    }
}

/// Largest resident size of this process so far; 0 where the system does not tell.
pub fn peak_rss_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"));
    let kib = line.and_then(|l| l.trim().trim_end_matches("kB").trim().parse::<u64>().ok());
    kib.unwrap_or(0) * 1024
}
