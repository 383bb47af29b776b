//! Smooth surfaces for built-in scenes: tubes along curves, solids of revolution, and patches stamped many times.
//!
//! A *tube* follows the quadratic Bézier curve p(s) = (1−s)²·p0 + 2s(1−s)·p1 + s²·p2. Such a curve is planar, so the
//! normal B of its plane is one axis of the cross-section everywhere and B × p'(s) is the other: nothing twists.
//! A *patch* is a small mesh in a local frame, made once and stamped as o + M·p with M = scale · rotation.
//! Everything is f64 and rounded once, when it becomes a vertex; sine and cosine come from `libm`.
//!
//! Based on: Wenping Wang, Bert Jüttler, Dayue Zheng, Yang Liu, "Computation of Rotation Minimizing Frames", 2008
//! (the planar case, which needs no computation); Nelson Max, "Weights for Computing Vertex Normals from Facet
//! Normals", 1999 (here: weights by area).

use std::f64::consts::TAU;

use glam::{DMat3, DVec3};

use crate::scene::{Material, Object, Scene};

/// A point on the quadratic Bézier curve with the given control points and its unnormalised tangent; s in 0..=1.
pub(crate) fn bezier([p0, p1, p2]: [DVec3; 3], s: f64) -> (DVec3, DVec3) {
    let (q0, q1) = (p0 + (p1 - p0) * s, p1 + (p2 - p1) * s);
    (q0 + (q1 - q0) * s, q1 - q0)
}

/// The rotation that takes +y to `axis` and turns by `roll` radians about it.
pub(crate) fn frame(axis: DVec3, roll: f64) -> DMat3 {
    let y = axis.normalize();
    let (x, z) = y.any_orthonormal_pair();
    let (sin, cos) = libm::sincos(roll);
    let x = x * cos + z * sin;
    DMat3::from_cols(x, y, x.cross(y))
}

/// A small mesh in a local frame, with one smooth normal per vertex.
#[derive(Debug, Default)]
pub(crate) struct Patch {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Patch {
    /// The sheet `surface(s, w)` with s in 0..=1 cut into `along` and w in −1..=1 into `across` cells. Its front is the
    /// side from which s runs up and w to the right.
    pub(crate) fn sheet(along: u32, across: u32, surface: impl Fn(f64, f64) -> DVec3) -> Self {
        let mut patch = Self::default();
        for i in 0..=along {
            for j in 0..=across {
                let (s, w) = (f64::from(i) / f64::from(along), f64::from(j) / f64::from(across) * 2.0 - 1.0);
                patch.positions.push(surface(s, w));
            }
        }
        for i in 0..along {
            for j in 0..across {
                let a = i * (across + 1) + j;
                let (b, c, d) = (a + 1, a + across + 2, a + across + 1);
                // The diagonals mirror each other about the midline w = 0.
                let mirrored = 2 * j < across;
                patch.triangles.extend(if mirrored {
                    [[a, b, c], [a, c, d]]
                } else {
                    [[a, b, d], [b, c, d]]
                });
            }
        }
        patch.smooth()
    }

    /// The closed solid that a profile of (radius, height) sweeps about +y. The first and the last point lie on the
    /// axis, the first one on top. `lift` is added to each height.
    pub(crate) fn revolved(profile: &[[f64; 2]], sectors: u32, lift: impl Fn(f64, f64) -> f64) -> Self {
        let mut patch = Self::default();
        let (top, bottom) = (profile[0][1], profile[profile.len() - 1][1]);
        patch.positions.push(DVec3::new(0.0, top + lift(0.0, 0.0), 0.0));
        let mut rings = 0;
        for &[radius, height] in &profile[1..profile.len() - 1] {
            for k in 0..sectors {
                let (sin, cos) = libm::sincos(TAU * f64::from(k) / f64::from(sectors));
                let (x, z) = (radius * cos, radius * sin);
                patch.positions.push(DVec3::new(x, height + lift(x, z), z));
            }
            rings += 1;
        }
        let last = 1 + rings * sectors;
        patch.positions.push(DVec3::new(0.0, bottom + lift(0.0, 0.0), 0.0));
        for k in 0..sectors {
            let next = (k + 1) % sectors;
            patch.triangles.push([0, 1 + next, 1 + k]);
            for ring in 1..rings {
                let (up, down) = (1 + (ring - 1) * sectors, 1 + ring * sectors);
                let (a, b, c, d) = (up + k, up + next, down + next, down + k);
                patch.triangles.extend([[a, b, c], [a, c, d]]);
            }
            let ring = last - sectors;
            patch.triangles.push([last, ring + k, ring + next]);
        }
        patch.smooth()
    }

    /// A closed ellipsoid about the origin: radius 1 across and `height` along y; `rings` of at least 2.
    pub(crate) fn ellipsoid(sectors: u32, rings: u32, height: f64) -> Self {
        let profile: Vec<_> = (0..=rings)
            .map(|i| {
                let (sin, cos) = libm::sincos(TAU / 2.0 * f64::from(i) / f64::from(rings));
                [sin, cos * height]
            })
            .collect();
        Self::revolved(&profile, sectors, |_, _| 0.0)
    }

    /// `count` copies turned about +y by equal angles.
    pub(crate) fn whorl(&self, count: u32) -> Self {
        let mut whole = Self::default();
        for k in 0..count {
            let turn = frame(DVec3::Y, TAU * f64::from(k) / f64::from(count));
            let first = u32::try_from(whole.positions.len()).expect("a patch is small");
            whole.positions.extend(self.positions.iter().map(|&p| turn * p));
            whole.normals.extend(self.normals.iter().map(|&n| turn * n));
            let shifted = self.triangles.iter().map(|t| t.map(|index| index + first));
            whole.triangles.extend(shifted);
        }
        whole
    }

    /// The number of triangles.
    pub(crate) fn len(&self) -> usize {
        self.triangles.len()
    }

    /// Gives each vertex the mean of its triangles' normals, weighted by area.
    fn smooth(mut self) -> Self {
        self.normals = vec![DVec3::ZERO; self.positions.len()];
        for &corners in &self.triangles {
            let [a, b, c] = corners.map(|index| self.positions[index as usize]);
            let normal = (b - a).cross(c - a);
            for index in corners {
                self.normals[index as usize] += normal;
            }
        }
        for normal in &mut self.normals {
            *normal = normal.normalize_or(DVec3::Y);
        }
        self
    }
}

/// A scene in the making: surfaces are added to the object that was opened last.
#[derive(Debug, Default)]
pub(crate) struct Builder {
    scene: Scene,
    object_start: u32,
}

impl Builder {
    /// An empty scene with room for `triangles`.
    pub(crate) fn new(name: String, materials: Vec<Material>, triangles: usize) -> Self {
        let mut builder = Self::default();
        builder.scene.name = name;
        builder.scene.materials = materials;
        builder.scene.positions.reserve(triangles * 3 / 4);
        builder.scene.normals.reserve(triangles * 3 / 4);
        builder.scene.triangles.reserve(triangles + triangles / 50);
        builder.scene.normal_indices.reserve(triangles + triangles / 50);
        builder
    }

    /// The number of triangles so far.
    pub(crate) fn len(&self) -> usize {
        self.scene.triangles.len()
    }

    /// Makes an object of the triangles that came since the last one. Without any there is no object.
    pub(crate) fn close_object(&mut self, name: &str, material: u32) {
        let end = index(self.scene.triangles.len());
        if end > self.object_start {
            self.scene.objects.push(Object {
                name: name.to_owned(),
                triangles: self.object_start..end,
                material: Some(material),
            });
            self.object_start = end;
        }
    }

    /// The scene.
    pub(crate) fn finish(self) -> Scene {
        self.scene
    }

    /// Stamps a patch: scaled, rotated, moved to `origin`.
    pub(crate) fn stamp(&mut self, patch: &Patch, origin: DVec3, rotation: DMat3, scale: f64) {
        let first = index(self.scene.positions.len());
        let first_normal = index(self.scene.normals.len());
        for (&position, &normal) in patch.positions.iter().zip(&patch.normals) {
            self.vertex(origin + rotation * position * scale, rotation * normal);
        }
        for corners in &patch.triangles {
            self.scene.triangles.push(corners.map(|k| k + first));
            self.scene.normal_indices.push(corners.map(|k| k + first_normal));
        }
    }

    /// A closed tube about the curve with flat caps. `radii` are those at its start and end, with a linear taper.
    pub(crate) fn tube(&mut self, curve: [DVec3; 3], radii: [f64; 2], [sides, segments]: [u32; 2]) {
        let first = index(self.scene.positions.len());
        let first_normal = index(self.scene.normals.len());
        let bend = (curve[1] - curve[0]).cross(curve[2] - curve[1]);
        // A straight curve bends nowhere; any direction across it will do.
        let chord = (curve[2] - curve[0]).normalize();
        let binormal = bend.try_normalize().unwrap_or_else(|| chord.any_orthonormal_vector());
        for i in 0..=segments {
            let s = f64::from(i) / f64::from(segments);
            let (center, tangent) = bezier(curve, s);
            let normal = binormal.cross(tangent.normalize());
            let radius = radii[0] + (radii[1] - radii[0]) * s;
            for k in 0..sides {
                let (sin, cos) = libm::sincos(TAU * f64::from(k) / f64::from(sides));
                let out = normal * cos + binormal * sin;
                self.vertex(center + out * radius, out);
            }
        }
        for i in 0..segments {
            for k in 0..sides {
                let (a, b) = (i * sides + k, i * sides + (k + 1) % sides);
                let (c, d) = (b + sides, a + sides);
                for corners in [[a, b, c], [a, c, d]] {
                    self.scene.triangles.push(corners.map(|k| k + first));
                    self.scene.normal_indices.push(corners.map(|k| k + first_normal));
                }
            }
        }
        let end = first + segments * sides;
        self.cap(-bezier(curve, 0.0).1, (1..sides - 1).map(|k| [first, first + k + 1, first + k]));
        self.cap(bezier(curve, 1.0).1, (1..sides - 1).map(|k| [end, end + k, end + k + 1]));
    }

    /// Triangles that share one normal.
    fn cap(&mut self, normal: DVec3, triangles: impl Iterator<Item = [u32; 3]>) {
        let shared = index(self.scene.normals.len());
        self.scene.normals.push(normal.normalize().as_vec3().to_array());
        for corners in triangles {
            self.scene.triangles.push(corners);
            self.scene.normal_indices.push([shared; 3]);
        }
    }

    /// A vertex with its normal, rounded to f32.
    fn vertex(&mut self, position: DVec3, normal: DVec3) {
        self.scene.positions.push(position.as_vec3().to_array());
        self.scene.normals.push(normal.as_vec3().to_array());
    }
}

/// A length as an index. Built-in scenes have at most 50 million triangles.
pub(crate) fn index(length: usize) -> u32 {
    u32::try_from(length).expect("a built-in scene fits 32-bit indices")
}
