//! The most bytes that a picture or a mask adds at a time: what is kept and what comes and goes, in the order of the run.
//!
//! How much of a picture sees a surface, and how much of that turns to a light, decides how many points there are. A look at a
//! small film of the same camera tells; it takes the engine the time of its triangles, and no more.

use umbel::engine::Dicing;
use umbel::formats::SurfaceScene;
use umbel::render::{Bounces, Look, preview_with, surface_visibility};
use umbel::shadow::{Receivers, receivers};
use umbel::{Aov, Camera, Error, Lens, NO_TRIANGLE, Options, Origin, Scene, visibility};

use crate::common::PathArg;
use crate::options::parse::extension;
use crate::options::picture::PictureArgs;

/// Columns of the small film, at most.
const COLUMNS: u32 = 64;

/// Bytes of the hit of a triangle: id and t.
pub(crate) const HIT_BYTES: u64 = 8;

/// Bytes of a micropolygon's hit: (u, v), the normal, and how many were tested, beside a triangle's.
pub(crate) const SURFACE_HIT_BYTES: u64 = 28;

/// Bytes of a scattered ray: its direction in f64, and its pixel.
pub(crate) const SCATTERED_BYTES: u64 = 28;

/// Bytes of the receiver of a light, with the number of its ray.
pub(crate) const RECEIVER_BYTES: u64 = 20;

/// Rays whose receivers are found together, before they join the others.
const TOGETHER: u64 = 1 << 18;

/// Bytes that the engine takes for a receiver: its place in an order.
const ORDERED_BYTES: u64 = 4;

/// Bytes of a micropolygon for shadows: its corners and their indices.
pub(crate) const CORNERS_BYTES: u64 = 48;

/// Bytes of a colour in f32.
const COLOUR_BYTES: u64 = 12;

/// Bytes of a colour in a PNG file before it is compressed.
const PNG_BYTES: u64 = 3;

/// Bytes of a point of a point cloud.
const POINT_BYTES: u64 = 28;

/// Bytes of a ray on the general path: as slab tests want it, and its nearest hit.
const GENERAL_BYTES: u64 = 88;

/// Bytes of a triangle in bundles, a tree with copies of the corners, and of a thread's constant.
const BUNDLE_BYTES: [u64; 2] = [63, 3 << 20];

/// Bytes of a ray while it is in a bundle: a thread has a limited number at a time.
const BUNDLED_BYTES: u64 = 40;

/// Bytes of a triangle in any order.
const ORDER_BYTES: u64 = 6;

/// Bytes now, and the most so far.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Tally {
    now: u64,
    pub(crate) most: u64,
}

impl Tally {
    /// Bytes that stay.
    pub(crate) fn keep(&mut self, bytes: u64) {
        self.now = self.now.saturating_add(bytes);
        self.most = self.most.max(self.now);
    }

    /// Bytes that go.
    pub(crate) fn free(&mut self, bytes: u64) {
        self.now = self.now.saturating_sub(bytes);
    }

    /// Bytes that come and go.
    pub(crate) fn pass(&mut self, bytes: u64) {
        self.most = self.most.max(self.now.saturating_add(bytes));
    }
}

/// Parts of a picture's rays.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Shares {
    /// Those that hit something.
    pub(crate) hit: f64,
    /// Those that hit what turns to a light, light by light.
    pub(crate) lit: Vec<f64>,
    /// Rays of each bounce behind them.
    pub(crate) followed: Vec<f64>,
}

impl Shares {
    /// All of them.
    pub(crate) fn whole(lights: usize) -> Self {
        Self { hit: 1.0, lit: vec![1.0; lights], followed: Vec::new() }
    }

    /// Those that a small film finds.
    pub(crate) fn of(scene: &Scene, camera: &Camera, look: &Look, options: &Options) -> Result<Self, Error> {
        let (camera, triangles) = (small(camera), scene.geometry()?);
        let (buffer, _) = visibility(scene, &camera, options)?;
        let found = receivers(&triangles, &buffer.shot.pencil, &buffer.hits, &look.lights)?;
        let mut shares = Self::among(buffer.hits.ids(), &found);
        if look.bounces.most > 0 {
            let once = Look { samples: 1, lights: Vec::new(), ..look.clone() };
            let seen = preview_with(scene, &camera, &buffer, &once, options, |_| ())?;
            let part = |&rays: &u64| rays as f64 / buffer.hits.len().max(1) as f64;
            shares.followed = seen.followed.rays.iter().map(part).collect();
        }
        Ok(shares)
    }

    /// The same of surfaces on demand.
    pub(crate) fn of_surfaces(
        scene: &SurfaceScene,
        camera: &Camera,
        lights: &[Origin],
        (dicing, options): (&Dicing, &Options),
    ) -> Result<Self, Error> {
        let (camera, dicing) = (small(camera), Dicing { keep_corners: true, ..*dicing });
        let (seen, _) = surface_visibility(scene, camera.shot()?, camera.pixels(), &dicing, options)?;
        Ok(Self::among(seen.hits.ids(), &seen.receivers(lights)?))
    }

    /// The shares of some rays, from their hits and the receivers of each light.
    fn among(ids: &[u32], receivers: &[Receivers]) -> Self {
        let part = |count: usize| count as f64 / ids.len().max(1) as f64;
        Self {
            hit: part(ids.iter().filter(|&&id| id != NO_TRIANGLE).count()),
            lit: receivers.iter().map(|found| part(found.rays.len())).collect(),
            followed: Vec::new(),
        }
    }

    /// Bytes of the receivers of all lights among so many rays: kept; and those that pass, of lists that join them and of the engine for the
    /// light that has most.
    pub(crate) fn receivers(&self, rays: u64) -> [u64; 2] {
        let all: f64 = self.lit.iter().sum();
        let most = self.lit.iter().copied().fold(0.0, f64::max);
        let together = (rays.min(TOGETHER) * RECEIVER_BYTES) as f64;
        let passing = most * (rays * ORDERED_BYTES) as f64 + all * together;
        [(all * (rays * RECEIVER_BYTES) as f64) as u64, passing as u64]
    }
}

/// The same camera with a small film.
fn small(camera: &Camera) -> Camera {
    let width = camera.width.min(COLUMNS);
    let rows = (u64::from(camera.height) * u64::from(width)).div_ceil(u64::from(camera.width.max(1)));
    let is_spinning = matches!(camera.lens, Lens::Spinning { .. });
    // In range: there are at most as many as before.
    let height = if is_spinning { camera.height } else { rows.max(1) as u32 };
    Camera { width, height, ..*camera }
}

/// Rays of a camera or of a pattern.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rays {
    pub(crate) pixels: u64,
    pub(crate) rays: u64,
    /// Bytes of a ray itself.
    pub(crate) ray_bytes: u64,
    /// Bytes of its hit.
    pub(crate) hit_bytes: u64,
}

impl Rays {
    /// Those of a camera that looks at triangles.
    pub(crate) fn of_camera(camera: &Camera) -> Self {
        let pixels = u64::from(camera.width) * u64::from(camera.rows());
        let side = u64::from(camera.width.min(camera.height));
        let rays = match camera.lens {
            // Those within the circle.
            Lens::Fisheye { .. } => (std::f64::consts::FRAC_PI_4 * (side * side) as f64) as u64,
            _ => pixels,
        };
        let ray_bytes = if camera.lens.bends_lines() { SCATTERED_BYTES } else { 0 };
        Self { pixels, rays, ray_bytes, hit_bytes: HIT_BYTES }
    }

    /// What is kept of them.
    pub(crate) fn bytes(&self) -> u64 {
        self.rays.saturating_mul(self.ray_bytes + self.hit_bytes)
    }

    /// What the engine takes to find their hits among so many triangles.
    pub(crate) fn engine(&self, triangles: u64, path: PathArg) -> u64 {
        if path == PathArg::General {
            return self.rays * GENERAL_BYTES + triangles * ORDER_BYTES;
        }
        let bundles = if self.ray_bytes > 0 { bundles(triangles, self.rays) } else { 0 };
        self.rays / 2 + triangles * ORDER_BYTES + bundles
    }
}

/// What the engine takes for so many arbitrary rays among so many triangles.
fn bundles(triangles: u64, rays: u64) -> u64 {
    let threads = rayon::current_num_threads() as u64 * BUNDLE_BYTES[1];
    triangles * BUNDLE_BYTES[0] + threads.min(rays.saturating_mul(BUNDLED_BYTES))
}

/// A picture and its files.
pub(crate) struct PictureBytes<'a> {
    pub(crate) args: &'a PictureArgs,
    pub(crate) rays: Rays,
    pub(crate) shares: Shares,
    pub(crate) bounces: Bounces,
    /// Triangles of the scene.
    pub(crate) triangles: u64,
    /// What the engine takes for the camera.
    pub(crate) engine: u64,
}

impl PictureBytes<'_> {
    /// The most bytes that it adds.
    pub(crate) fn most(&self) -> u64 {
        let (args, rays) = (self.args, self.rays);
        let mut tally = Tally::default();
        tally.keep(rays.bytes());
        if rays.ray_bytes > 0 {
            // What bundles give back of their tree stays in the lists of free memory.
            let tree = self.triangles * BUNDLE_BYTES[0];
            tally.keep(tree);
            tally.pass(self.engine - tree.min(self.engine));
        } else {
            tally.pass(self.engine);
        }
        let format = args.output.as_deref().map_or_else(|| "png".to_owned(), extension);
        let is_preview = (args.output.is_some() || args.aovs.is_empty()) && format != "ply";
        if is_preview {
            self.preview(&mut tally);
        }
        for (aov, file) in &args.aovs {
            let numbers = 4 * rays.pixels * numbers_of(*aov);
            tally.pass(numbers + self.scattered(numbers));
            if file.is_none() {
                // They are split into channels.
                tally.keep(2 * numbers);
                tally.free(numbers);
            }
        }
        match format.as_str() {
            "ply" => tally.pass(self.points()),
            "exr" => tally.pass(rays.pixels * COLOUR_BYTES),
            "png" => tally.pass(rays.pixels * PNG_BYTES),
            _ => {}
        }
        tally.most
    }

    /// The preview: it stays.
    fn preview(&self, tally: &mut Tally) {
        let (rays, samples) = (self.rays, self.args.samples);
        let colours = rays.pixels * COLOUR_BYTES;
        // Hits and rays of the pass, beside the sum of all.
        let pass = if samples > 1 { rays.bytes() + colours } else { 0 };
        tally.keep(pass);
        let [receivers, ordered] = self.shares.receivers(rays.rays);
        let lights = self.shares.lit.len() as u64;
        tally.pass(receivers + ordered + lights * rays.rays);
        // What one pass gives back of them is too scattered for the pictures of the next.
        let scattered = if samples > 1 { receivers } else { 0 };
        tally.keep(scattered);
        tally.keep(rays.rays * COLOUR_BYTES);
        let followed = self.shares.followed.iter().map(|share| (share * rays.rays as f64) as u64);
        let followed: Vec<u64> = followed.collect();
        tally.pass(lights * rays.rays + self.bounces.forecast(&followed, lights) + self.bundles(&followed));
        tally.pass(self.scattered(colours));
        tally.free(rays.rays * COLOUR_BYTES + pass + scattered);
        tally.keep(colours);
    }

    /// What the engine takes for bounces.
    fn bundles(&self, followed: &[u64]) -> u64 {
        let most = followed.iter().copied().max().unwrap_or(0);
        // One bounce leaves its tree in the lists of free memory, where the next one makes another.
        if most > 0 { bundles(self.triangles, most) + self.triangles * BUNDLE_BYTES[0] } else { 0 }
    }

    /// Values of rays are copied to their pixels, where these are not the same.
    fn scattered(&self, bytes: u64) -> u64 {
        if self.rays.ray_bytes > 0 { bytes } else { 0 }
    }

    /// The points of a cloud.
    fn points(&self) -> u64 {
        let pixels = self.rays.pixels;
        let derived = pixels * 2 * COLOUR_BYTES;
        let points = (self.shares.hit * (pixels * POINT_BYTES) as f64) as u64;
        derived + (pixels * 4 + points).max(self.scattered(pixels * COLOUR_BYTES))
    }
}

/// Numbers of a quantity.
fn numbers_of(aov: Aov) -> u64 {
    match aov {
        Aov::Normal | Aov::Position => 3,
        Aov::Bary | Aov::Uv => 2,
        Aov::Id | Aov::Depth | Aov::Distance | Aov::Object | Aov::Work | Aov::Doubts => 1,
    }
}
