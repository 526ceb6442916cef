//! Bilinear densities on the unit square that depend on two parameters: samples, and which sample
//! leads to a place (Dupuy and Jakob 2018, supplemental material; pbrt-v4's `PiecewiseLinear2D`).

/// A density for each pair of parameters, linear between.
#[derive(Debug, PartialEq)]
pub struct Warp {
    grid: Grid,
    /// Of each slice and row, its integral up to each column.
    conditional: Vec<f32>,
    /// Of each slice, its integral up to each row.
    marginal: Vec<f32>,
}

/// Values at the nodes of the unit square, with channels, of each pair of parameters.
#[derive(Debug, PartialEq)]
pub struct Grid {
    /// Nodes along `x` and `y`, 2 at least.
    size: [usize; 2],
    /// Values of the two parameters, rising.
    parameters: [Vec<f32>; 2],
    /// Slices, channels, rows.
    data: Vec<f32>,
    channels: usize,
}

/// Slices around a pair of parameters, and their weights.
#[derive(Clone, Copy)]
pub struct Slices([(usize, f64); 4]);

impl Grid {
    /// `data` are slices of channels of rows, `size` nodes along `x` and `y`.
    pub fn new(
        data: Vec<f32>,
        size: [usize; 2],
        parameters: [Vec<f32>; 2],
        channels: usize,
    ) -> Result<Self, String> {
        if size.iter().any(|n| *n < 2) {
            return Err("has a square of a single row".into());
        }
        let rises = |p: &Vec<f32>| !p.is_empty() && p.is_sorted_by(|a, b| a < b);
        if !parameters.iter().all(rises) {
            return Err("has angles that do not rise".into());
        }
        Ok(Self {
            size,
            parameters,
            data,
            channels,
        })
    }

    /// Around these parameters; the nearest beyond their ends.
    pub fn slices(&self, parameters: [f64; 2]) -> Slices {
        let around = |d: usize| {
            let (nodes, x) = (&self.parameters[d], parameters[d]);
            if nodes.len() == 1 {
                return (0, 0, 0.0);
            }
            let next = nodes.partition_point(|n| f64::from(*n) <= x);
            let next = next.clamp(1, nodes.len() - 1);
            let [a, b] = [next - 1, next].map(|i| f64::from(nodes[i]));
            (next - 1, next, ((x - a) / (b - a)).clamp(0.0, 1.0))
        };
        let ((a0, a1, s), (b0, b1, t)) = (around(0), around(1));
        let n = self.parameters[1].len();
        Slices([
            (a0 * n + b0, (1.0 - s) * (1.0 - t)),
            (a0 * n + b1, (1.0 - s) * t),
            (a1 * n + b0, s * (1.0 - t)),
            (a1 * n + b1, s * t),
        ])
    }

    fn node(&self, slices: &Slices, channel: usize, [x, y]: [usize; 2]) -> f64 {
        let at = |slice: usize| {
            let row = (slice * self.channels + channel) * self.size[1] + y;
            f64::from(self.data[row * self.size[0] + x])
        };
        slices.mix(at)
    }

    /// The patch that a place is in, and where in it.
    fn patch(&self, place: [f64; 2]) -> ([usize; 2], [f64; 2]) {
        let at = |d: usize| {
            let x = place[d].clamp(0.0, 1.0) * (self.size[d] - 1) as f64;
            let i = (x as usize).min(self.size[d] - 2);
            (i, x - i as f64)
        };
        let ((i, x), (j, y)) = (at(0), at(1));
        ([i, j], [x, y])
    }

    /// The value at a place.
    pub fn value(&self, slices: &Slices, channel: usize, place: [f64; 2]) -> f64 {
        let ([i, j], [x, y]) = self.patch(place);
        let row = |j: usize| {
            let [a, b] = [i, i + 1].map(|i| self.node(slices, channel, [i, j]));
            a + (b - a) * x
        };
        let (a, b) = (row(j), row(j + 1));
        a + (b - a) * y
    }
}

impl Slices {
    fn mix(&self, at: impl Fn(usize) -> f64) -> f64 {
        let some = self.0.iter().filter(|s| s.1 > 0.0);
        some.map(|(slice, weight)| weight * at(*slice)).sum()
    }
}

/// The integral of a line from `a` to `b`, inverted: `x` in [0, 1] where it has come to `sum`.
fn along(a: f64, b: f64, sum: f64) -> f64 {
    let x = 2.0 * sum / (a + (a * a + 2.0 * sum * (b - a)).max(0.0).sqrt());
    if x > 0.0 { x.min(1.0) } else { 0.0 }
}

/// The last of `n` rising numbers below `x`, but the last; the first if there is none.
fn interval(n: usize, x: f64, at: impl Fn(usize) -> f64) -> usize {
    let (mut low, mut high) = (0, n - 1);
    while high - low > 1 {
        let middle = low.midpoint(high);
        match at(middle) < x {
            true => low = middle,
            false => high = middle,
        }
    }
    low
}

impl Warp {
    /// Densities in proportion to a grid of one channel.
    pub fn new(mut grid: Grid) -> Result<Self, String> {
        let [nx, ny] = grid.size;
        if grid.data.iter().any(|v| *v < 0.0) {
            return Err("has densities below 0".into());
        }
        let (mut conditional, mut marginal) = (Vec::new(), Vec::new());
        for slice in grid.data.chunks_exact_mut(nx * ny) {
            let mut rows = Vec::new();
            let mut sums: Vec<f64> = Vec::new();
            for row in slice.chunks_exact(nx) {
                let mut sum = 0.0;
                sums.push(0.0);
                for pair in row.windows(2) {
                    sum += 0.5 * (f64::from(pair[0]) + f64::from(pair[1]));
                    sums.push(sum);
                }
                rows.push(sum);
            }
            let mut sum = 0.0;
            let mut up = vec![0.0];
            for pair in rows.windows(2) {
                sum += 0.5 * (pair[0] + pair[1]);
                up.push(sum);
            }
            if !(sum > 0.0 && sum.is_finite()) {
                return Err("has a density that is 0 everywhere".into());
            }
            conditional.extend(sums.iter().map(|s| (s / sum) as f32));
            marginal.extend(up.iter().map(|s| (s / sum) as f32));
            slice
                .iter_mut()
                .for_each(|v| *v = (f64::from(*v) / sum) as f32);
        }
        Ok(Self {
            grid,
            conditional,
            marginal,
        })
    }

    /// Around these parameters.
    pub fn slices(&self, parameters: [f64; 2]) -> Slices {
        self.grid.slices(parameters)
    }

    fn patches(&self) -> [f64; 2] {
        self.grid.size.map(|n| (n - 1) as f64)
    }

    fn up_to_row(&self, slices: &Slices, row: usize) -> f64 {
        slices.mix(|s| f64::from(self.marginal[s * self.grid.size[1] + row]))
    }

    fn up_to(&self, slices: &Slices, row: usize, column: usize) -> f64 {
        let [nx, ny] = self.grid.size;
        slices.mix(|s| f64::from(self.conditional[(s * ny + row) * nx + column]))
    }

    /// The density at a place.
    pub fn density(&self, slices: &Slices, place: [f64; 2]) -> f64 {
        let [x, y] = self.patches();
        self.grid.value(slices, 0, place) * x * y
    }

    /// A place, for a uniform sample.
    pub fn sample(&self, slices: &Slices, u: [f64; 2]) -> [f64; 2] {
        let [nx, ny] = self.grid.size;
        let row = interval(ny, u[1], |j| self.up_to_row(slices, j));
        let all = |j: usize| self.up_to(slices, j, nx - 1);
        let (r0, r1) = (all(row), all(row + 1));
        let y = along(r0, r1, u[1] - self.up_to_row(slices, row));
        let mix = |a: f64, b: f64| a + (b - a) * y;
        let x = u[0] * mix(r0, r1);
        let at = |i: usize| mix(self.up_to(slices, row, i), self.up_to(slices, row + 1, i));
        let column = interval(nx, x, at);
        let node = |i: usize| {
            let [a, b] = [row, row + 1].map(|j| self.grid.node(slices, 0, [i, j]));
            mix(a, b)
        };
        let rest = along(node(column), node(column + 1), x - at(column));
        let [px, py] = self.patches();
        [(column as f64 + rest) / px, (row as f64 + y) / py]
    }

    /// The sample that leads to a place, and the density there.
    pub fn invert(&self, slices: &Slices, place: [f64; 2]) -> ([f64; 2], f64) {
        let nx = self.grid.size[0];
        let ([i, j], [x, y]) = self.grid.patch(place);
        let mix = |a: f64, b: f64| a + (b - a) * y;
        let node = |i: usize| {
            let [a, b] = [j, j + 1].map(|j| self.grid.node(slices, 0, [i, j]));
            mix(a, b)
        };
        let (c0, c1) = (node(i), node(i + 1));
        let at = |i: usize| mix(self.up_to(slices, j, i), self.up_to(slices, j + 1, i));
        let (r0, r1) = (
            self.up_to(slices, j, nx - 1),
            self.up_to(slices, j + 1, nx - 1),
        );
        let along = (at(i) + x * (c0 + 0.5 * x * (c1 - c0))) / mix(r0, r1);
        let up = self.up_to_row(slices, j) + y * (r0 + 0.5 * y * (r1 - r0));
        let [px, py] = self.patches();
        let along = if along.is_finite() { along } else { 0.0 };
        ([along, up], (c0 + (c1 - c0) * x) * px * py)
    }
}
