//! Which integrator has the smallest error after so many seconds?
//! cargo run --release --example compare_integrators -- SCENE SECONDS

use std::error::Error;
use std::path::Path;
use std::time::Duration;

use phalanx::integrate::{Settings, Silent, render};
use phalanx::pbrt;
use phalanx::scene::IntegratorKind;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let scene = arguments.next().unwrap_or("scenes/cornell.pbrt".into());
    let seconds: f64 = arguments.next().map_or(Ok(2.0), |s| s.parse())?;

    let mut scene = pbrt::load(Path::new(&scene))?;
    scene.set_resolution(128, 128)?;
    for integrator in IntegratorKind::ALL {
        let settings = Settings {
            integrator,
            time: Some(Duration::try_from_secs_f64(seconds)?),
            // Without end, but for the time.
            samples_per_pixel: 1 << 30,
            mutations_per_pixel: 1 << 30,
            ..Settings::of(&scene)
        };
        let done = render(&scene, &settings, &Silent)?;
        // Estimated by the render itself.
        let error = (done.stats.relative_error).map_or("unknown".into(), |e| format!("{e:.4}"));
        println!("{:12} {error}", integrator.name());
    }
    Ok(())
}
