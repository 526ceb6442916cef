//! Paths through scenes that have every material, light and camera: whatever the primary samples,
//! contributions are numbers, and one lane finds what eight find.
//!
//! Input: scene, depth, then four bytes for every primary sample, as many as there are; the rest is
//! random.

use std::sync::OnceLock;

use phalanx::scene::Scene;
use phalanx::transport::World;

use super::sound::{self, Random};

#[path = "../../tests/renderer/common/scenes.rs"]
#[allow(dead_code)]
mod fixed;

const MAX_DEPTH: u32 = 7;

/// Built once.
fn worlds() -> &'static [World<'static>] {
    static SCENES: OnceLock<Vec<(&str, Scene)>> = OnceLock::new();
    static WORLDS: OnceLock<Vec<World>> = OnceLock::new();
    WORLDS.get_or_init(|| {
        let scenes = SCENES.get_or_init(fixed::all).iter();
        scenes
            .map(|(_, scene)| World::new(scene, MAX_DEPTH))
            .collect()
    })
}

pub fn check(data: &[u8]) {
    let [scene, depth, rest @ ..] = data else {
        return;
    };
    let worlds = worlds();
    let world = &worlds[*scene as usize % worlds.len()];
    let depth = u32::from(*depth) % (MAX_DEPTH + 1);
    sound::multiplexed(world, depth, &mut samples(rest, 1));
    sound::unidirectional(world, depth, &mut samples(rest, 2));
}

fn samples(data: &[u8], seed: u64) -> impl FnMut() -> f32 {
    let mut random = Random(seed);
    let mut chunks = data.as_chunks::<4>().0.iter();
    move || match chunks.next() {
        Some(bytes) => unit(u32::from_le_bytes(*bytes)),
        None => random.uniform(),
    }
}

/// Any float of `[0, 1)`, zero, subnormal ones and the last before 1 among them: these are the bit
/// patterns below that of 1.
fn unit(bits: u32) -> f32 {
    f32::from_bits(bits % 1f32.to_bits())
}
