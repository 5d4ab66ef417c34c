//! Plays and deadzones that come and go.
//!
//! Adding a play of half-width r and weight p adds `p F_r` to v; adding a deadzone of threshold eta and slope g adds
//! `g Z_eta(u)` to z. With p or g zero, the output is unchanged, and only the derivatives by the new values are new.
//! Removing one of weight zero changes nothing either, nor does moving a play of weight zero. Deadzones that are joined
//! change z within a bound that [`Point::drop_unused`] states; a deadzone that is silenced changes the output until the
//! next fit.

use super::bounds::range;
use super::group::Group;
use super::point::Point;
use super::table::Table;
use crate::Record;

impl Point {
    /// The point with one more play, where there is none of its half-width; its initial place is the mean of those of
    /// its neighbours, each as a fraction of its own half-width.
    pub(crate) fn with_play(&self, input: usize, half_width: f64, weight: f64) -> Self {
        let mut point = self.clone();
        let channel = &mut point.channels[input];
        let place = channel.half_widths.partition_point(|&r| r < half_width);
        channel.half_widths.insert(place, half_width);
        channel.weights.insert(place, weight);
        for sides in point.pasts.iter_mut().filter_map(|past| past.plays.as_mut()) {
            let neighbours = [place.checked_sub(1), Some(place)];
            let near: Vec<f64> = neighbours
                .into_iter()
                .flatten()
                .filter_map(|i| sides[input].get(i).copied())
                .collect();
            let side = near.iter().sum::<f64>() / near.len().max(1) as f64;
            sides[input].insert(place, side);
        }
        point
    }

    /// The point with one more deadzone.
    pub(crate) fn with_deadzone(&self, input: usize, threshold: f64, slope: f64) -> Self {
        let mut point = self.clone();
        let channel = &mut point.channels[input];
        let place = channel.thresholds[1..].partition_point(|&eta| eta < threshold) + 1;
        channel.thresholds.insert(place, threshold);
        channel.slopes.insert(place, slope);
        point
    }

    /// The point without plays and deadzones: v is proportional to the drive. The factor is the sum of the plays' weights times
    /// the slope of the envelope from the smallest to the largest input.
    pub(crate) fn without_hysteresis(&self, record: &Record) -> Self {
        let mut point = self.clone();
        for (input, channel) in point.channels.iter_mut().enumerate() {
            let (low, high) = range(record, input);
            let chord = (channel.envelope(low, high) - channel.envelope(high, low)) / (high - low);
            let gain: f64 = channel.weights.iter().sum();
            channel.slopes.fill(0.0);
            channel.weights.fill(0.0);
            (channel.slopes[0], channel.weights[0]) = (chord, gain.max(0.0));
        }
        point.drop_unused();
        point
    }

    /// Drops plays and deadzones without weight and joins deadzones that have come together; says
    /// whether there were any.
    ///
    /// Two deadzones at eta and eta + d, of slopes g and h, become one at eta + d of slope g + h. z changes by at most
    /// `|g| d` beyond them.
    pub(crate) fn drop_unused(&mut self) -> bool {
        /// Thresholds closer than this fraction of their range are one.
        const TOGETHER: f64 = 3e-3;
        let mut dropped = false;
        for (input, channel) in self.channels.iter_mut().enumerate() {
            let bounds = |f: fn(f64, f64) -> f64| channel.thresholds.iter().copied().fold(0.0, f);
            let closest = TOGETHER * (bounds(f64::max) - bounds(f64::min));
            for place in 2..channel.thresholds.len() {
                if channel.thresholds[place] - channel.thresholds[place - 1] < closest {
                    channel.slopes[place] += std::mem::take(&mut channel.slopes[place - 1]);
                }
            }
            let used = |place: &usize, weights: &[f64]| *place == 0 || weights[*place] != 0.0;
            // the second differences of a smooth density need its whole grid
            let is_smooth = channel.prior.weights > 0.0;
            let plays: Vec<usize> = (0..channel.weights.len())
                .filter(|i| is_smooth || used(i, &channel.weights))
                .collect();
            let zones: Vec<usize> =
                (0..channel.slopes.len()).filter(|j| used(j, &channel.slopes)).collect();
            dropped |= plays.len() < channel.weights.len() || zones.len() < channel.slopes.len();
            let keep = |values: &mut Vec<f64>, places: &[usize]| {
                *values = places.iter().map(|&place| values[place]).collect();
            };
            keep(&mut channel.weights, &plays);
            keep(&mut channel.half_widths, &plays);
            keep(&mut channel.slopes, &zones);
            keep(&mut channel.thresholds, &zones);
            for sides in self.pasts.iter_mut().filter_map(|past| past.plays.as_mut()) {
                keep(&mut sides[input], &plays);
            }
        }
        dropped
    }

    /// Puts plays without weight at `sides` from z in turn and, where half-widths may move, spreads
    /// them over the upper half below `limits` (one an input), where plays forget last; returns how
    /// many there are.
    ///
    /// The derivative of v by the start of a play is `p r` ([`super::sensitivity`]), zero with its weight p: a fit
    /// cannot move such a start, so that it is set. The m idle plays get the half-widths
    /// `limit (1/2 + (i + 1/2) / (2 m))`, i = 0 .. m - 1.
    pub(crate) fn put_idle_plays(&mut self, sides: &[f64], limits: Option<&[f64]>) -> usize {
        let mut moved = 0;
        for (input, channel) in self.channels.iter_mut().enumerate() {
            let is_smooth = channel.prior.weights > 0.0;
            let is_idle = |&i: &usize| i > 0 && channel.weights[i] == 0.0 && !is_smooth;
            let idle: Vec<usize> = (0..channel.weights.len()).filter(is_idle).collect();
            moved += idle.len();
            for (number, &play) in idle.iter().enumerate() {
                let place = 0.5 + 0.5 * (number as f64 + 0.5) / idle.len() as f64;
                if let Some(limits) = limits {
                    channel.half_widths[play] = place * limits[input];
                }
            }
            let mut order: Vec<usize> = (0..channel.weights.len()).collect();
            order.sort_by(|&i, &j| channel.half_widths[i].total_cmp(&channel.half_widths[j]));
            let reorder = |values: &mut Vec<f64>| {
                *values = order.iter().map(|&place| values[place]).collect();
            };
            reorder(&mut channel.half_widths);
            reorder(&mut channel.weights);
            for places in self.pasts.iter_mut().filter_map(|past| past.plays.as_mut()) {
                for (&play, &side) in idle.iter().zip(sides.iter().cycle()) {
                    places[input][play] = side;
                }
                reorder(&mut places[input]);
            }
        }
        moved
    }

    /// Takes the weight from the deadzone, the identity apart, that has the largest share in each
    /// direction that the data do not determine; says whether there was one.
    ///
    /// `open` has a list of unknowns with their shares for each direction, of length one in unknowns that are scaled by their
    /// sensitivities ([`Uncertainty::open`](crate::uncertainty::covariance::Uncertainty)). The sign of a share is ignored. The
    /// other unknowns of the direction can take over what the deadzone did; a fit afterwards makes them do so.
    pub(crate) fn silence_deadzones(&mut self, table: &Table, open: &[Vec<(usize, f64)>]) -> bool {
        /// Where it has a smaller share, the direction is about something else.
        const SHARE: f64 = 0.3;
        let mut silenced = false;
        for direction in open {
            let share = |i: &usize| {
                let found = direction.iter().find(|(unknown, _)| unknown == i);
                found.map_or(0.0, |(_, share)| share.abs())
            };
            let zones = (0..self.channels.len()).flat_map(|input| {
                let unknowns = table.range(Group::Slopes { input });
                unknowns.skip(1).zip(1..).map(move |(i, place)| (input, place, i))
            });
            let largest = zones.max_by(|a, b| share(&a.2).total_cmp(&share(&b.2)));
            if let Some((input, place, _)) = largest.filter(|(_, _, i)| share(i) > SHARE) {
                self.channels[input].slopes[place] = 0.0;
                silenced = true;
            }
        }
        silenced
    }
}
