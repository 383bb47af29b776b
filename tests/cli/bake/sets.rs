//! Sample sets: what a seed changes, what pieces, threads and groupings do not, and how far sets agree.

use common::place;
use umbel::bake::{Bake, BakeOptions, Falloff, Reach, SampleSet, Weighting};
use umbel::engine::Grouping;
use umbel::{Frame, Options, Path, Scene, builtin};

use super::{in_pieces, run};

const SETS: [SampleSet; 3] = [SampleSet::Shared, SampleSet::Interleaved, SampleSet::Independent];

fn scene() -> Scene {
    builtin("umbel:1000").expect("a built-in scene")
}

#[test]
fn a_seed_is_all_that_chance_depends_on() {
    let scene = scene();
    let receivers = scene.vertex_receivers().expect("receivers").range(0..200);
    for set in SETS {
        let with = |seed| {
            let options =
                BakeOptions { set, seed, rays: 32, bent: true, traced: true, ..BakeOptions::default() };
            run(&scene, &receivers, options)
        };
        assert_eq!(with(5), with(5), "{set:?}");
        assert_ne!(with(5).values, with(6).values, "{set:?}");
    }
}

/// A value depends on its receiver alone.
#[test]
fn pieces_groupings_paths_and_threads_change_nothing() {
    let scene = scene();
    let triangles = scene.geometry().expect("valid");
    let vertices = scene.vertex_receivers().expect("receivers");
    let reach = Reach { max_distance: 1.0, falloff: Falloff::Linear, min_distance: 0.0 };
    for set in SETS {
        let options =
            BakeOptions { set, rays: 24, reach, bent: true, traced: true, seed: 9, ..BakeOptions::default() };
        let whole = run(&scene, &vertices.range(0..300), options);
        let mut groupings = vec![Grouping::Auto, Grouping::Origin];
        groupings.extend((set != SampleSet::Independent).then_some(Grouping::Direction));
        for grouping in groupings {
            let bake = Bake::new(BakeOptions { grouping, ..options }).expect("valid options");
            for path in [Path::Pencil, Path::General] {
                let engine = Options { path, ..Options::default() };
                let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("one thread");
                let (mut values, mut bent, mut traced, mut rays) = (Vec::new(), Vec::new(), Vec::new(), 0);
                for first in (0..300).step_by(43) {
                    let piece = vertices.range(first..300.min(first + 43));
                    let found = pool.install(|| bake.run(&triangles, &piece, &mut Frame::new(), &engine));
                    let found = found.expect("in range");
                    values.extend(found.values);
                    bent.extend(found.bent);
                    traced.extend(found.traced);
                    rays += found.rays;
                }
                assert_eq!(values, whole.values, "{set:?} {grouping:?} {path:?}");
                assert_eq!((bent, rays), (whole.bent.clone(), whole.rays), "{set:?} {grouping:?}");
                assert!(traced == whole.traced, "{set:?} {grouping:?} {path:?}");
            }
        }
    }
}

#[test]
fn files_do_not_depend_on_threads_or_memory() {
    let place = place!();
    for set in ["shared", "interleaved", "independent"] {
        // More vertices than the least piece.
        let line = format!("bake builtin:umbel:9000 --vertices --rays 4 --set {set} --max-distance 5% -o");
        place.quiet_run(&format!("{line} a.npy --bent ab.npy --threads 1"));
        in_pieces(&place, &format!("{line} b.npy --bent bb.npy --threads 3"));
        assert_eq!(place.bytes("a.npy"), place.bytes("b.npy"), "{set}");
        assert_eq!(place.bytes("ab.npy"), place.bytes("bb.npy"), "{set}");
    }
}

/// The same openness from other directions: means over many vertices, and each vertex within what its rays allow.
#[test]
fn sets_agree() {
    let scene = scene();
    let receivers = scene.vertex_receivers().expect("receivers").range(0..150);
    for weighting in [Weighting::Cosine, Weighting::Uniform] {
        let of = |set| {
            let options = BakeOptions { set, weighting, rays: 1024, ..BakeOptions::default() };
            run(&scene, &receivers, options).values
        };
        let [shared, interleaved, independent] = SETS.map(of);
        for other in [interleaved, independent] {
            let differences = || shared.iter().zip(&other).map(|(a, b)| a - b);
            let mean = differences().sum::<f32>() / shared.len() as f32;
            let largest = differences().map(f32::abs).fold(0.0, f32::max);
            assert!(mean.abs() < 0.003 && largest < 0.05, "{weighting:?}: {mean} {largest}");
            assert!(largest > 0.0, "they are different directions");
        }
    }
}

/// Neighbours take different sets, and 16 texels of a tile take all of them.
#[test]
fn interleaved_sets_tile_texels() {
    let scene = scene();
    let one = scene.vertex_receivers().expect("receivers").range(40..41);
    let value = |index: u32| {
        let mut receivers = one.clone();
        receivers.indices[0] = index;
        let options = BakeOptions {
            set: SampleSet::Interleaved,
            rays: 48,
            columns: Some(100),
            traced: true,
            ..BakeOptions::default()
        };
        run(&scene, &receivers, options).traced
    };
    let tile: Vec<_> = (0..16).map(|k| value(k / 4 * 100 + k % 4)).collect();
    assert!((0..16).all(|k| (0..k).all(|other| tile[k] != tile[other])));
    assert_eq!(tile[0], value(4 * 100 + 96));
    assert_eq!(tile[7], value(97 * 100 + 51));
}

/// Half of the directions of a sphere are above any plane, and all of a receiver's own.
#[test]
fn there_are_as_many_rays_as_asked_for() {
    let scene = scene();
    let receivers = scene.vertex_receivers().expect("receivers").range(0..200);
    for (set, slack) in
        [(SampleSet::Shared, 0.02), (SampleSet::Interleaved, 0.02), (SampleSet::Independent, 0.0)]
    {
        let found = run(&scene, &receivers, BakeOptions { set, rays: 100, ..BakeOptions::default() });
        let share = found.rays as f64 / (100 * receivers.len()) as f64;
        assert!((share - 1.0).abs() <= slack, "{set:?}: {share}");
    }
    for rays in [1, 2, 3, 5] {
        let found =
            run(&Scene::default(), &receivers_of_nothing(), BakeOptions { rays, ..BakeOptions::default() });
        assert_eq!(found.values, [1.0; 6]);
        assert!(found.rays >= 6, "each hemisphere has a direction");
    }
}

/// Points in empty space that look along the axes.
fn receivers_of_nothing() -> umbel::bake::BakeReceivers {
    use umbel::glam::DVec3;
    let axes = [DVec3::X, DVec3::Y, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Y, DVec3::NEG_Z];
    super::free_points(&axes.map(|normal| ([0.0; 3], normal)))
}
