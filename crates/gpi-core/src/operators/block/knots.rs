//! The rank of a number among sorted numbers, at a cost that does not grow with their count.

/// Buckets for each number: most buckets then hold at most one.
const SPARSE: usize = 4;

/// 2^52: adding it to a number between 0 and 2^31 leaves the nearest integer in the last digits of the sum.
const INTEGER: f64 = 4_503_599_627_370_496.0;

/// Sorted numbers, divided among buckets of equal width.
pub(super) struct Knots {
    values: Vec<f64>,
    buckets: Vec<Bucket>,
    lowest: f64,
    scale: f64,
    /// The last bucket.
    last: f64,
}

/// The numbers in one part of the range.
#[derive(Clone, Copy)]
struct Bucket {
    /// Infinite if the bucket is empty.
    first: f64,
    /// The count of numbers in earlier buckets.
    before: u32,
    count: u32,
}

impl Knots {
    /// The buckets of finite numbers in ascending order.
    pub(super) fn new(values: Vec<f64>) -> Self {
        let (lowest, highest) = match &values[..] {
            [lowest, .., highest] => (*lowest, *highest),
            _ => (0.0, 0.0),
        };
        let last = SPARSE * values.len();
        let scale = last as f64 / (highest - lowest);
        let scale = if scale.is_finite() { scale } else { 0.0 };
        let empty = Bucket { first: f64::INFINITY, before: 0, count: 0 };
        let mut knots =
            Self { values, buckets: vec![empty; last + 1], lowest, scale, last: last as f64 };
        for i in 0..knots.values.len() {
            let (value, bucket) = (knots.values[i], knots.bucket(knots.values[i]));
            let bucket = &mut knots.buckets[bucket];
            bucket.first = bucket.first.min(value);
            bucket.count += 1;
        }
        let mut before = 0;
        for bucket in &mut knots.buckets {
            bucket.before = before;
            before += bucket.count;
        }
        knots
    }

    /// For each bucket: its smallest number or infinity, the count in earlier buckets, and its own count.
    pub(super) fn buckets(&self) -> impl Iterator<Item = (f64, usize, usize)> {
        let parts = |bucket: &Bucket| (bucket.first, bucket.before as usize, bucket.count as usize);
        self.buckets.iter().map(parts)
    }

    /// The bucket of a number that is not NaN. All numbers in earlier buckets are smaller.
    #[inline(always)]
    pub(super) fn bucket(&self, x: f64) -> usize {
        let place = (x - self.lowest) * self.scale;
        let place = if place > 0.0 { place } else { 0.0 };
        let place = if place < self.last { place } else { self.last };
        (place + INTEGER).to_bits() as u32 as usize
    }

    /// The count of numbers at or below x.
    #[inline(always)]
    pub(super) fn at_most(&self, x: f64) -> usize {
        let Bucket { first, before, count } = self.buckets[self.bucket(x)];
        let before = before as usize;
        if count <= 1 {
            return before + usize::from(first <= x);
        }
        let own = &self.values[before..before + count as usize];
        before + own.partition_point(|&value| value <= x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_also_where_numbers_crowd() {
        let crowded = (0..100).map(|i| 1e-3 * f64::from(i));
        let mut values: Vec<f64> = crowded.chain([-3.0, 0.0, 0.05, 5.0, 1e3]).collect();
        values.sort_by(f64::total_cmp);
        let knots = Knots::new(values.clone());
        for x in values.iter().flat_map(|&x| [x - 0.1, 0.999 * x, x, 1.001 * x, x + 0.1]) {
            assert_eq!(knots.at_most(x), values.iter().filter(|v| **v <= x).count(), "{x}");
        }
        assert_eq!(Knots::new(vec![0.0, 0.0]).at_most(0.0), 2);
        assert_eq!(Knots::new(vec![2.0]).at_most(1.0), 0);
        assert_eq!(Knots::new(vec![]).at_most(1.0), 0);
    }
}
