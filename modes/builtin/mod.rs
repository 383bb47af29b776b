//! The built-in scenes: `builtin:umbel`, `builtin:umbel:N` and `builtin:cornell`.
//!
//! All are made by rules, the same to the last bit on every machine. The flower is in `flower.rs`, what stands around it in
//! `foliage.rs`, its surfaces in `sweep.rs`, the box in `cornell.rs`; each says what it is based on.

pub(crate) mod cornell;
pub(crate) mod flower;
pub(crate) mod foliage;
pub(crate) mod sweep;

use crate::builtin::cornell::cornell;
use crate::builtin::flower::umbel;
use crate::error::Error;
use crate::scene::Scene;

/// The fewest and the most triangles of `builtin:umbel:N`.
const UMBEL_TRIANGLES: [u32; 2] = [100, 50_000_000];
/// How many triangles `builtin:umbel` has, about.
const UMBEL_DEFAULT: u32 = 100_000;

/// A camera and a light that suit a built-in scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BuiltinView {
    /// Where the camera is.
    pub eye: [f64; 3],
    /// The point in the middle of the picture.
    pub target: [f64; 3],
    /// The direction that is up in the picture.
    pub up: [f64; 3],
    /// The vertical field of view, in degrees.
    pub fov_degrees: f64,
    /// The position of a point light.
    pub light: [f64; 3],
}

/// What a name after `builtin:` stands for.
#[derive(Clone, Copy)]
enum Rule {
    Umbel(u32),
    Cornell,
}

/// The scene that a name after `builtin:` stands for: `umbel`, `umbel:N` for about N triangles, or `cornell`.
///
/// # Errors
/// [`Error::Usage`] for an unknown name and for an N that is not a number from 100 to 50,000,000.
pub fn builtin(name: &str) -> Result<Scene, Error> {
    let full_name = format!("builtin:{name}");
    Ok(match rule(name)? {
        Rule::Umbel(triangles) => umbel(full_name, triangles),
        Rule::Cornell => cornell(full_name),
    })
}

/// A curated view of the scene that [`builtin`] makes of the same name; `None` where it makes none.
#[must_use]
pub fn builtin_view(name: &str) -> Option<BuiltinView> {
    Some(match rule(name).ok()? {
        Rule::Umbel(_) => BuiltinView {
            eye: [3.75, 2.0, 4.05],
            target: [0.0, 1.04, -0.05],
            up: [0.0, 1.0, 0.0],
            fov_degrees: 36.0,
            light: [-1.5, 7.0, 3.5],
        },
        Rule::Cornell => BuiltinView {
            eye: [278.0, 273.0, -800.0],
            target: [278.0, 273.0, 0.0],
            up: [0.0, 1.0, 0.0],
            fov_degrees: 39.3,
            light: [278.0, 548.0, 279.5],
        },
    })
}

/// Reads a name.
fn rule(name: &str) -> Result<Rule, Error> {
    let (head, count) = name.split_once(':').map_or((name, None), |(a, b)| (a, Some(b)));
    match (head, count) {
        ("umbel", None) => Ok(Rule::Umbel(UMBEL_DEFAULT)),
        ("umbel", Some(count)) => {
            let [least, most] = UMBEL_TRIANGLES;
            let number = count.parse().ok().filter(|n| (least..=most).contains(n));
            number.map(Rule::Umbel).ok_or_else(|| {
                Error::Usage(format!(
                    "builtin:umbel:{count}: the number of triangles must be a whole number from {least} to {most}"
                ))
            })
        }
        ("cornell", None) => Ok(Rule::Cornell),
        _ => Err(Error::Usage(format!(
            "builtin:{name}: no such scene; there are builtin:umbel, builtin:umbel:N (about N triangles) and builtin:cornell, and for umbel reyes builtin:teapot, builtin:terrain and builtin:field"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    /// What every built-in scene promises.
    fn check(scene: &Scene) {
        assert!(scene.positions.iter().flatten().all(|x| x.is_finite()));
        let corners = scene.triangles.iter().flatten();
        assert!(corners.clone().all(|&index| (index as usize) < scene.positions.len()));
        for normal in &scene.normals {
            let length = normal.iter().map(|x| x * x).sum::<f32>();
            assert!((length - 1.0).abs() < 1e-5, "{normal:?}");
        }
        if scene.normals.is_empty() {
            assert!(scene.normal_indices.is_empty());
        } else {
            assert_eq!(scene.normal_indices.len(), scene.triangles.len());
        }
        let corners = scene.normal_indices.iter().flatten();
        assert!(corners.clone().all(|&index| (index as usize) < scene.normals.len()));
        let mut next = 0;
        for object in &scene.objects {
            assert_eq!(object.triangles.start, next);
            assert!(object.triangles.end > next && !object.name.is_empty());
            assert!((object.material.unwrap() as usize) < scene.materials.len());
            next = object.triangles.end;
        }
        assert_eq!(next as usize, scene.triangles.len());
    }

    /// Whether the triangles are a closed, consistently oriented surface: each directed edge once, its opposite once.
    fn is_closed(scene: &Scene, triangles: std::ops::Range<u32>) -> bool {
        let mut edges = HashMap::new();
        for [a, b, c] in &scene.triangles[triangles.start as usize..triangles.end as usize] {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((from, to)).or_insert(0) += 1;
            }
        }
        edges.iter().all(|(&(from, to), &count)| count == 1 && edges.get(&(to, from)) == Some(&1))
    }

    /// Six times the volume that the triangles enclose: positive when they face outwards.
    fn volume(scene: &Scene, triangles: std::ops::Range<u32>) -> f64 {
        let corners = &scene.triangles[triangles.start as usize..triangles.end as usize];
        let point = |index: u32| glam::Vec3::from(scene.positions[index as usize]).as_dvec3();
        corners.iter().map(|&[a, b, c]| point(a).dot(point(b).cross(point(c)))).sum()
    }

    #[test]
    fn umbels_have_about_the_triangles_asked_for() {
        for n in [1000_u32, 1234, 1999, 2000, 3999, 6000, 10_000, 31_623, 100_000, 500_000] {
            let scene = builtin(&format!("umbel:{n}")).unwrap();
            check(&scene);
            let error = scene.triangles.len() as f64 / f64::from(n) - 1.0;
            assert!(error.abs() < 0.02, "{n}: {}", scene.triangles.len());
        }
        for n in [100, 101, 150, 300, 500, 999] {
            let scene = builtin(&format!("umbel:{n}")).unwrap();
            check(&scene);
            assert!(scene.triangles.len().abs_diff(n) <= n / 10, "{n}: {}", scene.triangles.len());
        }
    }

    #[test]
    fn scenes_are_the_same_each_time() {
        for name in ["umbel", "umbel:1000", "cornell"] {
            assert_eq!(builtin(name).unwrap(), builtin(name).unwrap());
            assert!(builtin_view(name).is_some());
        }
    }

    /// FNV-1a over the bits: a difference between machines or optimisation levels shows here.
    #[test]
    fn umbels_are_the_same_on_every_machine() {
        let scene = builtin("umbel:10000").unwrap();
        let floats = scene.positions.iter().chain(&scene.normals).flatten();
        let words = floats.map(|x| x.to_bits()).chain(scene.triangles.iter().flatten().copied());
        let hash = words.fold(0xcbf2_9ce4_8422_2325_u64, |hash, word| {
            (hash ^ u64::from(word)).wrapping_mul(0x0100_0000_01b3)
        });
        assert_eq!(hash, 0x64ad_e84f_3eaa_b436, "{hash:#x}");
    }

    #[test]
    fn tubes_ground_and_buds_are_closed_and_face_outwards() {
        let scene = builtin("umbel").unwrap();
        for kind in ["ground", "stem", "rays", "umbellets", "buds"] {
            let object = scene.objects.iter().find(|object| object.name.starts_with(kind)).unwrap();
            assert!(is_closed(&scene, object.triangles.clone()), "{kind}");
            assert!(volume(&scene, object.triangles.clone()) > 0.0, "{kind}");
        }
    }

    #[test]
    fn vertex_normals_agree_with_their_triangles() {
        let scene = builtin("umbel").unwrap();
        for (corners, normals) in scene.triangles.iter().zip(&scene.normal_indices) {
            let [a, b, c] = corners.map(|k| glam::Vec3::from(scene.positions[k as usize]));
            let face = (b - a).cross(c - a);
            assert!(normals.iter().all(|&k| face.dot(scene.normals[k as usize].into()) > 0.0));
        }
    }

    #[test]
    fn the_cornell_box_is_a_box_with_closed_blocks() {
        let scene = builtin("cornell").unwrap();
        check(&scene);
        assert_eq!(scene.triangles.len(), 6 * 2 + 2 * 12);
        for block in &scene.objects[6..] {
            assert!(is_closed(&scene, block.triangles.clone()), "{}", block.name);
            assert!(volume(&scene, block.triangles.clone()) > 0.0, "{}", block.name);
        }
        let middle = glam::Vec3::new(278.0, 273.0, 279.0);
        for [a, b, c] in &scene.triangles[..12] {
            let [a, b, c] = [a, b, c].map(|&k| glam::Vec3::from(scene.positions[k as usize]));
            assert!((b - a).cross(c - a).dot(middle - a) > 0.0, "a wall faces outwards");
        }
    }

    #[test]
    fn bad_names_are_usage_errors_that_say_what_there_is() {
        for name in ["", "umbels", "cornell:3", "bunny"] {
            let Err(Error::Usage(text)) = builtin(name) else { panic!("{name}") };
            assert!(text.contains("builtin:umbel:N") && text.contains("builtin:cornell"));
            assert!(builtin_view(name).is_none());
        }
        for name in ["umbel:", "umbel:99", "umbel:50000001", "umbel:-1", "umbel:1e6", "umbel:7:7"] {
            let Err(Error::Usage(text)) = builtin(name) else { panic!("{name}") };
            assert!(text.contains("100") && text.contains("50000000"));
        }
    }
}
