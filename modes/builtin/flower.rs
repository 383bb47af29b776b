//! `builtin:umbel`: wild carrot (*Daucus carota*) at five ages, from bud to full flower, on a disc of soil.
//!
//! An umbel is a set of stalks, which botanists call rays, that spring from one point. A compound umbel does so twice:
//! primary rays end in umbellets, whose rays end in flowers. Both fans are spherical Fibonacci points on a cap,
//! cos θ_i = 1 − (i + ½)/n · (1 − cos θ_max) and φ_i = i · π(3 − √5), so any n spreads evenly.
//!
//! The stalks, leaves and soil come first; the flowers take the triangles that are left. One flower is the granularity.
//! A flower is small where many share an umbellet, so that the heads look alike at every count.
//!
//! Based on: Helmut Vogel, "A Better Way to Construct the Sunflower Head", 1979 (golden angle); Przemysław Prusinkiewicz
//! and Aristid Lindenmayer, "The Algorithmic Beauty of Plants", 1990 (compound inflorescences).

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DVec3};

use crate::builtin::foliage::{Chance, Detail, bracts, ground, leaves};
use crate::builtin::sweep::{Builder, Patch, bezier, frame};
use crate::scene::optics::Optics;
use crate::scene::{Material, Scene};

/// How far the primary and the secondary rays spread from the axis, in radians.
const CAP_ANGLES: [f64; 2] = [1.35, 1.2];

/// Names and linear diffuse reflectances; the constants below are the indices.
const MATERIALS: [(&str, [f32; 3]); 8] = [
    ("soil", [0.36, 0.28, 0.20]),
    ("leaf", [0.15, 0.34, 0.07]),
    ("stem", [0.28, 0.47, 0.13]),
    ("ray", [0.40, 0.56, 0.20]),
    ("petal", [0.90, 0.87, 0.79]),
    ("blush", [0.89, 0.70, 0.68]),
    ("bud", [0.80, 0.70, 0.26]),
    ("heart", [0.22, 0.02, 0.06]),
];
const SOIL: u32 = 0;
const LEAF: u32 = 1;
const STEM: u32 = 2;
const RAY: u32 = 3;
const PETAL: u32 = 4;
const BLUSH: u32 = 5;
const BUD: u32 = 6;
const HEART: u32 = 7;

/// A flower head: where its stem begins and ends, its radius, how far its flowers have opened (0 to 1), its petals.
struct Head {
    foot: DVec3,
    top: DVec3,
    radius: f64,
    open: f64,
    petal: u32,
}

/// The heads, largest first: small scenes have only the first ones. The camera looks from (1, 0.7, 1).
const HEADS: [Head; 5] = [
    Head {
        foot: DVec3::new(-0.05, -0.05, -0.03),
        top: DVec3::new(-0.1, 1.62, 0.1),
        radius: 1.0,
        open: 1.0,
        petal: PETAL,
    },
    Head {
        foot: DVec3::new(0.1, -0.05, -0.04),
        top: DVec3::new(0.80, 1.14, -0.88),
        radius: 0.64,
        open: 0.9,
        petal: PETAL,
    },
    Head {
        foot: DVec3::new(-0.09, -0.05, 0.01),
        top: DVec3::new(-0.96, 1.34, 0.66),
        radius: 0.50,
        open: 0.7,
        petal: BLUSH,
    },
    Head {
        foot: DVec3::new(-0.02, -0.05, 0.04),
        top: DVec3::new(0.16, 0.86, 0.98),
        radius: 0.36,
        open: 0.55,
        petal: BLUSH,
    },
    Head {
        foot: DVec3::new(0.03, -0.05, 0.01),
        top: DVec3::new(1.08, 0.66, -0.02),
        radius: 0.28,
        open: 0.3,
        petal: BLUSH,
    },
];

/// The end of a primary ray, where an umbellet sits.
struct Node {
    end: DVec3,
    axis: DVec3,
    radius: f64,
    flowers: u64,
}

/// The scene with about `triangles` triangles.
pub(crate) fn umbel(name: String, triangles: u32) -> Scene {
    let detail = Detail::new(triangles);
    let materials =
        MATERIALS.map(|(name, diffuse)| Material { name: name.to_owned(), diffuse, optics: Optics::OPAQUE });
    let mut builder = Builder::new(name, materials.to_vec(), triangles as usize);
    ground(&mut builder, &detail);
    builder.close_object("ground", SOIL);
    leaves(&mut builder, &detail);
    builder.close_object("leaves", LEAF);
    let heads = &HEADS[..detail.heads];
    let total: f64 = heads.iter().map(|head| libm::pow(head.radius, 1.3)).sum();
    let mut umbellets = Vec::new();
    let (mut weight, mut placed) = (0.0, 0);
    for (k, head) in heads.iter().enumerate() {
        let curve = stem(head);
        builder.tube(curve, [0.045, 0.03].map(|r| r * libm::sqrt(head.radius)), detail.tube(12.0, 16.0));
        builder.close_object(&format!("stem {}", k + 1), STEM);
        bracts(&mut builder, &detail, head.top, head_frame(head), head.radius);
        builder.close_object(&format!("bracts {}", k + 1), LEAF);
        weight += libm::pow(head.radius, 1.3);
        let until = libm::round(weight / total * detail.primary_rays as f64) as usize;
        umbellets.push(primary_rays(&mut builder, &detail, head, until - placed));
        builder.close_object(&format!("rays {}", k + 1), RAY);
        placed = until;
    }
    umbels(&mut builder, &detail, triangles as usize, &mut umbellets);
    builder.finish()
}

/// A stem from the ground to the head: it leaves upright and leans outwards.
fn stem(head: &Head) -> [DVec3; 3] {
    let lean = head.top - head.foot;
    [head.foot, head.foot + DVec3::new(lean.x * 0.63, lean.y * 0.5, lean.z * 0.63), head.top]
}

/// The axis of a head: the way its stem arrives, straightened up.
fn head_frame(head: &Head) -> DMat3 {
    let (_, arrival) = bezier(stem(head), 1.0);
    frame(arrival.normalize() + DVec3::Y, head.foot.x * 40.0)
}

/// The primary rays of a head: they leave sideways and turn upwards, so that their ends form a flat dome.
fn primary_rays(builder: &mut Builder, detail: &Detail, head: &Head, count: usize) -> Vec<Node> {
    let whole = head_frame(head);
    let widest = libm::sin(CAP_ANGLES[0]);
    let spread = head.radius * (0.55 + 0.45 * head.open) / widest;
    let mut nodes = Vec::with_capacity(count);
    for i in 0..count {
        let fan = cap_point(i as u64, count as u64, CAP_ANGLES[0]);
        let length = 0.95 + 0.1 * Chance(i as u64).at(head.petal.into());
        let rise = head.radius * (0.34 + 0.42 * fan.y);
        let end = DVec3::new(fan.x * spread, rise, fan.z * spread) * length;
        let knee = DVec3::new(end.x * 0.56, end.y * 0.36, end.z * 0.56);
        let curve = [head.top, head.top + whole * knee, head.top + whole * end];
        let thin = 0.012 * libm::sqrt(head.radius);
        builder.tube(curve, [thin, thin * 0.6], detail.tube(6.0, 5.0));
        nodes.push(Node {
            end: curve[2],
            axis: whole * DVec3::new(fan.x * 0.7, fan.y + 0.45, fan.z * 0.7),
            radius: 1.02 * spread * widest / libm::sqrt(count as f64),
            flowers: 0,
        });
    }
    nodes
}

/// A petal of a flower of radius 1 whose axis is +y: inversely heart-shaped, cupped, raised the less the more it is open.
fn petal(detail: &Detail, open: f64) -> Patch {
    let across = if detail.fineness < 0.4 { 1 } else { 2 * detail.cells(1.0, 1) };
    // With three vertices across, a deep notch would make two spikes of a petal.
    let depth = if across < 4 { 0.08 } else { 0.24 };
    let (sin, cos) = libm::sincos(0.15 + 1.15 * (1.0 - open));
    Patch::sheet(detail.cells(2.0, 1), across, |s, w| {
        let width = 0.05 + 0.40 * libm::sin(2.3 * s);
        let notch = depth * (1.0 - w.abs()) * (1.0 - w.abs());
        let reach = 0.1 + 0.98 * s * (1.0 - s * s * (0.16 * w * w + notch));
        let height = 0.20 * s * s + 0.30 * width * w * w;
        DVec3::new(reach * cos - height * sin, reach * sin + height * cos, w * width)
    })
}

/// A flower's place: its stalk, its axis and its size.
struct Site {
    stalk: [DVec3; 3],
    turned: DMat3,
    size: f64,
}

impl Node {
    /// The flower `j` of this umbellet, which is the one numbered `id`.
    fn site(&self, j: u64, id: u64) -> Site {
        let chance = Chance(id << 20 | j);
        let whole = frame(self.axis, id as f64);
        let fan = cap_point(j, self.flowers, CAP_ANGLES[1]);
        let rise = self.radius * (0.45 + 0.30 * fan.y);
        let end = DVec3::new(fan.x * self.radius, rise, fan.z * self.radius);
        let knee = DVec3::new(end.x * 0.6, end.y * 0.35, end.z * 0.6);
        let axis = whole * DVec3::new(fan.x * 0.6, fan.y + 0.35, fan.z * 0.6);
        let crowd = 1.08 * self.radius / libm::sqrt(self.flowers.max(3) as f64);
        Site {
            stalk: [self.end, self.end + whole * knee, self.end + whole * end],
            turned: frame(axis, TAU * chance.at(1)),
            size: crowd * (0.92 + 0.3 * chance.at(2)),
        }
    }
}

/// The umbellets of all heads: as many flowers as the triangles that are left allow.
fn umbels(builder: &mut Builder, detail: &Detail, triangles: usize, umbellets: &mut [Vec<Node>]) {
    let bud = Patch::ellipsoid(detail.cells(4.0, 3), detail.cells(2.5, 2), 0.8);
    let [sides, segments] = detail.tube(3.4, 2.0);
    let stalk = (2 * sides * segments + 2 * (sides - 2)) as usize;
    let flower = stalk + bud.len() + 5 * petal(detail, 1.0).len();
    let flowers = (triangles.saturating_sub(builder.len()) + flower / 2) / flower;
    share_out(flowers.max(1), umbellets);
    for (k, (head, nodes)) in HEADS.iter().zip(umbellets.iter()).enumerate() {
        let corolla = petal(detail, head.open).whorl(5);
        let sites = || {
            let ids = (k as u64 * 1000..).zip(nodes);
            ids.flat_map(|(id, node)| (0..node.flowers).map(move |j| node.site(j, id)))
        };
        for Site { stalk, size, .. } in sites() {
            let thin = size.min(0.06) * 0.1;
            builder.tube(stalk, [thin, thin * 0.8], [sides, segments]);
        }
        builder.close_object(&format!("umbellets {}", k + 1), RAY);
        // The one dark flower in the middle of a wild carrot's umbel.
        let heart = usize::from(k == 0);
        for site in sites().take(heart) {
            builder.stamp(&corolla, site.stalk[2], site.turned, site.size);
        }
        builder.close_object("heart", HEART);
        for site in sites().skip(heart) {
            builder.stamp(&corolla, site.stalk[2], site.turned, site.size);
        }
        builder.close_object(&format!("flowers {}", k + 1), head.petal);
        for site in sites() {
            builder.stamp(&bud, site.stalk[2], site.turned, site.size * 0.24);
        }
        builder.close_object(&format!("buds {}", k + 1), BUD);
    }
}

/// Deals flowers to umbellets in proportion to the square root of their radius, by rounding the running sum.
fn share_out(flowers: usize, umbellets: &mut [Vec<Node>]) {
    let weight = |node: &Node| libm::sqrt(node.radius);
    let total: f64 = umbellets.iter().flatten().map(weight).sum();
    let (mut sum, mut dealt) = (0.0, 0);
    for node in umbellets.iter_mut().flatten() {
        sum += weight(node);
        let until = libm::round(sum / total * flowers as f64) as u64;
        node.flowers = until - dealt;
        dealt = until;
    }
}

/// Point i of n on a cap about +y: unit length, spherical Fibonacci.
fn cap_point(i: u64, n: u64, max_angle: f64) -> DVec3 {
    let golden = PI * (3.0 - libm::sqrt(5.0));
    let part = (i as f64 + 0.5) / n as f64;
    let cos = 1.0 - part * (1.0 - libm::cos(max_angle));
    let across = libm::sqrt(1.0 - cos * cos);
    let (s, c) = libm::sincos(golden * i as f64);
    DVec3::new(across * c, cos, across * s)
}
