//! Limit masks: where a vertex of a Catmull-Clark surface ends up, and its tangents there.
//!
//! With N faces around v, the other ends e_i of its edges and the farthest vertices f_i of its quads, in order, θ = 2π/N:
//!
//! - p = (N²·v + 4·Σe_i + Σf_i) / (N·(N + 5));
//! - t_1 = Σ A·cos(iθ)·e_i + (cos(iθ) + cos((i + 1)θ))·f_i, t_2 the same with sin, A = 1 + cos θ + cos(θ/2)·√(18 + 2·cos θ);
//! - on a crease or a border p = (4·v + e_1 + e_2)/6, in a corner p = v.
//!
//! They are eigenvectors of subdivision. Where sharpness still fades, or a crease ends, no mask is given: there subdivision itself
//! finds the limit.
//!
//! Based on: Mark Halstead, Michael Kass and Tony DeRose, "Efficient, Fair Interpolation using Catmull-Clark Surfaces", 1993.

use std::f64::consts::TAU;

use crate::surfaces::subdivision::cage::{Cage, Rule};

/// Rows over the vertices of a neighbourhood.
type Row = Vec<(u32, f64)>;

/// The limit of a vertex.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Limit {
    pub(crate) point: Row,
    /// Two tangents whose cross product is the normal; `None` on creases and in corners.
    pub(crate) tangents: Option<[Row; 2]>,
}

impl Limit {
    /// The limit of the vertex of a corner in a cage of quads, if there is a mask.
    pub(crate) fn of(cage: &Cage, corner: u32) -> Option<Self> {
        let vertex = cage.vertex(corner);
        let fan = cage.fan(corner, Cage::across);
        let spokes = cage.spokes(&fan);
        let own = cage.corners[vertex as usize];
        let fades = |s: f32| s > 0.0 && s.is_finite();
        if fades(own) || spokes.iter().any(|spoke| fades(spoke.1)) {
            return None;
        }
        match Cage::rule(&spokes, own) {
            Rule::Corner => Some(Self { point: vec![(vertex, 1.0)], tangents: None }),
            Rule::Crease => {
                let ends = spokes.iter().filter(|spoke| spoke.1 > 0.0).map(|&(end, _)| (end, 1.0 / 6.0));
                let point = [(vertex, 4.0 / 6.0)].into_iter().chain(ends).collect();
                Some(Self { point, tangents: None })
            }
            // A crease that ends here changes the rules of its own points.
            Rule::Smooth if spokes.iter().any(|spoke| spoke.1 > 0.0) => None,
            Rule::Smooth => Some(smooth(cage, vertex, &fan)),
        }
    }
}

/// The limit of a smooth vertex with its corners.
fn smooth(cage: &Cage, vertex: u32, fan: &[u32]) -> Limit {
    let n = fan.len() as f64;
    let whole = n * (n + 5.0);
    let mut point = vec![(vertex, n * n / whole)];
    let (mut cosines, mut sines) = (Row::new(), Row::new());
    let theta = TAU / n;
    let a = 1.0 + libm::cos(theta) + libm::cos(theta * 0.5) * (18.0 + 2.0 * libm::cos(theta)).sqrt();
    for (i, &corner) in fan.iter().enumerate() {
        // The fan turns to the right, from the edge behind each corner to the one before it.
        let (end, far) = (cage.vertex(cage.next(corner)), cage.vertex(cage.next(cage.next(corner))));
        point.extend([(end, 4.0 / whole), (far, 1.0 / whole)]);
        let (here, next) = (libm::sincos(i as f64 * theta), libm::sincos((i as f64 + 1.0) * theta));
        cosines.extend([(end, a * here.1), (far, here.1 + next.1)]);
        sines.extend([(end, a * here.0), (far, here.0 + next.0)]);
    }
    Limit { point, tangents: Some([cosines, sines]) }
}
