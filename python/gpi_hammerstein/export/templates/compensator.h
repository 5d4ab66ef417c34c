/* $title.
 *
$facts
 */
#ifndef ${NAME}_H
#define ${NAME}_H

typedef $real ${name}_real;

#define ${NAME}_PLAYS $plays
#define ${NAME}_LAGS $lags

/* The state of the compensator between two samples. */
typedef struct {
    ${name}_real plays[${NAME}_PLAYS];
@creep
    ${name}_real lags[${NAME}_LAGS];
    ${name}_real carried[${NAME}_LAGS]; /* rounding errors of the lags */
@end
    ${name}_real drive;
    unsigned long out_of_reach; /* number of samples with the drive at a limit */
} ${name}_state;

/* Sets the steady state after the actuator has moved from zero to this reference$output_unit. */
void ${name}_start(${name}_state *state, ${name}_real reference);

/* Returns the drive$input_unit for the next sample of the reference$output_unit. If the reference is not finite, the drive does not
   change. */
${name}_real ${name}_step(${name}_state *state, ${name}_real reference);

#endif
