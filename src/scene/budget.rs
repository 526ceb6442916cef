//! How much memory a scene may take.

use super::Loading;
use crate::memory::Bytes;
use std::cell::Cell;
use std::sync::Arc;

/// Memory that a scene may take while it is loaded, and what it has taken.
#[derive(Debug)]
pub(super) struct Budget {
    /// Bytes.
    limit: u64,
    taken: Cell<u64>,
    /// Is told.
    pub loading: Arc<Loading>,
}

impl Default for Budget {
    /// Without limit.
    fn default() -> Self {
        Self::new(u64::MAX, Arc::default())
    }
}

impl Budget {
    pub fn new(limit: u64, loading: Arc<Loading>) -> Self {
        Self {
            limit,
            taken: Cell::new(0),
            loading,
        }
    }

    /// Whether there is room for so many bytes more.
    ///
    /// # Errors
    /// There is not; the message says how much there is.
    pub fn check(&self, bytes: u64) -> Result<(), String> {
        let taken = self.taken.get();
        if taken.saturating_add(bytes) <= self.limit {
            return Ok(());
        }
        let beside = match taken {
            0 => String::new(),
            taken => format!(" beside {} for what comes before", Bytes(taken)),
        };
        Err(format!(
            "needs {} of memory{beside}, and the limit is {}",
            Bytes(bytes),
            Bytes(self.limit)
        ))
    }

    /// [`Self::check`], and takes them.
    pub fn take(&self, bytes: u64) -> Result<(), String> {
        self.check(bytes)?;
        self.taken.set(self.taken.get().saturating_add(bytes));
        self.loading.set_bytes(self.taken.get());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_is_gone() {
        let budget = Budget::new(100, Arc::default());
        budget.take(60).unwrap();
        budget.check(40).unwrap();
        let message = budget.take(41).unwrap_err();
        assert_eq!(
            message,
            "needs 41 B of memory beside 60 B for what comes before, and the limit is 100 B"
        );
        budget.take(40).unwrap();
        Budget::default().take(u64::MAX).unwrap();
    }
}
