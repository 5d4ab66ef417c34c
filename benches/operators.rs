//! Play banks, deadzones, the cascade and its inverse: samples per second, on smooth input and on noise.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use gpi_core::operators::{Deadzones, Gpi, Operator, PlayBank, Reading};
use std::hint::black_box;

const SAMPLES: usize = 100_000;

fn smooth() -> Vec<f64> {
    (0..SAMPLES)
        .map(|k| (k as f64 * 0.01).sin() * (1.0 + 0.5 * (k as f64 * 0.0007).cos()))
        .collect()
}

/// A linear congruential sequence is random enough to defeat branch prediction.
fn noise() -> Vec<f64> {
    let mut state = 1_u64;
    let mut next = || {
        state =
            state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    (0..SAMPLES).map(|_| next()).collect()
}

fn bank(plays: usize) -> PlayBank<Vec<f64>> {
    let half_widths = (0..plays).map(|i| i as f64 / plays as f64).collect();
    let weights = (0..plays).map(|i| 1.0 / (1.0 + i as f64)).collect();
    PlayBank::new(half_widths, weights).expect("the parameters are valid")
}

fn envelope(zones: usize) -> Deadzones<Vec<f64>> {
    let middle = zones as f64 / 2.0;
    let thresholds = (0..zones).map(|j| (j as f64 - middle) / middle).collect();
    Deadzones::new(thresholds, vec![0.1; zones], Reading::OneSided)
        .expect("the parameters are valid")
}

fn blocks(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("operators");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    let mut output = vec![0.0; SAMPLES];
    for (name, input) in [("smooth", smooth()), ("noise", noise())] {
        group.bench_function(BenchmarkId::new("memcpy", name), |bencher| {
            bencher.iter(|| black_box(&mut output).copy_from_slice(black_box(&input)));
        });
        for plays in [8, 32, 128] {
            let bank = bank(plays);
            group.bench_function(BenchmarkId::new(format!("plays {name}"), plays), |bencher| {
                let mut state = bank.rest();
                bencher.iter(|| bank.block(&mut state, black_box(&input), &mut output));
            });
        }
        for zones in [17, 128] {
            let envelope = envelope(zones);
            group.bench_function(BenchmarkId::new(format!("deadzones {name}"), zones), |bencher| {
                let mut state = envelope.rest();
                bencher.iter(|| envelope.block(&mut state, black_box(&input), &mut output));
            });
        }
    }
    group.finish();
}

/// Records that do not fit into any cache: copying them is all that the memory allows.
fn long(criterion: &mut Criterion) {
    const SAMPLES: usize = 10_000_000;
    let input: Vec<f64> = (0..SAMPLES).map(|k| (k as f64 * 0.006).sin()).collect();
    let mut output = vec![0.0; SAMPLES];
    let mut group = criterion.benchmark_group("long and smooth");
    group.throughput(Throughput::Elements(SAMPLES as u64)).sample_size(10);
    group.bench_function("memcpy", |bencher| {
        bencher.iter(|| black_box(&mut output).copy_from_slice(black_box(&input)));
    });
    for plays in [8, 32] {
        let bank = bank(plays);
        group.bench_function(BenchmarkId::new("plays", plays), |bencher| {
            let mut state = bank.rest();
            bencher.iter(|| bank.block(&mut state, black_box(&input), &mut output));
        });
    }
    group.finish();
}

/// The inverse next to what it undoes.
fn inverse(criterion: &mut Criterion) {
    let zones = Deadzones::new(vec![-0.5, 0.0, 0.5], vec![0.2, 1.0, 0.3], Reading::OneSided);
    let gpi = Gpi::new(zones.expect("valid"), bank(32));
    let undo = gpi.inverse().expect("all slopes are positive");
    let mut group = criterion.benchmark_group("cascade");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    let mut output = vec![0.0; SAMPLES];
    for (name, input) in [("smooth", smooth()), ("noise", noise())] {
        group.bench_function(BenchmarkId::new("forward", name), |bencher| {
            let mut state = gpi.rest();
            bencher.iter(|| gpi.block(&mut state, black_box(&input), &mut output));
        });
        group.bench_function(BenchmarkId::new("inverse", name), |bencher| {
            let mut state = undo.rest();
            bencher.iter(|| undo.block(&mut state, black_box(&input), &mut output));
        });
    }
    group.finish();
}

fn streaming(criterion: &mut Criterion) {
    let plays = PlayBank::new([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7], [1.0; 8]);
    let zones = Deadzones::new(
        std::array::from_fn::<_, 17, _>(|j| j as f64 / 8.0 - 1.0),
        [0.1; 17],
        Reading::OneSided,
    );
    let gpi = Gpi::new(zones.expect("valid"), plays.expect("valid"));
    let input = smooth();
    let mut group = criterion.benchmark_group("streaming");
    group.throughput(Throughput::Elements(SAMPLES as u64));
    group.bench_function("8 plays, 17 deadzones", |bencher| {
        let mut state = gpi.rest();
        bencher.iter(|| {
            for &value in &input {
                black_box(gpi.step(&mut state, black_box(value)));
            }
        });
    });
    group.finish();
}

criterion_group!(benches, blocks, long, inverse, streaming);
criterion_main!(benches);
