//! Error against time: integrators and settings run against each other on the same scenes.
//!
//! ```text
//! axes -> variants -> efforts for equal budgets -> runs, interleaved -> errors
//!      -> lines, times, efficiencies -> report
//! ```
//!
//! The error of a picture is its relative mean squared error ([`crate::metrics::relmse`]) against a
//! reference, less what the reference's own error adds to it ([`reference`](mod@reference)). A
//! *variant* is a list of labels and the [`Settings`](crate::integrate::Settings) they stand
//! for ([`plan`]); a *budget* is a time, or an effort, that every variant gets. Runs take turns
//! ([`run`]), so that a machine that changes its speed changes it for all. [`fit`] has the
//! statistics, [`figures`] what is said of a variant, and [`report`] writes it down.
//!
//! To sweep another setting, add an [`Axis`](plan::Axis).

pub mod figures;
pub mod fit;
pub mod gallery;
pub mod plan;
pub mod reference;
pub mod report;
pub mod run;
pub mod subject;
mod trial;
pub mod watch;
