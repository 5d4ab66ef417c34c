/* The drive of u for a reference of y.
 *
 * Model: SHA-256 089f1aad1a22257d95d63013d78cd3c506e9470bd22007b8429d520f697149f1 of its file.
 * Rate: 10000 samples a second.
 * Reference: y in um.
 * Drive: u in V, from -120 to 120 V.
 * Undone: hysteresis, creep.
 * Left: dynamics: of G only the DC gain is undone.
 * Made by gpi-hammerstein 0.1.0, `gpi export`.
 */
#ifndef GPI_COMPENSATOR_H
#define GPI_COMPENSATOR_H

typedef float gpi_compensator_real;

#define GPI_COMPENSATOR_PLAYS 8
#define GPI_COMPENSATOR_LAGS 2

/* What the compensator remembers between two samples. */
typedef struct {
    gpi_compensator_real plays[GPI_COMPENSATOR_PLAYS];
    gpi_compensator_real lags[GPI_COMPENSATOR_LAGS];
    gpi_compensator_real carried[GPI_COMPENSATOR_LAGS]; /* what rounding has taken from the lags */
    gpi_compensator_real drive;
    unsigned long out_of_reach; /* samples at which the drive stood at a limit */
} gpi_compensator_state;

/* An actuator that was brought from zero to this reference in um long ago. */
void gpi_compensator_start(gpi_compensator_state *state, gpi_compensator_real reference);

/* The drive in V for the next sample of the reference in um; one that is not finite holds the drive. */
gpi_compensator_real gpi_compensator_step(gpi_compensator_state *state, gpi_compensator_real reference);

#endif
