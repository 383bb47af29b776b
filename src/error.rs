//! What the engine refuses, and why.

use rayon::prelude::*;

/// Elements that one task checks.
const CHECKED: usize = 1 << 12;

/// An input that the engine cannot take. Nothing was computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A vertex position with a NaN or an infinite coordinate.
    #[error("vertex {vertex} is not finite: {position:?}")]
    NonFinitePosition {
        /// Index into the positions.
        vertex: usize,
        /// The position as given.
        position: [f32; 3],
    },

    /// A triangle that names a vertex that does not exist.
    #[error("triangle {triangle} uses vertex {vertex}, but there are only {vertices} vertices")]
    IndexOutOfRange {
        /// Index of the triangle.
        triangle: usize,
        /// The index that is too large.
        vertex: u32,
        /// The number of vertices.
        vertices: usize,
    },

    /// More triangles than ids: `0xFFFF_FFFF` stands for a miss.
    #[error("{triangles} triangles are more than the {} that ids can name", u32::MAX)]
    TooManyTriangles {
        /// The number of triangles given.
        triangles: usize,
    },

    /// A group of triangles that has none.
    #[error(
        "group {group} ends at triangle {end}, and the group before it at {before}: no triangle is left for it"
    )]
    EmptyGroup {
        /// Index of the group.
        group: usize,
        /// Where it ends.
        end: u32,
        /// Where it begins.
        before: u32,
    },

    /// Groups that have more or fewer triangles than there are.
    #[error("the groups end at triangle {end}, but there are {triangles} triangles")]
    GroupsEnd {
        /// Where the last group ends; 0 where there is none.
        end: u32,
        /// The number of triangles.
        triangles: usize,
    },

    /// More rays than indices: at most 2³² − 1 in one call.
    #[error("{rays} rays are more than the {} that one call takes", u32::MAX)]
    TooManyRays {
        /// The number of rays asked for.
        rays: u64,
    },

    /// A ray origin outside the range in which the exact stage is exact.
    #[error("origin {origin:?} must be finite, below 2^129, and a multiple of 2^-149")]
    Origin {
        /// The origin as given.
        origin: [f64; 3],
    },

    /// A direction outside the range in which the exact stage is exact.
    #[error(
        "direction {direction:?} must not be zero, and each component must be 0 or of a size in [2^-240, 2^190]"
    )]
    Direction {
        /// The direction as given.
        direction: [f64; 3],
    },

    /// A ray interval that is empty, negative or out of range.
    #[error(
        "ray interval ({t_min}, {t_max}) must satisfy 0 <= t_min < t_max, each 0, infinite or in [2^-160, 2^130]"
    )]
    Interval {
        /// The lower end as given.
        t_min: f64,
        /// The upper end as given.
        t_max: f64,
    },

    /// A film whose spanning vectors do not span space, or without pixels.
    #[error("the film spans no volume: {reason}")]
    Film {
        /// What is wrong.
        reason: &'static str,
    },

    /// A receiver on a triangle that does not exist.
    #[error("receiver {receiver} lies on triangle {triangle}, which does not exist")]
    ReceiverTriangle {
        /// Index of the receiver.
        receiver: usize,
        /// The triangle that it names.
        triangle: u32,
    },

    /// A normal with a NaN or an infinite component.
    #[error("the normal of receiver {receiver} is not finite: {normal:?}")]
    Normal {
        /// Index of the receiver.
        receiver: usize,
        /// The normal as given.
        normal: [f32; 3],
    },

    /// Rays are to be grouped by direction, but each receiver has directions of its own.
    #[error("receivers that have directions of their own cannot be grouped by direction")]
    NoCommonDirections,

    /// Surfaces on demand seen by a scattered film, whose rays have no density.
    #[error(
        "surfaces that are made on demand need rays on a grid: a scattered film has no density to dice by"
    )]
    ScatteredDensity,

    /// A shading rate out of range.
    #[error("shading rate {rate} must lie between 1/64 and 4096 pixels")]
    ShadingRate {
        /// The rate as given.
        rate: f64,
    },

    /// Rays that are no distance apart.
    #[error(
        "rays {spacing} units and {angle} radians apart have no density: both must be finite, the first above 0"
    )]
    Spacing {
        /// World units.
        spacing: f64,
        /// Radians.
        angle: f64,
    },

    /// A surface that gave a point with a NaN or an infinite coordinate.
    #[error("surface {surface} is not finite at (u, v) = {parameters:?}: {position:?}")]
    SurfacePoint {
        /// The id of the surface.
        surface: u32,
        /// (u, v) of the patch.
        parameters: [f64; 2],
        /// The position as given.
        position: [f32; 3],
    },

    /// A surface that gave more or fewer points than it was asked for.
    #[error("surface {surface} gave {points} points for {parameters} parameters")]
    SurfacePoints {
        /// The id of the surface.
        surface: u32,
        /// The number of points.
        points: usize,
        /// The number of parameters.
        parameters: usize,
    },

    /// Instructions that this machine does not have.
    #[error("this machine has no {isa} instructions")]
    Isa {
        /// Their name.
        isa: &'static str,
    },

    /// The host has told the processor to flush subnormal numbers to zero. The engine would not be exact.
    #[error(
        "this thread flushes subnormal numbers to zero (FTZ/DAZ); clear that mode before calling the engine"
    )]
    FlushToZero,

    /// A thread rounds otherwise than to nearest, so that error bounds would not hold.
    #[error(
        "a thread of this process does not round to nearest: set its rounding mode back before the call, or call from a thread \
         that was started before it was changed"
    )]
    RoundingMode,
}

impl Error {
    /// Whether the error lies in the rays (a camera, a light) rather than in the triangles.
    #[must_use]
    pub fn is_about_rays(&self) -> bool {
        !matches!(
            self,
            Self::NonFinitePosition { .. }
                | Self::IndexOutOfRange { .. }
                | Self::TooManyTriangles { .. }
                | Self::EmptyGroup { .. }
                | Self::GroupsEnd { .. }
                | Self::SurfacePoint { .. }
                | Self::SurfacePoints { .. }
        )
    }
}

/// The first element that is wrong, by all threads. One by one, in a parallel iterator, 2 million rays took 15 ms
/// longer.
pub(crate) fn first_wrong<T: Sync>(items: &[T], is_wrong: impl Fn(&T) -> bool + Sync) -> Option<usize> {
    items.par_chunks(CHECKED).enumerate().find_map_first(|(number, chunk)| {
        chunk.iter().position(&is_wrong).map(|place| number * CHECKED + place)
    })
}
