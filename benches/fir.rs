//! FIR least squares: rows per second at several numbers of taps.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use gpi_core::excitation::{Drive, Lines, multisine};
use gpi_core::linear::estimate;
use gpi_core::{Channel, Experiment, Matrix, Record};

fn record(samples: usize) -> Record {
    let drive = Drive { samples, rate: 1000.0, range: (-1.0, 1.0), slew: None };
    let u = multisine(&drive, (0.5, 450.0), Lines::All, 1).expect("the drive is valid");
    let mut state = 0.0;
    let filtered = u.iter().map(|value| {
        state = 0.9 * state + value;
        state
    });
    let output = Matrix::from_iterator(samples, 1, filtered);
    let input = Matrix::from_column_slice(samples, 1, &u);
    let run = Experiment {
        input,
        output,
        covariates: Matrix::zeros(samples, 0),
        warmup: 0,
        held_out: vec![],
    };
    let channel = |name: &str| vec![Channel::new(name, "")];
    Record::new(vec![run], 1000.0, channel("u"), channel("y"), vec![]).expect("the record is valid")
}

fn fir(criterion: &mut Criterion) {
    let samples = 20_000;
    let record = record(samples);
    let mut group = criterion.benchmark_group("fir");
    group.throughput(Throughput::Elements(samples as u64));
    group.sample_size(10);
    for taps in [31, 301] {
        group.bench_function(BenchmarkId::from_parameter(taps), |bencher| {
            bencher.iter(|| estimate(&record, taps, 0.0));
        });
    }
    group.finish();
}

criterion_group!(benches, fir);
criterion_main!(benches);
