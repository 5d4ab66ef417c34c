//! The tests of one output.

use super::history::History;
use super::moved::Watched;
use super::settings::MonitorSettings;
use crate::Error;
use crate::operators::{Agreed, Limits, Moments, ResidualMonitor, Windows};

/// Levels of windows: more blocks than any stream has.
const LEVELS: usize = 40;

/// The strongest alarm so far: what two windows agree upon, and the block at which the later one ends.
#[derive(Clone, Copy, Debug)]
struct Alarm {
    agreed: Agreed,
    until: usize,
}

/// The tests of one output.
#[derive(Clone, Debug)]
pub(super) struct Watch {
    monitor: ResidualMonitor<Vec<f64>, LEVELS>,
    windows: Windows<Moments<Vec<f64>>, LEVELS>,
    history: History,
    empty: Moments<Vec<f64>>,
    block: Moments<Vec<f64>>,
    /// Whether the start is forgotten in this block, and whether it was in any.
    is_settled: bool,
    has_settled: bool,
    blocks: usize,
    noise: f64,
    count: usize,
    /// The strongest alarm that names each change, and that about the noise.
    alarms: Vec<Option<Alarm>>,
    about_noise: Option<Alarm>,
}

/// What has changed, in blocks and in the parts or units of the regressors.
pub(super) struct Found {
    pub watched: Watched,
    pub size: f64,
    pub std: f64,
    pub onset: usize,
    pub confidence: f64,
    pub instead: Vec<Watched>,
}

impl Watch {
    /// For `count` possible changes and as many draws of the error, with these limits.
    pub(super) fn new(
        limits: Limits<f64>,
        count: usize,
        draws: usize,
        settings: &MonitorSettings,
    ) -> Result<Self, Error> {
        let products = vec![0.0; Moments::<Vec<f64>>::length(count, draws)];
        let noise = limits.noise;
        let monitor = ResidualMonitor::new(limits, &products, count, 1)?;
        let empty = Moments::like(&products);
        Ok(Self {
            monitor,
            windows: Windows::default(),
            history: History::new(&empty, settings.history),
            block: empty.clone(),
            empty,
            is_settled: true,
            has_settled: false,
            blocks: 0,
            noise,
            count,
            alarms: vec![None; count],
            about_noise: None,
        })
    }

    /// Counts one sample with the draws of its error; one that is not finite is left out. `start` is the square of the error
    /// that the unknown start makes possible, and `known` that of all others.
    #[inline]
    pub(super) fn add(
        &mut self,
        (regressors, draws): (&[f64], &[f64]),
        residual: f64,
        known: f64,
        start: f64,
    ) {
        if residual.is_finite() {
            self.block.add(regressors, draws, residual, known + start);
            self.is_settled &= start <= known + self.noise * self.noise;
        }
    }

    /// Ends a block and tests all windows that end here.
    pub(super) fn end_block(&mut self) {
        let block = std::mem::replace(&mut self.block, self.empty.clone());
        // until the start is forgotten, residuals say little of onsets and sizes
        if self.is_settled && !self.has_settled {
            self.history.forget();
        }
        self.has_settled |= self.is_settled;
        let says_more = self.is_settled || !self.has_settled;
        self.history.push(if says_more { &block } else { &self.empty });
        self.is_settled = true;
        self.blocks += 1;
        let most = self.monitor.push(&mut self.windows, block);
        let Some(agreed) = most else { return };
        let noise = (agreed.noise != 0).then_some(&mut self.about_noise);
        let changes = self.alarms.iter_mut().enumerate().filter(|(i, _)| agreed.has(*i));
        for alarm in changes.map(|(_, alarm)| alarm).chain(noise) {
            if alarm.is_none_or(|alarm| agreed.evidence > alarm.agreed.evidence) {
                *alarm = Some(Alarm { agreed, until: self.blocks });
            }
        }
    }

    /// Whether a change was noticed.
    pub(super) fn has_changed(&self) -> bool {
        self.alarms.iter().chain([&self.about_noise]).any(Option::is_some)
    }

    /// The changes of the strongest alarm, those that were noticed before these began, and the block at which the alarm ends.
    ///
    /// What an alarm names besides at an earlier time may be one of these changes, which was not yet told from another.
    fn changes(&self) -> (Vec<usize>, usize) {
        let evidence = |alarm: &Alarm| alarm.agreed.evidence;
        let alarms = self.alarms.iter().flatten();
        let strongest = alarms.max_by(|a, b| evidence(a).total_cmp(&evidence(b)));
        let Some(Alarm { agreed, until }) = strongest else { return (Vec::new(), 0) };
        let set: Vec<usize> = (0..self.count).filter(|&i| agreed.has(i)).collect();
        let sized = self.history.sized(&set, *until, self.count, self.noise);
        let began = sized.iter().map(|own| own.onset).min().unwrap_or(0);
        let is_there =
            |i: usize| set.contains(&i) || self.alarms[i].is_some_and(|alarm| alarm.until <= began);
        ((0..self.count).filter(|&i| is_there(i)).collect(), *until)
    }

    /// The changes of the strongest alarms, those of `watched` (in the order of the regressors) and of the noise.
    pub(super) fn found(&self, watched: &[Watched]) -> Vec<Found> {
        let (set, until) = self.changes();
        let sized = self.history.sized(&set, until, self.count, self.noise);
        let mut found: Vec<Found> = (set.iter().zip(sized))
            .map(|(&i, own)| Found {
                watched: watched[i].clone(),
                size: own.size,
                std: own.std,
                onset: own.onset,
                confidence: own.confidence,
                instead: own.instead.iter().map(|&i| watched[i].clone()).collect(),
            })
            .collect();
        // what large changes leave looks like noise
        let began = found.iter().map(|own| own.onset).min();
        let is_before = |alarm: &Alarm| began.is_none_or(|began| alarm.until <= began);
        if let Some(alarm) = self.about_noise.filter(is_before) {
            let (onset, noise) = self.history.noise(alarm.until, self.count);
            let (size, std) = (noise / self.noise - 1.0, f64::NAN);
            let (watched, confidence, instead) = (Watched::Noise, 1.0, Vec::new());
            found.push(Found { watched, size, std, onset, confidence, instead });
        }
        found
    }
}
