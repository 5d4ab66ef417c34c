/* Compensator: drive of u for a reference of y.
 *
 * Model: SHA-256 089f1aad1a22257d95d63013d78cd3c506e9470bd22007b8429d520f697149f1 of its file.
 * Rate: 10000 samples a second.
 * Reference: y in um.
 * Drive: u in V, from -120 to 120 V.
 * Compensated: hysteresis, creep.
 * Not compensated: dynamics: only the DC gain of G is inverted.
 * Made by gpi-hammerstein 0.1.0, `gpi export`.
 */
#ifndef GPI_COMPENSATOR_H
#define GPI_COMPENSATOR_H

typedef float gpi_compensator_real;

#define GPI_COMPENSATOR_PLAYS 8
#define GPI_COMPENSATOR_LAGS 2

/* Faults of the references. */
#define GPI_COMPENSATOR_NOT_FINITE 1u /* a reference was NaN or infinite: the drive was held */
#define GPI_COMPENSATOR_SATURATED 2u  /* a reference needed a v outside of the range below: v was set to the nearest end */

/* What happens at bad samples:
 *
 * - The drive and the state are finite after every sequence of references, and the drive is within its limits.
 * - A reference that is NaN or infinite changes neither the drive nor the state. The start function takes it as 2, where v = 0.
 * - v is limited to -170.338 .. 171.423. In the steady state, these are the references
 *   -181.965 .. 187.137. A drive at its limit within this range is no fault.
 * - `faults` tells that one of the two has happened. It stays set until the caller sets it to zero.
 * - After m bad and n good samples, v differs from the v without the bad samples by at most m * 0.0546 * 0.99980002^n,
 *   apart from rounding errors, if all gains of creep have the sign of the gain.
 *   The plays return to the same state when v has moved up and down by twice the largest half-width, 32.618. Until
 *   then, the drive is the right one for the actuator, which has followed the drive too.
 */

/* The state of the compensator between two samples. */
typedef struct {
    gpi_compensator_real plays[GPI_COMPENSATOR_PLAYS];
    gpi_compensator_real lags[GPI_COMPENSATOR_LAGS];
    gpi_compensator_real carried[GPI_COMPENSATOR_LAGS]; /* rounding errors of the lags */
    gpi_compensator_real drive;
    unsigned long out_of_reach; /* number of samples with the drive at a limit */
    unsigned faults;            /* GPI_COMPENSATOR_NOT_FINITE, GPI_COMPENSATOR_SATURATED; set it to zero to clear it */
} gpi_compensator_state;

/* Sets the steady state after the actuator has moved from zero to this reference in um, and clears
   all counters and faults. */
void gpi_compensator_start(gpi_compensator_state *state, gpi_compensator_real reference);

/* Returns the drive in V for the next sample of the reference in um. See above for bad
   samples. */
gpi_compensator_real gpi_compensator_step(gpi_compensator_state *state, gpi_compensator_real reference);

#endif
