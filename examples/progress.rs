//! A progress display of one's own, and a render that ends when it is good enough:
//! cargo run --release --example progress

use std::error::Error;
use std::path::Path;
use std::sync::Mutex;

use phalanx::integrate::{Observer, Phase, Settings, render};
use phalanx::pbrt;

/// The latest estimate of the picture's relative error.
#[derive(Default)]
struct Watch(Mutex<Option<f64>>);

impl Observer for Watch {
    fn progress(&self, phase: Phase, done: u64, total: u64) {
        let percent = 100 * done / total.max(1);
        match *self.0.lock().unwrap() {
            Some(error) => eprintln!("{phase:?} {percent} %, error {error:.3}"),
            None => eprintln!("{phase:?} {percent} %"),
        }
    }

    fn error(&self, relative: f64) {
        *self.0.lock().unwrap() = Some(relative);
    }

    // The picture is normalised correctly, wherever it ends.
    fn stop(&self) -> bool {
        self.0.lock().unwrap().is_some_and(|error| error < 0.2)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut scene = pbrt::load(Path::new("scenes/cornell.pbrt"))?;
    scene.set_resolution(64, 64)?;
    let settings = Settings::of(&scene);
    let render = render(&scene, &settings, &Watch::default())?;
    println!("{:?}, {} rays", render.ended_by, render.stats.rays);
    render.write("progress.png")?;
    Ok(())
}
