/* $title.
 *
$facts
 */
#ifndef ${NAME}_H
#define ${NAME}_H

typedef $real ${name}_real;

#define ${NAME}_PLAYS $plays
#define ${NAME}_LAGS $lags

/* Faults of the references. */
#define ${NAME}_NOT_FINITE 1u /* a reference was NaN or infinite: the drive was held */
#define ${NAME}_SATURATED 2u  /* a reference needed a v outside of the range below: v was set to the nearest end */

/* What happens at bad samples:
 *
 * - The drive and the state are finite after every sequence of references, and the drive is within its limits.
 * - A reference that is NaN or infinite changes neither the drive nor the state. The start function takes it as $rest, where v = 0.
 * - v is limited to $v_range. In the steady state, these are the references
 *   $lowest_reference .. $highest_reference. A drive at its limit within this range is no fault.
 * - `faults` tells that one of the two has happened. It stays set until the caller sets it to zero.
 * - After m bad and n good samples, v differs from the v without the bad samples by at most m * $recovery * $decay^n,
 *   apart from rounding errors, if all gains of creep have the sign of the gain.
 *   The plays return to the same state when v has moved up and down by twice the largest half-width, $widest. Until
 *   then, the drive is the right one for the actuator, which has followed the drive too.
 */

/* The state of the compensator between two samples. */
typedef struct {
    ${name}_real plays[${NAME}_PLAYS];
@creep
    ${name}_real lags[${NAME}_LAGS];
    ${name}_real carried[${NAME}_LAGS]; /* rounding errors of the lags */
@end
    ${name}_real drive;
    unsigned long out_of_reach; /* number of samples with the drive at a limit */
    unsigned faults;            /* ${NAME}_NOT_FINITE, ${NAME}_SATURATED; set it to zero to clear it */
} ${name}_state;

/* Sets the steady state after the actuator has moved from zero to this reference$output_unit, and clears
   all counters and faults. */
void ${name}_start(${name}_state *state, ${name}_real reference);

/* Returns the drive$input_unit for the next sample of the reference$output_unit. See above for bad
   samples. */
${name}_real ${name}_step(${name}_state *state, ${name}_real reference);

#endif
