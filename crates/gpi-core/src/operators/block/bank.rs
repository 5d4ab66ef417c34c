//! The fastest way through a long record: chosen by how z moves and how many plays there are.

use super::lanes;
use super::ranked::Ranked;
use super::turning_points::TurningPoints;
use crate::operators::IN_CACHE;
use pulp::Simd;

/// Outputs of a bank of plays, long ones, of `input` or in place of their inputs; `places` move on.
///
/// The same as sample by sample up to rounding. What is not finite goes that way.
pub(crate) fn run(
    (half_widths, weights): (&[f64], &[f64]),
    places: &mut [f64],
    input: Option<&[f64]>,
    signal: &mut [f64],
) {
    pulp::Arch::new().dispatch(Bank { half_widths, weights, places, input, signal });
}

/// Whether a signal is long enough for it to pay that the bank is put in order first.
pub(crate) fn pays(plays: usize, samples: usize) -> bool {
    const FEWEST: usize = 256;
    plays > 1 && samples >= FEWEST.max(4 * plays)
}

struct Bank<'a> {
    half_widths: &'a [f64],
    weights: &'a [f64],
    places: &'a mut [f64],
    input: Option<&'a [f64]>,
    signal: &'a mut [f64],
}

impl pulp::WithSimd for Bank<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { half_widths, weights, places, input, signal } = self;
        let ranked = Ranked::new(half_widths, weights);
        let mut copy = Vec::new();
        let mut held: Option<TurningPoints> = None;
        for (index, block) in signal.chunks_mut(IN_CACHE).enumerate() {
            let given = input.map(|input| &input[index * IN_CACHE..][..block.len()]);
            let way = way(given.unwrap_or(block), places.len() <= FEW_A_LANE * S::F64_LANES);
            if way == Way::Turns {
                let input = given.unwrap_or_else(|| {
                    copy.clear();
                    copy.extend_from_slice(block);
                    &copy
                });
                if held.is_none() {
                    held = TurningPoints::new(&ranked, weights, places, input[0]);
                }
                if let Some(held) = &mut held {
                    held.run(simd, input, block);
                    continue;
                }
            }
            if let Some(given) = given {
                block.copy_from_slice(given);
            }
            if let Some(held) = held.take() {
                held.write_places(places);
            }
            let is_done = way == Way::Lanes
                && lanes::run(simd, &ranked, (half_widths, weights), places, block);
            if !is_done {
                lanes::one_by_one(half_widths, weights, places, block);
            }
        }
        if let Some(held) = held {
            held.write_places(places);
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Way {
    /// By turning points.
    Turns,
    /// Stretches of time side by side.
    Lanes,
    /// Play by play.
    OneByOne,
}

/// Plays for each number that a vector holds up to which noise is followed one by one.
const FEW_A_LANE: usize = 32;

/// Where z often turns, few plays are followed faster one by one than by their turning points.
fn way(input: &[f64], are_few: bool) -> Way {
    /// Of a block that tell how it goes on.
    const PROBE: usize = 128;
    /// Samples for each reversal of noise.
    const OFTEN: usize = 8;
    // counted, since to stop at the first one takes longer than to look at all
    if input.iter().filter(|z| !z.is_finite()).count() > 0 {
        return Way::OneByOne;
    }
    let probe = &input[..input.len().min(PROBE)];
    let turns = probe.windows(3).filter(|z| (z[1] - z[0]) * (z[2] - z[1]) < 0.0).count();
    if turns * OFTEN > probe.len() && are_few { Way::Lanes } else { Way::Turns }
}
