//! Tables that BSDFs look their values up in: too large for a row, which only names one.

use std::any::Any;
use std::sync::Arc;

/// All tables of a scene.
#[derive(Clone, Default)]
pub struct Tabulated(Vec<Arc<dyn Any + Send + Sync>>);

impl Tabulated {
    /// Adds a table, or finds it if it is there; what rows call it.
    pub fn name_of<T: Any + Send + Sync>(&mut self, table: &Arc<T>) -> f32 {
        let address = Arc::as_ptr(table).cast::<()>();
        let known = (self.0.iter()).position(|t| Arc::as_ptr(t).cast::<()>() == address);
        let index = known.unwrap_or_else(|| {
            self.0.push(table.clone());
            self.0.len() - 1
        });
        index as f32
    }

    /// The table that a row calls by this name, if it is of this type.
    pub fn get<T: Any>(&self, name: f32) -> Option<&T> {
        self.0.get(name as usize)?.downcast_ref()
    }
}
