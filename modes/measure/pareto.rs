//! The Pareto front: the settings that are worth having.
//!
//! A point (cost, error) is *dominated* when another one is at most as costly and at most as wrong, and better in one of the
//! two. The front is what nothing dominates. In the order of cost, then error, a point is on it iff its error is below all
//! errors before it, or both are equal to those of the last point found.
//!
//! Based on: H. T. Kung, Fabrizio Luccio and Franco Preparata, "On Finding the Maxima of a Set of Vectors", 1975.

/// Which points (cost, error) nothing dominates. Points with NaN are never on the front.
#[must_use]
pub fn pareto_front(points: &[[f64; 2]]) -> Vec<bool> {
    let mut order: Vec<usize> =
        (0..points.len()).filter(|&k| !points[k].iter().any(|x| x.is_nan())).collect();
    let key = |k: usize| points[k];
    order.sort_by(|&a, &b| key(a)[0].total_cmp(&key(b)[0]).then(key(a)[1].total_cmp(&key(b)[1])));
    let (mut front, mut last) = (vec![false; points.len()], [f64::NAN, f64::INFINITY]);
    for k in order {
        let point = points[k];
        // An infinite error may be the only one.
        if point[1] < last[1] || point == last || last[0].is_nan() {
            front[k] = true;
            last = point;
        }
    }
    front
}
