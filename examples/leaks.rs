//! Leaks per million: from inside a closed sphere, rays at every vertex, edge midpoint and centroid. None may escape.
//!
//! `cargo run --release --example leaks [DIVISIONS]` prints a line per origin and writes `leaks.txt`. Each division makes
//! four triangles of one: 5 makes 20,480, 8 makes 1.3 million. Elsewhere such rays are where cracks show, because they meet
//! edges and corners as exactly as numbers allow. For closed OBJ files see `tests/exactness/watertight.rs`.
//!
//! Based on: Sven Woop, Carsten Benthin and Ingo Wald, "Watertight Ray/Triangle Intersection", 2013 (the experiment).

#![expect(clippy::print_stdout, reason = "an example tells what it found")]

use std::collections::HashMap;
use std::path::Path;

use umbel::engine::Film;
use umbel::files::write_atomically;
use umbel::glam::DVec3;
use umbel::{Error, Options, Origin, Pencil, Triangles, closest_hit};

fn main() -> Result<(), Error> {
    let divisions = std::env::args().nth(1).map_or(Ok(5), |text| text.parse());
    let divisions = divisions.map_err(|_| Error::Usage("DIVISIONS must be a number from 0 to 8".into()))?;
    let (positions, indices) = icosphere(std::cmp::min(divisions, 8));
    let triangles = Triangles::new(&positions, &indices)?;
    let widen = |v: u32| DVec3::from_array(positions[v as usize].map(f64::from));
    let mut targets: Vec<DVec3> = (0..positions.len() as u32).map(widen).collect();
    for &[a, b, c] in &indices {
        // Each edge has two triangles; the one in which it ascends counts it.
        let ascending = [(a, b), (b, c), (c, a)].into_iter().filter(|(from, to)| from < to);
        targets.extend(ascending.map(|(from, to)| (widen(from) + widen(to)) * 0.5));
        targets.push((widen(a) + widen(b) + widen(c)) / 3.0);
    }

    let (mut rays, mut leaks, mut report) = (0, 0, String::new());
    for k in 0..12 {
        // Origins on a spiral, with coordinates of an f32; the first is the centre.
        let (angle, reach) = (2.4 * f64::from(k), 0.07 * f64::from(k));
        let origin = DVec3::new(angle.cos(), angle.sin(), 0.3) * reach;
        let origin = origin.as_vec3().as_dvec3();
        let directions = targets.iter().map(|&target| target - origin).collect();
        let pencil = Pencil::new(Origin::Point(origin), vec![Film::Scattered(directions)])?;
        let (hits, _) = closest_hit(&triangles, &pencil, &Options::default())?;
        let escaped = (0..hits.len()).filter(|&ray| hits.get(ray).is_none()).count();
        report += &format!("{} rays from {origin}: {escaped} escaped\n", hits.len());
        (rays, leaks) = (rays + hits.len(), leaks + escaped);
    }
    let per_million = leaks as f64 * 1e6 / rays as f64;
    report += &format!("{rays} rays, {per_million} leaks per million\n");
    print!("{report}");
    write_atomically(Path::new("leaks.txt"), |out| out.write_all(report.as_bytes()))
}

/// A sphere: the icosahedron, its triangles divided at the middles of their edges.
fn icosphere(divisions: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let unit = |p: DVec3| p.normalize().as_vec3().to_array();
    let mut positions = Vec::new();
    for (x, y) in [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)] {
        positions.extend([[x, y, 0.0], [0.0, x, y], [y, 0.0, x]].map(|p| unit(DVec3::from_array(p))));
    }
    let near = |a: u32, b: u32| {
        let [a, b] = [a, b].map(|v| DVec3::from_array(positions[v as usize].map(f64::from)));
        a.distance(b) < 1.1
    };
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            let third = (b + 1..12).filter(|&c| near(a, b) && near(b, c) && near(c, a));
            triangles.extend(third.map(|c| [a, b, c]));
        }
    }
    for _ in 0..divisions {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                let [p, q] = [a, b].map(|v| DVec3::from_array(positions[v as usize].map(f64::from)));
                positions.push(unit(p + q));
                u32::try_from(positions.len() - 1).unwrap_or(u32::MAX)
            })
        };
        let divide = |[a, b, c]: [u32; 3]| {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(divide).collect();
    }
    (positions, triangles)
}
