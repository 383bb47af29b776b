//! Surfaces on demand: flat ones head-on, and some upon each other.

use umbel::engine::{
    Aabb, Above, Around, Detail, Dicing, Domain, Grouping, Occlusion, OnDemand, RaySample, RaySamples,
    closest_hit_on_demand, open_rays_on_demand, shadowed_on_demand,
};
use umbel::glam::DVec3;
use umbel::surfaces::{DisplacedMesh, Displacement, SubdivisionSurface};
use umbel::{Options, Origin, Pencil, Triangles};

use crate::Result;
use crate::subjects::coincident::ask::{hemispheres, parallel, pinhole, receivers_at};
use crate::subjects::coincident::{Coincidence, Place, Query, scenes};
use crate::subjects::mesh::{Mesh, rounded};

const SIZE: [u32; 2] = [320, 180];
const HALF: f64 = 0.577_350_269;

pub(crate) const COINCIDENCES: [Coincidence; 13] = [
    Coincidence { name: "reyes sheet", query: |p| sheet(p, false) },
    Coincidence { name: "reyes sheet-ortho", query: |p| sheet(p, true) },
    Coincidence { name: "reyes same-sheet-4", query: |p| same_sheets(p, 4, DVec3::ZERO) },
    Coincidence { name: "reyes same-sheet-16", query: |p| same_sheets(p, 16, DVec3::ZERO) },
    Coincidence {
        name: "reyes slanted-same-sheet-4",
        query: |p| same_sheets(p, 4, DVec3::new(0.0, 0.0, 1.3)),
    },
    Coincidence { name: "reyes shifted-sheets", query: shifted_sheets },
    Coincidence { name: "reyes blocks", query: blocks },
    Coincidence { name: "reyes cage", query: |p| cage(p, 1) },
    Coincidence { name: "reyes same-cage-2", query: |p| cage(p, 2) },
    Coincidence { name: "reyes two-sided", query: two_sided },
    Coincidence { name: "reyes shadow-sheet", query: |p| shadow(p, 1) },
    Coincidence { name: "reyes shadow-same-sheet-4", query: |p| shadow(p, 4) },
    Coincidence { name: "reyes open-rays-same-sheet-4", query: open_rays },
];

/// Parallelograms, each a step beside the one before.
#[derive(Debug, Clone, Copy)]
struct Sheets {
    corner: DVec3,
    sides: [DVec3; 2],
    count: u32,
    step: DVec3,
}

impl Sheets {
    /// Squares of 8 x 8, slanted or not, so many, and from one to the next.
    fn new(place: Place, z: f64, slant: DVec3, (count, step): (u32, DVec3)) -> Self {
        let turn = place.of_both();
        let sides = [turn * (DVec3::X * 8.0), turn * (DVec3::Y * 8.0 + slant)];
        Self { corner: turn * DVec3::new(-4.0, -4.0, z), sides, count, step: turn * step }
    }

    fn at(&self, sheet: u32, [u, v]: [f64; 2]) -> [f32; 3] {
        rounded(self.corner + self.sides[0] * u + self.sides[1] * v + self.step * f64::from(sheet))
    }
}

impl OnDemand for Sheets {
    type Object = u32;

    fn roots(&self) -> Vec<u32> {
        (0..self.count).collect()
    }

    fn bounds(&self, sheet: &u32, Domain { u, v }: Domain, _: &Detail) -> Aabb {
        Aabb::of_points((0..4).map(|k| self.at(*sheet, [u[k % 2], v[k / 2]])))
    }

    fn expand(&self, _: &u32, _: f64, _: &Detail, _: &mut Vec<u32>) -> bool {
        false
    }

    fn evaluate(&self, sheet: &u32, parameters: &[[f64; 2]], _: &Detail, points: &mut Vec<[f32; 3]>) {
        points.extend(parameters.iter().map(|&p| self.at(*sheet, p)));
    }

    fn id(&self, sheet: &u32) -> u32 {
        *sheet
    }
}

/// What a film sees of surfaces.
fn closest<S: OnDemand + 'static>(surfaces: S, pencil: Pencil) -> Result<Query> {
    Ok(Box::new(move || {
        Ok(closest_hit_on_demand(&surfaces, &pencil, &Dicing::default(), &Options::default())?.1)
    }))
}

/// A square at the distance of the wall, head-on; turned against the view where it is apart.
fn sheet(place: Place, is_parallel: bool) -> Result<Query> {
    let turn = place.of_mesh();
    let corner = turn * DVec3::new(-4.0, -4.0, f64::from(-2.2_f32));
    let sides = [turn * (DVec3::X * 8.0), turn * (DVec3::Y * 8.0)];
    let sheets = Sheets { corner, sides, count: 1, step: DVec3::ZERO };
    let pencil = if is_parallel {
        parallel(place.of_rays(), DVec3::Z * 5.0, 3.0, SIZE)?
    } else {
        pinhole(place.of_rays(), DVec3::Z * 5.0, HALF, SIZE)?
    };
    closest(sheets, pencil)
}

/// The same square so many times, slanted or not.
fn same_sheets(place: Place, count: u32, slant: DVec3) -> Result<Query> {
    let step = DVec3::NEG_Z * place.gap(1e-2);
    let pencil = pinhole(place.of_both(), DVec3::new(0.123, 0.0456, 5.0), HALF, SIZE)?;
    closest(Sheets::new(place, -2.0, slant, (count, step)), pencil)
}

/// Squares in one plane that are shifted to each other.
fn shifted_sheets(place: Place) -> Result<Query> {
    let step = DVec3::new(0.0137, 0.0071, -place.gap(1e-2));
    let pencil = pinhole(place.of_both(), DVec3::new(0.123, 0.0456, 5.0), HALF, SIZE)?;
    closest(Sheets::new(place, -2.0, DVec3::new(0.0, 0.0, 1.3), (4, step)), pencil)
}

/// A city of flat faces.
fn blocks(place: Place) -> Result<Query> {
    let mesh = scenes::blocks(12).turned(place.of_mesh());
    let surfaces = DisplacedMesh::new(&mesh.scene(), Displacement::NONE);
    closest(surfaces, pinhole(place.of_rays(), DVec3::new(6.0, 6.0, 14.0), HALF, SIZE)?)
}

/// Faces with two sides.
fn two_sided(place: Place) -> Result<Query> {
    let surfaces = DisplacedMesh::new(&scenes::two_sided(12, place).scene(), Displacement::NONE);
    closest(surfaces, pinhole(place.of_both(), DVec3::new(0.123, 0.0456, 2.0), HALF, SIZE)?)
}

/// A rounded cube, symmetric around the view's axis, or so many copies of it.
fn cage(place: Place, count: u32) -> Result<Query> {
    let (turn, gap) = if count > 1 { (place.of_both(), place.gap(1e-2)) } else { (place.of_mesh(), 0.0) };
    let cube = |k: u32| {
        let at = DVec3::splat(-1.0) - DVec3::Z * (gap * f64::from(k));
        let mesh = Mesh::cuboid(at, DVec3::splat(2.0));
        welded(mesh)
    };
    let scene = (0..count).map(cube).fold(Mesh::default(), Mesh::and).turned(turn).scene();
    let surfaces = SubdivisionSurface::new(&scene, &scene.creases, Displacement::NONE);
    closest(surfaces, pinhole(place.of_rays(), DVec3::Z * 3.0, HALF, SIZE)?)
}

/// A mesh with one vertex for each position.
fn welded(mesh: Mesh) -> Mesh {
    let first = |v: u32| {
        let same = |p: &[f32; 3]| *p == mesh.positions[v as usize];
        // It is one of them.
        mesh.positions.iter().position(same).unwrap_or_default() as u32
    };
    Mesh { triangles: mesh.triangles.iter().map(|corners| corners.map(first)).collect(), ..mesh }
}

/// The shadows of squares above a plane, from a lamp straight above.
fn shadow(place: Place, count: u32) -> Result<Query> {
    let turn = place.of_both();
    let step = DVec3::NEG_Z * place.gap(1e-2);
    let sheets = Sheets::new(place, -2.0, DVec3::ZERO, (count, step));
    let view = pinhole(turn, DVec3::new(0.123, 0.0456, 5.0), HALF, SIZE)?;
    let at = |k: u32| DVec3::new(f64::from(k % 128) / 8.0 - 8.0, f64::from(k / 128) / 8.0 - 8.0, -4.0);
    // Receivers and lamp lie on the lattice of the squares, or beside it.
    let aside = DVec3::new(0.0031, 0.0017, 0.0) * if place == Place::Apart { 1.0 } else { 0.0 };
    let receivers = receivers_at((0..128 * 128).map(|k| turn * (at(k) + aside)));
    let light = Origin::Point(turn * (DVec3::Z * 4.0 + aside));
    Ok(Box::new(move || {
        let view = (&view, &Dicing::default());
        Ok(shadowed_on_demand(&sheets, view, light, &receivers, &Options::default())?.1)
    }))
}

/// Rays from receivers on squares that coincide.
fn open_rays(place: Place) -> Result<Query> {
    let turn = place.of_both();
    let step = DVec3::NEG_Z * place.gap(1e-2);
    let sheets = Sheets::new(place, -2.0, DVec3::ZERO, (4, step));
    let at = |k: u32| DVec3::new(f64::from(k % 32) / 8.0 - 2.0, f64::from(k / 32) / 8.0 - 2.0, -4.0);
    let receivers = receivers_at((0..32 * 32).map(|k| turn * at(k)));
    let bounds = Aabb::of_points(receivers.iter().map(|receiver| receiver.point));
    let hemispheres = hemispheres(receivers, Above::Normal(rounded(turn * DVec3::Z)));
    let of = |k: u32| DVec3::new(f64::from(k % 4) - 1.5, f64::from(k / 4) - 1.5, 2.0);
    let samples: Vec<RaySample> = (0..16).map(|k| RaySample::unlimited(turn * of(k))).collect();
    let around = Around { bounds, spacing: 0.125, angle: 0.25 };
    Ok(Box::new(move || {
        let samples = RaySamples::Shared(&samples);
        let grouping = Grouping::Auto;
        let occlusion = Occlusion { hemispheres: &hemispheres, samples, back_faces: true, grouping };
        let (nothing, around) = (Triangles::new(&[], &[])?, (&around, &Dicing::default()));
        Ok(open_rays_on_demand(&sheets, &nothing, &occlusion, around, &Options::default())?.1)
    }))
}
