//! Media: where light is scattered between surfaces, and how much of it passes.
//!
//! 1. [`MediumTable`] borrows the media of a scene. It knows neither surfaces nor rays' hits: it is
//!    asked about a piece of a ray that lies in one medium.
//! 2. The optical depth of such a piece is integrated exactly; it is no random number
//!    ([`MediumTable::pass`]).
//! 3. Where a ray is scattered is the inverse of a function of one primary sample `u`
//!    ([`MediumTable::scatter`]): the place where the mean transmittance over the channels, from
//!    the start of the ray, is `1 - u`. The density of that is the mean over the channels of
//!    `extinction * transmittance`, as of a distance sampled in a channel that is chosen at random
//!    and weighed against the others (pbrt-v3, section 15.2.1), but no channel is chosen: a small
//!    change of the sample is a small change of the path, whatever the colour of the medium.
//! 4. Media that do not scatter are passed, and take away what they absorb.
//! 5. What a medium emits is integrated along the pieces that a ray passes ([`Travel::glow`]), as
//!    far as it comes: over the probability that it comes so far, which makes up for the rest.
//! 6. In a [`grid`] the ray goes from cell to cell. What is interpolated in a cell is a cubic
//!    polynomial along the ray, so that its integral is exact; it is inverted by Newton's method.
//! 7. [`henyey_greenstein`] is the phase function.

mod glow;
pub mod grid;
pub mod henyey_greenstein;
mod passed;
mod span;
mod table;
#[cfg(test)]
mod tests;
mod travel;

pub use self::passed::{Passed, ln_1m};
pub use self::table::MediumTable;
pub use self::travel::{Piece, Scattered, Travel};
