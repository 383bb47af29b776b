//! Shadow maps: how far a light sees, in every direction.
//!
//! A point light sees a cube: texel (i, j) of a face looks along m + (2(i+½)/N − 1)s + (2(j+½)/N − 1)t in world axes
//! ([`crate::scene::camera::CUBE_FACES`]) and holds the Euclidean distance t·|d| to what it hits, +∞ where it hits nothing. A face's matrix
//! takes (x, y, 1), with x = 2(i+½)/N − 1 and y = 2(j+½)/N − 1, to that direction: its columns are s, t and m.
//!
//! The sun sees a square film that holds the box of the scene: texel (i, j) looks from F + X·R + Y·U, X = 2i + 1 − N,
//! Y = N − 1 − 2j, along D of unit length and holds t, a distance as well.
//!
//! Based on: Lance Williams, "Casting Curved Shadows on Curved Surfaces", 1978; the cube map tables of OpenGL 4.6,
//! section 8.13.

use glam::DVec3;
use rayon::prelude::*;
use umbel_core::{Aabb, Film, Frame, GridFilm, Hits, Options, Origin, Pencil, Stats, SurfaceHits, Triangles};

use crate::error::{Argument, Error};
use crate::scene::Scene;
use crate::scene::camera::{CUBE_FACES, Camera, Lens, unit};
use crate::scene::hit_points::{distance, surface_distance};
use crate::shadow::lookup::CubeMap;

/// How much larger than the scene a sun's film is, so that rounding leaves no vertex outside.
const MARGIN: f64 = 1.000_001;

/// How far before the scene a sun's film stands, in parts of the scene's size: what lies on the film itself is not hit.
const STAND_OFF: f64 = 0.05;

/// Rays up to which all films of a map are one query: those of a cube with faces of 2048 x 2048 texels.
const ONE_QUERY: usize = 6 << 22;

/// The rays of the six faces around a point light, `size` x `size` each.
///
/// # Errors
/// When the light is out of the range of [`umbel_core::Ray::origin`], or `size` is 0 or too large.
pub fn cube_pencil(light: DVec3, size: u32) -> Result<Pencil, Error> {
    if size == 0 {
        return Err(Argument::CubeSize.into());
    }
    let (target, up) = (light, DVec3::Y);
    let camera = Camera { eye: light, target, up, lens: Lens::Cube, width: size, height: size };
    Ok(camera.shot()?.pencil)
}

/// The distance cube of a point light. A frame that keeps the order of the triangles serves the next light faster.
///
/// # Errors
/// As [`cube_pencil`].
pub fn cube_map(
    triangles: &Triangles<'_>,
    light: DVec3,
    size: u32,
    frame: &mut Frame,
    options: &Options,
) -> Result<(CubeMap, Stats), Error> {
    let pencil = cube_pencil(light, size)?;
    let (mut stats, mut all) = (Stats::default(), Vec::with_capacity(pencil.len()));
    for piece in in_pieces(&pencil)? {
        stats = stats.then(frame.closest_hit(triangles, &piece, options)?);
        all.append(&mut distances(triangles, &piece, frame.hits()));
    }
    Ok((CubeMap::new(light, size, all)?, stats))
}

/// A map's rays in the pieces that are asked one after the other: all together, or film by film where they are more than
/// those of a cube with faces of 2048 x 2048 texels. So a large map takes 4 bytes a texel, and the work of one face beside that.
/// The rays of all pieces, joined, are those of the pencil; a frame that keeps the order of the triangles serves the next.
///
/// # Errors
/// None, as long as the pencil is one.
pub fn in_pieces(pencil: &Pencil) -> Result<Vec<Pencil>, Error> {
    if pencil.len() <= ONE_QUERY {
        return Ok(vec![pencil.clone()]);
    }
    let piece = |film: &Film| Pencil::new(pencil.origin(), vec![film.clone()]);
    Ok(pencil.films().iter().map(piece).collect::<Result<_, _>>()?)
}

impl CubeMap {
    /// The distances that a point light sees in a scene, on six faces of `size` x `size` texels. [`cube_map`] takes [`Options`],
    /// and a [`Frame`] for many lights.
    ///
    /// ```
    /// use umbel::{builtin, glam::DVec3, shadow::CubeMap};
    ///
    /// let scene = builtin("cornell")?;
    /// let map = CubeMap::of_scene(&scene, DVec3::new(278.0, 400.0, 279.0), 64)?;
    /// // A point on the floor, right below the light.
    /// assert!(map.is_lit(DVec3::new(278.0, 0.0, 279.0), DVec3::Y));
    /// # Ok::<(), umbel::Error>(())
    /// ```
    ///
    /// # Errors
    /// When the scene is refused, and as [`cube_pencil`].
    pub fn of_scene(scene: &Scene, light: DVec3, size: u32) -> Result<Self, Error> {
        let triangles = scene.geometry()?;
        Ok(cube_map(&triangles, light, size, &mut Frame::new(), &Options::default())?.0)
    }
}

/// The Euclidean distances of a pencil's hits, t·|d|. A miss is +∞, and nothing else is.
#[must_use]
pub fn distances(triangles: &Triangles<'_>, pencil: &Pencil, hits: &Hits) -> Vec<f32> {
    let of_ray =
        |k: usize| hits.get(k).map_or(f32::INFINITY, |hit| distance(triangles, &pencil.ray(k), &hit));
    (0..hits.len()).into_par_iter().map(of_ray).collect()
}

/// The same for surfaces on demand.
#[must_use]
pub fn surface_distances(pencil: &Pencil, hits: &SurfaceHits) -> Vec<f32> {
    let of_ray = |k: usize| match hits.ts()[k] {
        t if t < f32::INFINITY => surface_distance(&pencil.ray(k), t),
        miss => miss,
    };
    (0..hits.len()).into_par_iter().map(of_ray).collect()
}

/// The matrix of each face, row by row, in the order +X −X +Y −Y +Z −Z: it takes (x, y, 1) to a direction in the world.
#[must_use]
pub fn face_matrices() -> [[[f64; 3]; 3]; 6] {
    CUBE_FACES.map(|[m, s, t]| [0, 1, 2].map(|k| [s[k], t[k], m[k]]))
}

/// The rays of a sun's square film of `size` x `size` texels that holds a box. `toward` points to the sun.
///
/// The film's up is the world's +Y, or +Z where the sun stands within a degree of the zenith or below it.
///
/// # Errors
/// When `toward` has no direction, or `size` is 0 or too large.
pub fn sun_pencil(bounds: &Aabb, toward: DVec3, size: u32) -> Result<Pencil, Error> {
    if !toward.is_finite() || toward == DVec3::ZERO {
        return Err(Argument::SunDirection.into());
    }
    let bounds = if bounds.is_empty() { Aabb { lo: [-1.0; 3], hi: [1.0; 3] } } else { *bounds };
    let (centre, half) = (DVec3::from_array(bounds.centre()), DVec3::from_array(bounds.extent()) * 0.5);
    let forward = -unit(toward);
    // cos 1°.
    let vertical = forward.y.abs() > 0.999_85;
    let right = unit(forward.cross(if vertical { DVec3::Z } else { DVec3::Y }));
    let up = right.cross(forward);
    // Half of the box's extent along an axis of the film.
    let reach = |axis: DVec3| axis.abs().dot(half);
    let (side, depth) = (reach(right).max(reach(up)), reach(forward));
    // A box without extent, or one seen from its thin end.
    let side = if side > 0.0 { side * MARGIN } else { depth.max(1.0) };
    let scale = side / f64::from(size.max(1));
    let start = centre - forward * (depth + STAND_OFF * (side + depth));
    let film = GridFilm::new(size, size, start, right * scale, up * scale)?;
    Ok(Pencil::new(Origin::Infinity(forward), vec![Film::Grid(film)])?)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Film by film, a map has the rays and the distances of the whole.
    #[test]
    fn pieces_are_the_whole() {
        let small = cube_pencil(DVec3::new(1.0, 2.0, 3.0), 8).expect("a cube");
        assert_eq!(in_pieces(&small).expect("pieces"), [small]);
        let scene = crate::builtin::builtin("cornell").expect("a scene");
        let triangles = scene.geometry().expect("triangles");
        let large = cube_pencil(DVec3::new(278.0, 400.0, 279.0), 2049).expect("a cube");
        let pieces = in_pieces(&large).expect("pieces");
        assert_eq!((pieces.len(), pieces[0].len()), (6, 2049 * 2049));
        let (mut whole, mut kept) = (Frame::new(), Frame::keeping_order());
        whole.closest_hit(&triangles, &large, &Options::default()).expect("hits");
        for (piece, face) in pieces.iter().zip(0..) {
            let first = face * piece.len();
            kept.closest_hit(&triangles, piece, &Options::default()).expect("hits");
            let ids = &whole.hits().ids()[first..first + piece.len()];
            let of_piece = kept.hits();
            assert!(of_piece.ids() == ids, "face {face}");
            let ts = whole.hits().ts()[first..].iter().zip(of_piece.ts());
            assert!(ts.clone().all(|(one, other)| one.to_bits() == other.to_bits()), "face {face}");
            assert_eq!(piece.ray(77), large.ray(first + 77));
        }
    }
}
