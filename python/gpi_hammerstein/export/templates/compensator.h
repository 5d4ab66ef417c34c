/* $title.
 *
$facts
 */
#ifndef ${NAME}_H
#define ${NAME}_H

typedef $real ${name}_real;

#define ${NAME}_PLAYS $plays
#define ${NAME}_LAGS $lags

/* What the compensator remembers between two samples. */
typedef struct {
    ${name}_real plays[${NAME}_PLAYS];
@creep
    ${name}_real lags[${NAME}_LAGS];
    ${name}_real carried[${NAME}_LAGS]; /* what rounding has taken from the lags */
@end
    ${name}_real drive;
    unsigned long out_of_reach; /* samples at which the drive stood at a limit */
} ${name}_state;

/* An actuator that was brought from zero to this reference$output_unit long ago. */
void ${name}_start(${name}_state *state, ${name}_real reference);

/* The drive$input_unit for the next sample of the reference$output_unit; one that is not finite holds the drive. */
${name}_real ${name}_step(${name}_state *state, ${name}_real reference);

#endif
