//! Cuts one planar polygon into triangles by ear clipping, concave ones and bridged holes included.
//!
//! The polygon is projected along the dominant axis of its normal N = Σ p_k × p_{k+1} (Newell), so that it winds
//! counter-clockwise in 2D. Every decision is the sign of `orient2d`, exact on the f32 inputs.
//!
//! Ears are found and clipped in a ring of corners ([`crate::formats::polygons::clip_ring`]), quads mostly at once.
//!
//! Based on: Gary H. Meisters, "Polygons Have Ears", 1975; Martin Held, "FIST: Fast Industrial-Strength Triangulation of
//! Polygons", 2001 (fall-backs for polygons that are not simple).

use robust::orient2d;

use crate::formats::polygons::clip_ring::Ring;
use crate::formats::polygons::corner_tree::Point;

/// Cuts a polygon into triangles of the same winding, given as indices into `corners`.
///
/// Always returns n − 2 triangles (none for n < 3), and every edge of the polygon belongs to one of them. Where a polygon
/// crosses itself and no ear is left, the best remaining corner is clipped: one that turns left, else any. The signed
/// areas then still sum up to that of the polygon, but triangles overlap. The same happens with coordinates that are not
/// finite. More than `u32::MAX` corners give no triangles.
#[must_use]
pub(crate) fn triangulate(corners: &[[f32; 3]]) -> Vec<[u32; 3]> {
    let Ok(count) = u32::try_from(corners.len()) else {
        return Vec::new();
    };
    match count {
        0..3 => Vec::new(),
        3 => vec![[0, 1, 2]],
        _ => {
            let points = project(corners);
            split_quad(&points).unwrap_or_else(|| Ring::new(points, count).clip())
        }
    }
}

/// Projects the polygon along the dominant axis of its normal, so that it winds counter-clockwise.
fn project(corners: &[[f32; 3]]) -> Vec<Point> {
    let origin = corners[0].map(f64::from);
    // Relative to a corner the products stay small, so the sum keeps its sign far from the origin.
    let local = |corner: &[f32; 3]| -> [f64; 3] { std::array::from_fn(|k| f64::from(corner[k]) - origin[k]) };
    let mut normal = [0.0; 3];
    for (p, q) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let (p, q) = (local(p), local(q));
        for (k, sum) in normal.iter_mut().enumerate() {
            let (i, j) = ((k + 1) % 3, (k + 2) % 3);
            *sum += p[i] * q[j] - p[j] * q[i];
        }
    }
    let axis = (1..3).fold(0, |best, k| if normal[k].abs() > normal[best].abs() { k } else { best });
    let (mut x, mut y) = ((axis + 1) % 3, (axis + 2) % 3);
    if normal[axis] < 0.0 {
        (x, y) = (y, x);
    }
    corners.iter().map(|corner| Point { x: f64::from(corner[x]), y: f64::from(corner[y]) }).collect()
}

/// Cuts a quad along a diagonal with one corner on either side, if it has such a diagonal. Most faces end here.
fn split_quad(points: &[Point]) -> Option<Vec<[u32; 3]>> {
    let &[a, b, c, d] = points else { return None };
    if orient2d(a, b, c) > 0.0 && orient2d(a, c, d) > 0.0 {
        Some(vec![[0, 1, 2], [0, 2, 3]])
    } else if orient2d(b, c, d) > 0.0 && orient2d(b, d, a) > 0.0 {
        Some(vec![[1, 2, 3], [1, 3, 0]])
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twice the area of a triangle in the xy plane, exact for small integers.
    fn doubled(p: [f32; 3], q: [f32; 3], r: [f32; 3]) -> f64 {
        let [p, q, r] = [p, q, r].map(|v| v.map(f64::from));
        (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])
    }

    fn flat(points: &[(f32, f32)]) -> Vec<[f32; 3]> {
        points.iter().map(|&(x, y)| [x, y, 0.0]).collect()
    }

    /// Triangulates, forward and backward and in all three planes, and checks: n − 2 triangles, no flipped one, the areas
    /// sum up to that of the polygon, and each edge of the polygon is the edge of one triangle.
    fn check(points: &[(f32, f32)]) {
        let mut polygon = flat(points);
        let n = polygon.len();
        let area: f64 = (1..n - 1).map(|i| doubled(polygon[0], polygon[i], polygon[i + 1])).sum();
        for turn in 0..6 {
            if turn == 3 {
                polygon.reverse();
            }
            let rotated: Vec<_> =
                polygon.iter().map(|&[x, y, z]| [[x, y, z], [y, z, x], [z, x, y]][turn % 3]).collect();
            let triangles = triangulate(&rotated);
            assert_eq!(triangles.len(), n - 2);
            let sign = if turn < 3 { area.signum() } else { -area.signum() };
            let mut sum = 0.0;
            for triangle in &triangles {
                let [p, q, r] = triangle.map(|i| polygon[i as usize]);
                let part = doubled(p, q, r) * sign;
                assert!(part >= 0.0, "flipped triangle {triangle:?} of {points:?}");
                sum += part;
            }
            assert!((sum - area.abs()).abs() <= 1e-9 * area.abs(), "area of {points:?}: {sum}");
            let directed = |i: usize| [i, (i + 1) % n].map(|i| u32::try_from(i).unwrap());
            for i in 0..n {
                let edge = directed(i);
                let holds = |t: &[u32; 3]| (0..3).any(|k| [t[k], t[(k + 1) % 3]] == edge);
                assert_eq!(triangles.iter().filter(|t| holds(t)).count(), 1, "edge {edge:?}");
            }
        }
    }

    struct Lcg(u64);

    impl Lcg {
        /// Uniform in [0, 1).
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            f64::from(u32::try_from(self.0 >> 40).unwrap()) / f64::from(1 << 24)
        }
    }

    /// A star-shaped polygon around the origin: ascending angles with gaps under π.
    fn random_star(random: &mut Lcg, n: u32) -> Vec<(f64, f64)> {
        (0..n)
            .map(|i| {
                let angle = std::f64::consts::TAU * (f64::from(i) + 0.9 * random.next()) / f64::from(n);
                let radius = 1.0 + 20.0 * random.next();
                (radius * angle.cos(), radius * angle.sin())
            })
            .collect()
    }

    #[expect(clippy::cast_possible_truncation, reason = "test points need not be exact")]
    fn rounded(points: &[(f64, f64)]) -> Vec<(f32, f32)> {
        points.iter().map(|&(x, y)| (x as f32, y as f32)).collect()
    }

    /// Corners from text such as `0,0 4,0 4,4`.
    fn corners(text: &str) -> Vec<(f32, f32)> {
        let pairs = text.split_whitespace().map(|pair| pair.split_once(',').unwrap());
        pairs.map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap())).collect()
    }

    #[test]
    fn small_polygons() {
        assert!(triangulate(&[]).is_empty());
        assert!(triangulate(&[[0.0; 3], [1.0; 3]]).is_empty());
        assert_eq!(triangulate(&[[0.0; 3]; 3]), [[0, 1, 2]]);
        check(&corners("0,0 1,0 1,1 0,1"));
        // A quad that is concave at each corner in turn.
        let mut quad = corners("0,0 4,-2 1,0 4,2");
        for _ in 0..4 {
            quad.rotate_left(1);
            check(&quad);
        }
    }

    #[test]
    fn concave_polygons() {
        // The pentagon for which a fan gives area 14 instead of 10.
        check(&corners("0,0 4,0 4,4 2,1 0,4"));
        // A comb, a spiral, and an L with corners along its straight sides.
        check(&corners("0,0 7,0 7,5 6,1 5,5 4,1 3,5 2,1 0,5"));
        check(&corners("0,0 9,0 9,9 2,9 2,3 6,3 6,6 5,6 5,4 3,4 3,8 8,8 8,1 0,1"));
        check(&corners("0,0 1,0 2,0 4,0 4,1 1,1 1,2 1,3 0,3 0,1"));
    }

    #[test]
    fn keyholes() {
        // A square ring: the hole clockwise, a bridge from the first corner there and back.
        check(&corners("0,0 3,0 3,3 0,3 0,0 1,1 1,2 2,2 2,1 1,1"));
        // Two holes bridged from one corner.
        check(&corners("0,0 9,0 9,9 0,9 0,0 1,3 1,5 3,5 1,3 0,0 3,1 2,2 4,2 3,1"));
        // A hole that touches the tip of the outer triangle and reaches nearly to its base.
        check(&corners("0,0 6,-9 6,9 0,0 5,1 5,-1"));
        // A hole that continues its own bridge.
        check(&corners("0,0 8,0 8,8 0,8 0,4 2,4 4,4 4,2 2,4 0,4"));
        // Two squares joined by a bridge outside of them.
        check(&corners("0,0 2,0 2,2 5,2 5,0 7,0 7,4 5,4 5,2 2,2 0,2"));
    }

    #[test]
    fn random_stars() {
        let mut random = Lcg(1);
        for round in 0..300 {
            check(&rounded(&random_star(&mut random, 4 + round % 60)));
        }
    }

    /// A star with a smaller, reversed star as its hole; the bridge lies on a ray through the centre.
    #[test]
    fn random_keyholes() {
        let mut random = Lcg(2);
        for round in 0..300 {
            let n = 4 + round % 17;
            let outer = random_star(&mut random, n + round % 5);
            let mut hole: Vec<_> =
                random_star(&mut random, n).iter().map(|&(x, y)| (x / 25.0, y / 25.0)).collect();
            let (x, y) = outer[0];
            hole[0] = (0.9 * x / x.hypot(y), 0.9 * y / x.hypot(y));
            hole.push(hole[0]);
            hole.reverse();
            check(&rounded(&[&outer[..], &outer[..1], &hole[..]].concat()));
        }
    }

    #[test]
    fn lattice_stars_keep_their_count() {
        let mut random = Lcg(3);
        for round in 0..300 {
            let star = random_star(&mut random, 4 + round % 40);
            let snapped: Vec<_> =
                rounded(&star).iter().map(|&(x, y)| ((x / 4.0).round(), (y / 4.0).round())).collect();
            assert_eq!(triangulate(&flat(&snapped)).len(), snapped.len() - 2);
        }
    }

    #[test]
    fn degenerate_polygons_keep_their_count() {
        let cases = [
            "1,1 1,1 1,1 1,1 1,1 1,1 1,1",
            "0,0 1,0 2,0 3,0 1,0",
            "0,0 2,2 2,0 0,2",
            "0,3 2,-3 -3,1 3,1 -2,-3",
            "0,0 nan,0 2,nan 0,2 1,1",
            "0,0 inf,0 2,-inf 0,2 1,1",
        ];
        for case in cases {
            let polygon = flat(&corners(case));
            assert_eq!(triangulate(&polygon).len(), polygon.len() - 2, "{case}");
        }
        // Repeated corners and spikes do not change the area.
        check(&corners("0,0 0,0 4,0 4,0 6,0 4,0 4,4 2,1 2,1 0,4"));
    }

    /// Costs of a large polygon stay quadratic: this takes minutes if they are cubic.
    #[test]
    fn thousands_of_corners() {
        let mut random = Lcg(4);
        let star = rounded(&random_star(&mut random, 2000));
        assert_eq!(triangulate(&flat(&star)).len(), 1998);
        let crossed: Vec<_> = (0..2000).map(|_| (random.next(), random.next())).collect();
        assert_eq!(triangulate(&flat(&rounded(&crossed))).len(), 1998);
    }
}
