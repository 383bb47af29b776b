//! Instructions per query, counted by callgrind: the same on a busy machine, so that a regression shows.
//!
//! Each subject leans on one kernel. The pool is the thread that is counted.

#![allow(unused_qualifications, reason = "the macros of gungraun qualify all that they touch")]

use std::hint::black_box;

use gungraun::{library_benchmark, library_benchmark_group, main};
use umbel::engine::{Film, GridFilm};
use umbel::glam::DVec3;
use umbel::{Frame, Options, Origin, Pencil, Triangles};

/// The folder of the subjects, of which this program needs one.
mod subjects {
    pub(crate) mod icosphere;
}

/// Triangles and rays.
struct Query {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    pencil: Pencil,
}

/// A view of 256x256 pixels along −z, 60° wide.
fn query(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>, eye: DVec3) -> Query {
    // Fails where a pool is there already: it is the same one.
    let _ = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global();
    let half = (30.0_f64).to_radians().tan() / 256.0;
    let film = GridFilm::new(256, 256, DVec3::NEG_Z, DVec3::X * half, DVec3::Y * half).expect("a film");
    let pencil = Pencil::new(Origin::Point(eye), vec![Film::Grid(film)]).expect("rays in range");
    Query { positions, triangles, pencil }
}

/// A sphere of many small triangles: projection, setup and short rows.
fn small_triangles(divisions: u32) -> Query {
    let (positions, triangles) = subjects::icosphere::icosphere(divisions);
    query(positions, triangles, DVec3::Z * 2.2)
}

/// Walls one behind the other, seen through the corners of the view: blocks and full rows.
fn large_triangles(count: u32) -> Query {
    let wall = |k: u32| {
        let (z, turn) = (-1.0 - k as f32, (k % 3) as f32);
        [[-9.0 * (z.abs() + turn), -9.0, z], [9.0 * z.abs(), -8.0 - turn, z], [turn, 9.0 * z.abs(), z]]
    };
    let positions = (0..count).rev().flat_map(wall).collect();
    query(positions, (0..count).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect(), DVec3::ZERO)
}

/// A fan of slivers around a point before the eye, some of them beside and behind it: corners that cannot be projected.
fn slivers(count: u32) -> Query {
    let rim = |k: u32| {
        let turn = k as f32 * 0.01;
        [5.0 * (turn * 7.0).sin(), 5.0 * (turn * 3.0).cos(), 3.0 * turn.sin()]
    };
    let positions = std::iter::once([0.1, 0.05, -4.0]).chain((0..=count).map(rim)).collect();
    query(positions, (0..count).map(|k| [0, k + 1, k + 2]).collect(), DVec3::ZERO)
}

#[library_benchmark]
#[bench::small_triangles(args = (5), setup = small_triangles)]
#[bench::large_triangles(args = (300), setup = large_triangles)]
#[bench::slivers(args = (300), setup = slivers)]
fn closest_hit(query: Query) -> u64 {
    let triangles = Triangles::new(&query.positions, &query.triangles).expect("valid triangles");
    let mut frame = Frame::new();
    let stats = frame.closest_hit(black_box(&triangles), &query.pencil, &Options::default());
    stats.expect("in range").samples_tested
}

library_benchmark_group!(name = kernels; benchmarks = closest_hit);

main!(library_benchmark_groups = kernels);
