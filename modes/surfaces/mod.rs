//! Any of the surfaces on demand that this package has, as one type.

pub mod bezier;
pub mod builtin;
pub mod displaced;
pub mod displacement;
pub(crate) mod extent;
pub mod height_map;
pub(crate) mod lanes;
pub mod noise;
pub mod patch_tree;
pub(crate) mod polygons;
pub mod subdivision;

pub use bezier::BezierPatches;
pub use builtin::field::{Field, FieldObject};
pub use builtin::terrain::Terrain;
pub use displaced::{DisplacedMesh, FaceObject};
pub use displacement::{Displacement, Relief};
pub use height_map::HeightMap;
pub use noise::Noise;
pub use patch_tree::Node;
pub use subdivision::SubdivisionSurface;

use umbel_core::{Aabb, Detail, Domain, OnDemand};

/// A surface that is made where rays are.
#[derive(Debug, Clone, PartialEq)]
pub enum Surfaces {
    /// Bicubic Bézier patches.
    Patches(BezierPatches),
    /// Polygons, displaced or as they are.
    Displaced(Box<DisplacedMesh>),
    /// A Catmull-Clark surface, displaced or as it is.
    Subdivided(Box<SubdivisionSurface>),
    /// `builtin:terrain`.
    Terrain(Terrain),
    /// `builtin:field`.
    Field(Field),
}

/// A group or a patch of [`Surfaces`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SurfaceObject {
    /// Of Bézier patches or a Catmull-Clark surface.
    Node(Node),
    /// Of displaced polygons.
    Face(FaceObject),
    /// A patch of the terrain.
    Terrain(u32),
    /// Of the field.
    Field(FieldObject),
}

/// Calls a method of the surface that an object belongs to; an object of another surface gives the last expression.
macro_rules! dispatch {
    ($surfaces:expr, $object:expr, |$surface:ident, $part:ident| $call:expr, $otherwise:expr) => {
        match ($surfaces, $object) {
            (Surfaces::Patches($surface), SurfaceObject::Node($part)) => $call,
            (Surfaces::Displaced($surface), SurfaceObject::Face($part)) => $call,
            (Surfaces::Subdivided($surface), SurfaceObject::Node($part)) => $call,
            (Surfaces::Terrain($surface), SurfaceObject::Terrain($part)) => $call,
            (Surfaces::Field($surface), SurfaceObject::Field($part)) => $call,
            _ => $otherwise,
        }
    };
}

impl Surfaces {
    /// The box of everything, with all its detail.
    #[must_use]
    pub fn all_bounds(&self) -> Aabb {
        let detail = Detail::all();
        let of_root = |root| self.bounds(root, Domain::UNIT, &detail);
        self.roots().iter().map(of_root).fold(Aabb::EMPTY, Aabb::union)
    }
}

impl OnDemand for Surfaces {
    type Object = SurfaceObject;

    fn roots(&self) -> Vec<SurfaceObject> {
        match self {
            Self::Patches(surface) => surface.roots().into_iter().map(SurfaceObject::Node).collect(),
            Self::Displaced(surface) => surface.roots().into_iter().map(SurfaceObject::Face).collect(),
            Self::Subdivided(surface) => surface.roots().into_iter().map(SurfaceObject::Node).collect(),
            Self::Terrain(surface) => surface.roots().into_iter().map(SurfaceObject::Terrain).collect(),
            Self::Field(surface) => surface.roots().into_iter().map(SurfaceObject::Field).collect(),
        }
    }

    fn bounds(&self, object: &SurfaceObject, domain: Domain, detail: &Detail) -> Aabb {
        dispatch!(self, object, |surface, part| surface.bounds(part, domain, detail), Aabb::EMPTY)
    }

    fn expand(
        &self,
        object: &SurfaceObject,
        spacing: f64,
        detail: &Detail,
        parts: &mut Vec<SurfaceObject>,
    ) -> bool {
        fn wrapped<S: OnDemand>(
            (surface, object): (&S, &S::Object),
            (spacing, detail): (f64, &Detail),
            wrap: fn(S::Object) -> SurfaceObject,
            parts: &mut Vec<SurfaceObject>,
        ) -> bool {
            let mut own = Vec::new();
            let expanded = surface.expand(object, spacing, detail, &mut own);
            parts.extend(own.into_iter().map(wrap));
            expanded
        }
        let asked = (spacing, detail);
        match (self, object) {
            (Self::Patches(s), SurfaceObject::Node(o)) => wrapped((s, o), asked, SurfaceObject::Node, parts),
            (Self::Displaced(s), SurfaceObject::Face(o)) => {
                wrapped((s.as_ref(), o), asked, SurfaceObject::Face, parts)
            }
            (Self::Subdivided(s), SurfaceObject::Node(o)) => {
                wrapped((s.as_ref(), o), asked, SurfaceObject::Node, parts)
            }
            (Self::Field(s), SurfaceObject::Field(o)) => wrapped((s, o), asked, SurfaceObject::Field, parts),
            _ => false,
        }
    }

    fn evaluate(
        &self,
        patch: &SurfaceObject,
        parameters: &[[f64; 2]],
        detail: &Detail,
        points: &mut Vec<[f32; 3]>,
    ) {
        dispatch!(self, patch, |surface, part| surface.evaluate(part, parameters, detail, points), ());
    }

    fn id(&self, patch: &SurfaceObject) -> u32 {
        dispatch!(self, patch, |surface, part| surface.id(part), 0)
    }
}
