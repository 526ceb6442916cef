//! What happens to light between where it goes into a surface and where it comes out: a separable
//! BSSRDF (pbrt, 3rd edition, section 11.4), as where it comes out depends on the distance alone.

use super::diffusion_table::{Between, DiffusionTable};
use crate::scene::Rgb;
use std::sync::Arc;

/// A BSSRDF at a place, channel by channel. Without a medium nothing comes out.
#[derive(Clone, Debug)]
pub struct Bssrdf {
    /// Index of refraction, inside over outside.
    pub eta: f32,
    channels: [Option<Channel>; 3],
    table: Arc<DiffusionTable>,
}

#[derive(Clone, Copy, Debug)]
struct Channel {
    /// Extinction, per length.
    extinction: f64,
    row: Between,
    effective: f64,
    /// Where the profile is cut off, a length.
    reach: f64,
}

impl Bssrdf {
    /// Of absorption and scattering, per length.
    pub fn new(table: &Arc<DiffusionTable>, eta: f32, [absorption, scattering]: [Rgb; 2]) -> Self {
        let channel = |c: usize| {
            let [a, s] = [absorption[c], scattering[c]].map(|v| f64::from(v).max(0.0));
            let extinction = a + s;
            let usable = extinction > 0.0 && extinction.is_finite();
            let row = table.between(if usable { s / extinction } else { 0.0 });
            let effective = table.effective_albedo(&row);
            (usable && effective > 0.0).then(|| Channel {
                extinction,
                row,
                effective,
                reach: table.reach(&row) / extinction,
            })
        };
        Self {
            eta,
            channels: std::array::from_fn(channel),
            table: Arc::clone(table),
        }
    }

    /// The same where lengths are `scale` times as large.
    pub fn scaled(mut self, scale: f64) -> Self {
        for channel in self.channels.iter_mut().flatten() {
            channel.extinction /= scale;
            channel.reach *= scale;
        }
        self
    }

    /// A distance from the profile of a channel, and where that is cut off.
    pub fn sample(&self, channel: usize, u: f64) -> Option<[f64; 2]> {
        let of = self.channels[channel].as_ref()?;
        let r = self.table.radius(&of.row, u) / of.extinction;
        (r < of.reach).then_some([r, of.reach])
    }

    /// Densities, over area, of distances that [`Self::sample`] draws from each channel: `r` in the
    /// plane in which it is drawn, of points that are `distance` away in space.
    pub fn densities(&self, r: f64, distance: f64) -> [f64; 3] {
        self.channels.map(|channel| match channel {
            Some(of) if distance < of.reach => self.profile(&of, r) / of.effective,
            _ => 0.0,
        })
    }

    /// Light that comes out per area at a distance, over what went in.
    pub fn value(&self, distance: f64) -> [f64; 3] {
        self.channels
            .map(|channel| channel.map_or(0.0, |of| self.profile(&of, distance)))
    }

    fn profile(&self, of: &Channel, r: f64) -> f64 {
        let optical = r * of.extinction;
        self.table.per_area(&of.row, optical) * of.extinction * of.extinction
    }
}
