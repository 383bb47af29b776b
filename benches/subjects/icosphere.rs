//! A closed mesh for counting leaks, the same as in `examples/leaks.rs`: an icosahedron whose triangles are divided.

use std::collections::HashMap;

use umbel::glam::DVec3;

/// Positions on the unit sphere, and triangles.
pub(crate) fn icosphere(divisions: u32) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let (mut positions, mut triangles) = icosahedron();
    for _ in 0..divisions {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push(on_sphere(widen(positions[a as usize]) + widen(positions[b as usize])));
                // Eight divisions have 655,362 vertices.
                (positions.len() - 1) as u32
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

/// Twelve vertices, and a triangle wherever three are neighbours.
fn icosahedron() -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut positions = Vec::new();
    for (x, y) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
        positions.extend([[x, y, 0.0], [0.0, x, y], [y, 0.0, x]].map(|p| on_sphere(DVec3::from_array(p))));
    }
    let near = |a: u32, b: u32| widen(positions[a as usize]).distance(widen(positions[b as usize])) < 1.1;
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            let third = (b + 1..12).filter(|&c| near(a, b) && near(b, c) && near(c, a));
            triangles.extend(third.map(|c| [a, b, c]));
        }
    }
    (positions, triangles)
}

/// The nearest f32 point of the unit sphere.
fn on_sphere(point: DVec3) -> [f32; 3] {
    point.normalize().as_vec3().to_array()
}

/// An f32 point in f64.
pub(crate) fn widen(point: [f32; 3]) -> DVec3 {
    DVec3::from_array(point.map(f64::from))
}

#[cfg(test)]
mod tests {
    #[test]
    fn five_divisions() {
        let (positions, triangles) = super::icosphere(5);
        assert_eq!((positions.len(), triangles.len()), (10_242, 20_480));
    }
}
