//! What memory a render needs, before any of it is allocated.

use super::method::Method;
use super::{Settings, sampled, worker_threads};
use crate::chain::bootstrap::CHUNK;
use crate::chain::splats::ChainSplat;
use crate::film::{FilterTable, GROUPS, SampleFilm, SplatFilm, Tiling};
use crate::memory::Bytes;
use crate::scene::{IntegratorKind, LightKind, PathSamplerKind, Scene};
use crate::transport::bidirectional::{BidirectionalLayout, Strategy};
use std::collections::HashSet;
use std::fmt;

/// Bytes a primitive takes while the tree is built, and afterwards: `phalanx inspect` of meshes of
/// 2 and 5 million triangles peaked at 245 and ended at 72.
const BUILDING: u64 = 250;
const BUILT: u64 = 75;
/// The same of an instance: 411 MiB and 145 MiB for a million of them.
const PLACING: u64 = 300;
const PLACED: u64 = 170;
/// The program, and the workspace of a thread.
const PROGRAM: u64 = 10 << 20;
const THREAD: u64 = 3 << 20;
/// Chains of a depth at least, however little light it has.
const FEWEST: u64 = 512;

/// A part of a render, and the bytes it needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Need {
    /// Such as `film`.
    pub part: &'static str,
    /// At its fullest.
    pub bytes: u64,
    /// What it depends on, for people.
    pub why: String,
}

/// Memory of a render at its fullest, in parts.
#[derive(Clone, Debug, PartialEq)]
pub struct Needs(pub Vec<Need>);

impl Needs {
    /// Of [`render`](super::render) with these settings, the scene included. Within some per cent
    /// for large scenes and films.
    pub fn of(scene: &Scene, settings: &Settings) -> Self {
        Self::with(scene, settings, false)
    }

    /// The same of a render whose state is taken now and then, or that is resumed from one.
    pub fn of_kept(scene: &Scene, settings: &Settings) -> Self {
        Self::with(scene, settings, true)
    }

    fn with(scene: &Scene, settings: &Settings, kept: bool) -> Self {
        let primitives = (scene.triangles.len() + scene.spheres.len()) as u64;
        let need = |part, bytes, why: String| Need { part, bytes, why };
        let tables = need("scene", scene.bytes(), format!("{primitives} primitives"));
        let threads = worker_threads(settings.threads);
        let thread = THREAD + kept_bytes(settings);
        let program = need("program", PROGRAM + thread * threads as u64, String::new());
        let instances = scene.instances.placed.len() as u64;
        let tree = |[each, instance]: [u64; 2], what: &str| {
            let why = match instances {
                0 => format!("{primitives} primitives{what}"),
                _ => format!("{primitives} primitives and {instances} instances{what}"),
            };
            need("tree", each * primitives + instance * instances, why)
        };
        let crop = scene.film.crop;
        let why = format!("{} x {} pixels", crop[1] - crop[0], crop[3] - crop[2]);
        let film = need("film", film_bytes(settings, scene), why);
        let lights = lights(scene);
        let mut building = vec![
            tables.clone(),
            program.clone(),
            tree([BUILDING, PLACING], ", being sorted"),
        ];
        let mut rendering = vec![tables, program, tree([BUILT, PLACED], ""), film];
        building.extend(lights.clone());
        let mut phases = vec![building];
        if settings.integrator.mutates() {
            let integrals = integrals(settings);
            let paths = settings.bootstrap.saturating_mul(integrals);
            let mut why = format!("{} paths", settings.bootstrap);
            if integrals > 1 {
                why += &format!(" for each of {integrals} depths");
            }
            let mut bootstrap = rendering[..3].to_vec();
            bootstrap.extend(lights.clone());
            let bytes = paths.saturating_mul(size_of::<f32>() as u64);
            bootstrap.push(need("bootstrap", bytes, why));
            phases.push(bootstrap);
            rendering.push(chains(scene, settings));
        }
        if kept {
            // Compressed it takes about half; two of them can be there at a time.
            let state = rendering[3..].iter().map(|need| need.bytes).sum();
            rendering.push(need("checkpoint", state, "film and chains".into()));
        }
        rendering.extend(lights);
        phases.push(rendering);
        let fullest = phases.into_iter().map(Needs).max_by_key(Needs::bytes);
        fullest.unwrap_or(Needs(Vec::new()))
    }

    /// In all.
    pub fn bytes(&self) -> u64 {
        let parts = self.0.iter().map(|need| need.bytes);
        parts.fold(0, u64::saturating_add)
    }
}

/// `1.5 GiB (film, 3000 x 2000 pixels), 0.5 GiB (tree, ...)`: largest first, those that matter.
impl fmt::Display for Needs {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut parts: Vec<&Need> = self.0.iter().collect();
        parts.sort_by_key(|need| std::cmp::Reverse(need.bytes));
        let matters = |need: &&Need| need.bytes >= self.bytes() / 20;
        for (i, need) in parts.into_iter().filter(matters).enumerate() {
            let comma = if i > 0 { ", " } else { "" };
            write!(f, "{comma}{} {}", need.part, Bytes(need.bytes))?;
            if !need.why.is_empty() {
                write!(f, " ({})", need.why)?;
            }
        }
        Ok(())
    }
}

/// Tables of lights, if they are of any size: every light that shines through an image, or as one
/// from all around, has a copy of it and a distribution over its texels; lamps with the same image
/// share a copy.
fn lights(scene: &Scene) -> Option<Need> {
    const LIGHT: u64 = 200;
    const COPY: u64 = size_of::<[f32; 3]>() as u64;
    const DISTRIBUTION: u64 = size_of::<f32>() as u64;
    let texels = |image: u32| scene.images[image as usize].texels.len() as u64;
    let mut bytes = LIGHT * scene.lights.len() as u64;
    let mut most = 0;
    let mut images = 0;
    let mut shared = HashSet::new();
    for light in &scene.lights {
        match light.kind {
            LightKind::InfiniteImage { image, .. }
            | LightKind::Goniometric { image, .. }
            | LightKind::Projection { image, .. } => {
                bytes += texels(image) * (COPY + DISTRIBUTION);
                // Distributions are made in `f64`, one after the other.
                most = texels(image).max(most);
                images += 1;
            }
            LightKind::ImageTriangle { image, .. } | LightKind::ImageSphere { image, .. }
                if shared.insert(image) =>
            {
                bytes += texels(image) * COPY;
            }
            _ => {}
        }
    }
    bytes += most * size_of::<f64>() as u64;
    (bytes > NOTABLE).then(|| Need {
        part: "lights",
        bytes,
        why: format!("{}, {images} with images", scene.lights.len()),
    })
}

/// Lights that take less are not worth a word.
const NOTABLE: u64 = 1 << 20;

/// The film of a render, the finished picture included.
fn film_bytes(settings: &Settings, scene: &Scene) -> u64 {
    let pixels = scene.film.crop_pixels();
    let judged = u64::from(settings.estimate_error);
    let filter = FilterTable::new(&scene.film.filter, scene.film.crop);
    let bytes = |placed| SampleFilm::bytes(&filter, placed, settings.estimate_error);
    let sums = match settings.integrator {
        kind @ (IntegratorKind::Mmlt | IntegratorKind::Pssmlt(_)) => {
            let combined = matches!(kind, IntegratorKind::Pssmlt(_));
            let layers = Method::layers(integrals(settings) as usize, combined) as u64;
            SplatFilm::bytes(pixels, layers + judged)
        }
        // Chains of every depth, and samples beside them.
        IntegratorKind::Auto => {
            let layers = Method::layers(integrals(settings) as usize, false) as u64;
            SplatFilm::bytes(pixels, layers + judged) + pixels * (bytes(true) + bytes(false))
        }
        IntegratorKind::Pt => pixels * bytes(true),
        // What is placed, and what is splatted.
        IntegratorKind::Lt | IntegratorKind::Bdpt => pixels * (bytes(true) + bytes(false)),
    };
    let parts = parts(settings);
    let sums = sums.saturating_add(pixels * parts * SampleFilm::bytes(&filter, true, false));
    let pictures = 1 + u64::from(settings.error_layers) + parts;
    sums + pixels * pictures * size_of::<[f32; 3]>() as u64
}

/// Integrals that chains are shared among.
fn integrals(settings: &Settings) -> u64 {
    match settings.integrator {
        IntegratorKind::Auto | IntegratorKind::Mmlt => u64::from(settings.max_depth) + 1,
        _ => 1,
    }
}

/// Pictures of strategies, weighted and not.
fn parts(settings: &Settings) -> u64 {
    match settings.strategies && settings.integrator == IntegratorKind::Bdpt {
        true => 2 * Strategy::most(settings.max_depth),
        false => 0,
    }
}

/// What a thread holds of subpaths whose vertices are kept.
fn kept_bytes(settings: &Settings) -> u64 {
    let paths = match settings.integrator {
        IntegratorKind::Auto | IntegratorKind::Lt | IntegratorKind::Bdpt => sampled::BATCH,
        // The bootstrap's.
        IntegratorKind::Pssmlt(PathSamplerKind::Bdpt) => CHUNK as usize,
        _ => return 0,
    };
    let paths = settings.batch.unwrap_or(0).max(paths) as u64;
    let parts = parts(settings) > 0;
    let each = BidirectionalLayout::bytes_per_path(settings.max_depth, parts);
    paths.saturating_mul(each)
}

/// Chains: their primary samples twice, their states, and what is recorded of them.
fn chains(scene: &Scene, settings: &Settings) -> Need {
    if let IntegratorKind::Pssmlt(sampler) = settings.integrator {
        return whole_chains(scene, settings, sampler);
    }
    let chain = |depth: u64| {
        // Strategy, raster, lens; three numbers a bounce on either side; light choice, emission,
        // connection.
        let samples = 16 + 6 * depth;
        let states = 2 * size_of::<ChainSplat>() as u64 + 64;
        let recorded = if settings.estimate_error {
            260 + 16 * depth
        } else {
            0
        };
        8 * samples + states + recorded
    };
    let deepest = u64::from(settings.max_depth);
    let least: u64 = (0..=deepest).map(|depth| FEWEST * chain(depth)).sum();
    let count = settings.chains + FEWEST * (deepest + 1);
    // Most light has few bounces.
    let mut bytes = settings.chains * chain(deepest / 2) + least;
    if settings.estimate_error {
        // Every batch has sums for each tile.
        let batches = count / 256 + 2 * (deepest + 1);
        let tiles = Tiling::new(scene.film.crop).len() as u64;
        bytes += batches * tiles * 48 + (deepest + 1) * tiles * (GROUPS * 8) as u64;
    }
    Need {
        part: "chains",
        bytes,
        why: format!("{} and more of up to {deepest} bounces", settings.chains),
    }
}

/// Chains of all depths at once.
fn whole_chains(scene: &Scene, settings: &Settings, sampler: PathSamplerKind) -> Need {
    let depth = u64::from(settings.max_depth);
    // Raster, lens, wavelength; and a bounce with everything that can be chosen at it, its
    // connection included.
    let (samples, splats) = match sampler {
        PathSamplerKind::Pt => (5 + 7 * depth, 1),
        PathSamplerKind::Bdpt => (10 + 13 * depth, 1 + depth),
    };
    let states = splats * 2 * size_of::<ChainSplat>() as u64 + 64;
    let mut bytes = settings.chains * (8 * samples + states);
    if settings.estimate_error {
        let batches = settings.chains / 256 + 2;
        let tiles = Tiling::new(scene.film.crop).len() as u64;
        bytes += settings.chains * 280 + batches * tiles * 64 + tiles * (3 * GROUPS * 8) as u64;
    }
    let up_to = format!("{} of up to {depth} bounces", settings.chains);
    Need {
        part: "chains",
        bytes,
        why: up_to,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pbrt::load_str;

    #[test]
    fn the_fullest_phase_counts() {
        let text = "Film \"image\" \"integer xresolution\" 100 \"integer yresolution\" 100\nWorldBegin\n\
                    LightSource \"infinite\"\nShape \"sphere\"\nWorldEnd\n";
        let scene = load_str(text, "a.pbrt", "".as_ref()).unwrap();
        let mut settings = Settings::of(&scene);
        let small = Needs::of(&scene, &settings);
        assert!(small.bytes() < 200 << 20, "{small}");
        settings.bootstrap = 1 << 32;
        let large = Needs::of(&scene, &settings);
        assert!(
            large
                .to_string()
                .starts_with("bootstrap 96.0 GiB (4294967296 paths for each of 6 depths)"),
            "{large}"
        );
        settings.bootstrap = 1000;
        settings.chains = 1 << 20;
        assert!(
            Needs::of(&scene, &settings)
                .to_string()
                .starts_with("chains")
        );
        settings.integrator = IntegratorKind::Pt;
        assert_eq!(Needs::of(&scene, &settings).0.len(), 4);
        let film = |settings: &Settings| Needs::of(&scene, settings).0[3].bytes;
        let traced = film(&settings);
        settings.integrator = IntegratorKind::Bdpt;
        assert_eq!(film(&settings) - traced, 100 * 100 * 2 * 51);
        settings.strategies = true;
        // Depth 0 has one, depths 1 to 5 have 3 to 7.
        assert_eq!(
            film(&settings) - traced,
            100 * 100 * (2 * 51 + 2 * 26 * (51 + 12))
        );
    }
}
