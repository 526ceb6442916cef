//! Probes: what the waves tell whoever listens, several paths at a time.

use crate::common::scenes;
use crate::common::stats::Random;
use phalanx::camera::CameraConnection;
use phalanx::light::{DirectSample, EmissionSample};
use phalanx::simd::{Lanes, Mask, Vec3, f32x8};
use phalanx::transport::paths::Side;
use phalanx::transport::probe::{Ended, Scattered};
use phalanx::transport::records::LinkLanes;
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, Probe, World};

/// Adds up what it is told that paths carry, and notes which it has been told the end of.
struct Listener {
    rgb: Vec<[f32; 3]>,
    weighed: Vec<[f32; 3]>,
    ended: Vec<bool>,
}

impl Listener {
    fn add(&mut self, path: u32, rgb: [f32; 3]) {
        let sum = &mut self.rgb[path as usize];
        *sum = std::array::from_fn(|c| sum[c] + rgb[c]);
        self.ended[path as usize] = true;
    }

    fn end_others(&mut self, list: &[u32], alive: u32) {
        for (i, &path) in list.iter().enumerate() {
            self.ended[path as usize] |= alive >> i & 1 == 0;
        }
    }
}

impl Probe for Listener {
    fn light_started<L: Lanes>(
        &mut self,
        list: &[u32],
        _: &[u32],
        _: &EmissionSample<L>,
        alive: u32,
    ) {
        self.end_others(list, alive);
    }

    fn scattered<L: Lanes>(&mut self, list: &[u32], _: Side, event: &Scattered<L>) {
        self.end_others(list, event.alive);
    }

    fn linked_light<L: Lanes>(&mut self, list: &[u32], _: &[u32], _: &DirectSample<L>, alive: u32) {
        self.end_others(list, alive);
    }

    fn linked_lens<L: Lanes>(&mut self, list: &[u32], point: &CameraConnection<L>) {
        self.end_others(list, point.valid.bits());
    }

    fn linked_endpoints<L: Lanes>(&mut self, list: &[u32], _: &LinkLanes<L>, alive: u32) {
        self.end_others(list, alive);
    }

    fn weighed<L: Lanes>(&mut self, list: &[u32], _: L, rgb: Vec3<L>) {
        for (i, &path) in list.iter().enumerate() {
            self.weighed[path as usize] = rgb.lane(i);
            self.ended[path as usize] = true;
        }
    }

    fn looked(&mut self, list: &[u32], blocked: &[u32]) {
        for &path in list.iter().filter(|path| blocked[**path as usize] == 0) {
            self.add(path, self.weighed[path as usize]);
        }
    }

    fn emission<L: Lanes>(&mut self, list: &[u32], _: &[u32], _: L, rgb: Vec3<L>) {
        for (i, &path) in list.iter().enumerate() {
            self.add(path, rgb.lane(i));
        }
    }

    fn escaped<L: Lanes>(&mut self, list: &[u32], _: (u32, Vec3<L>), _: L, rgb: Vec3<L>) {
        for (i, &path) in list.iter().enumerate() {
            self.add(path, rgb.lane(i));
        }
    }

    fn ended(&mut self, path: u32, _: Ended) {
        self.ended[path as usize] = true;
    }
}

/// Eight paths at a time: what a probe hears adds up to the splats, and every path is told of to
/// its end.
#[test]
fn probes_hear_of_every_path() {
    let mut random = Random(74);
    // Not a multiple of the lanes.
    let n = 501;
    for (name, scene) in scenes::all() {
        let world = World::new(&scene, 3);
        let mut paths = Paths::new(&world);
        for plan in &world.plan.depths {
            if plan.strategies.is_empty() {
                continue;
            }
            let mut samples = Samples::new(plan.layout.total, n);
            for d in 0..plan.layout.total {
                samples.row_mut(d).fill_with(|| random.uniform());
            }
            let mut heard = Listener {
                rgb: vec![[0.0; 3]; n],
                weighed: vec![[0.0; 3]; n],
                ended: vec![false; n],
            };
            world.evaluate_multiplexed_with::<f32x8, _>(plan, &samples, n, &mut paths, &mut heard);
            for (i, o) in paths.splats.camera.iter().enumerate() {
                let about = format!("{name}, depth {}, path {i}", plan.depth);
                assert!(heard.ended[i], "{about}");
                if o.rejected == 0 {
                    assert_eq!(o.rgb, heard.rgb[i], "{about}");
                }
            }
        }
    }
}
