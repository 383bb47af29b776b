//! Cameras: from a view to the pencils that see it.
//!
//! forward f = normalize(target − eye), right r = normalize(f × up), u = r × f. Pixel (i, j), j = 0 at the top:
//!
//! - pinhole: d = f + (2(i+½)/W − 1)·tan(fov/2)·(W/H)·r + (1 − 2(j+½)/H)·tan(fov/2)·u, so t is the depth;
//! - ortho: the same film of start points, `height` world units high, d = f;
//! - equirect: λ = (2(i+½)/W − 1)π, φ = (1 − 2(j+½)/H)π/2, d = cos φ (cos λ f + sin λ r) + sin φ u;
//! - fisheye: equidistant, the angle from f grows with the distance from the centre up to fov/2 on the inscribed circle;
//! - spinning: a LiDAR; columns as in equirect, the elevation of ring j goes in equal steps from the upper to the lower limit,
//!   both included;
//! - cube: +X −X +Y −Y +Z −Z in world axes, texel (i, j) looks along m + (2(i+½)/N − 1)s + (2(j+½)/N − 1)t.
//!
//! sin, cos and tan come from `libm`: those of the platform differ in the last bit.
//!
//! Based on: the cube map tables of OpenGL 4.6, section 8.13, and of KTX 2.0.

use glam::DVec3;
use libm::{cos, sin, tan};
use std::f64::consts::PI;
use umbel_core::{Aabb, Film, GridFilm, Origin, Pencil};

use crate::error::{Argument, Error};
use crate::random::{hammersley, jittered};

/// Subpixels per pixel side for supersampling: offsets are whole numbers of 1/(2·SUBPIXELS) pixel.
const SUBPIXELS: u32 = 128;

/// Space around a scene that is framed automatically.
const FRAME_MARGIN: f64 = 1.06;

/// How a view becomes rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lens {
    /// One eye; the vertical field of view in degrees, exclusive (0, 180).
    Pinhole {
        /// Vertical field of view in degrees.
        fov: f64,
    },
    /// Parallel rays; the height of the film in world units.
    Ortho {
        /// World units from the lower to the upper edge.
        height: f64,
    },
    /// All directions, longitude by latitude.
    Equirect,
    /// Equidistant; the full angle over the inscribed circle in degrees, (0, 360].
    Fisheye {
        /// Full angle over the inscribed circle in degrees.
        fov: f64,
    },
    /// A spinning LiDAR: `height` rings of `width` directions each, the uppermost first.
    Spinning {
        /// Elevations of the lowest and of the highest ring in degrees, within [−90, 90]. A single ring lies between.
        elevations: [f64; 2],
    },
    /// Six square faces around the eye, in world axes.
    Cube,
}

impl Lens {
    /// Whether straight lines may be bent in the picture: its rays then lie scattered on a film.
    #[must_use]
    pub fn bends_lines(&self) -> bool {
        matches!(self, Self::Equirect | Self::Fisheye { .. } | Self::Spinning { .. })
    }
}

/// A camera: where, whereto, and through which lens.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// The eye; of an ortho camera, the middle of the film.
    pub eye: DVec3,
    /// A point in the middle of the picture.
    pub target: DVec3,
    /// A direction that is up in the picture, not parallel to the view.
    pub up: DVec3,
    /// The lens.
    pub lens: Lens,
    /// Pixels per row.
    pub width: u32,
    /// Rows. A cube has six faces of `width` x `width`; its height is ignored.
    pub height: u32,
}

/// The rays of a camera, and the pixel that each belongs to.
#[derive(Debug, Clone, PartialEq)]
pub struct Shot {
    /// The rays.
    pub pencil: Pencil,
    /// The pixel of each ray, row by row (face by face in a cube); `None` where ray k is pixel k.
    pub pixels: Option<Vec<u32>>,
}

/// Faces of a cube map: the axes m, s and t.
pub const CUBE_FACES: [[DVec3; 3]; 6] = [
    [DVec3::X, DVec3::NEG_Z, DVec3::NEG_Y],
    [DVec3::NEG_X, DVec3::Z, DVec3::NEG_Y],
    [DVec3::Y, DVec3::X, DVec3::Z],
    [DVec3::NEG_Y, DVec3::X, DVec3::NEG_Z],
    [DVec3::Z, DVec3::X, DVec3::NEG_Y],
    [DVec3::NEG_Z, DVec3::NEG_X, DVec3::NEG_Y],
];

impl Camera {
    /// The direction that is up where nobody says: +Y; and for a view along Y, the one that has +X on the right: −Z looking
    /// down, as on a map, and +Z looking up.
    #[must_use]
    pub fn default_up(view: DVec3) -> DVec3 {
        if !is_parallel(unit(view), DVec3::Y) {
            DVec3::Y
        } else if view.y > 0.0 {
            DVec3::Z
        } else {
            DVec3::NEG_Z
        }
    }

    /// A camera that frames a box from `direction`, up as [`Camera::default_up`] has it.
    #[must_use]
    pub fn framing(bounds: &Aabb, direction: DVec3, lens: Lens, width: u32, height: u32) -> Self {
        Self::framing_with_up(bounds, direction, Self::default_up(-direction), lens, width, height)
    }

    /// The same with an `up`; where it is parallel to the view or no direction, that of [`Camera::default_up`].
    #[must_use]
    pub fn framing_with_up(
        bounds: &Aabb,
        direction: DVec3,
        up: DVec3,
        lens: Lens,
        width: u32,
        height: u32,
    ) -> Self {
        let bounds = if bounds.is_empty() { Aabb { lo: [-1.0; 3], hi: [1.0; 3] } } else { *bounds };
        let (centre, half) = (DVec3::from_array(bounds.centre()), DVec3::from_array(bounds.extent()) * 0.5);
        let forward = -unit(direction);
        let is_usable = up.is_finite() && up != DVec3::ZERO && !is_parallel(forward, unit(up));
        let picture_up = if is_usable { up } else { Self::default_up(forward) };
        let right = unit(forward.cross(unit(picture_up)));
        let up = right.cross(forward);
        let aspect = f64::from(width) / f64::from(height);
        let corners = (0..8).map(|k| {
            let side = |bit: u32| if k >> bit & 1 == 0 { -1.0 } else { 1.0 };
            DVec3::new(side(0), side(1), side(2)) * half
        });
        let radius = half.length();
        let fov = match lens {
            // Angles out of range are refused with the rays; until then the eye must be somewhere.
            Lens::Pinhole { fov } if fov > 0.0 && fov < 180.0 => fov,
            _ => 45.0,
        };
        // An angle that is refused later frames as well as any.
        let slope = if fov > 0.0 && fov < 180.0 { tan(fov * PI / 360.0) } else { 1.0 };
        // The least distance from which each corner lies within the picture.
        let half_height = |p: &DVec3| (p.dot(right).abs() / aspect).max(p.dot(up).abs());
        let tallest = corners.clone().map(|p| half_height(&p)).fold(0.0, f64::max);
        let distance = corners.fold(0.0_f64, |least, p| least.max(half_height(&p) / slope - p.dot(forward)));
        let lens = match lens {
            Lens::Ortho { .. } => {
                Lens::Ortho { height: if tallest > 0.0 { 2.0 * tallest * FRAME_MARGIN } else { 1.0 } }
            }
            lens => lens,
        };
        let distance = if matches!(lens, Lens::Ortho { .. }) { 2.0 * radius } else { distance };
        let distance = if distance > 0.0 { distance * FRAME_MARGIN } else { 1.0 };
        Self { eye: centre - forward * distance, target: centre, up: picture_up, lens, width, height }
    }

    /// Rows of the picture: those of all six faces for a cube.
    #[must_use]
    pub fn rows(&self) -> u32 {
        if self.lens == Lens::Cube { self.width.saturating_mul(6) } else { self.height }
    }

    /// Pixels of the picture.
    #[must_use]
    pub fn pixels(&self) -> usize {
        self.width as usize * self.rows() as usize
    }

    /// The rays through the pixel centres.
    ///
    /// # Errors
    /// When the view is degenerate or out of range.
    pub fn shot(&self) -> Result<Shot, Error> {
        self.shot_at([0, 0])
    }

    /// Pass `pass` of `passes` over a supersampled picture: every ray moved by the same part of a pixel, on a Hammersley
    /// set. One pass goes through the pixel centres.
    ///
    /// # Errors
    /// As [`Camera::shot`].
    pub fn subpixel_shot(&self, pass: u32, passes: u32) -> Result<Shot, Error> {
        if passes == 1 {
            return self.shot();
        }
        self.shot_at(hammersley(pass, passes).map(offset))
    }

    /// The rays of pass `pass` of `passes` through pixels at sub-positions that a seed has jittered.
    ///
    /// # Errors
    /// As [`Camera::shot`].
    pub fn jittered_shot(&self, pass: u32, passes: u32, seed: u64) -> Result<Shot, Error> {
        self.shot_at(jittered(pass, passes, seed).map(offset))
    }

    /// The rays, moved by `offset`/(2·SUBPIXELS) pixels to the right and up.
    fn shot_at(&self, offset: [i32; 2]) -> Result<Shot, Error> {
        let [f, r, u] = self.frame()?;
        let eye = on_origin_grid(self.eye);
        let (width, height) = (self.width, self.height);
        let film = |width: u32, height: u32, span: [DVec3; 3]| {
            let subpixels = if offset == [0, 0] { 1 } else { SUBPIXELS };
            Ok::<_, Error>(Film::Grid(GridFilm::with_subpixel(width, height, span, subpixels, offset)?))
        };
        let (origin, films) = match self.lens {
            Lens::Pinhole { fov } => {
                check_angle(fov, 180.0, false)?;
                let scale = tan(fov * PI / 360.0) / f64::from(height);
                (Origin::Point(eye), vec![film(width, height, [f, r * scale, u * scale])?])
            }
            Lens::Ortho { height: world } => {
                if !(world > 0.0 && world.is_finite()) {
                    return Err(Argument::FilmHeight { height: world }.into());
                }
                let scale = world / (2.0 * f64::from(height));
                (Origin::Infinity(f), vec![film(width, height, [eye, r * scale, u * scale])?])
            }
            Lens::Cube => {
                let scale = 1.0 / f64::from(width);
                let faces = CUBE_FACES.map(|[m, s, t]| film(width, width, [m, s * scale, -t * scale]));
                (Origin::Point(eye), faces.into_iter().collect::<Result<_, _>>()?)
            }
            Lens::Equirect | Lens::Fisheye { .. } | Lens::Spinning { .. } => {
                return self.scattered_shot([f, r, u], eye, offset);
            }
        };
        Ok(Shot { pencil: Pencil::new(origin, films)?, pixels: None })
    }

    /// The rays of lenses that bend straight lines.
    fn scattered_shot(&self, axes: [DVec3; 3], eye: DVec3, offset: [i32; 2]) -> Result<Shot, Error> {
        match self.lens {
            Lens::Fisheye { fov } => check_angle(fov, 360.0, true)?,
            Lens::Spinning { elevations } => check_elevations(elevations, self.height)?,
            _ => {}
        }
        let shift = offset.map(|o| f64::from(o) / f64::from(2 * SUBPIXELS));
        let count = u64::from(self.width) * u64::from(self.height);
        let count = u32::try_from(count).map_err(|_| umbel_core::Error::TooManyRays { rays: count })?;
        // Lists that grow would be copied.
        let mut directions = Vec::with_capacity(count as usize);
        let mut pixels = Vec::with_capacity(count as usize);
        for pixel in 0..count {
            let (i, j) = (f64::from(pixel % self.width) + shift[0], f64::from(pixel / self.width) - shift[1]);
            if let Some(direction) = self.direction(axes, i, j) {
                directions.push(direction);
                pixels.push(pixel);
            }
        }
        let pencil = Pencil::new(Origin::Point(eye), vec![Film::Scattered(directions)])?;
        Ok(Shot { pencil, pixels: Some(pixels) })
    }

    /// Where a lens that bends straight lines looks at column i and row j; `None` outside its circle.
    fn direction(&self, [f, r, u]: [DVec3; 3], i: f64, j: f64) -> Option<DVec3> {
        let (w, h) = (f64::from(self.width), f64::from(self.height));
        if let Lens::Fisheye { fov } = self.lens {
            let radius = w.min(h) * 0.5;
            let (x, y) = ((i + 0.5 - w * 0.5) / radius, (h * 0.5 - j - 0.5) / radius);
            let distance = (x * x + y * y).sqrt();
            let angle = distance * fov * PI / 360.0;
            let across = if distance > 0.0 { (r * x + u * y) / distance } else { DVec3::ZERO };
            return (distance <= 1.0).then(|| f * cos(angle) + across * sin(angle));
        }
        let lambda = (2.0 * (i + 0.5) / w - 1.0) * PI;
        let phi = match self.lens {
            Lens::Spinning { elevations: [lower, upper] } => {
                let down = if self.height > 1 { j / (h - 1.0) } else { 0.5 };
                (upper + (lower - upper) * down) * PI / 180.0
            }
            _ => (1.0 - 2.0 * (j + 0.5) / h) * PI * 0.5,
        };
        Some((f * cos(lambda) + r * sin(lambda)) * cos(phi) + u * sin(phi))
    }

    /// forward, right and up, of unit length.
    fn frame(&self) -> Result<[DVec3; 3], Error> {
        if self.width == 0 || self.rows() == 0 {
            return Err(Argument::ImageSize.into());
        }
        if self.lens == Lens::Cube {
            return Ok([DVec3::NEG_Z, DVec3::X, DVec3::Y]);
        }
        let view = self.target - self.eye;
        if !(view.is_finite() && self.up.is_finite()) {
            return Err(Argument::ViewNotFinite.into());
        }
        if view == DVec3::ZERO {
            return Err(Argument::EyeIsTarget.into());
        }
        let (forward, up) = (unit(view), if self.up == DVec3::ZERO { self.up } else { unit(self.up) });
        if is_parallel(forward, up) {
            return Err(Argument::UpParallel.into());
        }
        let right = unit(forward.cross(up));
        Ok([forward, right, right.cross(forward)])
    }
}

/// Whether two unit vectors point along one line, or one of them is zero. Their components are within 2 ulp, so that the cross
/// product of parallel ones is below 16 ulp.
fn is_parallel(one: DVec3, other: DVec3) -> bool {
    one.cross(other).length() <= 16.0 * f64::EPSILON
}

/// Refuses angles outside (0, limit), or (0, limit] where that is allowed.
fn check_angle(degrees: f64, limit: f64, inclusive: bool) -> Result<(), Error> {
    if degrees > 0.0 && (degrees < limit || (inclusive && degrees == limit)) {
        return Ok(());
    }
    Err(Argument::FieldOfView { degrees, limit }.into())
}

/// Refuses elevations outside [−90, 90], and limits in the wrong order; a single ring needs no room between them.
fn check_elevations([lower, upper]: [f64; 2], rings: u32) -> Result<(), Error> {
    if -90.0 <= lower && upper <= 90.0 && (lower < upper || (rings == 1 && lower == upper)) {
        return Ok(());
    }
    Err(Argument::Elevations { lower, upper }.into())
}

/// v over its length; v must not be zero.
pub(crate) fn unit(v: DVec3) -> DVec3 {
    let scaled = v / v.abs().max_element();
    scaled / (scaled.x * scaled.x + scaled.y * scaled.y + scaled.z * scaled.z).sqrt()
}

/// The nearest point whose coordinates are multiples of 2⁻¹⁴⁹, as origins must be. Only coordinates below 2⁻⁹⁶ move.
pub(crate) fn on_origin_grid(point: DVec3) -> DVec3 {
    let grid = f64::from(f32::from_bits(1));
    let limit = grid * f64::from(1 << 26) * f64::from(1 << 26);
    let nearest = |x: f64| {
        if x.abs() < limit { (x / grid).round_ties_even() * grid } else { x }
    };
    DVec3::from_array(point.to_array().map(nearest))
}

/// A place in a pixel, in [0, 1], in half sub-pixels from its middle.
fn offset(place: f64) -> i32 {
    // In range: the cast is of at most ±SUBPIXELS.
    ((2.0 * place - 1.0) * f64::from(SUBPIXELS)).round_ties_even() as i32
}
