/* F(k) = max(z - w, min(z + w, F(k - 1))) */
static real play(real width, real z, real place)
{
    const real low = z - width, high = z + width;
    if (place > high)
        place = high;
    return place < low ? low : place;
}

@one_sided
/* The sum of one-sided deadzones: u - eta beyond a threshold eta, on the side away from zero. */
static real one_sided(real u, const real *thresholds, const real *slopes, int count)
{
    real z = 0;
    int j;
    for (j = 0; j < count; ++j) {
        real beyond = u - thresholds[j];
        if ((thresholds[j] > 0 && beyond < 0) || (thresholds[j] < 0 && beyond > 0))
            beyond = 0;
        z += slopes[j] * beyond;
    }
    return z;
}

@end
@directional
/* The sum of directional deadzones: u - eta while u rises above eta, u + eta while u falls below -eta. */
static real directional(real u, real before, const real *thresholds, const real *slopes, int count)
{
    real z = 0;
    int j;
    for (j = 0; j < count; ++j) {
        if (u > before && u > thresholds[j])
            z += slopes[j] * (u - thresholds[j]);
        else if (u < before && u < -thresholds[j])
            z += slopes[j] * (u + thresholds[j]);
    }
    return z;
}

@end
@delay
/* The input of `last - 1 + part` samples before. */
static real delay(real *line, real input, int last, real part)
{
    int i;
    for (i = last; i > 0; --i)
        line[i] = line[i - 1];
    line[0] = input;
    return (1 - part) * line[last - 1] + part * line[last];
}

@end
@slew
static real slew(real *drive, real input, real reach)
{
    real change = input - *drive;
    if (change > reach)
        change = reach;
    if (change < -reach)
        change = -reach;
    *drive += change;
    return *drive;
}

@end
@bent|bouc_wen|dahl|damping
/* log(1 + x) for x >= 0 */
static real log_of_one_plus(real x)
{
    real m = 1 + x, z, square, sum = 0;
    int halved = 0, n;
    while (m > (real)1.5 && halved < 1100) {
        m /= 2;
        ++halved;
    }
    while (m < (real)0.7 && halved > -1100) {
        m *= 2;
        --halved;
    }
    z = halved ? (m - 1) / (m + 1) : x / (2 + x);
    square = z * z;
    for (n = 27; n > 0; n -= 2)
        sum = sum * square + 1 / (real)n;
    return halved * $ln_two + 2 * z * sum;
}

/* exp(x) - 1 */
static real exp_less_one(real x)
{
    real sum = 1, scale = 1, rest;
    int turns, n;
    /* beyond, and for NaN, the quotient is no int */
    if (!(x < 800))
        x = 800;
    if (x < -800)
        x = -800;
    turns = (int)(x / $ln_two);
    rest = x - turns * $ln_two;
    for (n = 22; n > 1; --n)
        sum = 1 + sum * rest / n;
    for (n = turns; n > 0; --n)
        scale *= 2;
    for (n = turns; n < 0; ++n)
        scale /= 2;
    return scale * (rest * sum) + (scale - 1);
}

@end
@bent
/* The speed behind a lag, and the transformation of Box and Cox of it. */
static real bent(real *seen, real speed, real share, real exponent, real knee)
{
    real logarithm;
    *seen += share * (speed - *seen);
    logarithm = log_of_one_plus(*seen / knee);
    return knee * (exponent < 0 || exponent > 0 ? exp_less_one(exponent * logarithm) / exponent : logarithm);
}

@end
@widened
/* The half-width of a play at a speed. */
static real widened(real width, real speed, real relative, real absolute)
{
    const real wide = width * (1 + relative * speed) + absolute * speed;
    return width > 0 && wide > 0 ? wide : 0;
}

@end
@curved
/* The value of a play as it is read: integrals of Legendre polynomials are added, one for each factor. */
static real curved(real place, const real *factors, int degrees, real middle, real scale)
{
    real f = (place - middle) / scale, sum = 0, lower = 1, own;
    int a;
    if (f > 1)
        f = 1;
    if (f < -1)
        f = -1;
    own = f;
    for (a = 1; a <= degrees; ++a) {
        const real upper = ((2 * a + 1) * f * own - a * lower) / (a + 1);
        sum += factors[a - 1] * (upper - lower) / (2 * a + 1);
        lower = own;
        own = upper;
    }
    return place + scale * sum;
}

@end
@late
/* The value of `samples` samples before. */
static real late(real *line, real value, int samples)
{
    const real last = line[samples - 1];
    int i;
    for (i = samples - 1; i > 0; --i)
        line[i] = line[i - 1];
    line[0] = value;
    return last;
}

@end
@section
/* (b1 / q + b2 / q^2) / (1 + a1 / q + a2 / q^2) */
static real section(real *x, real v, real a1, real a2, real b1, real b2)
{
    const real y = x[0];
    x[0] = x[1] - a1 * y + b1 * v;
    x[1] = b2 * v - a2 * y;
    return y;
}

@end
@lags
/* First-order lags; the second half of their memory holds rounding errors. */
static real lags(real *lag, real v, const real *shares, const real *gains, int count)
{
    real y = 0;
    int i;
    for (i = 0; i < count; ++i) {
        const real wanted = shares[i] * (v - lag[i]) + lag[count + i];
        const real there = lag[i] + wanted;
        y += gains[i] * lag[i];
        lag[count + i] = wanted - (there - lag[i]);
        lag[i] = there;
    }
    return y;
}

@end
@power
static real power(real z, int exponent, real scale)
{
    real w = 1;
    int n;
    for (n = 0; n < exponent; ++n)
        w *= z / scale;
    return w * scale;
}

@end
@excess
static real excess(real z, real limit, int is_lower)
{
    const real beyond = z - limit;
    return (is_lower ? beyond < 0 : beyond > 0) ? beyond : 0;
}

@end
@stops
static real stops(real *places, real z, const real *widths, const real *weights, int count)
{
    real w = 0;
    int i;
    for (i = 0; i < count; ++i) {
        places[i] = play(widths[i], z, places[i]);
        w += weights[i] * (z - places[i]);
    }
    return w;
}

@end
@bouc_wen
/* g to a power, for g >= 0. */
static real power_of(real g, real exponent)
{
    if (!(g > 0))
        return 0;
    return exponent < 1 || exponent > 1 ? 1 + exp_less_one(exponent * log_of_one_plus(g - 1)) : g;
}

/* dg/dl = direction - k g^exponent over a length, by the method of Runge and Kutta. */
static real grown(real g, real length, real k, real exponent, real direction)
{
    const real most = direction > 0 ? g + length : g;
    real stiff = exponent * k * length * (exponent > 1 ? power_of(most, exponent - 1) : 1) * 20;
    int steps, n;
    if (stiff < 0)
        stiff = -stiff;
    steps = (stiff < 99 ? (int)stiff : 99) + 1;
    /* shortest near zero, where g^exponent bends */
    steps += 2;
    for (n = 0; n < steps; ++n) {
        const int part = direction > 0 ? n : steps - 1 - n;
        const real h = length * (2 * part + 1) / ((real)steps * steps);
        const real first = direction - k * power_of(g, exponent);
        const real second = direction - k * power_of(g + h / 2 * first, exponent);
        const real third = direction - k * power_of(g + h / 2 * second, exponent);
        const real last = direction - k * power_of(g + h * third, exponent);
        g += h / 6 * (first + 2 * (second + third) + last);
    }
    return g;
}

/* The force w behind a change of z in one direction: dw = dz - (beta |dz| w + gamma dz |w|) |w|^(exponent - 1). */
static real changed(real w, real dz, real beta, real gamma, real exponent)
{
    /* Gauss's quadrature from 0 to 1 */
    static const real nodes[] = {$nodes};
    static const real shares[] = {$shares};
    const real sign = dz < 0 ? -1 : 1;
    real length = dz * sign, size = w * sign;
    if (size < 0) {
        /* unloading, as far as zero or the end of the change */
        const real k = beta - gamma;
        real to_zero = 0;
        int n;
        size = -size;
        if (1 + k * power_of(size, exponent) > 0)
            for (n = 0; n < 8; ++n)
                to_zero += size * shares[n] / (1 + k * power_of(size * nodes[n], exponent));
        else
            to_zero = length;
        if (to_zero >= length)
            return -sign * grown(size, length, k, exponent, -1);
        length -= to_zero;
        size = 0;
    }
    return sign * grown(size, length, beta + gamma, exponent, 1);
}

/* The force at a sample: z turns back where the parabola through its last three samples does. */
static real bouc_wen(real *memory, real z, real beta, real gamma, real exponent)
{
    const real before = memory[1];
    const real slope = (3 * z - 4 * before + memory[2]) / 2, curvature = z - 2 * before + memory[2];
    real turn = before;
    if (slope * curvature > 0 && slope * slope < curvature * curvature) {
        turn = z - slope * slope / curvature / 2;
        memory[0] = changed(memory[0], turn - before, beta, gamma, exponent);
    }
    memory[0] = changed(memory[0], z - turn, beta, gamma, exponent);
    memory[2] = before;
    memory[1] = z;
    return memory[0];
}

@end
@dahl
/* The friction f behind a change of z in one direction, df = (dz - |dz| f) / distance, and its mean over the change. */
static real slid(real f, real dz, real distance, real *mean)
{
    const real sign = dz < 0 ? -1 : 1;
    const real x = dz * sign / distance;
    const real lost = -exp_less_one(-x);
    const real part = x > (real)1e-4 ? lost / x : 1 - x * ((real)0.5 - x / 6);
    *mean = sign + (f - sign) * part;
    return f + (sign - f) * lost;
}

/* Friction at a sample: z turns back where the parabola through its last three samples does. */
static real dahl(real *memory, real z, real distance, int averaged)
{
    const real before = memory[1], last = memory[0];
    const real slope = (3 * z - 4 * before + memory[2]) / 2, curvature = z - 2 * before + memory[2];
    real mean, rest;
    if (slope * curvature > 0 && slope * slope < curvature * curvature) {
        const real turn = z - slope * slope / curvature / 2;
        memory[0] = slid(last, turn - before, distance, &mean);
        memory[0] = slid(memory[0], z - turn, distance, &rest);
        mean += (rest - mean) * slope / curvature;
    } else {
        memory[0] = slid(last, z - before, distance, &mean);
    }
    memory[2] = before;
    memory[1] = z;
    return averaged ? mean + memory[0] - last : memory[0];
}

@end
@speed
/* The change of z in a sample, without its sign. */
static real speed(real *memory, real z, real pace)
{
    const real change = pace * (z - *memory);
    *memory = z;
    return change < 0 ? -change : change;
}

@end
@damping
/* A force that grows with the change of z in a sample up to a limit: scale tanh(change / scale). */
static real damping(real *memory, real z, real scale, real pace)
{
    const real change = pace * (z - *memory);
    const real lost = -exp_less_one((change < 0 ? 2 : -2) * change / scale);
    *memory = z;
    return (change < 0 ? -scale : scale) * lost / (2 - lost);
}

@end
@mixture
static real dot(const real *row, const real *signals)
{
    real sum = 0;
    int i;
    for (i = 0; i < STATES + INPUTS; ++i)
        sum += row[i] * signals[i];
    return sum;
}

@end
@polynomial
static real polynomial(real y, real middle, real scale, const real *coefficients, int count)
{
    const real x = (y - middle) / scale;
    real sum = 0;
    int i;
    for (i = count - 1; i >= 0; --i)
        sum = sum * x + coefficients[i];
    return y + scale * x * x * sum;
}

@end
@no_less
static real no_less(real y, real lowest)
{
    return y < lowest ? lowest : y;
}

@end
@no_more
static real no_more(real y, real highest)
{
    return y > highest ? highest : y;
}

@end
@scaled|at_knots
/* A function of time that is zero at the start: the cubic of Catmull and Rom through its later knots. */
static real at_knots(real pace, const real *later, int last, unsigned long sample)
{
    real place = sample * pace, t, before, left, right, after;
    int i;
    if (last == 0)
        return 0;
    if (place > last)
        place = (real)last;
    i = place < last ? (int)place : last - 1;
    t = place - i;
    left = i > 0 ? later[i - 1] : 0;
    right = later[i];
    if (i > 0)
        before = i > 1 ? later[i - 2] : 0;
    else
        before = last > 1 ? 3 * left - 3 * right + later[1] : 2 * left - right;
    if (i + 1 < last)
        after = later[i + 1];
    else
        after = last > 1 ? 3 * right - 3 * left + (last > 2 ? later[last - 3] : 0) : 2 * right - left;
    return left + t / 2 * (right - before
        + t * (2 * before - 5 * left + 4 * right - after + t * (3 * (left - right) + after - before)));
}

@end
@scaled
static real scaled(real y, real pace, const real *later, int last, unsigned long sample)
{
    return y * (1 + at_knots(pace, later, last, sample));
}

@end
@backlash
static real backlash(real *place, real y, real half_width)
{
    *place = play(half_width, y, *place);
    return *place;
}

@end
@gap
static real gap(real y, real half_width, real missing)
{
    const real inside = y > half_width ? half_width : y < -half_width ? -half_width : y;
    return y - missing * inside;
}

@end
@sinusoid
/* The phase is counted in turns. Its second number holds what the first one cannot. */
static real sinusoid(real *phase, real turns, real rest, real cosine, real sine)
{
    const real there = phase[0] + turns, part = there - phase[0];
    real own = phase[0] + phase[1];
    const int quarter = (int)(4 * own + (real)0.5);
    const real x = (own - quarter * (real)0.25) * $two_pi, square = x * x;
    real c = 1, s = 1, swap;
    int n;
    for (n = 18; n > 0; n -= 2) {
        c = 1 - c * square / (real)(n * (n - 1));
        s = 1 - s * square / (real)(n * (n + 1));
    }
    s *= x;
    for (n = quarter; n > 0; --n) {
        swap = c;
        c = -s;
        s = swap;
    }
    phase[1] += (phase[0] - (there - part)) + (turns - part) + rest;
    own = there + phase[1];
    phase[1] -= own - there;
    phase[0] = own >= 1 ? own - 1 : own;
    return cosine * c + sine * s;
}

@end
@leak
static real leak(real *lag, real value, real share, real gain, real start, unsigned long sample)
{
    real wanted, there;
    if (sample == 0)
        lag[0] = value + start;
    wanted = share * (value - lag[0]) + lag[1];
    there = lag[0] + wanted;
    lag[1] = wanted - (there - lag[0]);
    lag[0] = there;
    return gain * lag[0];
}

@end
