//! Statistics of tests: a generator apart from the renderer's, chi-square, and bounds by
//! false-alarm rate.

/// Chance that a correct program fails one comparison. Tests that make many compare against this
/// over their number.
pub const FALSE_ALARM: f64 = 1e-8;

/// splitmix64 (Steele et al. 2014).
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    /// In `[0, 1)`, 24 bits as the renderer's.
    pub fn uniform(&mut self) -> f32 {
        (self.next() >> 40) as f32 / 16_777_216.0
    }
    pub fn uniform64(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
    pub fn below(&mut self, n: usize) -> usize {
        (self.uniform64() * n as f64) as usize
    }
    /// A uniformly distributed unit vector.
    pub fn direction(&mut self) -> [f64; 3] {
        let z = 1.0 - 2.0 * self.uniform64();
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (s, c) = (std::f64::consts::TAU * self.uniform64()).sin_cos();
        [r * c, r * s, z]
    }
}

/// `P(X > x)` of a chi-square variable with `k` degrees of freedom.
pub fn chi_square_tail(x: f64, k: usize) -> f64 {
    upper_gamma(k as f64 / 2.0, x / 2.0)
}

/// Regularised upper incomplete gamma function (series and continued fraction; Press et al.,
/// Numerical Recipes, section 6.2).
fn upper_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > sum * 1e-16 {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        (1.0 - front * sum).max(0.0)
    } else {
        let mut b = x + 1.0 - a;
        let mut c = 1e300;
        let mut d = 1.0 / b;
        let mut h = d;
        for i in 1..100_000 {
            let an = -f64::from(i) * (f64::from(i) - a);
            b += 2.0;
            d = 1.0 / (an * d + b);
            c = b + an / c;
            h *= d * c;
            if (d * c - 1.0).abs() < 1e-15 {
                break;
            }
        }
        front * h
    }
}

/// Stirling's series after shifting the argument up.
fn ln_gamma(x: f64) -> f64 {
    let (mut x, mut shift) = (x, 0.0);
    while x < 10.0 {
        shift -= x.ln();
        x += 1.0;
    }
    let i = 1.0 / (x * x);
    shift + (x - 0.5) * x.ln() - x
        + 0.5 * std::f64::consts::TAU.ln()
        + (1.0 / 12.0 - i * (1.0 / 360.0 - i * (1.0 / 1260.0 - i / 1680.0))) / x
}

/// How many standard deviations a normal variable exceeds, in absolute value, with probability `p`.
pub fn normal_quantile(p: f64) -> f64 {
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..200 {
        let mid = 0.5 * (low + high);
        // |X| of a normal is the root of a chi-square with one degree of freedom.
        if chi_square_tail(mid * mid, 1) > p {
            low = mid;
        } else {
            high = mid;
        }
    }
    low
}

/// Pearson's statistic of counts against expectations; cells are pooled in order until each expects
/// at least 25, where the chi-square law holds far into its tail. Returns the statistic and its
/// degrees of freedom.
pub fn pearson(observed: &[f64], expected: &[f64]) -> (f64, usize) {
    let (mut x, mut cells) = (0.0, 0usize);
    let (mut o, mut e) = (0.0, 0.0);
    let mut order: Vec<usize> = (0..expected.len()).collect();
    order.sort_by(|a, b| expected[*a].total_cmp(&expected[*b]));
    for i in order {
        o += observed[i];
        e += expected[i];
        if e >= 25.0 {
            x += (o - e) * (o - e) / e;
            cells += 1;
            (o, e) = (0.0, 0.0);
        }
    }
    assert!(
        o <= 25.0 + 10.0 * (e + 25.0).sqrt(),
        "{o} counts where {e} are expected"
    );
    (x, cells.saturating_sub(1))
}

/// Fails if counts do not follow the expectations, at a false-alarm rate of `p`.
pub fn assert_follows(observed: &[f64], expected: &[f64], p: f64, what: &str) {
    let (x, k) = pearson(observed, expected);
    let tail = chi_square_tail(x, k.max(1));
    assert!(
        tail >= p,
        "{what}: chi-square {x:.1} with {k} degrees of freedom, p = {tail:.2e}"
    );
}

/// Mean and standard error.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mean {
    pub n: f64,
    pub sum: f64,
    pub squares: f64,
}

impl Mean {
    pub fn add(&mut self, x: f64) {
        self.n += 1.0;
        self.sum += x;
        self.squares += x * x;
    }
    pub fn mean(&self) -> f64 {
        self.sum / self.n
    }
    pub fn error(&self) -> f64 {
        ((self.squares / self.n - self.mean().powi(2)).max(0.0) / self.n).sqrt()
    }
}

/// Fails if two independent means differ by more than chance allows at a false-alarm rate of `p`.
pub fn assert_agree(a: &Mean, b: &Mean, p: f64, what: &str) {
    let error = a.error().hypot(b.error());
    let apart = (a.mean() - b.mean()).abs();
    // Rounding of f32 contributions.
    let slack = 1e-6 * a.mean().abs().max(b.mean().abs());
    assert!(
        apart <= normal_quantile(p) * error + slack,
        "{what}: {} +- {} against {} +- {} ({:.1} standard errors)",
        a.mean(),
        a.error(),
        b.mean(),
        b.error(),
        apart / error
    );
}

#[test]
fn tails_are_right() {
    // Reference values: scipy.stats.chi2.sf and norm.isf.
    assert!((chi_square_tail(10.0, 4) / 0.040_427_68 - 1.0).abs() < 1e-6);
    assert!((chi_square_tail(200.0, 100) / 1.214_4e-8 - 1.0).abs() < 0.2);
    assert!((normal_quantile(0.05) - 1.959_964).abs() < 1e-4);
    assert!((normal_quantile(1e-8) - 5.730_73).abs() < 1e-3);
}
