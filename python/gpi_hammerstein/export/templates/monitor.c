/* $title, see $name.h.
 *
 * Compile without -ffast-math: it would remove the check of the samples.
 */
#include "$name.h"

#include <float.h>

typedef ${model}_real real;
typedef ${name}_sums sums;

/* Standard deviation of the noise, standard errors that a change must exceed, the smallest part by which the noise
   must have changed, the error of any shape that is known to be possible, and the slow error that the training record may hide. */
static const double noise = $noise, deviations = $deviations, least_noise = $least_noise;
static const double misfit = $misfit, hidden = $hidden;
static const real model_offset = $model_offset;

/* A pivot below this part of its regressor's own sum is rounding. */
#define DEPENDENT 1e-6

/* The part of what changes explain that a further change must explain: a large change is not linear. */
#define REMAINDER 0.1

/* One of two windows that follow each other. */
typedef struct {
    double own[6], swept[6], noise, samples;
} side;

static int is_finite(real value)
{
    return value >= -$largest && value <= $largest;
}

static double root(double value)
{
    double from = value > 1 ? value : 1, next;
    if (!(value > 0))
        return 0;
    /* from above, the steps of Newton's method only fall */
    for (;;) {
        next = 0.5 * (from + value / from);
        if (!(next < from))
            return from;
        from = next;
    }
}

/* Place of the product of two of 1, movement and residual. */
static int place(int i, int j)
{
    int low = i < j ? i : j, high = i < j ? j : i;
    return low * (5 - low) / 2 + high;
}

/* Goodnight's sweep: sign is 1 to take a regressor in, -1 to take it out. */
static void sweep(double *m, int k, double pivot, double sign)
{
    int i, j;
    for (i = 0; i < 3; ++i) {
        for (j = i; j < 3; ++j) {
            if (i != k && j != k)
                m[place(i, j)] -= m[place(i, k)] * m[place(k, j)] / pivot;
        }
    }
    for (i = 0; i < 3; ++i) {
        if (i != k)
            m[place(i, k)] = sign * m[place(i, k)] / pivot;
    }
    m[place(k, k)] = -1 / pivot;
}

static int can_enter(const side *one, int i)
{
    double pivot = one->swept[place(i, i)];
    return pivot > 0 && pivot > DEPENDENT * one->own[place(i, i)];
}

static int enter(side *one, int i)
{
    if (!can_enter(one, i))
        return 0;
    sweep(one->swept, i, one->swept[place(i, i)], 1);
    return 1;
}

static double left(const side *one)
{
    return one->swept[5] > 0 ? one->swept[5] : 0;
}

static side side_of(const sums *window)
{
    side one;
    int i;
    for (i = 0; i < 6; ++i)
        one.own[i] = one.swept[i] = window->products[i];
    one.samples = window->samples;
    enter(&one, 0);
    enter(&one, 1);
    one.noise = root(left(&one) / one.samples);
    if (one.noise < noise)
        one.noise = noise;
    for (i = 0; i < 6; ++i)
        one.swept[i] = one.own[i];
    return one;
}

/* The standard errors by which a change exceeds what is possible without it, with the sign of the change. */
static double excess(const side *one, int i, int is_in)
{
    double product = one->swept[place(i, 2)], information = one->swept[place(i, i)], deviation, beyond, more;
    if (!is_in && !can_enter(one, i))
        return 0;
    deviation = product / root(is_in ? -information : information);
    beyond = (deviation < 0 ? -deviation : deviation) - misfit * root(one->samples);
    if (beyond <= 0)
        return 0;
    more = root(beyond * beyond - hidden * hidden * one->samples) / one->noise;
    return deviation < 0 ? -more : more;
}

/* The sum of squares that a change outside the regression would explain. */
static double explained_by(const side *one, int i)
{
    double product = one->swept[place(i, 2)];
    return can_enter(one, i) ? product * product / one->swept[place(i, i)] : 0;
}

/* By how much a change exceeds what is possible in both windows; 0 if they differ in its direction. */
static double common(const side *a, const side *b, int i, int is_in)
{
    double one = excess(a, i, is_in), two = excess(b, i, is_in);
    if (!(one * two > 0))
        return 0;
    if (one < 0) {
        one = -one;
        two = -two;
    }
    return one < two ? one : two;
}

static int way_of_noise(const side *one, double explained)
{
    double variance = noise * noise * one->samples, chance = deviations * root(2 / one->samples);
    double possible = (misfit * misfit + hidden * hidden) * one->samples;
    if ((left(one) - possible - explained) / variance - 1 > (2 + least_noise) * least_noise + chance)
        return 1;
    return left(one) / variance - 1 < -(2 - least_noise) * least_noise - chance ? -1 : 0;
}

/* The changes upon which two windows agree. */
static unsigned agreed(${name}_state *state, const sums *earlier, const sums *later)
{
    side a, b;
    unsigned found = 0;
    double explained;
    int i, best, way;
    if (!(earlier->samples > 0 && later->samples > 0))
        return 0;
    a = side_of(earlier);
    b = side_of(later);
    explained = left(&a) + left(&b);
    for (;;) {
        double most = found ? REMAINDER * (explained - left(&a) - left(&b)) : 0;
        best = -1;
        for (i = 0; i < 2; ++i) {
            double own = explained_by(&a, i) + explained_by(&b, i);
            if (!(found >> i & 1u) && common(&a, &b, i, 0) > deviations && own > most) {
                most = own;
                best = i;
            }
        }
        if (best < 0 || !enter(&a, best) || !enter(&b, best))
            break;
        found |= 1u << best;
    }
    for (i = 0; i < 2; ++i) {
        if (found >> i & 1u && common(&a, &b, i, 1) <= deviations) {
            sweep(a.swept, i, a.swept[place(i, i)], -1);
            sweep(b.swept, i, b.swept[place(i, i)], -1);
            found &= ~(1u << i);
        }
    }
    if (found)
        state->offset = found & 1u ? (real)b.swept[place(0, 2)] : 0;
    if (found)
        state->gain = found & 2u ? (real)b.swept[place(1, 2)] : 0;
    explained = found ? explained - left(&a) - left(&b) : 0;
    way = way_of_noise(&a, explained);
    if (way != 0 && way == way_of_noise(&b, explained))
        found |= way > 0 ? ${NAME}_NOISE_ROSE : ${NAME}_NOISE_FELL;
    return found;
}

/* Counts a block: merges the sums of each level in pairs. */
static unsigned end_block(${name}_state *state)
{
    sums sum = state->current, earlier;
    unsigned found = 0;
    int level, i;
    ++state->blocks;
    for (level = 0; level < ${NAME}_LEVELS; ++level) {
        unsigned long number = state->blocks >> level;
        int had = state->held[level];
        earlier = state->last[level];
        state->last[level] = sum;
        state->held[level] = 1;
        if (!had)
            break;
        found |= agreed(state, &earlier, &sum);
        if (number % 2 == 1)
            break;
        for (i = 0; i < 6; ++i)
            sum.products[i] += earlier.products[i];
        sum.samples += earlier.samples;
    }
    state->changed |= found;
    return found;
}

void ${name}_start(${name}_state *state, const real *input)
{
    static const ${name}_state zero;
    *state = zero;
    ${model}_start(&state->model, input);
}

@leak
unsigned ${name}_step(${name}_state *state, const real *input, const real *covariates, real output)
@else
unsigned ${name}_step(${name}_state *state, const real *input, real output)
@end
{
    static const sums none;
    real predicted, values[3];
    unsigned found;
    int i, j;
@leak
    ${model}_step(&state->model, input, covariates, &predicted);
@else
    ${model}_step(&state->model, input, &predicted);
@end
    values[0] = 1;
    values[1] = predicted - model_offset;
    values[2] = output - predicted;
    if (is_finite(values[1]) && is_finite(values[2])) {
        for (i = 0; i < 3; ++i) {
            for (j = i; j < 3; ++j)
                state->current.products[place(i, j)] += values[i] * values[j];
        }
        state->current.samples += 1;
    }
    if (++state->samples < $block)
        return 0;
    state->samples = 0;
    found = end_block(state);
    state->current = none;
    return found;
}
