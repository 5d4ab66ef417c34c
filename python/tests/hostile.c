/* Hostile references for an exported compensator, see test_hostile_references.py, which defines
 *
 *   SOURCE, START, STEP, STATE, PLAYS_OF, NOT_FINITE, SATURATED   the compensator
 *   BITS                                                          an unsigned integer as wide as its numbers
 *   SAMPLES                                                       the number of hostile samples
 *   LOW, HIGH, V_LOW, V_HIGH                                      the limits of the drive, the range of v
 *   LEAST, MOST                                                   the references between which the recovery is tested
 *   RECOVERY, DECAY, SLOPE                                        the documented bound, drive per v
 *   ROUNDING                                                      rounding errors of the drive
 */
#include SOURCE

#include <stdint.h>
#include <stdio.h>
#include <string.h>

static uint64_t seed = 88172645463325252u;

static uint64_t next(void)
{
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return seed;
}

/* All patterns of bits: NaN with every payload, infinities, subnormal and huge numbers; and large round numbers. */
static real hostile(void)
{
    static const real special[] = {0.0f, -0.0f, 1e37f, -1e37f, 1e10f, -1e10f, 1e-40f, FLT_MAX, -FLT_MAX};
    const uint64_t draw = next();
    const BITS bits = (BITS)next();
    real value;
    if (draw % 4 == 0)
        return special[draw / 4 % (sizeof special / sizeof special[0])];
    memcpy(&value, &bits, sizeof value);
    return value;
}

static int fail(const char *why, real a, real b)
{
    fprintf(stderr, "%s: %.9g %.9g\n", why, (double)a, (double)b);
    return 1;
}

static int is_wrong(const STATE *state)
{
    int i;
    if (!(state->drive >= LOW && state->drive <= HIGH))
        return fail("the drive is not within its limits", state->drive, 0);
    for (i = 0; i < PLAYS; ++i)
        if (!(state->plays[i] >= V_LOW * 1.0001 - half_widths[i] && state->plays[i] <= V_HIGH * 1.0001 + half_widths[i]))
            return fail("a play is out of range", state->plays[i], 0);
#ifdef LAGS
    for (i = 0; i < LAGS; ++i)
        if (!(state->lags[i] >= V_LOW * 1.0001 && state->lags[i] <= V_HIGH * 1.0001))
            return fail("a lag is out of range", state->lags[i], 0);
#endif
    return 0;
}

/* A triangle between LEAST and MOST of 64 samples. */
static real good(int k)
{
    const int place = k % 64;
    return (real)(LEAST + (MOST - LEAST) * (place < 32 ? place : 64 - place) / 32.0);
}

int main(void)
{
    STATE clean, hurt, worn;
    unsigned long done = 0, compared = 0, at_limit = 0;
    START(&worn, good(0));
    while (done < SAMPLES) {
        int bad, started, burst, k;
        double bound;
        unsigned expected;
        /* most bursts hit one state, which is never reset */
        for (burst = 0; burst < 32; ++burst) {
            for (k = 0; k < 8; ++k, ++done) {
                STEP(&worn, hostile());
                if (is_wrong(&worn))
                    return 1;
            }
            STEP(&worn, good(burst));
            if (is_wrong(&worn))
                return 1;
        }
        bad = 1 + (int)(next() % 8);
        started = (int)(next() % 16) == 0;
        expected = 0;
        START(&clean, good(0));
        hurt = clean;
        if (hurt.faults != 0)
            return fail("a good start is a fault", 0, 0);
        for (k = 0; k < 64; ++k) {
            STEP(&clean, good(k));
            STEP(&hurt, good(k));
        }
        if (started) { /* a start from nothing but a bad reference */
            memset(&hurt, 0xff, sizeof hurt);
            START(&hurt, hostile());
            ++done;
            if (is_wrong(&hurt))
                return 1;
        }
        hurt.faults = 0;
        for (k = 0; k < bad; ++k) {
            const real reference = hostile();
            const real held = hurt.drive;
            const real u = STEP(&hurt, reference);
            STEP(&clean, good(0));
            ++done;
            if (is_wrong(&hurt) || u != hurt.drive)
                return fail("after a bad sample", reference, u);
            if (!is_finite(reference)) {
                expected |= NOT_FINITE;
                if (u != held)
                    return fail("not held", u, held);
            }
            if ((hurt.faults & NOT_FINITE) != (expected & NOT_FINITE))
                return fail("the flag is wrong", reference, u);
        }
        if (started)
            continue; /* all lags began at the bad reference: not the case of the bound */
        hurt.faults = 0;
        bound = bad * RECOVERY;
        /* the first triangle returns the plays to the same state */
        for (k = 0; k < 400; ++k) {
            const unsigned long before = hurt.out_of_reach + clean.out_of_reach;
            const real a = STEP(&clean, good(k)), b = STEP(&hurt, good(k));
            const double apart = a > b ? (double)a - (double)b : (double)b - (double)a;
            bound *= DECAY;
            at_limit += hurt.out_of_reach + clean.out_of_reach != before;
            if (is_wrong(&hurt))
                return 1;
            if (hurt.faults != 0)
                return fail("a good sample is a fault", good(k), b);
            if (k >= 128) {
                ++compared;
                if (!(apart <= SLOPE * bound + ROUNDING))
                    return fail("not recovered", a, b);
            }
        }
    }
    printf("%lu %lu %lu\n", done, compared, at_limit);
    return 0;
}
