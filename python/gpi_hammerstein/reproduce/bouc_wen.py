"""The equations of the Bouc-Wen benchmark, integrated for tests without noise.

With the displacement y, the restoring force z and the drive u in SI units (J. P. Noel and M. Schoukens,
*Hysteretic benchmark with a dynamic nonlinearity*, 2016)::

    m y'' + c y' + k y + z = u
    z' = alpha y' - beta (gamma |y'| z + delta y' |z|)

The equations are integrated with 20 steps for each sample at 750 Hz by the classical method of Runge and
Kutta.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from gpi_hammerstein._native import Record

Array = NDArray[np.float64]

RATE = 750.0
STEPS = 20
MASS, DAMPING, STIFFNESS = 2.0, 10.0, 5e4
ALPHA, BETA, GAMMA, DELTA = 5e4, 1e3, 0.8, -1.1
MILLI = 1e3
# The multisine: samples of a period, its band in Hz and its rms in N.
PERIOD, BAND, RMS = 8192, (5.0, 150.0), 50.0
# The sweep: its amplitude in N, its frequencies in Hz and its length in s. The official one takes ten times
# as long.
AMPLITUDE, SWEEP, SECONDS = 40.0, (20.0, 50.0), 20.0


def motion(u: Callable[[Array], Array], samples: int) -> Array:
    """Return the displacement in m at each sample, from rest.

    Parameters
    ----------
    u
        The drive in N at times in s.
    samples
        Number of samples at 750 Hz.

    Returns
    -------
    numpy.ndarray
        In m, (samples,).

    Examples
    --------
    >>> import numpy as np
    >>> y = motion(np.ones_like, 750)
    >>> bool(0 < y[-1] < 2 / 5e4)
    True
    """
    h = 1.0 / RATE / STEPS
    # at the beginning and in the middle of each step
    times = np.arange(2 * samples * STEPS + 1, dtype=np.float64) * (h / 2)
    drive = u(times).tolist()
    y = speed = z = 0.0
    found = np.zeros(samples)

    def slopes(y: float, speed: float, z: float, u: float) -> tuple[float, float, float]:
        bent = BETA * (GAMMA * abs(speed) * z + DELTA * speed * abs(z))
        return speed, (u - DAMPING * speed - STIFFNESS * y - z) / MASS, ALPHA * speed - bent

    for step in range(samples * STEPS):
        if step % STEPS == 0:
            found[step // STEPS] = y
        u0, u1, u2 = drive[2 * step : 2 * step + 3]
        a = slopes(y, speed, z, u0)
        b = slopes(y + h / 2 * a[0], speed + h / 2 * a[1], z + h / 2 * a[2], u1)
        c = slopes(y + h / 2 * b[0], speed + h / 2 * b[1], z + h / 2 * b[2], u1)
        d = slopes(y + h * c[0], speed + h * c[1], z + h * c[2], u2)
        y += h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
        speed += h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
        z += h / 6 * (a[2] + 2 * b[2] + 2 * c[2] + d[2])
    return found


def recorded(u: Callable[[Array], Array], samples: int, warmup: int = 0) -> Record:
    """Return a record of the equations without noise, u in N and y in mm."""
    times = np.arange(samples, dtype=np.float64) / RATE
    y = MILLI * motion(u, samples)
    return Record(u(times), y, rate=RATE, warmup=warmup, input_units=["N"], output_units=["mm"])


def multisine(seed: int = 0) -> Record:
    """Return two periods of a multisine of random phases; the first period is the warm-up.

    Parameters
    ----------
    seed
        Seed of the phases.

    Returns
    -------
    Record
        u in N, y in mm.

    Examples
    --------
    >>> multisine().samples  # doctest: +SKIP
    16384
    """
    random = np.random.default_rng(seed)
    lines = np.arange(int(np.ceil(BAND[0] * PERIOD / RATE)), int(BAND[1] * PERIOD / RATE) + 1)
    phases = random.uniform(0, 2 * np.pi, len(lines))
    size = RMS * np.sqrt(2 / len(lines))

    def u(times: Array) -> Array:
        # all times of the integration lie on a grid, on which a Fourier sum is one transform
        count = round(PERIOD / RATE / (times[1] - times[0]))
        spectrum = np.zeros(count // 2 + 1, dtype=np.complex128)
        spectrum[lines] = size * count / 2 * np.exp(1j * phases)
        period = np.fft.irfft(spectrum, count)
        return np.resize(period, len(times))

    return recorded(u, 2 * PERIOD, warmup=PERIOD)


def sweep() -> Record:
    """Return a sine whose frequency rises linearly, from rest.

    Returns
    -------
    Record
        u in N, y in mm.

    Examples
    --------
    >>> sweep().rate  # doctest: +SKIP
    750.0
    """
    low, high = SWEEP
    slope = (high - low) / SECONDS

    def u(times: Array) -> Array:
        phase = 2 * np.pi * (low * times + slope / 2 * times**2)
        return np.asarray(AMPLITUDE * np.sin(phase))

    return recorded(u, int(SECONDS * RATE))
