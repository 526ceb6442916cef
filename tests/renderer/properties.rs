//! Properties of sampling, over arbitrary parameters and directions: what is sampled and its
//! densities are numbers, none negative.

use crate::common;
use crate::property;

use common::bsdf::Kernels;
use common::scenes;
use glam::Vec3 as Point;
use phalanx::camera::Camera;
use phalanx::scene::Scene;
use phalanx::simd::{Vec3, f32x8};
use phalanx::surface::coated_rows::{pack_bounces, pack_colour};
use phalanx::surface::diffuse::oren_nayar_coefficients;
use phalanx::surface::disney_row;
use phalanx::surface::hair;
use phalanx::surface::microfacet::{pack_alphas, pack_halves};
use phalanx::surface::rough_dielectric::resolved_eta;
use phalanx::surface::subsurface::Exit;
use phalanx::surface::{Kind, Mode};
use phalanx::transport::World;
use proptest::prelude::*;
use std::sync::OnceLock;

/// A primary sample: often the first or last there is.
fn sample() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => (0..1u32 << 24).prop_map(|i| i as f32 / 16_777_216.0),
        1 => Just(0.0),
        1 => Just(1f32.next_down()),
        1 => Just(f32::MIN_POSITIVE),
    ]
}

/// A unit vector off the surface, on either side; one in three grazes it, down to the smallest
/// cosine there is.
fn direction() -> impl Strategy<Value = [f32; 3]> {
    let cosine = prop_oneof![
        2 => 0f32..=1.0,
        1 => (-38f32..0.0).prop_map(|e| 10f32.powf(e).max(f32::MIN_POSITIVE)),
    ];
    (cosine, 0f32..std::f32::consts::TAU, any::<bool>()).prop_map(|(z, phi, below)| {
        let r = (1.0 - z * z).max(0.0).sqrt();
        [r * phi.cos(), r * phi.sin(), if below { -z } else { z }]
    })
}

/// A kind and a row of parameters that a material can have.
fn material() -> impl Strategy<Value = (Kind, [f32; 8])> {
    let unit = || prop_oneof![2 => 0f32..=1.0, 1 => Just(0.0), 1 => Just(1.0)];
    let any = || (-30f32..30.0).prop_map(|e| 10f32.powf(e));
    let index = || prop_oneof![2 => 0f32..10.0, 1 => Just(0.0), 1 => any()];
    let alpha = || (-3f32..3.0).prop_map(|e| 10f32.powf(e));
    let rgb = || prop::array::uniform3(unit());
    (
        prop::sample::select(Kind::ALL.to_vec()),
        (rgb(), rgb()),
        prop::array::uniform6(index()),
        (alpha(), alpha(), 0f32..=90.0),
    )
        .prop_map(|(kind, (a, b), indices, (u, v, sigma))| {
            let (oren_a, oren_b) = oren_nayar_coefficients(sigma);
            let [i, j, k, l, m, n] = indices;
            let row = match kind {
                Kind::Diffuse | Kind::Mirror => [a[0], a[1], a[2], 0.0, 0.0, 0.0, 0.0, 0.0],
                Kind::OrenNayar => [a[0], a[1], a[2], oren_a, oren_b, 0.0, 0.0, 0.0],
                Kind::Plastic | Kind::Substrate => [a[0], a[1], a[2], b[0], b[1], b[2], u, v],
                Kind::DiffuseTransmission => [a[0], a[1], a[2], b[0], b[1], b[2], 0.0, 0.0],
                Kind::ThinDielectric => {
                    [i.max(f32::MIN_POSITIVE), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
                }
                Kind::SmoothDielectric => [
                    a[0],
                    a[1],
                    a[2],
                    b[0],
                    b[1],
                    b[2],
                    i.max(f32::MIN_POSITIVE),
                    0.0,
                ],
                Kind::RoughDielectric | Kind::RoughInterface => {
                    let eta = resolved_eta(i.max(f32::MIN_POSITIVE), u.min(v));
                    [a[0], a[1], a[2], b[0], b[1], b[2], eta, pack_alphas(u, v)]
                }
                Kind::Coat => [i.clamp(1e-3, 1e3), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
                Kind::CoatedMirror => {
                    let thickness = pack_bounces(m, (n * 10.0).min(1e9) as u32);
                    [i, j, k, l, a[0], a[1], m.clamp(1e-3, 1e3), thickness]
                }
                Kind::CoatedDiffuseBase => [a[0], a[1], a[2], i.clamp(1e-3, 1e3), j, 0.0, 0.0, 0.0],
                Kind::CoatedDiffuse => {
                    let step =
                        |x: f32, y: f32| (x * 4095.0).floor() * 4096.0 + (y * 4095.0).floor();
                    let eta = i.clamp(1e-3, 1e3);
                    let t = [step(b[0], b[1]), step(b[2], a[0]), step(a[1], b[0])];
                    [a[0], a[1], a[2], eta, pack_alphas(u, v), t[0], t[1], t[2]]
                }
                Kind::CoatedConductor | Kind::CoatedConductorBase => {
                    let pairs = [pack_halves(i, l), pack_halves(j, m), pack_halves(k, n)];
                    let (eta, colour) = (l.clamp(1e-3, 1e3), pack_colour(b));
                    let [x, y, z] = pairs;
                    let layer = match kind {
                        Kind::CoatedConductor => pack_halves(i, j.clamp(0.25, 4.0)),
                        _ => i,
                    };
                    [
                        x,
                        y,
                        z,
                        eta,
                        pack_alphas(u, v),
                        pack_alphas(v, u),
                        layer,
                        colour,
                    ]
                }
                Kind::HenyeyGreenstein => [1.998 * a[0] - 0.999, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
                Kind::SmoothConductor | Kind::RoughConductor => [i, j, k, l, m, n, u, v],
                Kind::Hair => {
                    let beta = [b[1], b[2]].map(|beta| beta.clamp(0.01, 1.0));
                    hair::row([i, j, k], 2.0 * b[0] - 1.0, l, beta, sigma - 45.0)
                }
                Kind::Disney | Kind::DisneyThin => disney_row::Values {
                    colour: [a[0], a[1], i],
                    eta: resolved_eta(j, (b[0] * b[0]).max(1e-3)),
                    roughness: b[0],
                    metallic: b[1],
                    transmission: a[2],
                    specular_tint: a[0],
                    anisotropic: b[2],
                    sheen: k,
                    sheen_tint: a[1],
                    clearcoat: l,
                    gloss: b[1],
                    flatness: b[0],
                    through: b[2],
                }
                .row(),
                Kind::SubsurfaceExit => Exit::row(i.clamp(1.0, 100.0)),
                // Its table is not here: nothing is scattered.
                Kind::Fourier | Kind::Measured => [0.0; 8],
            };
            (kind, row)
        })
}

fn good(x: f32) -> bool {
    x.is_finite() && x >= 0.0
}

fn unit(w: [f32; 3]) -> bool {
    (Point::from(w).length() - 1.0).abs() < 1e-4
}

/// Scenes with every light and camera, and their worlds; built once.
fn all() -> &'static [(&'static Scene, World<'static>)] {
    static SCENES: OnceLock<Vec<(&str, Scene)>> = OnceLock::new();
    static ALL: OnceLock<Vec<(&Scene, World)>> = OnceLock::new();
    ALL.get_or_init(|| {
        let scenes = SCENES.get_or_init(scenes::all).iter();
        scenes
            .map(|(_, scene)| (scene, World::new(scene, 1)))
            .collect()
    })
}

proptest! {
    #![proptest_config(property::cases(4000))]

    /// Sampled directions are unit vectors with weights and densities that are numbers, the same
    /// from one lane and from eight.
    #[test]
    fn scattering_is_sampled_in_numbers(
        (kind, row) in material(),
        wo in direction(),
        u in prop::array::uniform3(sample()),
        importance in any::<bool>(),
    ) {
        let mode = if importance { Mode::Importance } else { Mode::Radiance };
        let (wi, weight, pdf, reverse) = Kernels::sample::<f32>(kind, &row, &[wo], &[u], mode)[0];
        let eight = Kernels::sample::<f32x8>(kind, &row, &[wo], &[u], mode)[0];
        prop_assert!(weight.iter().all(|w| good(*w)), "{:?}", weight);
        prop_assert_eq!(weight, eight.1);
        // Without a weight there is no sample.
        if weight != [0.0; 3] {
            prop_assert_eq!((wi, weight, pdf, reverse), eight);
            prop_assert!(unit(wi), "{:?}", wi);
            prop_assert!(good(pdf) && good(reverse), "{} {}", pdf, reverse);
            prop_assert!(kind.is_delta() || pdf > 0.0);
        }
    }

    /// Values and densities of any two directions are numbers.
    #[test]
    fn scattering_has_values_that_are_numbers(
        (kind, row) in material(),
        wo in direction(),
        wi in direction(),
        importance in any::<bool>(),
    ) {
        let mode = if importance { Mode::Importance } else { Mode::Radiance };
        let value = Kernels::eval::<f32>(kind, &row, &[wo], &[wi], mode)[0];
        prop_assert_eq!(value, Kernels::eval::<f32x8>(kind, &row, &[wo], &[wi], mode)[0]);
        let (f, pdf, reverse) = value;
        prop_assert!(f.iter().chain([&pdf, &reverse]).all(|x| good(*x)), "{:?}", value);
    }

    /// Cameras with and without a lens: rays are unit vectors with densities, and what they lead to
    /// is joined to where they came from.
    #[test]
    fn cameras_agree_with_themselves(
        which in any::<prop::sample::Index>(),
        place in prop::array::uniform2(sample()),
        lens in prop::array::uniform2(sample()),
        distance in -3f32..3.0,
    ) {
        let which = which.index(all().len());
        let (scene, _) = &all()[which];
        let camera = Camera::new(&scene.camera, &scene.film);
        let lens = (lens[0], lens[1]);
        let (x, y) = camera.region.place(place[0], place[1]);
        let ray = camera.ray::<f32, false>(x, y, lens);
        prop_assert!(unit(ray.direction.lane(0)) && good(ray.pdf) && ray.pdf > 0.0);
        let p = ray.direction.mul_add(10f32.powf(distance), ray.origin);
        let joined = camera.connect::<f32, false>(p, lens);
        // Positions at the very edge may round out of the region.
        if joined.valid {
            prop_assert!(good(joined.pdf) && unit(joined.to_camera.lane(0)), "scene {}", which);
            if camera.sphere_map().is_some() {
                // Another place may show the same.
                let other = camera.ray::<f32, false>(joined.raster.0, joined.raster.1, lens);
                let apart = (other.direction - ray.direction).length2().sqrt();
                prop_assert!(apart < 1e-4, "scene {}: {} apart", which, apart);
            } else {
                let apart = (joined.raster.0 - x).hypot(joined.raster.1 - y);
                prop_assert!(apart < 0.05, "scene {}: {} pixels apart", which, apart);
            }
        }
    }

    /// Lights seen from anywhere in the scene, from their own surface too: directions are unit
    /// vectors, densities and radiance numbers.
    #[test]
    fn lights_are_sampled_in_numbers(
        which in any::<prop::sample::Index>(),
        light in any::<prop::sample::Index>(),
        p in prop::array::uniform3(-1f32..1.0),
        u in prop::array::uniform4(sample()),
    ) {
        let which = which.index(all().len());
        let (scene, world) = &all()[which];
        let light = light.index(scene.lights.len()) as u32;
        check_light(world, light, p, u, &format!("scene {which}, light {light}"));
    }
}

/// The first and last primary samples there are: at the poles of a map its density vanishes.
#[test]
fn lights_are_sampled_in_numbers_at_the_corners() {
    let corner = |i: u32| [0.0, f32::MIN_POSITIVE, 1f32.next_down()][i as usize % 3];
    for (which, (scene, world)) in all().iter().enumerate() {
        for light in 0..scene.lights.len() as u32 {
            for i in 0..81 {
                let u = [1, 3, 9, 27].map(|n| corner(i / n));
                let what = format!("scene {which}, light {light}, {u:?}");
                check_light(world, light, [0.1, 0.2, -0.3], u, &what);
            }
        }
    }
}

/// A light as seen from `p` and from its own surface, and what it emits.
fn check_light(world: &World, light: u32, p: [f32; 3], u: [f32; 4], what: &str) {
    let (geometry, lights) = (&world.geometry, &world.lights);
    let sent = lights.sample_emission::<f32>(geometry, &[light], u);
    for p in [Vec3::splat(p), sent.origin] {
        let seen = lights.sample_direct::<f32>(geometry, &[light], p, [u[0], u[1]]);
        if seen.valid {
            assert!(unit(seen.to_light.lane(0)), "{what}");
            assert!(good(seen.pdf) && good(seen.emission_ratio), "{what}");
            let radiance = seen.radiance.lane(0);
            assert!(radiance.iter().all(|x| good(*x)), "{what}");
        }
    }
    let beta = sent.beta.lane(0);
    assert!(beta.iter().all(|x| good(*x)), "{what}: {beta:?}");
    if beta != [0.0; 3] {
        assert!(unit(sent.direction.lane(0)), "{what}");
        assert!(Point::from(sent.origin.lane(0)).is_finite(), "{what}");
    }
}
