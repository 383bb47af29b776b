//! Cameras and derived quantities against their formulas, which are written out here once more.
//!
//! f = normalize(target − eye), r = normalize(f × up), u = r × f. Directions may differ from the formula by the rounding
//! of a film, 2⁻⁵² of its largest component, and by the last bits of sin and cos.

mod coverage;

use std::f64::consts::PI;

use common::random::Random;
use coverage::wall;
use umbel::glam::DVec3;
use umbel::render::preview;
use umbel::scene::CUBE_FACES;
use umbel::{
    Aov, AovData, Camera, Lens, NO_TRIANGLE, Options, Origin, Scene, VisibilityBuffer, builtin, visibility,
};

/// The allowed error of a unit-sized direction.
const DIRECTION_ERROR: f64 = 32.0 * f64::EPSILON;
/// Half an ulp of an f32 near 1.
const U: f64 = f32::EPSILON as f64 / 2.0;

/// The lenses with their formulas: the start and the direction of pixel (i, j).
const LENSES: [Lens; 8] = [
    Lens::Pinhole { fov: 50.0 },
    Lens::Pinhole { fov: 170.0 },
    Lens::Ortho { height: 3.0 },
    Lens::Equirect,
    Lens::Fisheye { fov: 200.0 },
    Lens::Spinning { elevations: [-24.9, 2.0] },
    Lens::Spinning { elevations: [-90.0, 90.0] },
    Lens::Cube,
];

fn camera(lens: Lens) -> Camera {
    let (width, height) = if lens == Lens::Cube { (14, 14) } else { (22, 15) };
    Camera {
        eye: DVec3::new(2.0, 3.0, 4.5),
        target: DVec3::new(-0.5, 1.0, 0.25),
        up: DVec3::new(0.2, 3.0, -0.4),
        lens,
        width,
        height,
    }
}

/// f, r and u.
fn frame(camera: &Camera) -> [DVec3; 3] {
    let f = (camera.target - camera.eye).normalize();
    let r = f.cross(camera.up).normalize();
    [f, r, r.cross(f)]
}

/// The formula of design section 6: start and direction, or `None` outside a fisheye's circle.
fn formula(camera: &Camera, pixel: usize) -> Option<(DVec3, DVec3)> {
    let [f, r, u] = frame(camera);
    let (w, h) = (f64::from(camera.width), f64::from(camera.height));
    let (i, j) = ((pixel % camera.width as usize) as f64, (pixel / camera.width as usize) as f64);
    let (x, y) = (2.0 * (i + 0.5) / w - 1.0, 1.0 - 2.0 * (j + 0.5) / h);
    Some(match camera.lens {
        Lens::Pinhole { fov } => {
            let slope = (fov * PI / 360.0).tan();
            (camera.eye, f + x * slope * (w / h) * r + y * slope * u)
        }
        Lens::Ortho { height } => {
            let half = height / 2.0;
            (camera.eye + x * half * (w / h) * r + y * half * u, f)
        }
        Lens::Equirect => {
            let (lambda, phi) = (x * PI, y * PI / 2.0);
            let around = lambda.cos() * f + lambda.sin() * r;
            (camera.eye, phi.cos() * around + phi.sin() * u)
        }
        Lens::Fisheye { fov } => {
            let radius = w.min(h) / 2.0;
            let (x, y) = ((i + 0.5 - w / 2.0) / radius, (h / 2.0 - j - 0.5) / radius);
            let distance = x.hypot(y);
            if distance > 1.0 {
                return None;
            }
            let (angle, around) = (distance * fov * PI / 360.0, y.atan2(x));
            let across = around.cos() * r + around.sin() * u;
            (camera.eye, angle.cos() * f + angle.sin() * across)
        }
        Lens::Spinning { elevations: [lower, upper] } => {
            let (lambda, phi) = (x * PI, (upper - (upper - lower) * j / (h - 1.0)).to_radians());
            let around = lambda.cos() * f + lambda.sin() * r;
            (camera.eye, phi.cos() * around + phi.sin() * u)
        }
        Lens::Cube => (camera.eye, common::scenes::cube_direction(camera.width as usize, pixel)),
    })
}

#[test]
fn rays_follow_the_formulas() {
    for lens in LENSES {
        let camera = camera(lens);
        let shot = camera.shot().expect("a camera");
        let pixels = camera.width as usize * camera.rows() as usize;
        let expected: Vec<usize> = (0..pixels).filter(|&p| formula(&camera, p).is_some()).collect();
        let seen: Vec<usize> = shot.pixels.as_ref().map_or_else(
            || (0..pixels).collect(),
            |pixels| pixels.iter().map(|&pixel| pixel as usize).collect(),
        );
        assert_eq!(seen, expected, "{lens:?}: the pixels that have a ray");
        assert_eq!(shot.pencil.len(), seen.len());
        for (k, &pixel) in seen.iter().enumerate() {
            let (start, direction) = formula(&camera, pixel).expect("a ray");
            let ray = shot.pencil.ray(k);
            let size = direction.length().max(1.0);
            let error = (ray.direction - direction).abs().max_element();
            // The slope of 170 degrees makes the film's spacing larger than that of this ray.
            assert!(error <= 16.0 * DIRECTION_ERROR * size, "{lens:?} {pixel}: {error:e}");
            let error = (ray.origin - start).abs().max_element();
            assert!(error <= DIRECTION_ERROR * 5.0, "{lens:?} {pixel}: {error:e}");
        }
    }
}

#[test]
fn origins_are_points_and_directions() {
    for lens in LENSES {
        let camera = camera(lens);
        match camera.shot().expect("a camera").pencil.origin() {
            Origin::Point(point) => assert_eq!(point, camera.eye),
            Origin::Infinity(direction) => {
                assert!(matches!(lens, Lens::Ortho { .. }));
                assert!(direction.distance(frame(&camera)[0]) < DIRECTION_ERROR);
            }
        }
    }
}

/// Corner pixels by hand: what is left is left, what is up is up.
#[test]
fn nothing_is_mirrored() {
    for lens in [Lens::Pinhole { fov: 90.0 }, Lens::Ortho { height: 2.0 }, Lens::Equirect] {
        let camera =
            Camera { eye: DVec3::ZERO, target: DVec3::NEG_Z, up: DVec3::Y, lens, width: 4, height: 4 };
        let shot = camera.shot().expect("a camera");
        let place = |pixel: usize| {
            let ray = shot.pencil.ray(pixel);
            ray.origin + ray.direction
        };
        assert!(place(5).x < 0.0 && place(6).x > 0.0, "{lens:?}: +x is right");
        assert!(place(5).y > 0.0 && place(9).y < 0.0, "{lens:?}: +y is up");
    }
}

#[test]
fn faces_of_a_cube() {
    for (face, [m, s, t]) in CUBE_FACES.into_iter().enumerate() {
        assert_eq!(s.cross(t), -m, "face {face}: texels as seen from inside are not mirrored");
        // One texel per face looks along its axis.
        assert_eq!(common::scenes::cube_direction(1, face), m);
        assert_eq!(common::scenes::cube_direction(2, 4 * face + 1) - m, 0.5 * (s - t));
    }
}

#[test]
fn a_framed_box_fits() {
    let mut random = Random(5);
    for _ in 0..200 {
        let mut point = || DVec3::new(random.unit(), random.unit(), random.unit()) * 8.0 - 4.0;
        let (a, b, direction) = (point(), point(), point());
        let narrow = |v: DVec3| v.to_array().map(|x| x as f32);
        let bounds = umbel::engine::Aabb { lo: narrow(a.min(b)), hi: narrow(a.max(b)) };
        for lens in [Lens::Pinhole { fov: 45.0 }, Lens::Pinhole { fov: 100.0 }, Lens::Ortho { height: 1.0 }] {
            let camera = Camera::framing(&bounds, direction, lens, 160, 90);
            let [f, r, u] = frame(&camera);
            for corner in 0..8 {
                let pick = |k: usize| {
                    if corner >> k & 1 == 0 { bounds.lo[k] } else { bounds.hi[k] }
                };
                let p = DVec3::from_array([0, 1, 2].map(|k| f64::from(pick(k)))) - camera.eye;
                let half = match camera.lens {
                    Lens::Ortho { height } => height / 2.0,
                    Lens::Pinhole { fov } => p.dot(f) * (fov * PI / 360.0).tan(),
                    _ => unreachable!("only these"),
                };
                assert!(p.dot(f) > 0.0, "{camera:?}: before the eye");
                assert!(p.dot(u).abs() <= half && p.dot(r).abs() <= half * 16.0 / 9.0, "{camera:?}");
            }
        }
    }
}

/// The numbers of a floating-point quantity.
fn numbers(buffer: &VisibilityBuffer, aov: Aov, scene: &Scene) -> Vec<f32> {
    match buffer.derive(aov, scene).expect("derived") {
        AovData::F32(_, values) => values,
        AovData::U32(_) => panic!("{aov:?} is floating point"),
    }
}

/// Everything that is derived, pixel by pixel.
fn check_aovs(scene: &Scene, camera: &Camera) {
    let (buffer, _) = visibility(scene, camera, &Options::default()).expect("seen");
    let triangles = scene.geometry().expect("finite");
    let ids = buffer.ids();
    let [depth, distance, normal, position, bary] =
        [Aov::Depth, Aov::Distance, Aov::Normal, Aov::Position, Aov::Bary]
            .map(|aov| numbers(&buffer, aov, scene));
    let AovData::U32(objects) = buffer.derive(Aov::Object, scene).expect("derived") else {
        panic!("objects are whole numbers")
    };
    assert_eq!(buffer.derive(Aov::Id, scene).expect("derived"), AovData::U32(ids.clone()));
    let widen = |values: &[f32]| DVec3::new(values[0].into(), values[1].into(), values[2].into());
    let mut hits = 0;
    for ray in 0..buffer.hits.len() {
        let pixel = buffer.shot.pixels.as_ref().map_or(ray, |pixels| pixels[ray] as usize);
        let Some(hit) = buffer.hits.get(ray) else {
            assert_eq!((ids[pixel], objects[pixel]), (NO_TRIANGLE, NO_TRIANGLE));
            continue;
        };
        hits += 1;
        let ray = buffer.shot.pencil.ray(ray);
        assert_eq!((ids[pixel], depth[pixel]), (hit.id.0, hit.t));
        let reach = f64::from(hit.t) * ray.direction.length();
        let error = (f64::from(distance[pixel]) - reach).abs();
        assert!(error <= 1.01 * U * reach.abs(), "distance {} for {reach}", distance[pixel]);

        let p = widen(&position[3 * pixel..]);
        let along = ray.origin + ray.direction * f64::from(hit.t);
        let size = ray.origin.abs().max_element() + reach;
        assert!(p.distance(along) <= 4.0 * U * size, "{:?}: {p} for {along}", camera.lens);

        let corners = triangles.corners(hit.id).map(|c| widen(&c));
        let [v, w] = [bary[2 * pixel], bary[2 * pixel + 1]].map(f64::from);
        assert!(v >= 0.0 && w >= 0.0 && v + w <= 1.0 + 2.0 * U, "{v} {w}");
        let weighted = corners[0] * (1.0 - v - w) + corners[1] * v + corners[2] * w;
        let extent = corners.map(|c| c.abs().max_element()).into_iter().fold(0.0, f64::max);
        assert!(weighted.distance(p) <= 16.0 * U * extent);

        let n = widen(&normal[3 * pixel..]);
        assert!((n.length() - 1.0).abs() <= 4.0 * U, "|n| = {}", n.length());
        let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        assert!(n.dot(cross) > 0.999 * cross.length(), "(b − a)×(c − a), not flipped");
        let object = &scene.objects[objects[pixel] as usize];
        assert!(object.triangles.contains(&hit.id.0));
    }
    assert!(hits * 20 > ids.len(), "{:?}: only {hits} hits", camera.lens);
}

#[test]
fn derived_quantities_agree_with_their_rays() {
    let cornell = builtin("cornell").expect("it exists");
    let flower = builtin("umbel:5000").expect("it exists");
    for lens in LENSES {
        let inside = Camera {
            eye: DVec3::new(278.0, 300.0, 150.0),
            target: DVec3::new(250.0, 200.0, 500.0),
            lens: if let Lens::Ortho { .. } = lens { Lens::Ortho { height: 400.0 } } else { lens },
            width: 61,
            height: 47,
            ..camera(lens)
        };
        check_aovs(&cornell, &inside);
        let under = Camera { eye: DVec3::new(0.6, 1.0, 0.7), target: DVec3::new(0.0, 1.6, 0.0), ..inside };
        check_aovs(&flower, &Camera { lens, ..under });
    }
}

/// The z depth of a pinhole camera is t, so it is constant over a wall that faces it.
#[test]
fn depth_is_z_and_distance_is_not() {
    let scene = wall(-50.0, 50.0);
    let camera = Camera {
        eye: DVec3::new(0.0, 0.0, 4.0),
        target: DVec3::ZERO,
        up: DVec3::Y,
        lens: Lens::Pinhole { fov: 60.0 },
        width: 9,
        height: 9,
    };
    let (buffer, _) = visibility(&scene, &camera, &Options::default()).expect("seen");
    assert_eq!(numbers(&buffer, Aov::Depth, &scene), [4.0; 81]);
    let distance = numbers(&buffer, Aov::Distance, &scene);
    assert!(distance[0] > 4.9 && distance[40] == 4.0);
}

/// Outside its circle a fisheye has no rays: the picture is black there, and a miss in every quantity.
#[test]
fn a_fisheye_is_round() {
    let scene = builtin("cornell").expect("it exists");
    let camera = camera(Lens::Fisheye { fov: 360.0 });
    let options = Options::default();
    let (buffer, _) = visibility(&scene, &camera, &options).expect("seen");
    let picture = preview(&scene, &camera, &buffer, 1, &options, |_| ()).expect("shaded");
    let depth = numbers(&buffer, Aov::Depth, &scene);
    let outside: Vec<usize> = (0..buffer.pixels).filter(|&p| formula(&camera, p).is_none()).collect();
    let area = 1.0 - outside.len() as f64 / buffer.pixels as f64;
    assert!((area - PI * 7.5 * 7.5 / (22.0 * 15.0)).abs() < 0.03, "{area}");
    for pixel in outside {
        assert_eq!(picture[3 * pixel..][..3], [0.0; 3]);
        assert_eq!((buffer.ids()[pixel], depth[pixel]), (NO_TRIANGLE, f32::INFINITY));
    }
}
