//! What engines find, and how two answers are compared.

/// The id that stands for a miss, as umbel has it.
pub(crate) const MISS: u32 = umbel::NO_TRIANGLE;

/// Two distances agree within this part of umbel's.
const T_TOLERANCE: f64 = 1e-4;

/// What an engine finds for all rays of a subject.
pub(crate) trait Answer: Clone {
    /// How far another answer agrees with this one, which is umbel's. Without rays, all agree.
    fn agreement(&self, other: &Self) -> Vec<Share>;
}

/// A share of the rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Share {
    /// In tables, in percent.
    pub(crate) heading: &'static str,
    /// In JSON.
    pub(crate) key: &'static str,
    /// From 0 to 1.
    pub(crate) of_all: f64,
}

impl Share {
    /// The share of the pairs that are equal.
    fn new<T>(
        [heading, key]: [&'static str; 2],
        pairs: (&[T], &[T]),
        equal: impl Fn(&T, &T) -> bool,
    ) -> Self {
        let count = pairs.0.iter().zip(pairs.1).filter(|(umbel, other)| equal(umbel, other)).count();
        let of_all = if pairs.0.is_empty() { 1.0 } else { count as f64 / pairs.0.len() as f64 };
        Self { heading, key, of_all }
    }
}

/// An id and a distance per ray: [`MISS`] and +∞ where nothing is hit.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Hits {
    pub(crate) ids: Vec<u32>,
    /// In units of the ray's direction.
    pub(crate) ts: Vec<f32>,
}

impl Hits {
    /// Misses only.
    pub(crate) fn missed(rays: usize) -> Self {
        Self { ids: vec![MISS; rays], ts: vec![f32::INFINITY; rays] }
    }
}

impl Answer for Hits {
    /// Rays with the same id: where surfaces coincide, several are right. Rays that both miss, or both hit at the same t
    /// within 1e-4 of it.
    fn agreement(&self, other: &Self) -> Vec<Share> {
        let ids = Share::new(["ids eq %", "ids_equal"], (&self.ids, &other.ids), u32::eq);
        let ts = Share::new(["t eq %", "ts_equal"], (&self.ts, &other.ts), |&umbel, &other| {
            same_distance(umbel, other)
        });
        vec![ids, ts]
    }
}

/// Whether each receiver is in shadow.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Blocked(pub(crate) Vec<bool>);

impl Answer for Blocked {
    fn agreement(&self, other: &Self) -> Vec<Share> {
        vec![Share::new(["flags eq %", "flags_equal"], (&self.0, &other.0), bool::eq)]
    }
}

/// Which rays of many receivers are open: a bit for each, of which those above the horizon count.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct OpenBits {
    pub(crate) words: Vec<u32>,
    /// How many count.
    pub(crate) rays: usize,
}

impl OpenBits {
    /// How many of the bits that differ are set here, and how many there.
    pub(crate) fn differences(&self, other: &Self) -> [u64; 2] {
        let pairs = self.words.iter().zip(&other.words);
        let counts = pairs.map(|(&a, &b)| [a & !b, b & !a].map(|bits| u64::from(bits.count_ones())));
        counts.fold([0; 2], |sum, counts| [sum[0] + counts[0], sum[1] + counts[1]])
    }
}

impl Answer for OpenBits {
    /// Rays with umbel's answer; those that only the other has as blocked, and those that it alone has as open.
    fn agreement(&self, other: &Self) -> Vec<Share> {
        let [blocked, open] = self.differences(other).map(|rays| rays as f64 / self.rays.max(1) as f64);
        vec![
            Share { heading: "rays eq %", key: "rays_equal", of_all: 1.0 - blocked - open },
            Share { heading: "blocks %", key: "it_alone_blocks", of_all: blocked },
            Share { heading: "opens %", key: "it_alone_opens", of_all: open },
        ]
    }
}

/// Whether two distances agree; misses are infinite.
fn same_distance(umbel: f32, other: f32) -> bool {
    let (umbel, other) = (f64::from(umbel), f64::from(other));
    umbel == other || (umbel - other).abs() <= T_TOLERANCE * umbel.abs() && umbel.is_finite()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agreement_counts_ids_and_distances_apart() {
        let umbel = Hits { ids: vec![0, 1, MISS, MISS], ts: vec![1.0, 2.0, f32::INFINITY, f32::INFINITY] };
        let other = Hits { ids: vec![7, 1, MISS, 3], ts: vec![1.00001, 2.1, f32::INFINITY, 5.0] };
        let shares = umbel.agreement(&other);
        assert_eq!(shares.iter().map(|share| share.of_all).collect::<Vec<_>>(), [0.5, 0.5]);
    }

    #[test]
    fn differences_have_two_sides() {
        let bits = |words: [u32; 2]| OpenBits { words: words.to_vec(), rays: 8 };
        let shares = bits([0b1100, 1]).agreement(&bits([0b1010, 0]));
        assert_eq!(shares.iter().map(|share| share.of_all).collect::<Vec<_>>(), [0.625, 0.25, 0.125]);
    }

    #[test]
    fn without_rays_all_agree() {
        assert_eq!(Blocked(Vec::new()).agreement(&Blocked(Vec::new()))[0].of_all, 1.0);
    }
}
