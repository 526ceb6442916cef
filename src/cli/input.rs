//! The scene a command works on: a file, or the Cornell box inside the program.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::failure::Failure;
use super::memory::MemoryLimit;
use super::messages::Messages;
use super::progress::while_loading;
use crate::pbrt;
use crate::scene::Scene;

/// The built-in scene and the name that messages give it.
const DEFAULT: (&str, &str) = ("cornell.pbrt", include_str!("../../scenes/cornell.pbrt"));

/// Triangles, and as many spheres, that the tree can index.
const MAX_PRIMITIVES: usize = 1 << 26;

/// A loaded scene.
pub struct Input {
    pub scene: Scene,
    /// File, or name of the built-in scene.
    pub name: String,
    /// `None` is the built-in scene.
    pub path: Option<PathBuf>,
    pub load_time: Duration,
}

/// Loads a scene and passes on its warnings.
pub fn load(
    path: Option<&Path>,
    memory: &MemoryLimit,
    messages: Messages,
) -> Result<Input, Failure> {
    let start = Instant::now();
    let loaded = match path {
        Some(path) => {
            let loading = Arc::default();
            while_loading(&loading, messages, || {
                pbrt::load_within(path, memory.bytes, &loading)
            })
        }
        None => pbrt::load_str(DEFAULT.1, DEFAULT.0, Path::new("")),
    };
    let scene = loaded.map_err(|e| Failure::Input(e.to_string()))?;
    let name = path.map_or_else(|| DEFAULT.0.into(), |p| p.display().to_string());
    for warning in &scene.warnings {
        messages.warning(warning);
    }
    if scene.triangles.len().max(scene.spheres.len()) > MAX_PRIMITIVES {
        return Err(Failure::Input(format!(
            "{name}: {} triangles and {} spheres; at most {MAX_PRIMITIVES} of each can be rendered",
            scene.triangles.len(),
            scene.spheres.len()
        )));
    }
    Ok(Input {
        scene,
        name,
        path: path.map(Path::to_owned),
        load_time: start.elapsed(),
    })
}
