//! How far the loading of a scene has come, for whoever watches from another thread.

use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

/// Counts of what has been loaded so far.
#[derive(Debug, Default)]
pub struct Loading {
    primitives: AtomicU64,
    bytes: AtomicU64,
    file: Mutex<Option<String>>,
}

impl Loading {
    /// Triangles and spheres.
    pub fn primitives(&self) -> u64 {
        self.primitives.load(Ordering::Relaxed)
    }

    /// Memory of the scene, roughly.
    pub fn bytes(&self) -> u64 {
        self.bytes.load(Ordering::Relaxed)
    }

    /// Name of the mesh that is being read.
    pub fn file(&self) -> Option<String> {
        self.file.lock().ok()?.clone()
    }

    pub(super) fn add_primitives(&self, count: u64) {
        self.primitives.fetch_add(count, Ordering::Relaxed);
    }

    pub(super) fn set_bytes(&self, bytes: u64) {
        self.bytes.store(bytes, Ordering::Relaxed);
    }

    pub(super) fn set_file(&self, name: Option<String>) {
        if let Ok(mut file) = self.file.lock() {
            *file = name;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pbrt::load_within;
    use std::path::Path;
    use std::sync::Arc;

    #[test]
    fn what_is_loaded_is_counted() {
        let loading = Arc::new(Loading::default());
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bulb.pbrt");
        let scene = load_within(&path, u64::MAX, &loading).unwrap();
        let primitives = scene.triangles.len() + scene.spheres.len();
        assert!(!scene.spheres.is_empty() && !scene.triangles.is_empty());
        assert_eq!(loading.primitives(), primitives as u64);
        assert!(loading.bytes() > 0);
        assert_eq!(loading.file(), None);
    }
}
