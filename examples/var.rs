use phalanx::{chain::*, integrate::*, scene, simd::*, transport::*};
use std::path::Path;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let s = scene::load(Path::new(&a[1])).unwrap();
    let set = Settings::of(&s);
    let w = World::new(&s, set.max_depth);
    let mut paths = Paths::new(&w);
    let mut tot_b = 0.0;
    let mut tot_v = 0.0;
    let mut tot_vs = 0.0;
    for d in &w.plan.depths {
        let n = 1024usize;
        let mut m: Vec<(f64, f64, f64, f64)> = vec![(0.0, 0.0, 0.0, 0.0); d.depth as usize + 2];
        let reps = 300u64;
        for r in 0..reps {
            let idx: Vec<u64> = (0..n as u64).map(|i| r * n as u64 + i).collect();
            let samples = bootstrap::regenerate::<f32x8>(d, 1, &idx);
            w.evaluate_multiplexed::<f32x8>(d, &samples, n, &mut paths);
            for o in &paths.outcome {
                let t = accept::target(o.rgb) as f64;
                let e = &mut m[o.s as usize];
                e.0 += 1.0;
                e.1 += t;
                e.2 += t * t;
                if t > 0.0 {
                    e.3 += 1.0;
                }
            }
        }
        let tot = (reps as usize * n) as f64;
        let b: f64 = m.iter().map(|e| e.1).sum::<f64>() / tot;
        let v: f64 = m.iter().map(|e| e.2).sum::<f64>() / tot - b * b;
        let vs: f64 = m
            .iter()
            .filter(|e| e.0 > 0.0)
            .map(|e| (e.2 / e.0 - (e.1 / e.0).powi(2)) * e.0 / tot)
            .sum();
        println!(
            "depth {} b {:.5} relvar {:.1} strat {:.1}",
            d.depth,
            b,
            v / b / b,
            vs / b / b
        );
        for (s, e) in m.iter().enumerate() {
            if e.0 > 0.0 {
                println!(
                    "   s={s} share {:.3} nonzero {:.3} var-share {:.3}",
                    e.1 / tot / b,
                    e.3 / e.0,
                    e.2 / tot / (v + b * b)
                );
            }
        }
        tot_b += b;
        tot_v += v;
        tot_vs += vs;
    }
    println!(
        "b {tot_b} relvar {} strat {}",
        tot_v / tot_b / tot_b,
        tot_vs / tot_b / tot_b
    );
}
