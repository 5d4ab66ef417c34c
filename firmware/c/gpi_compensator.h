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

/* The state of the compensator between two samples. */
typedef struct {
    gpi_compensator_real plays[GPI_COMPENSATOR_PLAYS];
    gpi_compensator_real lags[GPI_COMPENSATOR_LAGS];
    gpi_compensator_real carried[GPI_COMPENSATOR_LAGS]; /* rounding errors of the lags */
    gpi_compensator_real drive;
    unsigned long out_of_reach; /* number of samples with the drive at a limit */
} gpi_compensator_state;

/* Sets the steady state after the actuator has moved from zero to this reference in um. */
void gpi_compensator_start(gpi_compensator_state *state, gpi_compensator_real reference);

/* Returns the drive in V for the next sample of the reference in um. If the reference is not finite, the drive does not
   change. */
gpi_compensator_real gpi_compensator_step(gpi_compensator_state *state, gpi_compensator_real reference);

#endif
