//! ERA: a realization at several sizes of the Hankel matrix.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use gpi_core::linear::{EraOptions, TransferFunction, realize};

fn era(criterion: &mut Criterion) {
    let system = TransferFunction::new(&[1.0, 0.3], &[1.0, -1.9, 0.95])
        .expect("proper")
        .to_state_space()
        .expect("finite");
    let mut group = criterion.benchmark_group("era");
    group.sample_size(10);
    for blocks in [15, 50, 150, 300] {
        let markov = system.markov(2 * blocks + 1);
        let options = EraOptions { order: Some(2), blocks: Some(blocks) };
        group.bench_function(BenchmarkId::from_parameter(blocks), |bencher| {
            bencher.iter(|| realize(&markov, &options));
        });
    }
    group.finish();
}

criterion_group!(benches, era);
criterion_main!(benches);
