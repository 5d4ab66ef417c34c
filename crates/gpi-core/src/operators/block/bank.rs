//! The fastest way through a long record: chosen by how z moves and how many plays there are.

use super::lanes;
use super::ranked::Ranked;
use super::turning_points::TurningPoints;
use crate::operators::play;
use pulp::Simd;

/// Samples for which a way is chosen; they stay in the processor's second cache.
const BLOCK: usize = 32_768;

/// Outputs of a bank of plays in place of its inputs, long ones; `places` move on.
///
/// The same as sample by sample up to rounding. What is not finite goes that way.
pub(crate) fn in_place(
    half_widths: &[f64],
    weights: &[f64],
    places: &mut [f64],
    signal: &mut [f64],
) {
    pulp::Arch::new().dispatch(Bank { half_widths, weights, places, signal });
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
    signal: &'a mut [f64],
}

impl pulp::WithSimd for Bank<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { half_widths, weights, places, signal } = self;
        let ranked = Ranked::new(half_widths, weights);
        let mut input = vec![0.0; BLOCK.min(signal.len())];
        let mut held: Option<TurningPoints> = None;
        for block in signal.chunks_mut(BLOCK) {
            let input = &mut input[..block.len()];
            input.copy_from_slice(block);
            let way = way(input, places.len());
            if way == Way::Turns && held.is_none() {
                held = TurningPoints::new(&ranked, weights, places, input[0]);
            }
            if let (Way::Turns, Some(held)) = (way, &mut held) {
                held.run(simd, input, block);
                continue;
            }
            if let Some(held) = held.take() {
                held.write_places(places);
            }
            let is_done =
                way == Way::Lanes && lanes::run(simd, half_widths, weights, places, input, block);
            if !is_done {
                one_by_one(half_widths, weights, places, input, block);
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

/// Where z often turns, few plays are followed faster one by one than by their turning points.
fn way(input: &[f64], plays: usize) -> Way {
    /// Of a block that tell how it goes on.
    const PROBE: usize = 128;
    /// Plays up to which noise is followed one by one.
    const FEW: usize = 40;
    /// Samples for each reversal of noise.
    const OFTEN: usize = 8;
    if !input.iter().all(|z| z.is_finite()) {
        return Way::OneByOne;
    }
    let probe = &input[..input.len().min(PROBE)];
    let turns = probe.windows(3).filter(|z| (z[1] - z[0]) * (z[2] - z[1]) < 0.0).count();
    if turns * OFTEN > probe.len() && plays <= FEW { Way::Lanes } else { Way::Turns }
}

/// Each sample by the definition.
fn one_by_one(
    half_widths: &[f64],
    weights: &[f64],
    places: &mut [f64],
    input: &[f64],
    output: &mut [f64],
) {
    for (z, v) in input.iter().zip(output) {
        *v = 0.0;
        for ((place, &r), weight) in places.iter_mut().zip(half_widths).zip(weights) {
            *place = play(r, *z, *place);
            *v += weight * *place;
        }
    }
}
