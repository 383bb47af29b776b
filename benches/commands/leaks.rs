//! `umbel-bench leaks`: rays at the vertices, edge midpoints and centroids of a closed sphere, from inside. A ray that hits
//! nothing has leaked.
//!
//! The mesh, the spiral of origins and the targets are those of `examples/leaks.rs`; directions are rounded to f32, so that
//! all engines get the same rays. Rays at vertices meet several triangles at their corners, as exactly as f32 allows.
//!
//! Based on: Sven Woop, Carsten Benthin and Ingo Wald, "Watertight Ray/Triangle Intersection", 2013 (the experiment).

use serde_json::json;
use umbel::engine::Film;
use umbel::glam::DVec3;
use umbel::{Options, Origin, Pencil, Triangles, closest_hit};

use crate::Result;
use crate::commands::cli::{Common, LeaksArgs};
use crate::engines::Engines;
use crate::report;
use crate::subjects::icosphere::{icosphere, widen};

/// The rays from one origin.
struct Bundle {
    origin: [f32; 3],
    directions: Vec<[f32; 3]>,
}

/// Counts the bundle's rays that hit nothing.
type Escaped<'a> = Box<dyn Fn(&Bundle) -> Result<usize> + 'a>;

/// Counts for every engine and kind of target.
pub(crate) fn run(args: &LeaksArgs, common: &Common) -> Result<()> {
    let (positions, triangles) = icosphere(args.divisions);
    let engines = Engines::open(common, |_| false)?;
    println!("{}", engines.versions());
    println!("closed sphere of {} triangles, {} origins inside", triangles.len(), args.origins);
    println!("{:<24}{:<14}{:>12}{:>10}{:>14}", "engine", "rays at", "rays", "escaped", "per million");

    let mut counted = Vec::new();
    for (name, escaped) in contestants(&engines, &positions, &triangles)? {
        for (kind, targets) in targets(&positions, &triangles) {
            let (mut rays, mut leaks) = (0, 0);
            for k in 0..args.origins {
                let bundle = bundle(origin(k, args.origins), &targets);
                rays += bundle.directions.len();
                leaks += escaped(&bundle)?;
            }
            let per_million = leaks as f64 * 1e6 / rays as f64;
            println!("{name:<24}{kind:<14}{rays:>12}{leaks:>10}{per_million:>14.2}");
            counted.push(json!({
                "engine": name, "rays_at": kind, "rays": rays, "escaped": leaks, "per_million": per_million,
            }));
        }
    }
    let head = json!({
        "schema": 1, "command": "leaks", "versions": engines.versions(), "triangles": triangles.len(),
    });
    args.json.as_deref().map_or(Ok(()), |path| report::write(path, head, "counts", counted))
}

/// Vertices, edge midpoints and centroids.
fn targets(positions: &[[f32; 3]], triangles: &[[u32; 3]]) -> [(&'static str, Vec<DVec3>); 3] {
    let at = |v: u32| widen(positions[v as usize]);
    let (mut midpoints, mut centroids) = (Vec::new(), Vec::new());
    for &[a, b, c] in triangles {
        // Each edge has two triangles; the one in which it ascends counts it.
        let ascending = [(a, b), (b, c), (c, a)].into_iter().filter(|(from, to)| from < to);
        midpoints.extend(ascending.map(|(from, to)| (at(from) + at(to)) * 0.5));
        centroids.push((at(a) + at(b) + at(c)) / 3.0);
    }
    let vertices = positions.iter().copied().map(widen).collect();
    [("vertices", vertices), ("midpoints", midpoints), ("centroids", centroids)]
}

/// Origin k of so many: a spiral that begins at the centre and stays well inside. Twelve are those of `examples/leaks.rs`.
fn origin(k: u32, count: u32) -> DVec3 {
    let reach = 0.07 * 12.0 / f64::from(count.max(12));
    let (angle, reach) = (2.4 * f64::from(k), reach * f64::from(k));
    (DVec3::new(angle.cos(), angle.sin(), 0.3) * reach).as_vec3().as_dvec3()
}

/// Rays from an origin at targets, with f32 directions.
fn bundle(origin: DVec3, targets: &[DVec3]) -> Bundle {
    let directions = targets.iter().map(|&target| (target - origin).as_vec3().to_array());
    Bundle { origin: origin.as_vec3().to_array(), directions: directions.collect() }
}

/// All engines that count.
#[cfg_attr(not(feature = "embree"), expect(unused_mut, unused_variables, reason = "umbel is alone"))]
fn contestants<'a>(
    engines: &'a Engines,
    positions: &'a [[f32; 3]],
    triangles: &'a [[u32; 3]],
) -> Result<Vec<(&'static str, Escaped<'a>)>> {
    let mesh = Triangles::new(positions, triangles)?;
    let umbel: Escaped<'a> = Box::new(move |bundle| {
        let directions = bundle.directions.iter().copied().map(widen).collect();
        let pencil = Pencil::new(Origin::Point(widen(bundle.origin)), vec![Film::Scattered(directions)])?;
        let (hits, _) = closest_hit(&mesh, &pencil, &Options::default())?;
        Ok((0..hits.len()).filter(|&ray| hits.get(ray).is_none()).count())
    });
    let mut all = vec![("umbel", umbel)];
    #[cfg(feature = "embree")]
    if let Some(device) = &engines.embree {
        use crate::engines::embree::device::{Build, Mesh};
        for (name, build) in [("embree", Build::Medium), ("embree robust", Build::MediumRobust)] {
            let mut mesh = Mesh::new(device, positions, triangles, build)?;
            mesh.build()?;
            let escaped = move |bundle: &Bundle| Ok(embree_escaped(&mesh, bundle));
            all.push((name, Box::new(escaped)));
        }
    }
    Ok(all)
}

/// Counts the rays that Embree lets escape, in packets of 16.
#[cfg(feature = "embree")]
fn embree_escaped(mesh: &crate::engines::embree::device::Mesh, bundle: &Bundle) -> usize {
    use crate::engines::embree::api::{RtcRayHit, Valid};
    use crate::engines::embree::device::{Coherence, Packet};

    let mut packet = RtcRayHit::<16>::from_origin(bundle.origin);
    let mut escaped = 0;
    for directions in bundle.directions.chunks(16) {
        packet.reset();
        let mut valid = Valid([0; 16]);
        for (n, direction) in directions.iter().enumerate() {
            [packet.ray.dir_x[n], packet.ray.dir_y[n], packet.ray.dir_z[n]] = *direction;
            valid.0[n] = -1;
        }
        packet.intersect(mesh, &valid, Coherence::Coherent);
        escaped +=
            (0..directions.len()).filter(|&n| packet.hit(n).0 == crate::subjects::answer::MISS).count();
    }
    escaped
}
