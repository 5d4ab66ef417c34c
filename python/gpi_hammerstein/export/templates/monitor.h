/* $title.
 *
$facts
 */
#ifndef ${NAME}_H
#define ${NAME}_H

#include "$model.h"

/* Windows of 1, 2, 4, .. blocks of $block samples. */
#define ${NAME}_LEVELS $levels

/* What has changed. */
#define ${NAME}_OFFSET 1u     /* the constant term of the output */
#define ${NAME}_GAIN 2u       /* the movement of the output over that of the input */
#define ${NAME}_NOISE_ROSE 4u
#define ${NAME}_NOISE_FELL 8u

/* Sums over a window: of the products of 1, the movement of the model and the residual, and of the samples. */
typedef struct {
    ${model}_real products[6], samples;
} ${name}_sums;

/* The state of the monitor between two samples. */
typedef struct {
    ${model}_state model;
    ${name}_sums current, last[${NAME}_LEVELS];
    unsigned char held[${NAME}_LEVELS]; /* whether a level has a sum */
    unsigned long blocks;
    unsigned samples; /* of the current block */
    unsigned changed; /* all changes so far; set it to zero to clear it */
    /* The changes by the latest two windows that agreed upon one: the offset$output_unit, and the gain as a part. */
    ${model}_real offset, gain;
} ${name}_state;

/* Starts with the machine in the steady state at this input.

   input: $inputs_said */
void ${name}_start(${name}_state *state, const ${model}_real *input);

/* Counts one sample and returns the changes that are noticed at the end of a block, 0 elsewhere. A sample of the output that is
   NaN or infinite is left out.

   input:  $inputs_said
   output: the measured output$output_unit */
@leak
unsigned ${name}_step(${name}_state *state, const ${model}_real *input, const ${model}_real *covariates, ${model}_real output);
@else
unsigned ${name}_step(${name}_state *state, const ${model}_real *input, ${model}_real output);
@end

#endif
