/* Compensator: drive of u for a reference of y, see gpi_compensator.h.
 *
 * Compile without -ffast-math: it would remove the check of the reference and the correction of rounding errors of creep.
 */
#include "gpi_compensator.h"

#include <float.h>

typedef gpi_compensator_real real;

#define PLAYS GPI_COMPENSATOR_PLAYS
#define KNOTS 17
#define LAGS GPI_COMPENSATOR_LAGS

/* v = (reference - offset - creep) / gain */
static const real offset = 2.0f;
static const real gain = 1.0f;
static const real standing_gain = 1.08f;

/* Creep: in each sample, each lag changes by rate (v - lag). Its contribution to creep is gain times its value. */
static const real lag_rates[LAGS] = {0.0049875206f, 0.00019998f};
static const real lag_gains[LAGS] = {0.03f, 0.05f};

/* The inverse plays, by increasing half-width. */
static const real half_widths[PLAYS] = {
    0.0f, 0.6f, 1.62f, 3.1f, 5.075f, 7.565f,
    11.005f, 16.309f,
};
static const real weights[PLAYS] = {
    3.3333333f, -0.39215687f, -0.23847377f, -0.17105713f, -0.12200701f, -0.08405716f,
    -0.063137956f, -0.05005406f,
};

/* The inverse deadzones as a piecewise linear curve: knots, the drive at each knot, the slope before the first knot and after
   each knot. */
static const real knots[KNOTS] = {
    -120.9f, -106.05f, -90.75f, -75.6f, -60.75f, -45.3f,
    -30.3f, -15.0f, 0.0f, 15.0f, 30.15f, 45.75f,
    61.05f, 76.65f, 92.4f, 107.7f, 123.3f,
};
static const real heights[KNOTS] = {
    -120.0f, -105.0f, -90.0f, -75.0f, -60.0f, -45.0f,
    -30.0f, -15.0f, 0.0f, 15.0f, 30.0f, 45.0f,
    60.0f, 75.0f, 90.0f, 105.0f, 120.0f,
};
static const real slopes[KNOTS + 1] = {
    0.990099f, 1.010101f, 0.98039216f, 0.990099f, 1.010101f, 0.9708738f,
    1.0f, 0.98039216f, 1.0f, 1.0f, 0.990099f, 0.96153843f,
    0.98039216f, 0.96153843f, 0.95238096f, 0.98039216f, 0.96153843f, 0.95238096f,
};

/* The range of v, and the part of it in which neither this range nor a limit of the drive is reached. */
static const real lowest_v = -170.3382f;
static const real highest_v = 171.423f;
static const real usual_below = -52.8758f;
static const real usual_above = 53.9606f;

/* The limits of the drive, the corresponding inputs of the inverse deadzones, and the range of v in which no limit is reached. */
static const real lowest_drive = -120.0f;
static const real highest_drive = 120.0f;
static const real lowest = -120.9f;
static const real highest = 123.3f;
static const real safe_below = -52.8758f;
static const real safe_above = 53.9606f;

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
static real move_far(gpi_compensator_state *state, real v)
{
    if (v < lowest_v || v > highest_v) {
        v = clamp(v, lowest_v, highest_v);
        state->faults |= GPI_COMPENSATOR_SATURATED;
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
static real move(gpi_compensator_state *state, real v)
{
    if (v < usual_below || v > usual_above)
        return move_far(state, v);
    state->drive = drive_for(step_plays(state->plays, v));
    return v;
}

static int is_finite(real reference)
{
    return reference >= -FLT_MAX && reference <= FLT_MAX;
}

static void creep_on(gpi_compensator_state *state, real v)
{
    int i;
    for (i = 0; i < LAGS; ++i) {
        const real wanted = lag_rates[i] * (v - state->lags[i]) + state->carried[i];
        const real there = state->lags[i] + wanted;
        state->carried[i] = wanted - (there - state->lags[i]);
        state->lags[i] = there;
    }
}

void gpi_compensator_start(gpi_compensator_state *state, gpi_compensator_real reference)
{
    int i;
    real v;
    for (i = 0; i < PLAYS; ++i)
        state->plays[i] = 0;
    state->faults = 0;
    if (!is_finite(reference)) {
        reference = offset;
        state->faults |= GPI_COMPENSATOR_NOT_FINITE;
    }
    v = move(state, (reference - offset) / standing_gain);
    for (i = 0; i < LAGS; ++i) {
        state->lags[i] = v;
        state->carried[i] = 0;
    }
    state->out_of_reach = 0;
}

gpi_compensator_real gpi_compensator_step(gpi_compensator_state *state, gpi_compensator_real reference)
{
    real creep = 0, v;
    int i;
    if (!is_finite(reference)) {
        state->faults |= GPI_COMPENSATOR_NOT_FINITE;
        return state->drive;
    }
    for (i = 0; i < LAGS; ++i)
        creep += lag_gains[i] * state->lags[i];
    v = move(state, (reference - offset - creep) / gain);
    creep_on(state, v);
    return state->drive;
}
