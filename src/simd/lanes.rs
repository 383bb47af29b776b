//! Vectors of eight numbers, and eight points side by side.
//!
//! Only + − × ÷ and comparisons are used, so every instruction set gives the same bits. Products and sums are fused
//! only where that decides what is looked at, and nothing else.
//!
//! Closures over vectors, `map` among them, are compiled without the instruction set of their surroundings: they are
//! called instead of inlined, and vectors pass through memory (15 % of all instructions in one case). Loops and plain
//! calls of `#[inline(always)]` functions are fine.

use fearless_simd::{f32x8, f32x16, f64x8, mask32x8, mask64x8, prelude::*};
use glam::DVec3;

/// Lanes of a vector.
pub(crate) const LANES: usize = 8;

/// Eight numbers.
pub(crate) type Lanes<S> = f64x8<S>;

/// Eight truth values.
pub(crate) type LaneMask<S> = mask64x8<S>;

/// Eight numbers of f32.
pub(crate) type Narrow<S> = f32x8<S>;

/// Eight truth values over [`Narrow`].
pub(crate) type NarrowMask<S> = mask32x8<S>;

/// Numbers of f32 side by side where sixteen are.
pub(crate) const WIDTH: usize = 16;

/// Sixteen numbers of f32.
pub(crate) type Wide<S> = f32x16<S>;

/// Eight numbers, rounded to the nearest f32.
#[inline(always)]
pub(crate) fn narrow<S: Simd>(x: Lanes<S>) -> Narrow<S> {
    let (low, high) = x.split();
    low.narrow(high)
}

/// Eight points.
#[derive(Clone, Copy)]
pub(crate) struct Points<S: Simd> {
    pub(crate) x: Lanes<S>,
    pub(crate) y: Lanes<S>,
    pub(crate) z: Lanes<S>,
}

impl<S: Simd> Points<S> {
    /// The same point eight times.
    #[inline(always)]
    pub(crate) fn splat(simd: S, p: DVec3) -> Self {
        Self {
            x: Lanes::simd_from(simd, p.x),
            y: Lanes::simd_from(simd, p.y),
            z: Lanes::simd_from(simd, p.z),
        }
    }

    /// Eight points given as f32 coordinates.
    #[inline(always)]
    pub(crate) fn widen(simd: S, p: &[[f32; LANES]; 3]) -> Self {
        let [x, y, z] = p;
        Self {
            x: widen(Narrow::load_array_ref(simd, x)),
            y: widen(Narrow::load_array_ref(simd, y)),
            z: widen(Narrow::load_array_ref(simd, z)),
        }
    }

    #[inline(always)]
    pub(crate) fn minus(self, other: Self) -> Self {
        Self { x: self.x - other.x, y: self.y - other.y, z: self.z - other.z }
    }

    #[inline(always)]
    pub(crate) fn plus(self, other: Self) -> Self {
        Self { x: self.x + other.x, y: self.y + other.y, z: self.z + other.z }
    }

    /// The dot product, lane by lane, with fewer roundings where the machine has them: not the same bits on all.
    #[inline(always)]
    pub(crate) fn fused_dot(self, p: Self) -> Lanes<S> {
        self.z.mul_add(p.z, self.y.mul_add(p.y, self.x * p.x))
    }

    /// Each point by a number of its own.
    #[inline(always)]
    pub(crate) fn times(self, factor: Lanes<S>) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }

    /// The greatest of |x|, |y| and |z|.
    #[inline(always)]
    pub(crate) fn greatest(self) -> Lanes<S> {
        self.x.abs().max(self.y.abs()).max(self.z.abs())
    }

    /// |x|, |y| and |z|.
    #[inline(always)]
    pub(crate) fn magnitudes(self) -> Self {
        Self { x: self.x.abs(), y: self.y.abs(), z: self.z.abs() }
    }

    /// The cross product, lane by lane.
    #[inline(always)]
    pub(crate) fn cross(self, other: Self) -> Self {
        Self {
            x: self.y * other.z - self.z * other.y,
            y: self.z * other.x - self.x * other.z,
            z: self.x * other.y - self.y * other.x,
        }
    }

    /// The dot product with one point.
    #[inline(always)]
    pub(crate) fn dot(self, p: DVec3) -> Lanes<S> {
        self.x * p.x + self.y * p.y + self.z * p.z
    }

    /// The dot product, lane by lane.
    #[inline(always)]
    pub(crate) fn dot_lanes(self, p: Self) -> Lanes<S> {
        self.x * p.x + self.y * p.y + self.z * p.z
    }
}

/// Eight f32 as f64, exactly.
#[inline(always)]
pub(crate) fn widen<S: Simd>(x: Narrow<S>) -> Lanes<S> {
    let (low, high) = x.widen();
    low.combine(high)
}

/// The positions of the bits that are set, from the lowest.
pub(crate) fn bits(mut mask: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = mask.trailing_zeros() as usize;
        (mask != 0).then(|| {
            mask &= mask - 1;
            lane
        })
    })
}

/// The least lane; none is NaN.
#[inline(always)]
pub(crate) fn least_of<S: Simd>(lanes: Narrow<S>) -> f32 {
    lanes.to_array().into_iter().fold(f32::INFINITY, |least, x| if x < least { x } else { least })
}
