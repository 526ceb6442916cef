//! Tests of the renderer as a library: kernels against closed forms and independent arithmetic,
//! pictures against each other and against references. One binary, so that kernels are compiled for
//! tests once.

// The seeds of fuzz targets bring scenes of their own copy.
#![allow(clippy::duplicate_mod)]

mod accuracy;
mod alpha_masks;
mod analytic;
mod auto;
mod bdpt;
mod bidirectional;
mod bsdf;
mod built_scenes;
mod bumps;
mod cameras;
mod chains;
mod choice;
mod claims;
mod coated;
mod common;
mod determinism;
mod disney;
mod dispersion;
mod effects;
mod fourier;
mod fuzz_seeds;
mod glass_maps;
mod hair;
mod hard_cases;
mod hard_scenes;
mod image_lights;
mod instances;
mod lens_files;
mod lights;
mod lt;
mod made_up_states;
mod measured;
mod media;
mod mixtures;
mod mutation;
mod nanovdb;
mod precision;
mod probe;
mod properties;
#[path = "../../src/property.rs"]
mod property;
mod pssmlt;
mod reference;
mod reflectances;
mod replay;
mod resume;
mod rng;
mod rough_dielectric;
mod scenes_hard;
mod shapes;
mod strategies;
mod subsurface;
mod support;
mod tangents;
mod textures;
