//! What `umbel bake` bakes, in units that can be cut into pieces: vertices, points, or rows of texels.

use umbel::bake::{
    Atlas, AtlasOptions, Bake, BakeReceivers, Baked, Fans, TexelImage, TexelReceiver, TracedRay,
    VertexReceivers, read_points,
};
use umbel::engine::Aabb;
use umbel::glam::DVec3;
use umbel::{Camera, Error, Lens, NO_TRIANGLE, Options, Scene, Stats, Triangles, closest_hit};

use crate::bake::args::{BakeArgs, Target};

/// Bytes of a vertex: its six or so corners of triangles and their end, and on the way its faces, owner and normal.
const VERTEX_BYTES: u64 = 72;
/// Bytes of a point: its row in f64, its id, and the receiver.
const POINT_BYTES: u64 = 48 + 8 + 48;
/// Bytes of the smallest point in a file: six `f4`.
const ROW_BYTES: u64 = 24;
/// Bytes of a value, and of whether it is covered.
const VALUE_BYTES: u64 = 4 + 1;
/// Rows that an atlas makes together.
const BLOCK_ROWS: u64 = 16;
/// Bytes of a triangle in an atlas, with what is there on the way.
const ATLAS_BYTES: u64 = 88;
/// Bytes of a bent normal, and of whether it is covered.
const BENT_BYTES: u64 = 12 + 1;
/// Bytes of a texel's receiver in its band.
const TEXEL_BYTES: u64 = size_of::<TexelReceiver>() as u64;
/// Bands of rows of a texture.
const BANDS: u32 = 256;

/// The receivers.
pub(crate) enum Source<'a> {
    Vertices(VertexReceivers<'a>, usize),
    Points(BakeReceivers),
    Texels(Atlas<'a>, Triangles<'a>),
}

/// How much there is to bake, before anything of it has been made.
pub(crate) struct Extent {
    /// Values.
    pub(crate) values: u64,
    /// Units that are cut into pieces.
    pub(crate) units: u64,
    /// The most receivers of a unit.
    pub(crate) per_unit: u64,
    /// Bytes that the source and the values take.
    pub(crate) bytes: u64,
    /// Bytes of a receiver beside those of the bake.
    pub(crate) receiver: u64,
    /// The part of the receivers that there are, in equal bands of the units.
    bands: Vec<f64>,
}

impl Extent {
    pub(crate) fn new(args: &BakeArgs, scene: &Scene) -> Result<Self, Error> {
        let bent = if args.bent.is_some() { BENT_BYTES } else { 0 };
        let of = |values: u64, units: u64, per_unit: u64, source: u64| Self {
            values,
            units,
            per_unit,
            bytes: source + values * (VALUE_BYTES + bent),
            receiver: 0,
            bands: vec![1.0],
        };
        Ok(match args.target() {
            Target::Vertices => {
                let vertices = scene.positions.len() as u64;
                of(vertices, vertices, 1, vertices * VERTEX_BYTES + Fans::bytes(vertices))
            }
            // A file that cannot be looked at is refused when it is read.
            Target::Points(path) => {
                let rows = std::fs::metadata(path).map_or(0, |found| found.len()) / ROW_BYTES;
                of(rows, rows, 1, rows * POINT_BYTES)
            }
            Target::Texels(AtlasOptions { size, samples }) => {
                let size = u64::from(size);
                let receivers = size * u64::from(samples);
                let atlas = of(size * size, size, receivers, scene.triangles.len() as u64 * ATLAS_BYTES);
                Self { receiver: TEXEL_BYTES, bands: covered_bands(scene)?, ..atlas }
            }
        })
    }

    /// That of the vertices of a scene, without bent normals.
    pub(crate) fn of_vertices(scene: &Scene) -> Self {
        let vertices = scene.positions.len() as u64;
        Self {
            values: vertices,
            units: vertices,
            per_unit: 1,
            bytes: vertices * (VERTEX_BYTES + VALUE_BYTES) + Fans::bytes(vertices),
            receiver: 0,
            bands: vec![1.0],
        }
    }

    /// How many units to take at once, with so many bytes for them.
    pub(crate) fn piece(&self, bake: &Bake, bytes: u64) -> u64 {
        let units = bake.piece(bytes) as u64 / self.per_unit;
        let whole =
            if self.per_unit > 1 && units > BLOCK_ROWS { units / BLOCK_ROWS * BLOCK_ROWS } else { units };
        whole.min(self.units).max(1)
    }

    /// About how many receivers a piece of so many units has: that which has most.
    pub(crate) fn receivers(&self, units: u64) -> u64 {
        let all = self.bands.len() as f64;
        let bands = (units as f64 / self.units.max(1) as f64 * all).ceil().clamp(1.0, all) as usize;
        let sums = self.bands.chunks(bands).map(|bands| bands.iter().fold(0.0, |sum, part| sum + part));
        let part = sums.fold(0.0, f64::max) / bands as f64;
        (part * (units * self.per_unit) as f64) as u64
    }
}

/// The part of a texture that charts cover, in bands of rows from the top of the image: what parallel rays hit of the triangles in the
/// texture, which are laid out in a plane.
fn covered_bands(scene: &Scene) -> Result<Vec<f64>, Error> {
    let corners = |triangle: &[u32; 3]| triangle.iter().all(|&corner| (corner as usize) < scene.uvs.len());
    let triangles: Vec<[u32; 3]> = scene.uv_indices.iter().copied().filter(corners).collect();
    let flip = |v: f32| if scene.uv_v_down { -v } else { v };
    // What is not finite lies outside, as what is not a texture's.
    let place =
        |&[u, v]: &[f32; 2]| if u.is_finite() && v.is_finite() { [u, flip(v), 0.0] } else { [-1.0; 3] };
    let positions: Vec<[f32; 3]> = scene.uvs.iter().map(place).collect();
    let laid_out = Triangles::new(&positions, &triangles)?;
    let middle = DVec3::new(0.5, f64::from(flip(0.5)), 1.0);
    let camera = Camera {
        eye: middle,
        target: middle - DVec3::Z,
        up: DVec3::Y,
        lens: Lens::Ortho { height: 1.0 },
        width: BANDS,
        height: BANDS,
    };
    let (hits, _) = closest_hit(&laid_out, &camera.shot()?.pencil, &Options::default())?;
    let rows = hits.ids().chunks(BANDS as usize);
    Ok(rows
        .map(|row| row.iter().filter(|&&id| id != NO_TRIANGLE).count() as f64 / f64::from(BANDS))
        .collect())
}

impl<'a> Source<'a> {
    /// Reads or makes the receivers.
    pub(crate) fn new(args: &BakeArgs, scene: &'a Scene) -> Result<Self, Error> {
        Ok(match args.target() {
            Target::Vertices => Self::Vertices(scene.vertex_receivers()?, scene.positions.len()),
            Target::Points(path) => {
                let ids = args.receivers.point_ids.as_deref();
                Self::Points(read_points(path, ids, &scene.geometry()?, (args.receivers.bias, scene.offset))?)
            }
            Target::Texels(options) => Self::Texels(Atlas::new(scene, &options)?, scene.geometry()?),
        })
    }

    /// The box of points that may lie anywhere; empty for what lies on the scene.
    pub(crate) fn points_bounds(&self) -> Aabb {
        match self {
            Self::Points(points) => {
                Aabb::of_points(points.hemispheres.iter().map(|found| found.receiver.point))
            }
            _ => Aabb::EMPTY,
        }
    }

    /// What it is called.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Vertices(..) => "vertices",
            Self::Points(_) => "points",
            Self::Texels(..) => "texels",
        }
    }

    /// How many units there are.
    pub(crate) fn units(&self) -> usize {
        match self {
            Self::Vertices(_, vertices) => *vertices,
            Self::Points(points) => points.len(),
            Self::Texels(atlas, _) => atlas.size() as usize,
        }
    }

    /// The receivers among some units, and their texels where they have some.
    pub(crate) fn piece(&self, first: usize, end: usize) -> (BakeReceivers, Vec<TexelReceiver>) {
        match self {
            Self::Vertices(vertices, _) => (vertices.range(first..end), Vec::new()),
            Self::Points(points) => (points.slice(first..end), Vec::new()),
            Self::Texels(atlas, geometry) => {
                // Rows are u32: there are as many as the atlas has.
                let band = atlas.band(first as u32..end as u32);
                (atlas.bake_receivers(geometry, &band), band)
            }
        }
    }
}

/// The values, in their places; NaN where there is no receiver.
pub(crate) enum Values {
    /// One after the other, with bent normals or without.
    List(Vec<f32>, Vec<[f32; 3]>),
    /// As images.
    Image(TexelImage<1>, Option<TexelImage<3>>),
}

/// What has been found.
pub(crate) struct Results {
    pub(crate) values: Values,
    pub(crate) traced: Vec<TracedRay>,
    pub(crate) receivers: usize,
    /// How many of them lie nearer to another surface than rounding can tell, where that was looked for; about, of very many.
    pub(crate) near: u64,
    pub(crate) rays: u64,
    pub(crate) stats: Stats,
}

impl Results {
    /// Nothing yet.
    pub(crate) fn new(source: &Source<'_>, with_bent: bool) -> Self {
        let count = source.units();
        let values = match source {
            Source::Texels(atlas, _) => {
                let bent = with_bent.then(|| TexelImage::new(atlas.size()));
                Values::Image(TexelImage::new(atlas.size()), bent)
            }
            _ => Values::List(vec![f32::NAN; count], vec![[f32::NAN; 3]; if with_bent { count } else { 0 }]),
        };
        Self { values, traced: Vec::new(), receivers: 0, near: 0, rays: 0, stats: Stats::default() }
    }

    /// Puts the values of a piece in their places.
    pub(crate) fn take(&mut self, receivers: &BakeReceivers, texels: &[TexelReceiver], baked: Baked) {
        match &mut self.values {
            Values::List(values, bent) => {
                let places = || receivers.indices.iter().map(|&index| index as usize);
                places().zip(&baked.values).for_each(|(place, &value)| values[place] = value);
                places().zip(&baked.bent).for_each(|(place, &of_one)| bent[place] = of_one);
            }
            Values::Image(values, bent) => {
                values.cover(texels, baked.values.as_chunks().0);
                if let Some(bent) = bent {
                    bent.cover(texels, &baked.bent);
                }
            }
        }
        self.traced.extend(baked.traced);
        self.receivers += receivers.len();
        self.rays += baked.rays;
        self.stats = self.stats.then(baked.stats);
    }
}
