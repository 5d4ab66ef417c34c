//! The fastest method for a long record, selected by the number of plays and by how often z reverses.

use super::lanes;
use super::ranked::Ranked;
use super::turning_points::TurningPoints;
use crate::operators::IN_CACHE;
use pulp::Simd;

/// Fewest samples for which sorting the bank takes less time than it saves.
const FEWEST: usize = 256;

/// The turning-point method is used for more plays than this per SIMD lane even if z reverses often.
const FEW_A_LANE: usize = 32;

/// Samples at the start of a block from which the rate of reversals is estimated.
const PROBE: usize = 128;

/// A signal reverses often if it has more than one reversal per this number of samples, as noise has.
const OFTEN: usize = 8;

/// The outputs of a bank of plays for a long record, from `input` or in place; updates `places`, the plays' outputs.
///
/// The outputs equal those of the definition up to rounding. Blocks with values that are not finite use the definition.
pub(crate) fn run(
    (half_widths, weights): (&[f64], &[f64]),
    places: &mut [f64],
    input: Option<&[f64]>,
    signal: &mut [f64],
) {
    pulp::Arch::new().dispatch(Bank { half_widths, weights, places, input, signal });
}

/// Whether a signal is long enough for [`run`] to be the faster choice.
pub(crate) fn pays(plays: usize, samples: usize) -> bool {
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
    /// From the turning points.
    Turns,
    /// Segments of time in parallel.
    Lanes,
    /// By the definition, one play after the other.
    OneByOne,
}

/// The method for a block: if z reverses often, few plays are computed faster one by one than from turning points.
fn way(input: &[f64], are_few: bool) -> Way {
    // a count vectorizes, a search for the first one does not
    if input.iter().filter(|z| !z.is_finite()).count() > 0 {
        return Way::OneByOne;
    }
    let probe = &input[..input.len().min(PROBE)];
    let turns = probe.windows(3).filter(|z| (z[1] - z[0]) * (z[2] - z[1]) < 0.0).count();
    if turns * OFTEN > probe.len() && are_few { Way::Lanes } else { Way::Turns }
}
