use phalanx::{integrate::*, scene};
use std::path::Path;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let s = scene::load(Path::new(&a[1])).unwrap_or_else(|e| {
        eprintln!("{e}");
        std::process::exit(2)
    });
    for w in &s.warnings {
        eprintln!("warning: {w}");
    }
    let mut set = Settings::of(&s);
    let out = &a[2];
    for f in &a[3..] {
        let (k, v) = f.split_once('=').unwrap();
        match k {
            "i" => {
                set.integrator = if v == "pt" {
                    scene::IntegratorKind::Pt
                } else {
                    scene::IntegratorKind::Mmlt
                }
            }
            "m" => set.mutations_per_pixel = v.parse().unwrap(),
            "spp" => set.samples_per_pixel = v.parse().unwrap(),
            "seed" => set.seed = v.parse().unwrap(),
            "t" => set.threads = v.parse().unwrap(),
            "l" => set.lanes = if v == "1" { Width::One } else { Width::Eight },
            "d" => set.max_depth = v.parse().unwrap(),
            "c" => set.chains = v.parse().unwrap(),
            "b" => set.bootstrap = v.parse().unwrap(),
            "B" => set.batch = Some(v.parse().unwrap()),
            _ => panic!(),
        }
    }
    let r = render(&s, &set, &Silent).unwrap();
    println!("{:?}", r.stats);
    for w in &r.warnings {
        eprintln!("warning: {w}");
    }
    let p = phalanx::film::output::Picture {
        width: r.width,
        height: r.height,
        offset: [0, 0],
        full: [r.width, r.height],
        pixels: r.pixels,
    };
    phalanx::film::output::write(Path::new(&format!("{out}.pfm")), &p, &[], 0.0).unwrap();
    phalanx::film::output::write(Path::new(&format!("{out}.png")), &p, &[], 0.0).unwrap();
}
