"""What a model of a record can and cannot determine, and what an experiment must contain for it.

The rules follow from the model and need no fit:

- A play of half-width r moves its output only if a swing of the input is longer than 2 r. Half-widths up to
  half the largest swing are determined. Swings between the same two levels determine one loop only, because
  every combination of plays with this loop is equal there.
- A linear system of order n has 2 n parameters, and needs as large an order of persistent excitation. It is
  determined where the input has power, and a sampled response shows nothing above half the sampling rate.
- A slow lag with the time constant T has reached 63 % of its response after T. A record of the duration D
  shows time constants up to about D / 3. The fastest lag that is not part of the linear dynamics takes some
  samples.
- An effect of the speed of the input needs equal swings at several speeds, and an effect of its amplitude
  needs several amplitudes. Otherwise it is the same as another curve.
"""

from dataclasses import dataclass

from gpi_hammerstein.inspection.excitation import Excitation

# Whole swings for a loop: one in each direction.
SWINGS = 2
# Lengths of swings that determine nested loops. By hand: two lengths give two loops.
NESTED = 3
# Ratio of speeds that shows an effect of the speed. By hand.
SPEEDS = 3.0
# Amplitudes that distinguish a curve from a loop.
AMPLITUDES = 2
# Part of the duration that the longest time constant can have.
SLOWEST = 1 / 3
# Samples of the fastest lag.
FASTEST = 10.0
# Durations in s from which slow effects are visible at all, and are told apart from a trend. By hand: creep
# of piezo stacks has time constants from 0.1 s to some minutes.
SLOW, LONG = 3.0, 60.0
# Time in s that the input must rest for creep to be seen alone.
HOLD = 5.0
# Mains frequency in Hz, of which some periods must be in the record.
MAINS, PERIODS = 60.0, 20.0


@dataclass(frozen=True)
class Facts:
    """What the rules ask of a record."""

    rate: float
    duration: float
    """Duration of the longest experiment in s."""
    experiments: int
    excitations: list[Excitation]
    order: int | None
    """Order of persistent excitation; None where it grows with the number of taps."""
    covariates: list[str]
    input_unit: str


@dataclass(frozen=True)
class Answer:
    """Whether a property can be identified, and why."""

    what: str
    possible: str
    """``yes``, ``partly`` or ``no``."""
    why: str
    experiment: str = ""
    """The kind of excitation that would determine it: ``triangle``, ``multisine`` or ``steps``."""


def answers(facts: Facts) -> list[Answer]:
    """Return what a model of the record can and cannot determine.

    Parameters
    ----------
    facts
        Properties of the record.

    Returns
    -------
    list of Answer
        One answer for each property; for several inputs, of the one that is excited least.

    Examples
    --------
    >>> from gpi_hammerstein.inspection.excitation import Excitation
    >>> slow = Excitation(0.0, 10.0, (1.0, 1.0), 20, 10.0, 1, 1.0, 0.0, 1.0)
    >>> found = answers(Facts(1000.0, 10.0, 1, [slow], 2, [], "V"))
    >>> [answer.what for answer in found if answer.possible == "no"]  # doctest: +ELLIPSIS
    ['rate dependence...
    """
    weakest = min(facts.excitations, key=lambda found: (found.lengths, found.swings))
    if not weakest.span() > 0:
        return [Answer("anything", "no", "an input is constant", "multisine")]
    return [
        _hysteresis(facts, weakest),
        _dynamics(facts),
        _slow(facts, weakest),
        _rate_dependence(weakest),
        _amplitude(weakest),
        _periodic(facts),
        _covariates(facts),
        _noise(facts, weakest),
    ]


def _hysteresis(facts: Facts, found: Excitation) -> Answer:
    unit = f" {facts.input_unit}" if facts.input_unit else ""
    limit = f"half-widths up to {0.5 * found.largest_swing:.4g}{unit}, half the largest stroke"
    if found.swings < SWINGS:
        return Answer("hysteresis", "no", "the input reverses too rarely for a hysteresis loop", "triangle")
    if found.lengths < NESTED:
        loops = "one loop, because all strokes have the same length" if found.lengths == 1 else "two loops"
        return Answer("hysteresis", "partly", f"{limit}, but only along {loops}", "triangle")
    return Answer("hysteresis", "yes", f"{limit}; the strokes have {found.lengths} different lengths")


def _dynamics(facts: Facts) -> Answer:
    what = "linear dynamics (resonances, delay)"
    top = max(found.band_hz[1] for found in facts.excitations)
    if facts.order is not None:
        lines = max(1, facts.order // 2)
        seen = "one frequency" if lines == 1 else f"about {lines} frequencies"
        return Answer(
            what,
            "partly",
            f"only at {seen}, up to {top:.3g} Hz",
            "multisine",
        )
    return Answer(what, "yes", f"up to about {top:.3g} Hz, where 99.5 % of the power of the input lies")


def _slow(facts: Facts, found: Excitation) -> Answer:
    what = "slow response (creep), drift"
    longest = SLOWEST * facts.duration
    lags = f"time constants from {FASTEST / facts.rate:.3g} s to {longest:.3g} s"
    if facts.duration < SLOW:
        return Answer(what, "no", f"the longest experiment takes only {facts.duration:.3g} s", "steps")
    if found.longest_hold_s >= HOLD or facts.duration >= LONG:
        rests = (
            f"; the input is constant for up to {found.longest_hold_s:.3g} s"
            if found.longest_hold_s >= HOLD
            else ""
        )
        return Answer(what, "yes", lags + rests)
    return Answer(
        what,
        "partly",
        f"{lags}; creep and drift cannot be distinguished: the input is never constant for {HOLD:g} s",
        "steps",
    )


def _rate_dependence(found: Excitation) -> Answer:
    what = "rate dependence, slew rate"
    if found.speeds >= SPEEDS:
        return Answer(what, "yes", f"the speeds of long strokes differ by a factor of {found.speeds:.3g}")
    return Answer(
        what,
        "no",
        f"all long strokes have about the same speed (factor {found.speeds:.2f}); repeat one triangle at "
        "three speeds",
        "triangle",
    )


def _amplitude(found: Excitation) -> Answer:
    what = "curves (sensor, stiffness, butterfly)"
    if found.lengths >= AMPLITUDES:
        return Answer(what, "yes", f"the strokes have {found.lengths} different lengths")
    return Answer(what, "partly", "all strokes have the same length", "triangle")


def _periodic(facts: Facts) -> Answer:
    what = "mains hum, other periodic disturbances"
    if facts.rate < 2 * MAINS:
        return Answer(
            what, "no", f"mains frequency is above half the sampling rate, {0.5 * facts.rate:.4g} Hz"
        )
    low = PERIODS / facts.duration
    return Answer(what, "yes", f"from {low:.3g} Hz ({PERIODS:g} periods) to {0.5 * facts.rate:.4g} Hz")


def _covariates(facts: Facts) -> Answer:
    what = "influence of temperature, load, .."
    if facts.covariates:
        return Answer(what, "yes", f"if the other columns show it: {', '.join(facts.covariates)}")
    return Answer(what, "no", "no other quantity was recorded; record it in a column of its own")


def _noise(facts: Facts, found: Excitation) -> Answer:
    what = "noise of the sensor"
    if found.period_s is not None:
        return Answer(what, "yes", f"the input repeats every {found.period_s:.4g} s")
    if found.longest_hold_s >= 1.0:
        return Answer(what, "yes", "the input is constant for a while")
    return Answer(
        what,
        "partly",
        "estimated from high frequencies, because the input neither repeats nor is constant for a while",
    )
