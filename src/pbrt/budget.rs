//! How much memory a scene may take.

use super::loading::Loading;
use crate::memory::Bytes;
use std::cell::Cell;
use std::rc::Rc;
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

/// Bytes of a budget that something holds as long as it lives.
#[derive(Debug)]
pub(super) struct Charge {
    budget: Rc<Budget>,
    bytes: u64,
}

impl Charge {
    /// Takes the first bytes.
    pub fn of(budget: &Rc<Budget>, bytes: u64) -> Result<Self, String> {
        budget.take(bytes)?;
        Ok(Self {
            budget: Rc::clone(budget),
            bytes,
        })
    }

    /// Takes nothing yet.
    pub fn none(budget: &Rc<Budget>) -> Self {
        Self {
            budget: Rc::clone(budget),
            bytes: 0,
        }
    }

    /// Takes more.
    pub fn add(&mut self, bytes: u64) -> Result<(), String> {
        self.budget.take(bytes)?;
        self.bytes += bytes;
        Ok(())
    }

    /// Takes what a list needs to hold `more` entries, if it must grow for them.
    pub fn grow<T>(&mut self, list: &Vec<T>, more: usize) -> Result<(), String> {
        let (length, capacity) = (list.len().saturating_add(more), list.capacity());
        if length <= capacity {
            return Ok(());
        }
        let grown = length.max(2 * capacity).max(4) - capacity;
        self.add(grown as u64 * size_of::<T>() as u64)
    }
}

impl Drop for Charge {
    fn drop(&mut self) {
        let taken = self.budget.taken.get();
        self.budget.taken.set(taken.saturating_sub(self.bytes));
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
        budget.take(10).unwrap();
        let budget = Rc::new(budget);
        let mut charge = Charge::of(&budget, 10).unwrap();
        charge.add(21).unwrap_err();
        charge.add(20).unwrap();
        drop(charge);
        let mut charge = Charge::of(&budget, 10).unwrap();
        charge.grow(&Vec::<u32>::with_capacity(3), 3).unwrap();
        assert_eq!(budget.taken.get(), 80);
        charge.grow(&Vec::<u32>::with_capacity(3), 4).unwrap();
        assert_eq!(budget.taken.get(), 92);
        Budget::default().take(u64::MAX).unwrap();
    }
}
