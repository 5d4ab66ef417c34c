//! Windows of all lengths at the cost of one: sums of 1, 2, 4, 8, .. blocks.
//!
//! Two successive sums of a level are merged into one of the next, as a binary counter carries. A block therefore costs two
//! merges on average, and the memory grows with the logarithm of the longest window. A change that lasts is covered by two
//! successive sums of a level within three times the length of these sums.

/// Sums that can be merged with those of the following window.
pub trait Merge: Clone {
    /// The sums of both windows.
    #[must_use]
    fn merged(&self, later: &Self) -> Self;
}

/// The latest sums of windows of `2^level` blocks, for `LEVELS` levels.
#[derive(Clone, Debug, PartialEq)]
pub struct Windows<M, const LEVELS: usize> {
    /// Of each level the last sum.
    last: [Option<M>; LEVELS],
    blocks: u64,
}

impl<M: Merge, const LEVELS: usize> Default for Windows<M, LEVELS> {
    fn default() -> Self {
        Self { last: [const { None }; LEVELS], blocks: 0 }
    }
}

impl<M: Merge, const LEVELS: usize> Windows<M, LEVELS> {
    /// Number of blocks so far.
    pub fn blocks(&self) -> u64 {
        self.blocks
    }

    /// Counts one block. `pair` is called with the level and the two latest sums of every level of which a sum is complete,
    /// the earlier sum first.
    pub fn push(&mut self, block: M, mut pair: impl FnMut(usize, &M, &M)) {
        self.blocks += 1;
        let mut sum = block;
        for (level, last) in self.last.iter_mut().enumerate() {
            let number = self.blocks >> level;
            let earlier = last.replace(sum);
            let (Some(earlier), Some(later)) = (earlier, last.as_ref()) else { return };
            pair(level, &earlier, later);
            // an odd sum waits for the next one
            if number % 2 == 1 {
                return;
            }
            sum = earlier.merged(later);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// First block and number of blocks.
    impl Merge for (u32, u32) {
        fn merged(&self, later: &Self) -> Self {
            assert_eq!(self.0 + self.1, later.0, "neighbours only");
            (self.0, self.1 + later.1)
        }
    }

    #[test]
    fn every_pair_of_neighbours_is_seen_once() {
        let mut windows = Windows::<(u32, u32), 4>::default();
        let mut seen = Vec::new();
        for block in 0..32 {
            windows.push((block, 1), |level, earlier, later| {
                assert_eq!((earlier.1, later.1), (1 << level, 1 << level));
                assert_eq!(earlier.0 + earlier.1, later.0);
                assert_eq!(later.0 + later.1, block + 1);
                seen.push((level, later.0 >> level));
            });
        }
        for (level, count) in [(0, 31), (1, 15), (2, 7), (3, 3)] {
            let own: Vec<u32> = seen.iter().filter(|one| one.0 == level).map(|one| one.1).collect();
            assert_eq!(own, (1..=count).collect::<Vec<u32>>());
        }
        assert_eq!(windows.blocks(), 32);
    }
}
