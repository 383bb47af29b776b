//! Rays against triangles, eight pairs at once: the f64 filter of [`crate::exact::predicates`] in lanes. What it leaves
//! in doubt is decided one by one.
//!
//! With A = a − o, E = b − a and so on, the edge function is e = d·(A×E), the normal N = (b − a)×(c − a), and t =
//! (A·N)/(d·N). A pair is a hit where the signs of the three e and of A·N agree. Errors are those of
//! [`crate::exact::filter`], with Σ|x_k|(|y_i z_j| + |y_j z_i|) ≤ 6|x|∞|y|∞|z|∞; A·N, of which exactly zero is common
//! (rays leave walls along an axis), has the sum itself.
//!
//! Products and sums may be fused: they round less then, and only what is certain counts.
//!
//! One by one a pair took 410 instructions; together, with reading them, it is about 250 (AVX2), and few branches are
//! hard to guess.
//!
//! Based on: Jonathan Shewchuk, "Adaptive Precision Floating-Point Arithmetic and Fast Robust Geometric Predicates",
//! 1997 (filters).

use fearless_simd::{mask32x8, prelude::*, u32x8, u64x8};

use crate::exact::filter::TRIPLE_PRODUCT_ERROR;
use crate::exact::integer::{SHORT_DIRECTION, SHORT_POINT, steps_of};
use crate::geometry::aabb::U;
use crate::geometry::ray::{Ray, Ties};
use crate::geometry::triangles::Triangles;
use crate::intersect::bundle::eight_rays::EightRays;
use crate::intersect::ray_set::Known;
use crate::objects::gather;
use crate::simd::lanes::{LANES, LaneMask, Lanes, Points};

/// What is known of eight pairs: bits, and bounds of t.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Verdicts {
    /// Pairs that may be a hit within the ray's interval, not beyond its nearest hit.
    pub(crate) possible: u64,
    /// Pairs that certainly are a hit, within the interval.
    certain: u64,
    /// Of the certain ones, those that meet their triangle from behind: d·N > 0.
    from_behind: u64,
    lo: [f64; LANES],
    hi: [f64; LANES],
}

impl Verdicts {
    /// Nothing is known.
    pub(crate) const NONE: Self =
        Self { possible: !0, certain: 0, from_behind: 0, lo: [0.0; LANES], hi: [0.0; LANES] };

    /// What is known of a pair; nothing unless it certainly is a hit.
    #[inline]
    pub(crate) fn known(&self, lane: usize) -> Option<Known> {
        let from_behind = self.from_behind >> lane & 1 == 1;
        (self.certain >> lane & 1 == 1).then(|| Known { lo: self.lo[lane], hi: self.hi[lane], from_behind })
    }
}

/// What f64 can tell of eight rays, each against its triangle. Nothing beyond a ray's `nearest` matters.
#[inline(always)]
pub(crate) fn filter<S: Simd>(
    simd: S,
    triangles: &Triangles<'_>,
    rays: &[&Ray; LANES],
    ids: &[u32; LANES],
    (nearest, ties): (&[f64; LANES], Ties),
) -> Verdicts {
    let corners = gather::corners(simd, triangles, ids);
    let [a, b, c] = corners;
    let rays = EightRays::new(simd, rays);
    let (ab, bc, ca) = (b.minus(a), c.minus(b), a.minus(c));
    let (sup_ab, sup_bc, sup_ca) = (ab.greatest(), bc.greatest(), ca.greatest());
    let ac = Points { x: -ca.x, y: -ca.y, z: -ca.z };
    let (a, b, c) = (a.minus(rays.origin), b.minus(rays.origin), c.minus(rays.origin));
    let of_direction = rays.direction.greatest() * (6.0 * TRIPLE_PRODUCT_ERROR);

    // A·N, with the error that is zero where nothing was rounded.
    let normal = cross(ab, ac);
    let permanent = permanent(ab.magnitudes(), ac.magnitudes());
    let side = a.fused_dot(normal);
    let side_error = a.magnitudes().fused_dot(permanent) * TRIPLE_PRODUCT_ERROR;
    let zero = Lanes::simd_from(simd, 0.0);
    let within = side.simd_eq(zero) & side_error.simd_eq(zero);

    let d = rays.direction;
    let edges = [d.fused_dot(cross(a, ab)), d.fused_dot(cross(b, bc)), d.fused_dot(cross(c, ca))];
    let one = Signs::of(edges[0], of_direction * a.greatest() * sup_ab);
    let two = Signs::of(edges[1], of_direction * b.greatest() * sup_bc);
    let three = Signs::of(edges[2], of_direction * c.greatest() * sup_ca);
    let four = Signs::of(side, side_error);
    let mut all_positive = one.positive & two.positive & three.positive & four.positive;
    let mut all_negative = one.negative & two.negative & three.negative & four.negative;
    let some_positive = one.positive | two.positive | three.positive | four.positive;
    let some_negative = one.negative | two.negative | three.negative | four.negative;
    let mut missed = (some_positive & some_negative) | within;

    // t, as of `Distance::bounds`.
    let facing = d.fused_dot(normal);
    let facing_error = of_direction * sup_ab * sup_ca;
    let (n, d) = (side.abs(), facing.abs());
    let slack = 4.0 * U;
    let lo = ((n - side_error) / (d + facing_error) * (1.0 - slack)).max(zero);
    let hi = (n + side_error) / (d - facing_error) * (1.0 + slack);
    let unbounded = Lanes::simd_from(simd, f64::INFINITY);
    let hi = hi.simd_ge(lo).select(hi, unbounded);

    let beyond = lo.simd_gt(Lanes::load_array_ref(simd, nearest));
    let after = rays.t_min.simd_eq(zero) | lo.simd_gt(rays.t_min);
    let before = rays.t_max.simd_eq(unbounded) | hi.simd_lt(rays.t_max);
    let mut doubtful = !(missed | beyond | all_positive | all_negative);
    if doubtful.to_bitmask() != 0 {
        // From one of its corners no triangle is hit. Common where rays leave vertices.
        let at_corner = a.greatest().simd_eq(zero) | b.greatest().simd_eq(zero) | c.greatest().simd_eq(zero);
        missed |= at_corner;
        doubtful &= !at_corner;
    }
    if doubtful.to_bitmask() != 0 {
        let exact = are_short(simd, &corners, &rays) & doubtful;
        let [positive, negative] = exact_signs(simd, edges, ([a, b, c], rays.direction), ties);
        let hit = exact & ((positive & side.simd_gt(zero)) | (negative & side.simd_lt(zero)));
        all_positive |= hit & positive;
        all_negative |= hit & negative;
        missed |= exact & !hit;
    }
    let possible = !(missed | beyond);
    let certain = (all_positive | all_negative) & after & before & possible;
    Verdicts {
        possible: possible.to_bitmask(),
        certain: certain.to_bitmask(),
        from_behind: all_positive.to_bitmask(),
        lo: lo.to_array(),
        hi: hi.to_array(),
    }
}

/// Which of eight pairs are short enough for f64 to be exact: coordinates of at most 15 bits on a common grid, directions of 18. See
/// [`crate::exact::integer`].
#[inline(always)]
fn are_short<S: Simd>(simd: S, [a, b, c]: &[Points<S>; 3], rays: &EightRays<S>) -> LaneMask<S> {
    let o = rays.origin;
    let greatest = a.greatest().max(b.greatest()).max(c.greatest().max(o.greatest()));
    let steps = grid_steps(greatest, SHORT_POINT);
    let of_direction = grid_steps(rays.direction.greatest(), SHORT_DIRECTION);
    let mut short = LaneMask::simd_from(simd, true);
    for (point, steps) in [(*a, steps), (*b, steps), (*c, steps), (o, steps), (rays.direction, of_direction)]
    {
        for x in [point.x, point.y, point.z] {
            short &= ((x + steps) - steps).simd_eq(x);
        }
    }
    short
}

/// What rounds numbers up to some greatest ones to so many bits, when it is added and taken away.
#[inline(always)]
fn grid_steps<S: Simd>(greatest: Lanes<S>, bits: i32) -> Lanes<S> {
    let exponent_bits = 0x7FF0_0000_0000_0000_u64;
    let power: Lanes<S> = (greatest.bitcast::<u64x8<S>>() & exponent_bits).bitcast();
    power * steps_of(bits)
}

/// Where all edge functions, which are exact, are positive, and where they are negative: zero has the sign of the first component of
/// the edge's normal that is not zero. Nowhere, where all three are zero: the plane holds the direction.
#[inline(always)]
fn exact_signs<S: Simd>(
    simd: S,
    edges: [Lanes<S>; 3],
    (corners, direction): ([Points<S>; 3], Points<S>),
    ties: Ties,
) -> [LaneMask<S>; 2] {
    let zero = Lanes::simd_from(simd, 0.0);
    let mut all_zero = LaneMask::simd_from(simd, true);
    let (mut positive, mut negative) = (all_zero, all_zero);
    for (k, edge) in edges.into_iter().enumerate() {
        let (from, to) = (corners[k], corners[(k + 1) % 3]);
        let normal = match ties {
            Ties::Direction => cross(from, to),
            Ties::Origin => cross(direction, to.minus(from)),
        };
        let last = normal.y.simd_eq(zero).select(normal.z, normal.y);
        let tie = normal.x.simd_eq(zero).select(last, normal.x);
        let is_zero = edge.simd_eq(zero);
        let decided = is_zero.select(tie, edge);
        all_zero &= is_zero;
        positive &= decided.simd_gt(zero);
        negative &= decided.simd_lt(zero);
    }
    [positive & !all_zero, negative & !all_zero]
}

/// The signs of eight numbers, where certain.
struct Signs<S: Simd> {
    positive: LaneMask<S>,
    negative: LaneMask<S>,
}

impl<S: Simd> Signs<S> {
    #[inline(always)]
    fn of(value: Lanes<S>, error: Lanes<S>) -> Self {
        Self { positive: value.simd_gt(error), negative: value.simd_lt(-error) }
    }
}

/// y×z.
#[inline(always)]
fn cross<S: Simd>(y: Points<S>, z: Points<S>) -> Points<S> {
    Points { x: y.y.mul_sub(z.z, y.z * z.y), y: y.z.mul_sub(z.x, y.x * z.z), z: y.x.mul_sub(z.y, y.y * z.x) }
}

/// The sums of the magnitudes of the products of y×z, from those of y and z.
#[inline(always)]
fn permanent<S: Simd>(y: Points<S>, z: Points<S>) -> Points<S> {
    Points { x: y.y.mul_add(z.z, y.z * z.y), y: y.z.mul_add(z.x, y.x * z.z), z: y.x.mul_add(z.y, y.y * z.x) }
}

/// Pairs that wait until they are eight, or a few more.
#[derive(Debug, Default)]
pub(crate) struct Pairs {
    /// The places of the rays.
    rays: [u32; 2 * LANES],
    /// The triangles.
    ids: [u32; 2 * LANES],
    len: usize,
}

impl Pairs {
    /// Adds the triangles of a ray whose bits are set. There must be fewer than eight pairs.
    #[inline(always)]
    pub(crate) fn push<S: Simd>(&mut self, simd: S, ray: u32, ids: u32x8<S>, bits: u64) {
        let ids = ids.compress(mask32x8::from_bitmask(simd, bits));
        ids.store_slice(&mut self.ids[self.len..self.len + LANES]);
        u32x8::splat(simd, ray).store_slice(&mut self.rays[self.len..self.len + LANES]);
        self.len += bits.count_ones() as usize;
    }

    /// The number of pairs.
    pub(crate) fn len(&self) -> usize {
        self.len
    }

    /// Takes the first eight pairs, or what there is: their rays, their triangles, and how many they are. The rest of
    /// the eight repeats the first.
    #[inline(always)]
    pub(crate) fn take(&mut self) -> ([u32; LANES], [u32; LANES], usize) {
        let count = self.len.min(LANES);
        for lane in count..LANES {
            (self.rays[lane], self.ids[lane]) = (self.rays[0], self.ids[0]);
        }
        let mut eight = [[0; LANES]; 2];
        for (all, eight) in [&mut self.rays, &mut self.ids].into_iter().zip(&mut eight) {
            let (first, rest) = all.split_at_mut(LANES);
            eight.copy_from_slice(first);
            first.copy_from_slice(rest);
        }
        self.len -= count;
        let [rays, ids] = eight;
        (rays, ids, count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::exact::distance::{Distance, within_interval};
    use crate::exact::filter::Sign;
    use crate::exact::predicates::{covers_unfiltered, facing};
    use crate::geometry::triangles::Triangles;
    use crate::intersect::bundle::cull_space::tests::numbers;
    use crate::simd::isa::Isa;
    use crate::stats::Stats;
    use fearless_simd::dispatch;
    use glam::DVec3;

    /// What is said of a pair against exact arithmetic.
    fn check(verdicts: &Verdicts, lane: usize, ray: &Ray, triangles: &Triangles<'_>, nearest: f64) -> bool {
        let triangle = triangles.triangle(lane as u32);
        let distance = Distance::new(ray, &triangle);
        let mut stats = Stats::default();
        let hits =
            covers_unfiltered(ray, &triangle, Ties::Direction) && within_interval(ray, &distance, &mut stats);
        if verdicts.possible >> lane & 1 == 0 {
            assert!(
                !hits || distance.compare_to(nearest, &mut stats) == Sign::Positive,
                "{ray:?} {triangle:?} was dropped"
            );
        }
        if let Some(Known { lo, hi, from_behind }) = verdicts.known(lane) {
            assert!(hits, "{ray:?} {triangle:?} is no hit");
            assert_ne!(distance.compare_to(lo, &mut stats), Sign::Negative, "{lo} is beyond t");
            assert!(
                hi == f64::INFINITY || distance.compare_to(hi, &mut stats) != Sign::Positive,
                "{hi} is before t"
            );
            assert_eq!(facing(ray.direction, &triangle) == Sign::Positive, from_behind);
        }
        verdicts.known(lane).is_some() == hits
    }

    #[test]
    fn what_is_certain_is_true() {
        let mut next = numbers();
        let (mut told, mut asked) = (0, 0);
        for isa in [Isa::Auto, Isa::Sse2] {
            let Ok(level) = isa.level() else { continue };
            for _ in 0..5_000 {
                // Coordinates from few numbers put rays through corners, along edges and into planes.
                let steps = if next() < 0.5 { 4.0 } else { 1e6 };
                let mut point = || [0; 3].map(|_: i32| ((next() * steps).floor() / steps) as f32);
                let positions: Vec<[f32; 3]> = (0..24).map(|_| point()).collect();
                let wide = |p: [f32; 3]| DVec3::from_array(p.map(f64::from));
                // Every other ray is aimed at an edge of its triangle: only rounding takes it off.
                let mut rays = [0, 1, 2, 3, 4, 5, 6, 7].map(|lane: usize| {
                    let [a, b] = [0, 1].map(|k| wide(positions[3 * lane + k]));
                    let from = wide(point());
                    let to = if lane.is_multiple_of(2) {
                        wide(point())
                    } else {
                        a + (b - a) * f64::from(point()[0])
                    };
                    let direction = if from == to { DVec3::X } else { to - from };
                    Ray::new(from - direction, direction)
                });
                for (lane, ray) in rays.iter_mut().enumerate() {
                    (ray.t_min, ray.t_max) = [(0.0, f64::INFINITY), (1.0, 2.0), (0.0, 1.5)][lane % 3];
                }
                let indices: Vec<[u32; 3]> = (0..8).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
                let triangles = Triangles::new(&positions, &indices).expect("valid triangles");
                let nearest = [2.5, f64::INFINITY].repeat(4).try_into().expect("eight");
                let ids = [0, 1, 2, 3, 4, 5, 6, 7];
                let verdicts = dispatch!(level, simd => filter(simd, &triangles, &rays.each_ref(), &ids, (&nearest, Ties::Direction)));
                for (lane, ray) in rays.iter().enumerate() {
                    told += u32::from(check(&verdicts, lane, ray, &triangles, nearest[lane]));
                    asked += 1;
                }
            }
        }
        assert!(told * 3 > asked, "only {told} of {asked} pairs were settled");
    }
}
