/* $title, see $name.h.
 *
 * Compile without -ffast-math: it would remove the check of the input and the correction of rounding errors.
 */
#include "$name.h"

#include <float.h>

typedef ${name}_real real;

#define INPUTS ${NAME}_INPUTS
#define OUTPUTS ${NAME}_OUTPUTS
#define STATES $states

@widened
/* Samples a second. */
static const real rate = $rate;

@end
$tables

static int is_finite(real value)
{
    return value >= -$largest && value <= $largest;
}

$operations$hysteresis
/* The next states and the output of the linear dynamics, from the states and v. */
static void multiply(const real *signals, real *result)
{
    int i, j = 0;
    for (i = 0; i < STATES + OUTPUTS; ++i) {
        result[i] = 0;
        for (; j < row_ends[i]; ++j)
            result[i] += factors[j] * signals[columns[j]];
    }
}

@stand
static void stand(real *memory, const real *factors, int count, real value)
{
    int i;
    for (i = 0; i < count; ++i)
        memory[i] = factors[i] * value;
}

@end
static void observe(${name}_state *state, const real *input)
{
    int i;
    for (i = 0; i < INPUTS; ++i) {
        if (is_finite(input[i]))
            state->input[i] = input[i];
        else
            state->faults |= ${NAME}_NOT_FINITE;
    }
}

void ${name}_start(${name}_state *state, const real *input)
{
    static const ${name}_state zero;
    real v[INPUTS];
    int i, j;
    *state = zero;
    observe(state, input);
$start_hysteresis
    for (i = 0; i < STATES; ++i) {
        for (j = 0; j < INPUTS; ++j)
            state->states[i] += steady[i * INPUTS + j] * v[j];
    }
$start_effects
}

@leak
void ${name}_step(${name}_state *state, const real *input, const real *covariates, real *output)
@else
void ${name}_step(${name}_state *state, const real *input, real *output)
@end
{
    real signals[STATES + INPUTS], next[STATES + OUTPUTS];
    real *const v = signals + STATES, *const y = next + STATES;
    int i;
    observe(state, input);
@leak
    for (i = 0; i < ${NAME}_COVARIATES; ++i) {
        if (is_finite(covariates[i]))
            state->covariates[i] = covariates[i];
        else
            state->faults |= ${NAME}_NOT_FINITE;
    }
@end
    for (i = 0; i < STATES; ++i)
        signals[i] = state->states[i];
    for (i = 0; i < INPUTS; ++i)
        v[i] = state->input[i];
$drive
$move
@steps
    /* the loops from the sample before to this one */
    if (state->sample > 0) {
$settle
    }
@end
    multiply(signals, next);
$respond
    for (i = 0; i < STATES; ++i)
        state->states[i] = next[i];
$read
    for (i = 0; i < OUTPUTS; ++i)
        output[i] = y[i] + offsets[i];
    if (state->sample < 0xffffffffUL)
        ++state->sample;
}
