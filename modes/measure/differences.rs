//! How far two answers of the same shape are apart.
//!
//! Items, such as pixels or receivers, have C numbers each. Over the items that either answer has, and their numbers e of
//! one minus the other,
//!
//! ```text
//! rmse = √(Σ e² / count),   greatest = max |e|,   differing = items of which any number differs.
//! ```
//!
//! NaN says that there is nothing: where both have nothing, there is nothing to compare; what only one of the two has
//! counts as an error of 1, the whole range of a mask or an openness. Sums are made in order.

/// What differs between two answers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Differences {
    /// Items that either answer has.
    pub items: usize,
    /// The root of the mean squared error of their numbers, 0 where there are none.
    pub rmse: f64,
    /// The greatest error.
    pub greatest: f64,
    /// Items of which any number differs.
    pub differing: usize,
}

impl Differences {
    /// Compares two answers whose items have `channels` numbers each.
    ///
    /// # Panics
    /// When they are not of the same length.
    #[must_use]
    pub fn between(found: &[f32], reference: &[f32], channels: usize) -> Self {
        assert_eq!(found.len(), reference.len(), "answers of one shape");
        let channels = channels.max(1);
        let (mut all, mut squares) = (Self::default(), 0.0);
        for (found, reference) in found.chunks(channels).zip(reference.chunks(channels)) {
            if found.iter().chain(reference).all(|value| value.is_nan()) {
                continue;
            }
            all.items += 1;
            let mut differs = false;
            for error in found.iter().zip(reference).map(|(&a, &b)| error(a, b)) {
                squares += error * error;
                all.greatest = all.greatest.max(error);
                differs |= error > 0.0;
            }
            all.differing += usize::from(differs);
        }
        all.rmse = (squares / (all.items * channels).max(1) as f64).sqrt();
        all
    }

    /// The part of the items that differ, 0 to 1.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.differing as f64 / self.items.max(1) as f64
    }
}

/// The error of one number, 0 or more.
#[must_use]
pub(crate) fn error(found: f32, reference: f32) -> f64 {
    match (found.is_nan(), reference.is_nan()) {
        (true, true) => 0.0,
        (false, false) if found == reference => 0.0,
        (false, false) => (f64::from(found) - f64::from(reference)).abs(),
        _ => 1.0,
    }
}
