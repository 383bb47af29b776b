//! What an engine finds, and how two answers are compared.

/// The id that stands for a miss, as umbel has it.
pub(crate) const MISS: u32 = umbel::NO_TRIANGLE;

/// Two distances agree within this part of umbel's.
const T_TOLERANCE: f64 = 1e-4;

/// An id and a distance per ray: [`MISS`] and +∞ where nothing is hit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Answer {
    pub(crate) ids: Vec<u32>,
    /// In units of the ray's direction.
    pub(crate) ts: Vec<f32>,
}

impl Answer {
    /// Misses only.
    pub(crate) fn missed(rays: usize) -> Self {
        Self { ids: vec![MISS; rays], ts: vec![f32::INFINITY; rays] }
    }
}

/// How far an answer agrees with umbel's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Agreement {
    /// Rays with the same id, from 0 to 1. Where surfaces coincide, several ids are right.
    pub(crate) ids_equal: f64,
    /// Rays that both miss, or both hit at the same t within 1e-4 of it.
    pub(crate) ts_equal: f64,
}

impl Agreement {
    /// Compares ray by ray. Without rays, all agree.
    pub(crate) fn of(umbel: &Answer, other: &Answer) -> Self {
        let share = |count: usize| count as f64 / umbel.ids.len().max(1) as f64;
        let ids = umbel.ids.iter().zip(&other.ids).filter(|(a, b)| a == b).count();
        let ts = umbel.ts.iter().zip(&other.ts).filter(|&(&a, &b)| same_distance(a, b)).count();
        Self { ids_equal: share(ids), ts_equal: share(ts) }
    }
}

/// Whether two distances agree; misses are infinite.
fn same_distance(umbel: f32, other: f32) -> bool {
    let (umbel, other) = (f64::from(umbel), f64::from(other));
    umbel == other || (umbel - other).abs() <= T_TOLERANCE * umbel.abs() && umbel.is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agreement_counts_ids_and_distances_apart() {
        let umbel = Answer { ids: vec![0, 1, MISS, MISS], ts: vec![1.0, 2.0, f32::INFINITY, f32::INFINITY] };
        let other = Answer { ids: vec![7, 1, MISS, 3], ts: vec![1.00001, 2.1, f32::INFINITY, 5.0] };
        let agreement = Agreement::of(&umbel, &other);
        assert_eq!(agreement, Agreement { ids_equal: 0.5, ts_equal: 0.5 });
    }
}
