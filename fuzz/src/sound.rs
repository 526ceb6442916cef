//! What a loaded scene and the paths in it keep to.

use phalanx::chain::evaluator::Evaluator;
use phalanx::scene::{LightKind, NONE, Param, Scene};
use phalanx::simd::{Lanes, f32x8};
use phalanx::transport::evaluate::UnidirectionalLayout;
use phalanx::transport::samples::Samples;
use phalanx::transport::{Paths, Splat, World};

/// Paths of a batch: not a multiple of the lanes.
const PATHS: usize = 11;

/// Primitives of the largest scene that is walked.
const MAX_PRIMITIVES: usize = 5000;

/// Indices lead to entries, places are numbers, and the geometry is within its space.
pub fn tables(scene: &Scene) {
    let finite = |v: &[f32]| assert!(v.iter().all(|x| x.is_finite()), "{v:?}");
    for vertex in &scene.vertices {
        finite(&vertex.p);
        finite(&vertex.n);
        finite(&vertex.uv);
    }
    for triangle in &scene.triangles {
        assert!(
            triangle
                .v
                .iter()
                .all(|&i| (i as usize) < scene.vertices.len())
        );
        assert!((triangle.shape as usize) < scene.shapes.len());
    }
    for sphere in &scene.spheres {
        finite(sphere.to_world.as_flattened());
        assert!((sphere.shape as usize) < scene.shapes.len());
    }
    for shape in &scene.shapes {
        assert!((shape.material as usize) < scene.materials.len());
        assert!(shape.light == NONE || (shape.light as usize) < scene.lights.len());
    }
    for light in &scene.lights {
        match light.kind {
            LightKind::Point { p, .. } | LightKind::Spot { p, .. } => finite(&p.to_array()),
            LightKind::Goniometric { p, image, .. } | LightKind::Projection { p, image, .. } => {
                finite(&p.to_array());
                assert!((image as usize) < scene.images.len());
            }
            LightKind::ImageTriangle { image, .. }
            | LightKind::ImageSphere { image, .. }
            | LightKind::InfiniteImage { image, .. } => {
                assert!((image as usize) < scene.images.len());
            }
            _ => {}
        }
    }
    for bound in scene.bounds {
        assert!(bound.length() <= 1.001, "{bound}");
    }
    finite(scene.camera.to_world.as_flattened());
    finite(&scene.camera.screen);
    finite(&[
        scene.camera.lens_radius,
        scene.camera.focal_distance,
        scene.film.scale,
    ]);
    for (i, texture) in scene.textures.iter().enumerate() {
        let earlier = |param: Param| match param {
            Param::Texture(child) => assert!((child as usize) < i),
            Param::Constant(_) => {}
        };
        texture.children().for_each(earlier);
        if let phalanx::scene::Texture::Image { image, .. } = texture {
            assert!((*image as usize) < scene.images.len());
        }
    }
}

/// Paths of up to three scattering events through a scene, if it is small.
pub fn a_few_paths(scene: &Scene) {
    if scene.triangles.len() + scene.spheres.len() > MAX_PRIMITIVES {
        return;
    }
    let world = World::new(scene, 3);
    let mut random = Random(7);
    for depth in 0..=3 {
        multiplexed(&world, depth, &mut || random.uniform());
    }
    unidirectional(&world, 3, &mut || random.uniform());
}

/// Evaluates multiplexed paths of one depth at both widths, which agree to the bit. Returns how
/// many contributions were rejected.
pub fn multiplexed(world: &World, depth: u32, sample: &mut dyn FnMut() -> f32) -> u32 {
    let plan = &world.plan.depths[depth as usize];
    let samples = matrix(plan.layout.total, sample);
    let evaluate = |evaluator: Evaluator| {
        let mut paths = Paths::new(world);
        evaluator.multiplexed(world, plan, &samples, PATHS, &mut paths);
        paths.splats.camera
    };
    agree(evaluate)
}

/// The same of path tracing with up to `max_depth` scattering events.
pub fn unidirectional(world: &World, max_depth: u32, sample: &mut dyn FnMut() -> f32) -> u32 {
    let layout = UnidirectionalLayout::new(&world.plan, max_depth);
    let samples = matrix(layout.total(), sample);
    let evaluate = |evaluator: Evaluator| {
        let mut paths = Paths::new(world);
        evaluator.unidirectional(world, &layout, &samples, PATHS, &mut paths);
        paths.splats.camera
    };
    agree(evaluate)
}

fn matrix(dimensions: usize, sample: &mut dyn FnMut() -> f32) -> Samples {
    let mut samples = Samples::new(dimensions, PATHS);
    for path in 0..PATHS {
        for d in 0..dimensions {
            samples.row_mut(d)[path] = sample();
        }
    }
    samples
}

fn agree(evaluate: impl Fn(Evaluator) -> Vec<Splat>) -> u32 {
    let [one, eight] = Evaluator::BOTH.map(evaluate);
    assert_eq!((one.len(), eight.len()), (PATHS, <f32x8 as Lanes>::N + 3));
    for (a, b) in one.iter().zip(&eight) {
        let bits = |o: &Splat| {
            let [r, g, b] = o.rgb.map(f32::to_bits);
            let [x, y] = o.raster.map(f32::to_bits);
            [r, g, b, x, y, o.s, o.rejected]
        };
        assert_eq!(bits(a), bits(b), "{a:?}, eight at once {b:?}");
        let fair = a.rgb.iter().all(|v| v.is_finite() && *v >= 0.0);
        assert!(fair && a.rejected <= 1, "{a:?}");
        assert!(a.rejected == 0 || a.rgb == [0.0; 3], "{a:?}");
        let lit = a.rgb != [0.0; 3];
        assert!(!lit || a.raster.iter().all(|v| v.is_finite()), "{a:?}");
    }
    one.iter().map(|o| o.rejected).sum()
}

/// splitmix64 (Steele et al. 2014).
pub struct Random(pub u64);

impl Random {
    /// In `[0, 1)`, 24 bits as the renderer's.
    pub fn uniform(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f32 / 16_777_216.0
    }
}
