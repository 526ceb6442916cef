//! The scene a command works on: a file, or the one inside the program.

use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::failure::Failure;
use super::memory::MemoryLimit;
use super::messages::Messages;
use super::progress::while_loading;
use crate::memory::Bytes;
use crate::pbrt;
use crate::scene::Scene;

/// The built-in scene and the name that messages give it.
const DEFAULT: (&str, &str) = ("studio.pbrt", include_str!("../../scenes/studio.pbrt"));

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

/// What messages call a scene that comes from standard input.
const STDIN: &str = "stdin";

/// `-` stands for standard input.
pub fn is_stdin(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// All of standard input, if it is shorter than `most` bytes.
fn read_stdin(most: u64) -> Result<Vec<u8>, Failure> {
    let mut content = Vec::new();
    let mut stdin = io::stdin().lock().take(most);
    let read = stdin.read_to_end(&mut content);
    let count = read.map_err(|e| Failure::Input(format!("{STDIN}: cannot be read: {e}")))?;
    if count as u64 == most {
        let most = Bytes(most);
        return Err(Failure::Input(format!("{STDIN}: does not fit into {most}")));
    }
    Ok(content)
}

/// Loads a scene and passes on its warnings.
pub fn load(
    path: Option<&Path>,
    memory: &MemoryLimit,
    messages: Messages,
) -> Result<Input, Failure> {
    let start = Instant::now();
    let loaded = match path {
        Some(path) if is_stdin(path) => {
            let content = read_stdin(memory.bytes)?;
            let loading = Arc::default();
            while_loading(&loading, messages, || {
                pbrt::load_bytes(&content, STDIN, memory.bytes, &loading)
            })
        }
        Some(path) => {
            let loading = Arc::default();
            while_loading(&loading, messages, || {
                pbrt::load_within(path, memory.bytes, &loading)
            })
        }
        None => pbrt::load_str(DEFAULT.1, DEFAULT.0, Path::new("")),
    };
    let scene = loaded.map_err(|e| Failure::Input(e.to_string()))?;
    let name = match path {
        None => DEFAULT.0.into(),
        Some(path) if is_stdin(path) => STDIN.into(),
        Some(path) => path.display().to_string(),
    };
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
