//! What a pilot has seen: contributions of independent samples, and states of chains.

use crate::chain::trial::Trace;

/// Part of its rays that a mutation traces in the mean: many proposals end early.
const LIVE: f64 = 0.7;

/// A contribution of a sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Contribution {
    /// Number of the sample. Samples `2 i` and `2 i + 1` are of one pixel.
    pub sample: u32,
    pub depth: u32,
    /// It lies where the sample does, not elsewhere.
    pub placed: bool,
    pub raster: [f32; 2],
    /// Mean channel.
    pub value: f32,
}

/// Chains of a depth.
#[derive(Clone, Debug, Default)]
pub(super) struct Chains {
    /// Mean target of independent paths: the light of the depth.
    pub light: f64,
    /// Strategies of the depth, which a path chooses among uniformly.
    pub strategies: f64,
    /// Rays of a mutation.
    pub rays: f64,
    pub traces: Vec<Trace>,
}

/// A contribution and what it counts for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub sample: u32,
    pub placed: bool,
    pub value: f64,
    /// What a squared error at its place counts for.
    pub weight: f64,
}

/// A state of a chain.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    /// Part of all states of its depth.
    pub part: f64,
    /// Mean channel of its contribution, as samples would bring it.
    pub value: f64,
    /// What a squared error at its place counts for.
    pub weight: f64,
    /// The same beside the light that others have brought there.
    pub alone: f64,
    /// Integrated autocorrelation of its chain.
    pub memory: f64,
}

/// What is known of a depth.
#[derive(Clone, Debug, Default)]
pub(super) struct Depth {
    pub samples: Vec<Seen>,
    /// Mean radiance.
    pub light: f64,
    /// Rays of a mutation.
    pub rays: f64,
    pub states: Vec<State>,
}

/// Samples of a cell of the map.
const CELL: f64 = 32.0;
/// Where the picture is dimmer than this part of its mean its errors count as if it were not. Not
/// an absolute number: what is chosen does not depend on how bright the lights are.
const DARK: f64 = 0.3;

/// How bright the picture is, roughly.
struct Map {
    origin: [f64; 2],
    side: f64,
    columns: usize,
    rows: usize,
    radiance: Vec<f64>,
}

impl Map {
    /// Of cells that hold about [`CELL`] of so many samples. `region` is `[x0, y0, width,
    /// height]`.
    fn new(region: [f64; 4], samples: f64) -> Self {
        let [x0, y0, width, height] = region;
        let side = (width * height * CELL / samples.max(1.0)).sqrt().max(1.0);
        let count = |size: f64| (size / side).ceil().max(1.0) as usize;
        let (columns, rows) = (count(width), count(height));
        Self {
            origin: [x0, y0],
            side,
            columns,
            rows,
            radiance: vec![0.0; columns * rows],
        }
    }

    fn index(&self, raster: [f32; 2]) -> usize {
        let at = |axis: usize, count: usize| {
            let cell = (f64::from(raster[axis]) - self.origin[axis]) / self.side;
            (cell.max(0.0) as usize).min(count - 1)
        };
        at(1, self.rows) * self.columns + at(0, self.columns)
    }

    /// Light that falls at a place, in parts of the picture's mean radiance times its area.
    fn add(&mut self, raster: [f32; 2], light: f64) {
        let i = self.index(raster);
        self.radiance[i] += light / (self.side * self.side);
    }

    /// Light in the cell of a place, less what is to be left out of it.
    fn at(&self, raster: [f32; 2], without: f64) -> f64 {
        let others = self.radiance[self.index(raster)] - without / (self.side * self.side);
        others.max(0.0)
    }
}

/// States of a chain in the cell of one of them.
fn companions(map: &Map, trace: &Trace, raster: [f32; 2]) -> f64 {
    let cell = map.index(raster);
    let same = trace.states.iter().filter(|(at, _)| map.index(*at) == cell);
    same.count() as f64
}

/// What a pilot of so many samples over a region `[x0, y0, width, height]` knows of each depth.
/// `chains` are those of all depths, if there were any.
pub(super) fn gather(
    region: [f64; 4],
    samples: u32,
    contributions: &[Contribution],
    chains: &[Chains],
    depths: usize,
) -> Vec<Depth> {
    let area = region[2] * region[3];
    let each = area / f64::from(samples.max(1));
    let mut map = Map::new(region, f64::from(samples));
    // Samples and chains have seen the same light: each counts half.
    let half = if chains.is_empty() { 1.0 } else { 0.5 };
    for c in contributions {
        map.add(c.raster, half * each * f64::from(c.value));
    }
    for depth in chains {
        let states: usize = depth.traces.iter().map(|t| t.states.len()).sum();
        let light = half * depth.light * area / states.max(1) as f64;
        let states = depth.traces.iter().flat_map(|t| &t.states);
        states.for_each(|(raster, _)| map.add(*raster, light));
    }
    let mean = map.radiance.iter().sum::<f64>() * map.side * map.side / area;
    let dark = (DARK * mean).powi(2).max(f64::MIN_POSITIVE);
    let weight = |raster: [f32; 2], without: f64| 1.0 / (map.at(raster, without).powi(2) + dark);
    let mut all = vec![Depth::default(); depths];
    for (k, depth) in all.iter_mut().enumerate() {
        let tried = chains.get(k).map_or(0.0, |c| c.rays);
        let most = (k + 1) as f64;
        depth.rays = if tried > 0.0 { tried } else { LIVE * most };
    }
    for c in contributions {
        let depth = &mut all[c.depth as usize];
        let value = f64::from(c.value);
        depth.light += value / f64::from(samples.max(1));
        depth.samples.push(Seen {
            sample: c.sample,
            placed: c.placed,
            value,
            // What has brought the light counts, too: an edge would else be taken for luck.
            weight: weight(c.raster, 0.0),
        });
    }
    for (depth, chains) in all.iter_mut().zip(chains) {
        let states: usize = chains.traces.iter().map(|t| t.states.len()).sum();
        let own = half * chains.light * area / states.max(1) as f64;
        depth.light = chains.light;
        let of = |t: &Trace, (raster, target): &([f32; 2], f32)| State {
            part: 1.0 / states.max(1) as f64,
            value: f64::from(*target) / chains.strategies.max(1.0),
            weight: weight(*raster, 0.0),
            // A chain that is alone in a dark place leaves a spot there.
            alone: weight(*raster, own * companions(&map, t, *raster)),
            memory: t.memory,
        };
        depth.states = (chains.traces.iter())
            .flat_map(|t| t.states.iter().map(move |s| of(t, s)))
            .collect();
    }
    if chains.is_empty() {
        all.iter_mut().for_each(Depth::suppose);
    }
    all
}

/// Memory supposed of chains that were not tried; few have a shorter one.
const SUPPOSED: f64 = 3.0;

impl Depth {
    /// Supposes that chains would be where samples have found light, and forget quickly.
    fn suppose(&mut self) {
        let all: f64 = self.samples.iter().map(|s| s.value).sum();
        let state = |s: &Seen| State {
            part: s.value / all,
            value: s.value,
            weight: s.weight,
            alone: s.weight,
            memory: SUPPOSED,
        };
        self.states = self.samples.iter().map(state).collect();
    }
}
