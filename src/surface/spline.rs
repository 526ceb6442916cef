//! Cubic interpolation over nodes at any distances (Catmull and Rom 1974): tangents at a node are
//! those of the chord of its neighbours, at both ends of the first and the last interval its own.

/// Two nodes and what is between them; `t` goes from 0 to 1.
#[derive(Clone, Copy, Debug)]
pub struct Segment {
    /// From node to node.
    pub width: f64,
    values: [f64; 2],
    /// Per `t`.
    tangents: [f64; 2],
}

/// The interval that `x` is in, if it is in any.
pub fn interval(nodes: &[f64], x: f64) -> Option<usize> {
    let inside = x >= *nodes.first()? && x <= *nodes.last()?;
    let after = nodes.partition_point(|node| *node <= x);
    inside.then(|| after.clamp(1, nodes.len() - 1) - 1)
}

/// How the four nodes from `interval - 1` on are weighed at `x`; those that are none have 0.
pub fn weights(nodes: &[f64], interval: usize, x: f64) -> [f64; 4] {
    std::array::from_fn(|k| {
        let unit = |i: usize| if i + 1 == interval + k { 1.0 } else { 0.0 };
        let segment = Segment::new(nodes, interval, unit);
        segment.value((x - nodes[interval]) / segment.width)
    })
}

impl Segment {
    /// From node `i` to the next; `value` says what a node has.
    pub fn new(nodes: &[f64], i: usize, value: impl Fn(usize) -> f64) -> Self {
        let width = nodes[i + 1] - nodes[i];
        let values = [value(i), value(i + 1)];
        let chord =
            |a: usize, b: usize, va: f64, vb: f64| width * (vb - va) / (nodes[b] - nodes[a]);
        let [first, last] = values;
        let before = i.checked_sub(1);
        let after = (i + 2 < nodes.len()).then_some(i + 2);
        Self {
            width,
            values,
            tangents: [
                before.map_or(last - first, |j| chord(j, i + 1, value(j), last)),
                after.map_or(last - first, |j| chord(i, j, first, value(j))),
            ],
        }
    }

    /// Coefficients of the powers of `t`.
    fn powers(&self) -> [f64; 4] {
        let ([a, b], [da, db]) = (self.values, self.tangents);
        [
            a,
            da,
            3.0 * (b - a) - 2.0 * da - db,
            2.0 * (a - b) + da + db,
        ]
    }

    /// At `t`.
    pub fn value(&self, t: f64) -> f64 {
        let [a, b, c, d] = self.powers();
        a + t * (b + t * (c + t * d))
    }

    /// From 0 to `t`, over `t`.
    pub fn integral(&self, t: f64) -> f64 {
        let [a, b, c, d] = self.powers();
        t * (a + t * (b / 2.0 + t * (c / 3.0 + t * d / 4.0)))
    }

    fn slope(&self, t: f64) -> f64 {
        let [_, b, c, d] = self.powers();
        b + t * (2.0 * c + 3.0 * t * d)
    }

    /// Where [`Self::value`] is `target`, which is between those of its ends.
    pub fn find_value(&self, target: f64) -> f64 {
        solve(target, |t| (self.value(t), self.slope(t)))
    }

    /// Where [`Self::integral`] is `target`, which is at most that of the whole.
    pub fn find_integral(&self, target: f64) -> f64 {
        solve(target, |t| (self.integral(t), self.value(t)))
    }
}

/// Where a function of `[0, 1]` with its derivative is `target`: Newton's steps, or halves where
/// they lead out of what is known to hold it.
fn solve(target: f64, f: impl Fn(f64) -> (f64, f64)) -> f64 {
    let ([mut low, mut high], mut t) = ([0.0, 1.0], 0.5);
    for _ in 0..60 {
        let (value, slope) = f(t);
        if value < target {
            low = t;
        } else {
            high = t;
        }
        let next = t - (value - target) / slope;
        let next = if next > low && next < high {
            next
        } else {
            0.5 * (low + high)
        };
        if (next - t).abs() < 1e-9 {
            return next;
        }
        t = next;
    }
    t
}

#[cfg(test)]
mod tests {
    use super::*;

    const NODES: [f64; 5] = [0.0, 0.1, 0.5, 0.6, 2.0];

    /// Straight lines stay what they are, at uneven nodes as well.
    #[test]
    fn lines_are_lines() {
        let line = |x: f64| 3.0 * x + 1.0;
        for j in 0..=200 {
            let x = f64::from(j) / 100.0;
            let i = interval(&NODES, x).unwrap();
            let segment = Segment::new(&NODES, i, |i| line(NODES[i]));
            let t = (x - NODES[i]) / segment.width;
            assert!((segment.value(t) - line(x)).abs() < 1e-12);
            assert!((segment.find_value(line(x)) - t).abs() < 1e-6);
            assert!((segment.find_integral(segment.integral(t)) - t).abs() < 1e-6);
            let w = weights(&NODES, i, x);
            let sum: f64 = (0..4)
                .filter(|k| (1..6).contains(&(i + k)))
                .map(|k| w[k] * line(NODES[i + k - 1]))
                .sum();
            assert!((sum - line(x)).abs() < 1e-12, "{x} {w:?}");
        }
        assert_eq!(interval(&NODES, 2.1), None);
        assert_eq!(interval(&NODES, f64::NAN), None);
    }
}
