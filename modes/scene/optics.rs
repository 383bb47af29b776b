//! What a surface does with a ray: how much of it is mirrored, how much passes through, and where that goes.
//!
//! With the unit direction d, the unit normal n against it and c = −d·n: the mirrored direction is r = d + 2c n. Through a
//! boundary from refractive index n₁ to n₂, with η = n₁/n₂, Snell's law gives t = η d + (ηc − c')n, c' = √(1 − η²(1 − c²));
//! where the root is of a negative number, everything is mirrored (total internal reflection).
//!
//! A boundary between two indices mirrors what Fresnel's equations say, without polarization: F = (r∥² + r⊥²)/2. Where
//! there is no such boundary (metals, coated or thin surfaces), head-on reflectance R₀ is given, and F = R₀ + (1 − R₀)(1 − c)⁵.
//!
//! Based on: Turner Whitted, "An Improved Illumination Model for Shaded Display", 1980; Augustin Fresnel, "Mémoire sur la
//! loi des modifications que la réflexion imprime à la lumière polarisée", 1823; Christophe Schlick, "An Inexpensive BRDF
//! Model for Physically-based Rendering", 1994.

use glam::DVec3;

/// How a surface mirrors light and lets it through. Opaque without a mirror by default.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Optics {
    /// Mirrored share of light that arrives head-on: red, green, blue, 0 to 1. Counts where `ior` is 1.
    pub mirror: [f32; 3],
    /// Share that passes through of what is not mirrored: 0 is opaque.
    pub transmission: [f32; 3],
    /// Refractive index of what lies behind the fronts of the triangles over that before them; 1 bends nothing.
    pub ior: f32,
}

impl Default for Optics {
    fn default() -> Self {
        Self::OPAQUE
    }
}

impl Optics {
    /// Neither mirrored nor let through.
    pub const OPAQUE: Self = Self { mirror: [0.0; 3], transmission: [0.0; 3], ior: 1.0 };

    /// A silvered mirror.
    pub const MIRROR: Self = Self { mirror: [0.95; 3], ..Self::OPAQUE };

    /// Clear glass of a refractive index; 1.5 is that of window glass.
    #[must_use]
    pub const fn glass(ior: f32) -> Self {
        Self { transmission: [1.0; 3], ior, ..Self::OPAQUE }
    }

    /// Whether light is mirrored at all.
    #[must_use]
    pub fn reflects(&self) -> bool {
        self.ior != 1.0 || self.mirror != [0.0; 3]
    }

    /// Whether light passes through.
    #[must_use]
    pub fn transmits(&self) -> bool {
        self.transmission != [0.0; 3]
    }

    /// The mirrored share of a ray that arrives with cosine c, with η of its way through; 1 where it cannot pass.
    pub(crate) fn reflectance(&self, cosine: f64, eta: f64) -> [f64; 3] {
        if self.ior != 1.0 {
            return [fresnel(cosine, eta); 3];
        }
        let grazing = (1.0 - cosine).max(0.0);
        let grazing = (grazing * grazing) * (grazing * grazing) * grazing;
        if self.mirror == [0.0; 3] {
            return [0.0; 3];
        }
        self.mirror.map(f64::from).map(|head_on| head_on + (1.0 - head_on) * grazing)
    }
}

/// The direction d mirrored at a plane with normal n, both of unit length.
pub(crate) fn mirrored(d: DVec3, n: DVec3) -> DVec3 {
    d - n * (2.0 * d.dot(n))
}

/// The direction d bent at a plane with normal n against it, both of unit length; `None` where it is mirrored totally.
pub(crate) fn refracted(d: DVec3, n: DVec3, eta: f64) -> Option<DVec3> {
    let cosine = -d.dot(n);
    let inner = inner_cosine(cosine, eta)?;
    Some(d * eta + n * (eta * cosine - inner))
}

/// The cosine behind the boundary.
fn inner_cosine(cosine: f64, eta: f64) -> Option<f64> {
    let square = 1.0 - eta * eta * (1.0 - cosine * cosine);
    (square > 0.0).then(|| square.sqrt())
}

/// The mirrored share of unpolarized light at a boundary between two refractive indices, η their ratio.
fn fresnel(cosine: f64, eta: f64) -> f64 {
    let Some(inner) = inner_cosine(cosine, eta) else {
        return 1.0;
    };
    let parallel = (cosine - eta * inner) / (cosine + eta * inner);
    let across = (eta * cosine - inner) / (eta * cosine + inner);
    (parallel * parallel + across * across) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn glass_mirrors_four_percent_head_on_and_all_at_grazing_angles() {
        for eta in [1.5, 1.0 / 1.5] {
            assert!((fresnel(1.0, eta) - 0.04).abs() < 1e-15);
            assert!((fresnel(1e-9, eta) - 1.0).abs() < 1e-7);
        }
        // Brewster's angle: tan = n₂/n₁. Only light across the plane is mirrored there.
        let cosine = 1.0 / (1.0_f64 + 1.5 * 1.5).sqrt();
        let across = (1.0 - 1.5_f64 * 1.5) / (1.0 + 1.5 * 1.5);
        assert!((fresnel(cosine, 1.0 / 1.5) - across * across / 2.0).abs() < 1e-15);
    }

    #[test]
    fn what_enters_and_leaves_is_mirrored_alike() {
        let (d, n) = (DVec3::new(0.6, -0.8, 0.0), DVec3::Y);
        let inside = refracted(d, n, 1.0 / 1.5).expect("a way in");
        assert!((inside.length() - 1.0).abs() < 1e-15 && (inside.x - 0.4).abs() < 1e-15);
        let back = refracted(inside, n, 1.5).expect("a way out");
        assert!((back - d).length() < 1e-15);
        assert!((fresnel(0.8, 1.0 / 1.5) - fresnel(-inside.y, 1.5)).abs() < 1e-15);
    }

    #[test]
    fn beyond_the_critical_angle_all_is_mirrored() {
        // The sine of the critical angle is 1/1.5.
        let direction = |sine: f64| DVec3::new(sine, -(1.0 - sine * sine).sqrt(), 0.0);
        assert!(refracted(direction(0.666), DVec3::Y, 1.5).is_some());
        assert!(refracted(direction(0.667), DVec3::Y, 1.5).is_none());
        assert_eq!(fresnel(-direction(0.667).y, 1.5), 1.0);
    }
}
