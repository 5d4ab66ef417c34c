/// F(k) = max(z - w, min(z + w, F(k - 1)))
#[inline]
fn play(width: Real, z: Real, place: Real) -> Real {
    let place = if place > z + width { z + width } else { place };
    if place < z - width { z - width } else { place }
}
@one_sided

/// The sum of one-sided deadzones: u - eta beyond a threshold eta, on the side away from zero.
fn one_sided(u: Real, thresholds: &[Real], slopes: &[Real]) -> Real {
    let mut z = 0.0;
    for (threshold, slope) in thresholds.iter().zip(slopes) {
        let beyond = u - threshold;
        let is_inside = (*threshold > 0.0 && beyond < 0.0) || (*threshold < 0.0 && beyond > 0.0);
        z += if is_inside { 0.0 } else { slope * beyond };
    }
    z
}
@end
@directional

/// The sum of directional deadzones: u - eta while u rises above eta, u + eta while u falls below -eta.
fn directional(u: Real, before: Real, thresholds: &[Real], slopes: &[Real]) -> Real {
    let mut z = 0.0;
    for (&threshold, slope) in thresholds.iter().zip(slopes) {
        if u > before && u > threshold {
            z += slope * (u - threshold);
        } else if u < before && u < -threshold {
            z += slope * (u + threshold);
        }
    }
    z
}
@end
@delay

/// The input of `last - 1 + part` samples before.
fn delay(line: &mut [Real], input: Real, last: usize, part: Real) -> Real {
    line.copy_within(..last, 1);
    line[0] = input;
    (1.0 - part) * line[last - 1] + part * line[last]
}
@end
@slew

fn slew(drive: &mut [Real], input: Real, reach: Real) -> Real {
    drive[0] += (input - drive[0]).max(-reach).min(reach);
    drive[0]
}
@end
@bent|bouc_wen|dahl|damping

/// log(1 + x) for x >= 0
fn log_of_one_plus(x: Real) -> Real {
    let (mut m, mut halved) = (1.0 + x, 0_i16);
    while m > 1.5 && halved < 1100 {
        m /= 2.0;
        halved += 1;
    }
    while m < 0.7 && halved > -1100 {
        m *= 2.0;
        halved -= 1;
    }
    let z = if halved != 0 { (m - 1.0) / (m + 1.0) } else { x / (2.0 + x) };
    let mut sum = 0.0;
    for n in (1_i16..28).rev().step_by(2) {
        sum = sum * z * z + 1.0 / Real::from(n);
    }
    Real::from(halved) * $ln_two + 2.0 * z * sum
}

/// exp(x) - 1
fn exp_less_one(x: Real) -> Real {
    let turns = (x / $ln_two) as i16;
    let rest = x - Real::from(turns) * $ln_two;
    let (mut sum, mut scale) = (1.0, 1.0);
    for n in (2_i16..23).rev() {
        sum = 1.0 + sum * rest / Real::from(n);
    }
    for _ in 0..turns.unsigned_abs() {
        scale *= if turns > 0 { 2.0 } else { 0.5 };
    }
    scale * (rest * sum) + (scale - 1.0)
}
@end
@bent

/// The speed behind a lag, and the transformation of Box and Cox of it.
fn bent(seen: &mut [Real], speed: Real, share: Real, exponent: Real, knee: Real) -> Real {
    seen[0] += share * (speed - seen[0]);
    let logarithm = log_of_one_plus(seen[0] / knee);
    knee * if exponent == 0.0 { logarithm } else { exp_less_one(exponent * logarithm) / exponent }
}
@end
@widened

/// The half-width of a play at a speed.
#[inline]
fn widened(width: Real, speed: Real, relative: Real, absolute: Real) -> Real {
    let wide = width * (1.0 + relative * speed) + absolute * speed;
    if width > 0.0 && wide > 0.0 { wide } else { 0.0 }
}
@end
@curved

/// The value of a play as it is read: integrals of Legendre polynomials are added, one for each factor.
fn curved(place: Real, factors: &[Real], degrees: u8, middle: Real, scale: Real) -> Real {
    let f = ((place - middle) / scale).max(-1.0).min(1.0);
    let (mut sum, mut lower, mut own) = (0.0, 1.0, f);
    for (a, factor) in (1..=degrees).zip(factors) {
        let a = Real::from(a);
        let upper = ((2.0 * a + 1.0) * f * own - a * lower) / (a + 1.0);
        sum += factor * (upper - lower) / (2.0 * a + 1.0);
        (lower, own) = (own, upper);
    }
    place + scale * sum
}
@end
@late

/// The value of as many samples before as the line has places.
fn late(line: &mut [Real], value: Real) -> Real {
    line.rotate_right(1);
    core::mem::replace(&mut line[0], value)
}
@end
@section

/// (b1 / q + b2 / q^2) / (1 + a1 / q + a2 / q^2)
fn section(x: &mut [Real], v: Real, a1: Real, a2: Real, b1: Real, b2: Real) -> Real {
    let y = x[0];
    x[0] = x[1] - a1 * y + b1 * v;
    x[1] = b2 * v - a2 * y;
    y
}
@end
@lags

/// First-order lags; the second half of their memory holds rounding errors.
fn lags(memory: &mut [Real], v: Real, shares: &[Real], gains: &[Real]) -> Real {
    let (lags, carried) = memory.split_at_mut(shares.len());
    let mut y = 0.0;
    for ((lag, carried), (share, gain)) in lags.iter_mut().zip(carried).zip(shares.iter().zip(gains)) {
        let wanted = share * (v - *lag) + *carried;
        let there = *lag + wanted;
        y += gain * *lag;
        *carried = wanted - (there - *lag);
        *lag = there;
    }
    y
}
@end
@power

fn power(z: Real, exponent: u32, scale: Real) -> Real {
    (0..exponent).fold(scale, |w, _| w * (z / scale))
}
@end
@excess

fn excess(z: Real, limit: Real, is_lower: i32) -> Real {
    let beyond = z - limit;
    if is_lower != 0 { beyond.min(0.0) } else { beyond.max(0.0) }
}
@end
@stops

fn stops(places: &mut [Real], z: Real, widths: &[Real], weights: &[Real]) -> Real {
    let mut w = 0.0;
    for (place, (width, weight)) in places.iter_mut().zip(widths.iter().zip(weights)) {
        *place = play(*width, z, *place);
        w += weight * (z - *place);
    }
    w
}
@end
@bouc_wen

/// g to a power, for g >= 0.
fn power_of(g: Real, exponent: Real) -> Real {
    if g <= 0.0 {
        0.0
    } else if exponent < 1.0 || exponent > 1.0 {
        1.0 + exp_less_one(exponent * log_of_one_plus(g - 1.0))
    } else {
        g
    }
}

/// dg/dl = direction - k g^exponent over a length, by the method of Runge and Kutta.
fn grown(mut g: Real, length: Real, k: Real, exponent: Real, direction: Real) -> Real {
    let most = if direction > 0.0 { g + length } else { g };
    let bend = if exponent > 1.0 { power_of(most, exponent - 1.0) } else { 1.0 };
    let stiff = (exponent * k * length * bend * 20.0).abs();
    let steps = (if stiff < 99.0 { stiff as u8 } else { 99 }) + 3;
    for step in 0..steps {
        // shortest near zero, where g^exponent bends
        let part = Real::from(if direction > 0.0 { step } else { steps - 1 - step });
        let h = length * (2.0 * part + 1.0) / (Real::from(steps) * Real::from(steps));
        let first = direction - k * power_of(g, exponent);
        let second = direction - k * power_of(g + h / 2.0 * first, exponent);
        let third = direction - k * power_of(g + h / 2.0 * second, exponent);
        let last = direction - k * power_of(g + h * third, exponent);
        g += h / 6.0 * (first + 2.0 * (second + third) + last);
    }
    g
}

/// The force w behind a change of z in one direction: dw = dz - (beta |dz| w + gamma dz |w|) |w|^(exponent - 1).
fn changed(w: Real, dz: Real, beta: Real, gamma: Real, exponent: Real) -> Real {
    // Gauss's quadrature from 0 to 1
    const NODES: [Real; 8] = [$nodes];
    const SHARES: [Real; 8] = [$shares];
    let sign = if dz < 0.0 { -1.0 } else { 1.0 };
    let (mut length, mut size) = (dz * sign, w * sign);
    if size < 0.0 {
        // unloading, as far as zero or the end of the change
        let k = beta - gamma;
        size = -size;
        let mut to_zero = 0.0;
        if 1.0 + k * power_of(size, exponent) > 0.0 {
            for (node, share) in NODES.iter().zip(&SHARES) {
                to_zero += size * share / (1.0 + k * power_of(size * node, exponent));
            }
        } else {
            to_zero = length;
        }
        if to_zero >= length {
            return -sign * grown(size, length, k, exponent, -1.0);
        }
        length -= to_zero;
        size = 0.0;
    }
    sign * grown(size, length, beta + gamma, exponent, 1.0)
}

/// The force at a sample: z turns back where the parabola through its last three samples does.
fn bouc_wen(memory: &mut [Real], z: Real, beta: Real, gamma: Real, exponent: Real) -> Real {
    let (before, older) = (memory[1], memory[2]);
    let slope = (3.0 * z - 4.0 * before + older) / 2.0;
    let curvature = z - 2.0 * before + older;
    let mut turn = before;
    if slope * curvature > 0.0 && slope * slope < curvature * curvature {
        turn = z - slope * slope / curvature / 2.0;
        memory[0] = changed(memory[0], turn - before, beta, gamma, exponent);
    }
    memory[0] = changed(memory[0], z - turn, beta, gamma, exponent);
    memory[2] = before;
    memory[1] = z;
    memory[0]
}
@end
@dahl

/// The friction f behind a change of z in one direction, df = (dz - |dz| f) / distance, and its mean over the change.
fn slid(f: Real, dz: Real, distance: Real) -> (Real, Real) {
    let sign = if dz < 0.0 { -1.0 } else { 1.0 };
    let x = dz * sign / distance;
    let lost = -exp_less_one(-x);
    let part = if x > 1e-4 { lost / x } else { 1.0 - x * (0.5 - x / 6.0) };
    (f + (sign - f) * lost, sign + (f - sign) * part)
}

/// Friction at a sample: z turns back where the parabola through its last three samples does.
fn dahl(memory: &mut [Real], z: Real, distance: Real, averaged: u8) -> Real {
    let (last, before, older) = (memory[0], memory[1], memory[2]);
    let slope = (3.0 * z - 4.0 * before + older) / 2.0;
    let curvature = z - 2.0 * before + older;
    let (f, mean) = if slope * curvature > 0.0 && slope * slope < curvature * curvature {
        let turn = z - slope * slope / curvature / 2.0;
        let (turned, mean) = slid(last, turn - before, distance);
        let (f, rest) = slid(turned, z - turn, distance);
        (f, mean + (rest - mean) * slope / curvature)
    } else {
        slid(last, z - before, distance)
    };
    memory.copy_from_slice(&[f, z, before]);
    if averaged > 0 { mean + f - last } else { f }
}
@end
@speed

/// The change of z in a sample, without its sign.
fn speed(memory: &mut [Real], z: Real, pace: Real) -> Real {
    let change = pace * (z - memory[0]);
    memory[0] = z;
    change.abs()
}
@end
@damping

/// A force that grows with the change of z in a sample up to a limit: scale tanh(change / scale).
fn damping(memory: &mut [Real], z: Real, scale: Real, pace: Real) -> Real {
    let change = pace * (z - memory[0]) / scale;
    memory[0] = z;
    let lost = -exp_less_one(-2.0 * change.abs());
    let force = scale * lost / (2.0 - lost);
    if change < 0.0 { -force } else { force }
}
@end
@mixture

fn dot(row: &[Real], signals: &[Real]) -> Real {
    row.iter().zip(signals).map(|(factor, signal)| factor * signal).sum()
}
@end
@polynomial

fn polynomial(y: Real, middle: Real, scale: Real, coefficients: &[Real]) -> Real {
    let x = (y - middle) / scale;
    let sum = coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient);
    y + scale * x * x * sum
}
@end
@no_less

fn no_less(y: Real, lowest: Real) -> Real {
    y.max(lowest)
}
@end
@no_more

fn no_more(y: Real, highest: Real) -> Real {
    y.min(highest)
}
@end
@scaled|at_knots

/// A function of time that is zero at the start: the cubic of Catmull and Rom through its later knots.
fn at_knots(pace: Real, later: &[Real], sample: u32) -> Real {
    let last = later.len();
    if last == 0 {
        return 0.0;
    }
    let value = |knot: usize| if knot == 0 { 0.0 } else { later[knot - 1] };
    let place = (sample as Real * pace).min(last as Real);
    let i = (place as usize).min(last - 1);
    let t = place - i as Real;
    let (left, right) = (value(i), value(i + 1));
    let before = if i > 0 {
        value(i - 1)
    } else if last > 1 {
        3.0 * left - 3.0 * right + value(2)
    } else {
        2.0 * left - right
    };
    let after = if i + 1 < last {
        value(i + 2)
    } else if last > 1 {
        3.0 * right - 3.0 * left + value(last - 2)
    } else {
        2.0 * right - left
    };
    let bend = t * (3.0 * (left - right) + after - before);
    left + 0.5 * t * (right - before + t * (2.0 * before - 5.0 * left + 4.0 * right - after + bend))
}
@end
@scaled

fn scaled(y: Real, pace: Real, later: &[Real], sample: u32) -> Real {
    y * (1.0 + at_knots(pace, later, sample))
}
@end
@backlash

fn backlash(place: &mut [Real], y: Real, half_width: Real) -> Real {
    place[0] = play(half_width, y, place[0]);
    place[0]
}
@end
@gap

fn gap(y: Real, half_width: Real, missing: Real) -> Real {
    y - missing * y.clamp(-half_width, half_width)
}
@end
@sinusoid

/// The phase is counted in turns. Its second number holds what the first one cannot.
fn sinusoid(phase: &mut [Real], turns: Real, rest: Real, cosine: Real, sine: Real) -> Real {
    let own = phase[0] + phase[1];
    let quarter = (4.0 * own + 0.5) as u8;
    let x = (own - Real::from(quarter) * 0.25) * $two_pi;
    let (mut c, mut s) = (1.0, 1.0);
    for n in (2_i16..19).rev().step_by(2) {
        c = 1.0 - c * x * x / Real::from(n * (n - 1));
        s = 1.0 - s * x * x / Real::from(n * (n + 1));
    }
    s *= x;
    for _ in 0..quarter {
        (c, s) = (-s, c);
    }
    let there = phase[0] + turns;
    let part = there - phase[0];
    let low = phase[1] + (phase[0] - (there - part)) + (turns - part) + rest;
    let sum = there + low;
    phase[1] = low - (sum - there);
    phase[0] = if sum >= 1.0 { sum - 1.0 } else { sum };
    cosine * c + sine * s
}
@end
@leak

fn leak(lag: &mut [Real], value: Real, share: Real, gain: Real, start: Real, sample: u32) -> Real {
    if sample == 0 {
        lag[0] = value + start;
    }
    let wanted = share * (value - lag[0]) + lag[1];
    let there = lag[0] + wanted;
    lag[1] = wanted - (there - lag[0]);
    lag[0] = there;
    gain * lag[0]
}
@end
@stand

fn stand(memory: &mut [Real], factors: &[Real], value: Real) {
    for (own, factor) in memory.iter_mut().zip(factors) {
        *own = factor * value;
    }
}
@end
