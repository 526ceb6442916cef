//! Renders a scene file into a picture: cargo run --release --example render -- SCENE PICTURE

use std::error::Error;
use std::path::Path;

use phalanx::integrate::{Settings, Silent, render};
use phalanx::pbrt;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().unwrap_or("scenes/cornell.pbrt".into());
    let picture = arguments.next().unwrap_or("cornell.png".into());

    let scene = pbrt::load(Path::new(&scene))?;
    // What the scene file says, or pbrt's defaults.
    let settings = Settings::of(&scene);
    let render = render(&scene, &settings, &Silent)?;
    for warning in &render.warnings {
        eprintln!("warning: {warning}");
    }
    if let Some(error) = render.stats.relative_error {
        eprintln!("relative error {:.1} %", 100.0 * error);
    }
    render.write(&picture)?;
    Ok(())
}
