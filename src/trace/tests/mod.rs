//! What the tracer promises, against oracles: every primitive tested by every ray.

mod agreement;
mod instances;
mod large;
mod scenes;
mod surfaces;
