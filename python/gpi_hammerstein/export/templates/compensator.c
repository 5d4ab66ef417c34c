/* $title, see $name.h.
 *
 * Compile without -ffast-math: it would remove the check of the reference and the correction of rounding errors of creep.
 */
#include "$name.h"

#include <float.h>

typedef ${name}_real real;

#define PLAYS ${NAME}_PLAYS
#define KNOTS $knot_count
@creep
#define LAGS ${NAME}_LAGS
@end

/* v = (reference - offset - creep) / gain */
static const real offset = $offset;
static const real gain = $gain;
static const real standing_gain = $standing_gain;
@creep

/* Creep: in each sample, each lag changes by rate (v - lag). Its contribution to creep is gain times its value. */
static const real lag_rates[LAGS] = {$lag_rates};
static const real lag_gains[LAGS] = {$lag_gains};
@end

/* The inverse plays, by increasing half-width. */
static const real half_widths[PLAYS] = {$half_widths};
static const real weights[PLAYS] = {$weights};

/* The inverse deadzones as a piecewise linear curve: knots, the drive at each knot, the slope before the first knot and after
   each knot. */
static const real knots[KNOTS] = {$knots};
static const real heights[KNOTS] = {$heights};
static const real slopes[KNOTS + 1] = {$slopes};

/* The range of v, and the part of it in which neither this range nor a limit of the drive is reached. */
static const real lowest_v = $lowest_v;
static const real highest_v = $highest_v;
static const real usual_below = $usual_below;
static const real usual_above = $usual_above;

/* The limits of the drive, the corresponding inputs of the inverse deadzones, and the range of v in which no limit is reached. */
static const real lowest_drive = $lowest_drive;
static const real highest_drive = $highest_drive;
static const real lowest = $lowest;
static const real highest = $highest;
static const real safe_below = $safe_below;
static const real safe_above = $safe_above;

static real clamp(real value, real low, real high)
{
    if (high < value)
        value = high;
    if (low > value)
        value = low;
    return value;
}

static real rise(real *places, int i, real v)
{
    const real pushed = v - half_widths[i];
    if (pushed > places[i])
        places[i] = pushed;
    return weights[i] * places[i];
}

static real fall(real *places, int i, real v)
{
    const real pushed = v + half_widths[i];
    if (pushed < places[i])
        places[i] = pushed;
    return weights[i] * places[i];
}

/* The first play has no width and stores the last v. If v rises, no play moves down. */
static real step_plays(real *places, real v)
{
    real a = 0, b = 0, c = 0, d = 0;
    int i = 0;
    if (v > places[0]) {
        for (; i + 3 < PLAYS; i += 4) {
            a += rise(places, i, v);
            b += rise(places, i + 1, v);
            c += rise(places, i + 2, v);
            d += rise(places, i + 3, v);
        }
        for (; i < PLAYS; ++i)
            a += rise(places, i, v);
    } else {
        for (; i + 3 < PLAYS; i += 4) {
            a += fall(places, i, v);
            b += fall(places, i + 1, v);
            c += fall(places, i + 2, v);
            d += fall(places, i + 3, v);
        }
        for (; i < PLAYS; ++i)
            a += fall(places, i, v);
    }
    return (a + b) + (c + d);
}

static real drive_for(real z)
{
    int passed = 0, left = KNOTS;
    while (left > 0) {
        const int half = left / 2;
        if (knots[passed + half] <= z) {
            passed += half + 1;
            left -= half + 1;
        } else {
            left = half;
        }
    }
    {
        const int j = passed > 0 ? passed - 1 : 0;
        const real drive = heights[j] + slopes[passed] * (z - knots[j]);
        return clamp(drive, lowest_drive, highest_drive);
    }
}

/* Returns the v that moves the plays from their present state to an output. */
static real input_for(const real *places, real output)
{
    real v = places[0], reached = 0, slope = 0;
    int i, rises;
    for (i = 0; i < PLAYS; ++i)
        reached += weights[i] * places[i];
    rises = output > reached;
    for (i = 0; i < PLAYS; ++i) {
        const real turn = rises ? places[i] + half_widths[i] : places[i] - half_widths[i];
        const real there = reached + slope * (turn - v);
        if (rises ? there > output : there < output)
            break;
        v = turn;
        reached = there;
        slope += weights[i];
    }
    return slope > 0 ? v + (output - reached) / slope : v;
}

/* Moves the plays to the nearest v that can be reached. */
static real move_far(${name}_state *state, real v)
{
    if (v < lowest_v || v > highest_v) {
        v = clamp(v, lowest_v, highest_v);
        state->faults |= ${NAME}_SATURATED;
    }
    if (v < safe_below || v > safe_above) {
        real z = 0, within;
        int i;
        for (i = 0; i < PLAYS; ++i)
            z += weights[i] * clamp(state->plays[i], v - half_widths[i], v + half_widths[i]);
        within = clamp(z, lowest, highest);
        if (within != z) {
            v = input_for(state->plays, within);
            ++state->out_of_reach;
        }
        step_plays(state->plays, v);
        state->drive = drive_for(within);
    } else {
        state->drive = drive_for(step_plays(state->plays, v));
    }
    return v;
}

/* Moves the plays to v, or to the nearest v that can be reached, and sets the drive. */
static real move(${name}_state *state, real v)
{
    if (v < usual_below || v > usual_above)
        return move_far(state, v);
    state->drive = drive_for(step_plays(state->plays, v));
    return v;
}

static int is_finite(real reference)
{
    return reference >= -$largest && reference <= $largest;
}
@creep

static void creep_on(${name}_state *state, real v)
{
    int i;
    for (i = 0; i < LAGS; ++i) {
        const real wanted = lag_rates[i] * (v - state->lags[i]) + state->carried[i];
        const real there = state->lags[i] + wanted;
        state->carried[i] = wanted - (there - state->lags[i]);
        state->lags[i] = there;
    }
}
@end

void ${name}_start(${name}_state *state, ${name}_real reference)
{
    int i;
@creep
    real v;
@end
    for (i = 0; i < PLAYS; ++i)
        state->plays[i] = 0;
    state->faults = 0;
    if (!is_finite(reference)) {
        reference = offset;
        state->faults |= ${NAME}_NOT_FINITE;
    }
@creep
    v = move(state, (reference - offset) / standing_gain);
    for (i = 0; i < LAGS; ++i) {
        state->lags[i] = v;
        state->carried[i] = 0;
    }
@else
    move(state, (reference - offset) / standing_gain);
@end
    state->out_of_reach = 0;
}

${name}_real ${name}_step(${name}_state *state, ${name}_real reference)
{
@creep
    real creep = 0, v;
    int i;
@end
    if (!is_finite(reference)) {
        state->faults |= ${NAME}_NOT_FINITE;
        return state->drive;
    }
@creep
    for (i = 0; i < LAGS; ++i)
        creep += lag_gains[i] * state->lags[i];
    v = move(state, (reference - offset - creep) / gain);
    creep_on(state, v);
@else
    move(state, (reference - offset) / gain);
@end
    return state->drive;
}
