//! Choosing a light in proportion to its power, by inversion: neighbouring primary samples keep choosing the same light,
//! which an alias table would not.

/// A discrete distribution over lights.
pub struct LightChoice {
    /// Upper ends of the lights' intervals in `[0, 1]`; the last is 1.
    cdf: Vec<f32>,
    probability: Vec<f32>,
}

/// A light whose power is estimated at zero is still chosen this often relative to a uniform choice: the estimate averages
/// over the picture, and a zero here would lose light.
const FLOOR: f64 = 1e-3;

impl LightChoice {
    pub fn new(powers: &[f64]) -> Self {
        let n = powers.len();
        let finite = |p: &f64| if p.is_finite() { p.max(0.0) } else { 0.0 };
        let total: f64 = powers.iter().map(finite).sum();
        let weight = |p: &f64| {
            if total > 0.0 {
                finite(p) / total + FLOOR / n as f64
            } else {
                1.0
            }
        };
        let sum: f64 = powers.iter().map(weight).sum();
        let mut cdf = Vec::with_capacity(n);
        let mut running = 0.0;
        for p in powers {
            running += weight(p) / sum;
            cdf.push(running as f32);
        }
        if let Some(last) = cdf.last_mut() {
            *last = 1.0;
        }
        // The probability of a light is the width of its interval as rounded, not the wish.
        let probability = (0..n)
            .map(|i| cdf[i] - if i == 0 { 0.0 } else { cdf[i - 1] })
            .collect();
        Self { cdf, probability }
    }

    pub fn probability(&self, light: usize) -> f32 {
        self.probability[light]
    }

    /// The light whose interval holds `u` in `[0, 1)`.
    pub fn sample(&self, u: f32) -> u32 {
        let i = self.cdf.partition_point(|end| *end <= u);
        i.min(self.cdf.len() - 1) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_the_probabilities() {
        let choice = LightChoice::new(&[1.0, 0.0, 3.0, f64::NAN]);
        let n = 1 << 20;
        let mut count = [0u32; 4];
        for i in 0..n {
            count[choice.sample(i as f32 / n as f32) as usize] += 1;
        }
        for (i, c) in count.iter().enumerate() {
            let p = f64::from(choice.probability(i));
            // A regular grid over an interval: exact to one cell at each end.
            assert!((f64::from(*c) - p * f64::from(n)).abs() <= 2.0, "{i}");
        }
        assert!(choice.probability(2) > 0.7 && choice.probability(1) > 0.0);
    }
}
