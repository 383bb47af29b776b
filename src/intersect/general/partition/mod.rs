//! How the general path divides objects: the heuristics of the paper, and one that came after it.
//!
//! | partition | objects | what decides |
//! |---|---|---|
//! | middle | in place | the middle of the longest side of their box |
//! | given | as they are | the ends of groups, within a group the middle of its order: [`crate::intersect::general::partition::given`] |
//! | spatial | referenced by each voxel that their boxes meet | the middle of the longest side of the voxel |
//! | sampled | in place | what a sample of the active rays meets |
//!
//! Hits are ordered by (t, id), which is total: the order of work, and testing a pair twice, change no hit.
//!
//! Based on: Alexander Keller and Carsten Wächter, "Efficient Ray Tracing without Auxiliary Acceleration Data Structure",
//! 2011; Kosuke Nabata, Kei Iwasaki, Yoshinori Dobashi, Tomoyuki Nishita, "Efficient Divide-And-Conquer Ray Tracing using
//! Ray Sampling", 2013.

pub(crate) mod given;
pub(crate) mod sampled;
pub(crate) mod spatial;

/// Two sides of some objects.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Split {
    /// How many objects are on the left side.
    pub(crate) left: usize,
    /// The axis along which the sides lie one behind the other.
    pub(crate) axis: usize,
    /// Whether the left side has the lesser coordinates.
    pub(crate) ascending: bool,
    /// What a sample of the rays says.
    pub(crate) sampled: Option<Sampled>,
}

/// What a sample of the active rays says about two sides.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sampled {
    /// Whether so many rays meet the side that finding out which ones does not pay: left and right.
    pub(crate) met_by_most: [bool; 2],
    /// Whether most rays go towards greater coordinates on the axis.
    pub(crate) most_ascend: bool,
}
