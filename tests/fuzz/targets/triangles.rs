//! Any numbers at the door: positions, indices, films, rays, segments, cameras. The engine answers or refuses; it never panics.
//!
//! What is answered is well-formed, and the same by pencils, by the general path and for any hit.

#![no_main]

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;
use umbel::glam::DVec3;
use umbel::{Aov, Camera, Lens, NO_TRIANGLE, Options, Origin, Path, Pencil, Ray, Scene, TriangleId, Triangles, any_hit, closest_hit, visibility};
use umbel::engine::{Accuracy, Film, GridFilm, Isa, Rays, Segment, Side, blocked};

/// More rays than this only cost time.
const MOST_RAYS: usize = 2048;

type Vector = [f64; 3];

#[derive(Debug, Arbitrary)]
struct Input {
    positions: Vec<[f32; 3]>,
    indices: Vec<[u8; 3]>,
    /// An index far out of range.
    wild: Option<[u32; 3]>,
    at_infinity: bool,
    origin: Vector,
    films: Vec<AnyFilm>,
    rays: Vec<(Vector, Vector, f64, f64)>,
    segments: Vec<(Vector, Vector, Option<u32>)>,
    leave: (u8, [u8; 3], bool),
    camera: Option<(Vector, Vector, Vector, u8, f64, [u32; 2])>,
    isa: u8,
    fast: bool,
}

#[derive(Debug, Arbitrary)]
enum AnyFilm {
    Grid {
        size: [u8; 2],
        span: [Vector; 3],
        subpixels: u32,
        offset: [i32; 2],
    },
    Plain {
        size: [u8; 2],
        span: [Vector; 3],
    },
    Huge {
        size: [u32; 2],
        span: [Vector; 3],
    },
    Scattered(Vec<Vector>),
    /// f32 numbers are in range far more often.
    ScatteredF32(Vec<[f32; 3]>),
}

impl AnyFilm {
    fn film(&self) -> Option<Film> {
        let vectors = |span: [Vector; 3]| span.map(DVec3::from_array);
        let grid = |[w, h]: [u32; 2], span| {
            let [f, r, u] = vectors(span);
            GridFilm::new(w, h, f, r, u)
        };
        let grid = match *self {
            Self::Scattered(ref samples) => {
                return Some(Film::Scattered(samples.iter().copied().map(DVec3::from_array).collect()));
            }
            Self::ScatteredF32(ref samples) => {
                return Some(Film::Scattered(
                    samples.iter().map(|s| DVec3::from_array(s.map(f64::from))).collect(),
                ));
            }
            Self::Grid { size: [w, h], span, subpixels, offset } => {
                GridFilm::with_subpixel(w.into(), h.into(), vectors(span), subpixels, offset)
            }
            Self::Plain { size, span } => grid(size.map(u32::from), span),
            Self::Huge { size, span } => grid(size, span),
        };
        grid.ok().map(Film::Grid)
    }
}

fuzz_target!(|input: Input| {
    let mut indices: Vec<_> = input.indices.iter().map(|t| t.map(u32::from)).collect();
    indices.extend(input.wild);
    let vertices = input.positions.len();
    let valid = input.positions.iter().flatten().all(|x| x.is_finite())
        && indices.iter().flatten().all(|&i| (i as usize) < vertices);
    let triangles = Triangles::new(&input.positions, &indices);
    assert_eq!(triangles.is_ok(), valid);
    let isas = [Isa::Auto, Isa::Sse2, Isa::Sse42, Isa::Avx2, Isa::Avx512, Isa::Neon];
    let accuracy = if input.fast { Accuracy::Fast } else { Accuracy::Exact };
    let isa = isas[usize::from(input.isa) % isas.len()];
    let options = Options { isa, accuracy, ..Options::default() };
    if let Some((eye, target, up, lens, number, size)) = input.camera {
        let lens = match lens % 5 {
            0 => Lens::Pinhole { fov: number },
            1 => Lens::Ortho { height: number },
            2 => Lens::Equirect,
            3 => Lens::Fisheye { fov: number },
            _ => Lens::Cube,
        };
        // Huge pictures only cost memory.
        let [width, height] = size.map(|n| if n % 8 == 0 { n % 3 } else { n % 24 });
        let [eye, target, up] = [eye, target, up].map(DVec3::from_array);
        let camera = Camera { eye, target, up, lens, width, height };
        see(&input, &indices, &camera, &options);
    }
    let Ok(triangles) = triangles else {
        return;
    };
    leave(&triangles, input.leave);
    let vector = DVec3::from_array;
    let origin = vector(input.origin);
    let origin = if input.at_infinity { Origin::Infinity(origin) } else { Origin::Point(origin) };
    let films = input.films.iter().filter_map(AnyFilm::film).collect();
    if let Ok(pencil) = Pencil::new(origin, films)
        && pencil.len() <= MOST_RAYS
    {
        ask(&triangles, Rays::Pencil(&pencil), options);
    }
    let rays = input.rays.iter().map(|&(o, d, t_min, t_max)| Ray {
        origin: vector(o),
        direction: vector(d),
        t_min,
        t_max,
    });
    ask(&triangles, Rays::General(&rays.collect::<Vec<_>>()), options);
    let segments = input.segments.iter().map(|&(from, to, receiver)| Segment {
        from: vector(from),
        to: vector(to),
        receiver: receiver.map(TriangleId),
    });
    let _ = blocked(&triangles, &segments.collect::<Vec<_>>(), &options);
});

/// Asks on both paths.
fn ask(triangles: &Triangles<'_>, rays: Rays<'_>, options: Options) {
    let Ok((hits, _)) = closest_hit(triangles, rays, &options) else {
        return;
    };
    for ray in 0..hits.len() {
        let (id, t) = (hits.ids()[ray], hits.ts()[ray]);
        if id == NO_TRIANGLE {
            assert_eq!(t, f32::INFINITY);
        } else {
            assert!((id as usize) < triangles.len() && t > 0.0 && t.is_finite(), "{id} {t}");
        }
    }
    if options.accuracy == Accuracy::Exact {
        let general = Options { path: Path::General, ..options };
        let (other, _) = closest_hit(triangles, rays, &general).expect("the same rays");
        assert_eq!(hits, other);
        let (any, _) = any_hit(triangles, rays, &options).expect("the same rays");
        assert!(any.iter().enumerate().all(|(ray, &any)| any == hits.get(ray).is_some()));
    } else {
        let _ = any_hit(triangles, rays, &options);
    }
}

/// Leaves a triangle: to a finite point, on its plane or on the right side of it, so that it is not hit.
fn leave(triangles: &Triangles<'_>, (id, weights, front): (u8, [u8; 3], bool)) {
    let sum: f64 = weights.map(f64::from).iter().sum();
    if triangles.is_empty() || sum == 0.0 {
        return;
    }
    let id = TriangleId(u32::from(id) % triangles.len() as u32);
    let side = if front { Side::Front } else { Side::Back };
    let weights = weights.map(|w| f64::from(w) / sum);
    let point = triangles.leave(id, weights, side);
    assert!(point.iter().all(|x| x.is_finite()), "{point:?}");
    let origin = DVec3::from_array(point.map(f64::from));
    for direction in DVec3::AXES.into_iter().flat_map(|d| [d, -d]) {
        if triangles.side_toward(id, direction) == Some(side) {
            let (hits, _) = closest_hit(triangles, &[Ray::new(origin, direction)][..], &Options::default())
                .expect("an f32 origin");
            assert_ne!(hits.ids()[0], id.0, "from {point:?} to {direction}");
        }
    }
}

/// Renders, and derives everything.
fn see(input: &Input, indices: &[[u32; 3]], camera: &Camera, options: &Options) {
    let scene = Scene { positions: input.positions.clone(), triangles: indices.to_vec(), ..Scene::default() };
    if let Ok((buffer, _)) = visibility(&scene, camera, options) {
        for aov in [Aov::Id, Aov::Depth, Aov::Distance, Aov::Normal, Aov::Position, Aov::Bary, Aov::Object] {
            buffer.derive(aov, &scene).expect("the same scene");
        }
    }
}
