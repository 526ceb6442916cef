//! Lights that nothing but chance could have met ([`crate::plan::Chance`]).

use super::World;
use super::records::*;
use crate::simd::{Lanes, Mask, Vec3};

impl World<'_> {
    /// Notes in the splats of `list` which paths have met a light as no other strategy of the
    /// render could have made them: their weight is 1, to the bit. Light that comes by specular
    /// surfaces alone is left out: it is seen as lights themselves are.
    pub(super) fn note_chance<L: Lanes>(
        &self,
        flights: &[Flight],
        list: &[u32],
        light: impl Fn(usize) -> u32,
        (radiance, weight): (Vec3<L>, L),
        splats: &mut [Splat],
    ) {
        let Some(chance) = &self.chance else {
            return;
        };
        let open = FlightLanes::<L>::load(flights, list).open;
        let sum = radiance.x + radiance.y + radiance.z;
        let alone = weight.ge(L::one()).and(open.gt(L::zero()));
        let found = alone.and(sum.gt(L::zero())).bits();
        if found == 0 {
            return;
        }
        for (i, &path) in list.iter().enumerate() {
            if found >> i & 1 != 0 {
                let lamp = chance.lamp(light(i), sum.lane(i) / 3.0);
                splats[path as usize].chance = lamp + 1;
            }
        }
    }
}
