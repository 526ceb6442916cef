//! Workspace of rays on their way through media.

use super::list::List;
use super::records::Ray;
use crate::medium::Travel;
use crate::scene::NONE;

/// Workspace of rays on their way through media; empty in scenes without.
#[derive(Default)]
pub struct Flying {
    /// What is left of each ray beyond the border it has crossed.
    pub(super) beyond: Vec<Ray>,
    /// Where that starts, in units of the length of the ray's direction.
    pub(super) start: Vec<f32>,
    /// Where the ray's latest piece starts.
    pub(super) from: Vec<f32>,
    /// Medium of each.
    pub(super) medium: Vec<u32>,
    pub(super) travel: Vec<Travel>,
    pub(super) left: List,
    pub(super) next: List,
}

impl Flying {
    pub(super) fn start(&mut self, n: usize) {
        if self.beyond.len() < n {
            self.beyond.resize(n, Ray::default());
            self.start.resize(n, 0.0);
            self.from.resize(n, 0.0);
            self.medium.resize(n, NONE);
            self.travel.resize(n, Travel::new(0.0, false));
        }
        self.left.reserve(n);
        self.next.reserve(n);
        self.left.clear();
        self.next.clear();
    }
}
