//! Sets of rays: films, pencils, segments, receivers and hemispheres; the bounds that stand for many of them; and the
//! hits that come back.

pub(crate) mod cone;
pub(crate) mod film;
pub(crate) mod frustum;
pub(crate) mod hemisphere;
pub(crate) mod hits;
pub(crate) mod origin;
pub(crate) mod pencil;
pub(crate) mod point_order;
pub(crate) mod projection;
pub(crate) mod receiver;
pub(crate) mod segment;
