//! What the tracer promises, against oracles: every primitive tested by every ray.

mod agreement;
mod scenes;
mod surfaces;
