/* $title.
 *
$facts
 */
#ifndef ${NAME}_H
#define ${NAME}_H

typedef $real ${name}_real;

#define ${NAME}_INPUTS $inputs
#define ${NAME}_OUTPUTS $outputs
@leak
#define ${NAME}_COVARIATES $covariates
@end

/* A fault of the inputs. */
#define ${NAME}_NOT_FINITE 1u /* a value was NaN or infinite: the last finite one was used */

/* The state of the model between two samples. */
typedef struct {
    ${name}_real states[$states_held]; /* of the linear dynamics */
    ${name}_real plays[$plays_held];
    ${name}_real drive[${NAME}_INPUTS]; /* the last one that reached the hysteresis */
    ${name}_real memory[$memory_held];  /* of the effects */
    ${name}_real input[${NAME}_INPUTS];
@leak
    ${name}_real covariates[${NAME}_COVARIATES];
@end
    unsigned long sample; /* number of samples since the start */
    unsigned faults;      /* ${NAME}_NOT_FINITE; set it to zero to clear it */
} ${name}_state;

/* Sets the steady state after the actuator has moved from zero to this input, and clears the faults. For the
   simulation of a record, this is its first input. Functions of time start at zero.

   input: $inputs_said */
void ${name}_start(${name}_state *state, const ${name}_real *input);

/* Computes the next sample of the output.

   input:  $inputs_said
@leak
   covariates: $covariates_said
@end
   output: $outputs_said

   A value that is NaN or infinite is replaced by the last finite one of its channel. */
@leak
void ${name}_step(${name}_state *state, const ${name}_real *input, const ${name}_real *covariates, ${name}_real *output);
@else
void ${name}_step(${name}_state *state, const ${name}_real *input, ${name}_real *output);
@end

#endif
