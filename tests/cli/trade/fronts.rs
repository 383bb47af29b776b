//! The front: what nothing dominates, by the definition.

use proptest::prelude::*;
use umbel::measure::pareto_front;

/// The definition, pair by pair.
fn is_dominated(points: &[[f64; 2]], k: usize) -> bool {
    let [cost, error] = points[k];
    points.iter().any(|other| {
        let no_worse = other[0] <= cost && other[1] <= error;
        no_worse && (other[0] < cost || other[1] < error)
    })
}

#[test]
fn the_front_of_a_few_points_is_known() {
    let points = [[1.0, 9.0], [2.0, 4.0], [2.0, 5.0], [3.0, 4.0], [4.0, 0.0], [5.0, 0.0], [2.0, 4.0]];
    assert_eq!(pareto_front(&points), [true, true, false, false, true, false, true]);
    assert_eq!(pareto_front(&[]), [false; 0]);
    assert_eq!(pareto_front(&[[f64::NAN, 0.0], [1.0, f64::INFINITY]]), [false, true]);
}

proptest! {
    /// Few different numbers, so that many are equal.
    #[test]
    fn the_front_is_what_nothing_dominates(raw in prop::collection::vec((0_u8..8, 0_u8..8), 0..30)) {
        let points: Vec<[f64; 2]> = raw.iter().map(|&(a, b)| [f64::from(a), f64::from(b)]).collect();
        for (k, is_on_front) in pareto_front(&points).into_iter().enumerate() {
            prop_assert_eq!(is_on_front, !is_dominated(&points, k));
        }
    }
}
