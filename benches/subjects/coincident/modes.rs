//! The verbs of the command, as the library has them: pictures, masks, maps, bakes.

use umbel::bake::{Atlas, AtlasOptions, Bake, BakeOptions, BakeReceivers, SampleSet};
use umbel::engine::{Above, Hemisphere, Receiver};
use umbel::glam::DVec3;
use umbel::render::{Bounces, Look, preview_with, visibility, visible};
use umbel::scene::{Material, Object, Optics};
use umbel::shadow::{cube_map, point_light, shadow_masks, sun_light};
use umbel::{Camera, Frame, Lens, NO_TRIANGLE, Options, Origin, Scene, Stats, TriangleId};

use crate::Result;
use crate::subjects::coincident::{Coincidence, Place, Query, scenes};
use crate::subjects::mesh::{Mesh, rounded};

/// An eye in the middle of a lattice, above the blocks.
const ABOVE: DVec3 = DVec3::new(8.0, 8.0, 14.0);

pub(crate) const COINCIDENCES: [Coincidence; 24] = [
    Coincidence {
        name: "render pinhole-blocks",
        query: |p| see(city(p), p, (ABOVE, Lens::Pinhole { fov: 90.0 }, [320, 240])),
    },
    Coincidence {
        name: "render ortho-blocks",
        query: |p| see(city(p), p, (ABOVE, Lens::Ortho { height: 16.0 }, [256; 2])),
    },
    Coincidence {
        name: "render equirect-blocks",
        query: |p| see(city(p), p, (ABOVE, Lens::Equirect, [256, 128])),
    },
    Coincidence {
        name: "render equirect-room",
        query: |p| see(room(p), p, (DVec3::new(0.0, 2.0, 0.0), Lens::Equirect, [256, 128])),
    },
    Coincidence {
        name: "render fisheye-blocks",
        query: |p| see(city(p), p, (ABOVE, Lens::Fisheye { fov: 180.0 }, [192; 2])),
    },
    Coincidence {
        name: "render spinning-room",
        query: |p| {
            see(
                room(p),
                p,
                (DVec3::new(0.0, 2.0, 0.0), Lens::Spinning { elevations: [-45.0, 45.0] }, [256, 64]),
            )
        },
    },
    Coincidence {
        name: "render fisheye-two-sided",
        query: |p| {
            see(
                scenes::two_sided(40, p).scene(),
                p,
                (DVec3::new(0.1, 0.2, 0.7), Lens::Fisheye { fov: 180.0 }, [192; 2]),
            )
        },
    },
    Coincidence {
        name: "render equirect-same-quad-4",
        query: |p| {
            see(
                scenes::same_quads(4, p).scene(),
                p,
                (DVec3::new(0.123, 0.0456, 0.789), Lens::Equirect, [256, 128]),
            )
        },
    },
    Coincidence { name: "render mirrors", query: mirrors },
    Coincidence {
        name: "probe room",
        query: |p| see(room(p), p, (DVec3::new(0.0, 2.0, 0.0), Lens::Cube, [128; 2])),
    },
    Coincidence { name: "visible blocks", query: visible_triangles },
    Coincidence {
        name: "shadow mask-of-light-blocks",
        query: |p| mask(city(p), p, (ABOVE, point_light(DVec3::new(8.0, 8.0, 6.0)))),
    },
    Coincidence {
        name: "shadow mask-of-light-room",
        query: |p| mask(room(p), p, (DVec3::new(0.0, 1.6, 3.0), point_light(DVec3::new(0.0, 3.0, 0.0)))),
    },
    Coincidence {
        name: "shadow mask-of-sun-blocks",
        query: |p| mask(city(p), p, (ABOVE, sun_light(DVec3::Z))),
    },
    Coincidence {
        name: "shadow mask-of-light-two-sided",
        query: |p| {
            mask(
                scenes::two_sided(40, p).scene(),
                p,
                (DVec3::new(0.1, 0.2, 2.0), point_light(DVec3::new(0.4, 0.7, 1.5))),
            )
        },
    },
    Coincidence {
        name: "shadow mask-of-sun-overlay",
        query: |p| {
            mask(
                scenes::overlay(0.25, [16, 8], p).scene(),
                p,
                (DVec3::new(0.1, 0.2, 7.0), sun_light(DVec3::new(0.3, 0.2, 1.0))),
            )
        },
    },
    Coincidence { name: "shadow cube-blocks", query: |p| cube(city(p), p, DVec3::new(8.0, 8.0, 6.0)) },
    Coincidence { name: "shadow cube-room", query: |p| cube(room(p), p, DVec3::new(0.0, 2.0, 0.0)) },
    Coincidence {
        name: "bake vertices-blocks",
        query: |p| bake_vertices(scenes::blocks(8).turned(p.of_mesh()).scene(), SampleSet::Shared),
    },
    Coincidence {
        name: "bake vertices-blocks-independent",
        query: |p| bake_vertices(scenes::blocks(8).turned(p.of_mesh()).scene(), SampleSet::Independent),
    },
    Coincidence {
        name: "bake vertices-two-sided",
        query: |p| bake_vertices(scenes::two_sided(30, p).scene(), SampleSet::Shared),
    },
    Coincidence { name: "bake texels-room", query: texels },
    Coincidence { name: "bake points-at-vertices", query: |p| bake_points(p, SampleSet::Shared) },
    Coincidence {
        name: "bake points-at-vertices-independent",
        query: |p| bake_points(p, SampleSet::Independent),
    },
];

fn city(place: Place) -> Scene {
    scenes::blocks(16).turned(place.of_mesh()).scene()
}

fn room(place: Place) -> Scene {
    scenes::room().turned(place.of_mesh()).scene()
}

/// A camera that looks along −z, turned as rays are.
fn camera(place: Place, (eye, lens, [width, height]): (DVec3, Lens, [u32; 2])) -> Camera {
    let turn = place.of_rays();
    let (eye, up) = (turn * eye, turn * DVec3::Y);
    Camera { eye, target: eye + turn * DVec3::NEG_Z, up, lens, width, height }
}

/// What a camera sees.
fn see(scene: Scene, place: Place, view: (DVec3, Lens, [u32; 2])) -> Result<Query> {
    let camera = camera(place, view);
    Ok(Box::new(move || Ok(visibility(&scene, &camera, &Options::default())?.1)))
}

/// The room, all of mirrors.
fn mirrors(place: Place) -> Result<Query> {
    let mut scene = room(place);
    let material = |optics| Material { name: "mirror".into(), diffuse: [0.5; 3], optics };
    scene.materials = vec![material(Optics::MIRROR)];
    // In range: a few triangles.
    let triangles = 0..scene.triangles.len() as u32;
    scene.objects = vec![Object { name: String::new(), triangles, material: Some(0) }];
    let camera = camera(place, (DVec3::new(0.0, 1.6, 3.0), Lens::Pinhole { fov: 60.0 }, [160, 120]));
    let bounces = Bounces { reflect: true, most: 3, ..Bounces::default() };
    let look = Look { samples: 1, bounces, ..Look::default() };
    Ok(Box::new(move || {
        let options = Options::default();
        let (buffer, stats) = visibility(&scene, &camera, &options)?;
        let preview = preview_with(&scene, &camera, &buffer, &look, &options, |_| ())?;
        Ok(stats.then(preview.followed.stats))
    }))
}

/// The triangles that cameras at lattice points see.
fn visible_triangles(place: Place) -> Result<Query> {
    let scene = city(place);
    let of = |k: u32| {
        let eye = DVec3::new(4.0 * f64::from(k), 8.0, 8.0);
        camera(place, (eye, Lens::Pinhole { fov: 90.0 }, [128; 2]))
    };
    let cameras: Vec<Camera> = (0..4).map(of).collect();
    Ok(Box::new(move || Ok(visible(&scene, &cameras, &Options::default(), |_| ())?.1)))
}

/// Which pixels a light reaches.
fn mask(scene: Scene, place: Place, (eye, light): (DVec3, Origin)) -> Result<Query> {
    let camera = camera(place, (eye, Lens::Pinhole { fov: 90.0 }, [256; 2]));
    let light = match light {
        Origin::Point(p) => Origin::Point(place.of_rays() * p),
        Origin::Infinity(d) => Origin::Infinity(place.of_rays() * d),
    };
    Ok(Box::new(move || {
        shadow_masks(&scene, &camera, &[light], 1, &Options::default())?;
        Ok(Stats::default())
    }))
}

/// The distances around a light. The faces stand across the world's axes: only the mesh is turned.
fn cube(scene: Scene, place: Place, light: DVec3) -> Result<Query> {
    let (mut frame, light) = (Frame::new(), place.of_rays() * light);
    Ok(Box::new(move || Ok(cube_map(&scene.geometry()?, light, 128, &mut frame, &Options::default())?.1)))
}

fn options(set: SampleSet) -> BakeOptions {
    BakeOptions { rays: 32, set, ..BakeOptions::default() }
}

fn bake_vertices(scene: Scene, set: SampleSet) -> Result<Query> {
    let receivers = scene.vertex_receivers()?.range(0..scene.positions.len());
    bake(scene, receivers, options(set))
}

fn bake(scene: Scene, receivers: BakeReceivers, options: BakeOptions) -> Result<Query> {
    let (bake, mut frame) = (Bake::new(options)?, Frame::new());
    Ok(Box::new(move || {
        let triangles = scene.geometry()?;
        Ok(bake.run(&triangles, &receivers, &mut frame, &Options::default())?.stats)
    }))
}

/// The texels of the room, whose triangles lie side by side in a texture.
fn texels(place: Place) -> Result<Query> {
    let mut scene = room(place);
    // In range: 36 triangles.
    let count = scene.triangles.len() as u32;
    let corner = |k: u32| {
        let [x, y] = [k / 3 % 6, k / 18].map(|cell| cell as f32 / 6.0);
        [x + if k % 3 == 1 { 0.15 } else { 0.01 }, y + if k % 3 == 2 { 0.15 } else { 0.01 }]
    };
    scene.uvs = (0..3 * count).map(corner).collect();
    scene.uv_indices = (0..count).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let receivers = {
        let atlas = Atlas::new(&scene, &AtlasOptions { size: 128, samples: 1 })?;
        let texels = atlas.band(0..128);
        atlas.bake_receivers(&scene.geometry()?, &texels)
    };
    bake(scene, receivers, BakeOptions { columns: Some(128), ..options(SampleSet::Shared) })
}

/// Points at a mesh's own vertices, or a little above them.
fn bake_points(place: Place, set: SampleSet) -> Result<Query> {
    let mesh: Mesh = scenes::waves(40).turned(place.of_both());
    let (up, gap) = (place.of_both() * DVec3::Z, place.gap(1e-3));
    let mut receivers = BakeReceivers::default();
    for (index, p) in (0..).zip(&mesh.positions) {
        let point = rounded(DVec3::from_array(p.map(f64::from)) + up * gap);
        let receiver = Receiver { point, triangle: TriangleId(NO_TRIANGLE) };
        receivers.push(Hemisphere { receiver, above: Above::Normal(rounded(up)) }, rounded(up), index);
    }
    bake(mesh.scene(), receivers, options(set))
}
