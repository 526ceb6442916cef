//! Bright spots: what is said of them, and their replacement.

use crate::cli::args::errors::ErrorArgs;
use crate::cli::messages::Messages;
use crate::integrate::{Render, Speckles, Stats};

/// Spots that are named one by one.
const NAMED: usize = 10;
/// Relative standard error of a tile's mean from which on it rests on little.
const UNCERTAIN: f64 = 0.3;

/// Finds spots if they are asked for, reports them and replaces them. What has been replaced is
/// handed back: the picture as it was rendered.
pub fn treat(args: &ErrorArgs, render: &mut Render, messages: Messages) -> Option<Vec<[f32; 3]>> {
    if !args.despeckle && !args.firefly_report {
        return None;
    }
    let Some(deviation) = &render.deviation else {
        let flag = match args.despeckle {
            true => "--despeckle",
            false => "--firefly-report",
        };
        messages.warning(format_args!(
            "{flag}: one sample per pixel has no two halves to compare; nothing is looked for"
        ));
        return None;
    };
    let width = render.width as usize;
    let mut found = Speckles::find(&render.pixels, deviation, width, render.offset);
    if args.firefly_report {
        for line in report(&found, &render.stats, render.offset) {
            messages.always(line);
        }
    }
    let raw = args.despeckle.then(|| {
        let raw = render.pixels.clone();
        found.replace(&mut render.pixels);
        raw
    });
    render.stats.speckles = Some(found);
    raw
}

/// What `--despeckle` has done; `kept` says where the picture as it was rendered is.
pub fn replaced(found: &Speckles, pixels: usize, kept: &[String]) -> String {
    if found.pixels == 0 {
        return "--despeckle: there is no spot that one half of the render alone knows of".into();
    }
    let kept = match kept {
        [] => "what was rendered is kept nowhere (.exr files would have it in layers raw)".into(),
        files => format!("layers raw of {} have what was rendered", files.join(", ")),
    };
    format!(
        "--despeckle: {} replaced, {:.2} % of the pixels, by the medians of their surroundings; \
         {:.3} % of the picture's light is gone, by which it is biased; {kept}",
        count(found),
        100.0 * found.pixels as f64 / pixels.max(1) as f64,
        100.0 * found.share
    )
}

fn count(found: &Speckles) -> String {
    let s = |n: usize| if n == 1 { "" } else { "s" };
    let (pixels, spots) = (found.pixels, found.spots.len());
    format!("{pixels} pixel{} in {spots} spot{}", s(pixels), s(spots))
}

/// Lines of `--firefly-report`.
fn report(found: &Speckles, stats: &Stats, offset: [u32; 2]) -> Vec<String> {
    let mut lines = vec![match found.pixels {
        0 => "fireflies: none; both halves of the render agree on what is bright".into(),
        _ => format!(
            "fireflies: {} that only one half of the render knows of, with {:.3} % of the picture's light",
            count(found),
            100.0 * found.share
        ),
    }];
    lines.extend(found.spots.iter().take(NAMED).map(|spot| {
        let stuck = stay_at(stats, spot.x as f32, spot.y as f32).map_or(String::new(), |(d, n)| {
            format!("; one chain of {d} stayed there for {n} mutations")
        });
        format!(
            "  pixel {}, {}: {} pixel{}, {:.1} times as bright as around it, {:.3} % of the light{stuck}",
            spot.x,
            spot.y,
            spot.pixels,
            if spot.pixels == 1 { "" } else { "s" },
            spot.times,
            100.0 * spot.share
        )
    }));
    if found.spots.len() > NAMED {
        lines.push(format!(
            "  and {} more, all in \"speckles\" of --stats",
            found.spots.len() - NAMED
        ));
    }
    lines.extend(tiles(stats, offset));
    lines
}

/// The chain that was stuck at a place, to within two pixels: its depth and how long.
fn stay_at(stats: &Stats, x: f32, y: f32) -> Option<(String, u32)> {
    let near = |at: f32, to: f32| (at - 0.5 - to).abs() <= 2.0;
    let all = stats.depths.iter().flat_map(|d| {
        let name = d
            .depth
            .map_or("all depths".into(), |n| format!("depth {n}"));
        d.mixing.stuck.iter().map(move |s| (name.clone(), s))
    });
    all.filter(|(_, s)| near(s.x, x) && near(s.y, y))
        .map(|(name, s)| (name, s.iterations))
        .max_by_key(|(_, n)| *n)
}

/// Tiles whose mean rests on little.
fn tiles(stats: &Stats, offset: [u32; 2]) -> Option<String> {
    let tiles = stats.tiles.as_ref()?;
    let stderr = tiles.stderr.as_ref()?;
    let uncertain = |(_, (mean, stderr)): &(usize, (&f64, &f64))| *stderr > &(UNCERTAIN * **mean);
    let all = || tiles.mean.iter().zip(stderr).enumerate().filter(uncertain);
    let relative = |(_, (mean, stderr)): &(usize, (&f64, &f64))| *stderr / *mean;
    let worst = all().max_by(|a, b| relative(a).total_cmp(&relative(b)))?;
    let light: f64 = all().map(|(_, (mean, _))| mean).sum();
    let total: f64 = tiles.mean.iter().sum();
    let place = [worst.0 % tiles.columns, worst.0 / tiles.columns];
    let [x, y] =
        std::array::from_fn(|i| u64::from(offset[i]) + place[i] as u64 * u64::from(tiles.size));
    let last = u64::from(tiles.size) - 1;
    Some(format!(
        "  {} of {} tiles rest on few chains or samples (their means are known to {:.0} % at best), with {:.2} % of the light; the worst \
         at pixels {x}-{}, {y}-{}: {:.0} %",
        all().count(),
        tiles.mean.len(),
        100.0 * UNCERTAIN,
        100.0 * light / total.max(f64::MIN_POSITIVE),
        x + last,
        y + last,
        100.0 * relative(&worst)
    ))
}
