//! Errors of a whole, estimated on a seeded sample of it.
//!
//! *A root mean square.* From n of P squared errors x = e² with mean m, variance s² and skewness g, the mean of all lies, at
//! about 95 %, within
//!
//! ```text
//! m + σ·(g·(1 + 2z²)/(6√n) ± z),   σ = s/√n · √((P − n)/(P − 1)),   z = 1.96.
//! ```
//!
//! The term with g is Johnson's: squared errors are skewed, and a plain interval would lie too low. The roots of m and of
//! the limits are the estimate. Where the sample is everything, σ = 0 and the estimate is the truth.
//!
//! *A rate.* k of n items are wrong: Wilson's interval, which is sound for k = 0 as well, with n·(P − 1)/(P − n) in the
//! place of n. The estimate is the share of wrong items, not its root: of a mask, five in a hundred pixels are 0.05.
//!
//! *A power law* e = c·K⁻ᵖ through errors of K rays, by least squares of logarithms, says where to look for the K of an error.
//!
//! Based on: Norman Johnson, "Modified t Tests and Confidence Intervals for Asymmetrical Populations", 1978; Edwin Wilson,
//! "Probable Inference, the Law of Succession, and Statistical Inference", 1927; William Cochran, "Sampling Techniques", 1977
//! (finite populations).

use crate::random::mix;

/// Standard deviations to either side that hold 95 % of a normal distribution.
const Z: f64 = 1.96;

/// An estimated error with its 95 % interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ErrorEstimate {
    /// The estimate: a root mean square in the units of the values, or a share of wrong items from 0 to 1.
    pub error: f64,
    /// The lower limit.
    pub lower: f64,
    /// The upper limit.
    pub upper: f64,
    /// Items that were looked at.
    pub sample: usize,
    /// Items that there are.
    pub population: usize,
}

impl ErrorEstimate {
    /// From the squared errors of some of `population` items.
    #[must_use]
    pub fn of_squares(squares: &[f64], population: usize) -> Self {
        let (n, sample) = (squares.len().max(1) as f64, squares.len());
        let mean = squares.iter().sum::<f64>() / n;
        let moment = |power: i32| squares.iter().map(|x| (x - mean).powi(power)).sum::<f64>() / n;
        let deviation = moment(2).sqrt();
        let skewness = if deviation > 0.0 { moment(3) / (deviation * deviation * deviation) } else { 0.0 };
        let spread = deviation / n.sqrt() * (1.0 / inflation(sample, population)).sqrt();
        let shift = skewness * (1.0 + 2.0 * Z * Z) / (6.0 * n.sqrt());
        let limit = |side: f64| (mean + spread * (shift + side * Z)).max(0.0).sqrt();
        let rmse = mean.sqrt();
        Self { error: rmse, lower: limit(-1.0).min(rmse), upper: limit(1.0).max(rmse), sample, population }
    }

    /// The share of wrong answers: `wrong` of `sample` that were looked at, out of `population`.
    #[must_use]
    pub fn of_rate(wrong: usize, sample: usize, population: usize) -> Self {
        let rate = wrong as f64 / sample.max(1) as f64;
        let inflation = inflation(sample, population);
        let (mut lower, mut upper) = (rate, rate);
        if sample == 0 && population > 0 {
            (lower, upper) = (0.0, 1.0);
        } else if inflation.is_finite() {
            let n = sample as f64 * inflation;
            let middle = (rate + Z * Z / (2.0 * n)) / (1.0 + Z * Z / n);
            let half = Z / (1.0 + Z * Z / n) * (rate * (1.0 - rate) / n + Z * Z / (4.0 * n * n)).sqrt();
            (lower, upper) = ((middle - half).clamp(0.0, rate), (middle + half).min(1.0));
        }
        Self { error: rate, lower, upper, sample, population }
    }

    /// The same share among more items, of which the others are right.
    #[must_use]
    pub fn among(self, items: usize) -> Self {
        let part = self.population as f64 / items.max(1) as f64;
        Self { error: self.error * part, lower: self.lower * part, upper: self.upper * part, ..self }
    }
}

/// (P − 1)/(P − n): infinite where the sample is everything.
fn inflation(sample: usize, population: usize) -> f64 {
    if sample >= population {
        return f64::INFINITY;
    }
    (population as f64 - 1.0) / (population - sample) as f64
}

/// e = c·K⁻ᵖ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PowerLaw {
    /// c.
    pub factor: f64,
    /// p.
    pub exponent: f64,
}

impl PowerLaw {
    /// The law nearest to pairs (K, e); those without an error say nothing. `None` where fewer than two are left.
    #[must_use]
    pub fn fit(pairs: &[(f64, f64)]) -> Option<Self> {
        let usable = pairs.iter().filter(|&&(count, error)| count > 0.0 && error > 0.0 && error.is_finite());
        let logs: Vec<[f64; 2]> =
            usable.map(|&(count, error)| [libm::log(count), libm::log(error)]).collect();
        let n = logs.len() as f64;
        let mean = |axis: usize| logs.iter().map(|point| point[axis]).sum::<f64>() / n;
        let (x, y) = (mean(0), mean(1));
        let across = logs.iter().map(|point| (point[0] - x) * (point[0] - x)).sum::<f64>();
        let along = logs.iter().map(|point| (point[0] - x) * (point[1] - y)).sum::<f64>();
        (across > 0.0).then(|| Self { factor: libm::exp(y - along / across * x), exponent: -along / across })
    }

    /// The error of K.
    #[must_use]
    pub fn error(&self, count: f64) -> f64 {
        self.factor * libm::pow(count, -self.exponent)
    }

    /// The K of an error; infinite where the law never gets there.
    #[must_use]
    pub fn count(&self, error: f64) -> f64 {
        if self.exponent > 0.0 { libm::pow(error / self.factor, -1.0 / self.exponent) } else { f64::INFINITY }
    }
}

/// Where item `index` stands in a random order that a seed chooses: a sample is the items with the least keys.
#[must_use]
pub fn sample_key(seed: u64, index: u64) -> u64 {
    mix(mix(seed ^ 0x9e37_79b9_7f4a_7c15).wrapping_add(index))
}
