//! Surfaces on demand: bound, split, dice, sample, forget.

pub(crate) mod closest;
pub(crate) mod dice;
pub(crate) mod occlusion;
pub(crate) mod reference;
pub(crate) mod sample;
pub(crate) mod shadow;
pub(crate) mod tile;
