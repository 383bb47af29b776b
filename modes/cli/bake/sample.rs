//! A seeded sample of what is baked, on which errors are estimated.
//!
//! Vertices, points and texels are taken with all their receivers, so that their values are those of the whole bake: a value
//! depends on its receiver and its number alone.

use umbel::bake::BakeReceivers;
use umbel::measure::sample_key;

use crate::bake::source::Source;

/// Some of the vertices, points or texels, in random order.
pub(crate) struct Sample {
    pub(crate) items: Vec<BakeReceivers>,
    /// How many there are in all.
    pub(crate) population: usize,
}

impl Sample {
    /// At most `count`, chosen by a seed; the source is passed over once, in pieces.
    pub(crate) fn new(source: &Source<'_>, piece: usize, count: usize, seed: u64) -> Self {
        let (mut kept, mut population) = (Vec::new(), 0);
        let mut bound = u64::MAX;
        for first in (0..source.units()).step_by(piece) {
            let (receivers, _) = source.piece(first, source.units().min(first + piece));
            let mut place = 0;
            for of_item in receivers.indices.chunk_by(|one, other| one == other) {
                let places = place..place + of_item.len();
                place = places.end;
                population += 1;
                let key = sample_key(seed, u64::from(of_item[0]));
                if key <= bound {
                    kept.push((key, receivers.slice(places)));
                }
            }
            kept.sort_by_key(|(key, item): &(u64, BakeReceivers)| (*key, item.indices[0]));
            kept.truncate(count);
            if kept.len() == count {
                bound = kept.last().map_or(u64::MAX, |(key, _)| *key);
            }
        }
        Self { items: kept.into_iter().map(|(_, item)| item).collect(), population }
    }

    /// Their receivers, in one list.
    pub(crate) fn receivers(&self) -> BakeReceivers {
        let mut all = BakeReceivers::default();
        self.items.iter().for_each(|item| all.append(item));
        all
    }
}

/// The value of each item: the mean of its receivers' values.
pub(crate) fn item_values(receivers: &BakeReceivers, values: &[f32]) -> Vec<f64> {
    let mut values = values.iter();
    let of_item = |of_item: &[u32]| {
        let sum: f64 = values.by_ref().take(of_item.len()).map(|&value| f64::from(value)).sum();
        sum / of_item.len() as f64
    };
    receivers.indices.chunk_by(|one, other| one == other).map(of_item).collect()
}
