/* The compensator as a reader of the formulas would write it: what the exported one is compared with. */
#include "numbers.h"

typedef struct {
    float places[PLAYS];
    float lags[LAGS];
} by_hand_state;

float by_hand_step(by_hand_state *state, float reference)
{
    float v = reference - OFFSET, z = 0, u = 0;
    int i;
    for (i = 0; i < LAGS; ++i)
        v -= lag_gains[i] * state->lags[i];
    for (i = 0; i < LAGS; ++i)
        state->lags[i] += lag_rates[i] * (v - state->lags[i]);
    for (i = 0; i < PLAYS; ++i) {
        if (v - state->places[i] > half_widths[i])
            state->places[i] = v - half_widths[i];
        else if (v - state->places[i] < -half_widths[i])
            state->places[i] = v + half_widths[i];
        z += weights[i] * state->places[i];
    }
    for (i = 0; i < DEADZONES; ++i) {
        if (thresholds[i] > 0) {
            if (z > thresholds[i])
                u += slopes[i] * (z - thresholds[i]);
        } else if (thresholds[i] < 0) {
            if (z < thresholds[i])
                u += slopes[i] * (z - thresholds[i]);
        } else {
            u += slopes[i] * z;
        }
    }
    return u;
}
