//! Joint refinement of a long record: seconds, and how much memory it takes beyond the record's own.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use gpi_core::excitation::{Drive, Lines, multisine};
use gpi_core::identify::{RefineOptions, refine};
use gpi_core::linear::TransferFunction;
use gpi_core::operators::{Deadzones, Gpi, PlayBank, Reading};
use gpi_core::{Channel, Experiment, Matrix, Model, Record};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Counts what is allocated, so that the peak can be told.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is handed on to the system's allocator unchanged; the counters allocate nothing.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        PEAK.fetch_max(now, Ordering::Relaxed);
        // SAFETY: the caller's promises are those that the system's allocator asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const SAMPLES: usize = 120_000;
const PLAYS: usize = 12;

/// Order 4, 12 plays, 3 deadzones; `change` is a relative error of every parameter.
fn model(change: f64) -> Model {
    let off = |index: usize| 1.0 + change * (1.7 * index as f64).sin();
    let denominator = [1.0, -2.4 * off(0).powf(0.1), 2.23, -0.99, 0.18];
    let gain = denominator.iter().sum::<f64>();
    let numerator = [0.0, 0.5 * gain, 0.3 * gain, 0.2 * gain];
    let linear = TransferFunction::new(&numerator, &denominator)
        .and_then(|g| g.to_state_space())
        .expect("the transfer function is proper");
    let half_widths: Vec<f64> = (0..PLAYS).map(|i| 4.0 * i as f64).collect();
    let weights = (0..PLAYS).map(|i| off(i) / (1.0 + i as f64)).collect();
    let thresholds = vec![0.0, 20.0, 50.0, 80.0];
    let slopes = vec![1.0, -0.1 * off(20), 0.15 * off(21), -0.2 * off(22)];
    let envelope = Deadzones::new(thresholds, slopes, Reading::OneSided);
    let plays = PlayBank::new(half_widths, weights);
    let gpi = Gpi::new(envelope.expect("equal lengths"), plays.expect("positive half-widths"));
    let channel = |name: &str| vec![Channel::new(name, "")];
    Model::new(4000.0, channel("u"), channel("y"), vec![gpi], linear, vec![0.0])
        .expect("one channel everywhere")
}

fn record() -> Record {
    let drive = Drive { samples: SAMPLES, rate: 4000.0, range: (0.0, 100.0), slew: None };
    let u = multisine(&drive, (0.2, 400.0), Lines::All, 1).expect("the drive is valid");
    let mut input = Matrix::from_column_slice(SAMPLES, 1, &u);
    input.rows_mut(0, 100).fill(0.0);
    let mut output = model(0.0).simulate(&input).expect("one channel");
    for (k, value) in output.iter_mut().enumerate() {
        *value += 0.05 * (k as f64 * (1.0 + k as f64 * 1e-3)).sin();
    }
    let run = Experiment {
        input,
        output,
        covariates: Matrix::zeros(SAMPLES, 0),
        warmup: 0,
        held_out: vec![],
    };
    let channel = |name: &str| vec![Channel::new(name, "")];
    Record::new(vec![run], 4000.0, channel("u"), channel("y"), vec![]).expect("the record is valid")
}

fn refinement(criterion: &mut Criterion) {
    let (record, start) = (record(), model(0.05));
    let options = RefineOptions::default();
    let run = || refine(&start, &record, &options, &mut |_| true).expect("the model is stable");
    PEAK.store(NOW.load(Ordering::Relaxed), Ordering::Relaxed);
    let before = NOW.load(Ordering::Relaxed);
    let (_, how) = run();
    let own = (2 * 8 * SAMPLES) as f64;
    let peak = (PEAK.load(Ordering::Relaxed) - before) as f64 / own;
    println!(
        "refine: {} (outliers {}) after {} steps, rms {:.3e} to {:.3e}; peak memory beyond the record {peak:.2} times its own",
        how.status.name(),
        how.outliers,
        how.history.len() - 1,
        how.history[0],
        how.history[how.history.len() - 1]
    );
    let mut group = criterion.benchmark_group("refine");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    group.sample_size(10);
    group.bench_function("120000 samples, 12 plays, 3 deadzones, order 4", |b| b.iter(run));
    group.finish();
}

criterion_group!(benches, refinement);
criterion_main!(benches);
