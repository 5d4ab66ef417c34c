"""The textbook stages: their parts obey their equations, and their records are what they are said to be."""

from pathlib import Path

import numpy as np
import pytest
import scipy.signal
from numpy.typing import NDArray

from plants import textbook
from plants.excitation import stream
from plants.hysteresis import play_bank
from plants.textbook import combined, friction, loops, mechanics, process, sensing, slow
from plants.textbook.drives import Drive
from plants.textbook.linear import Mode, lag, modal_sum
from plants.textbook.run import Run, ordinary

Array = NDArray[np.float64]

RATE = 1000.0


def drive_of(unit: Array, resonance: float = 50.0) -> Drive:
    """An experiment with this signal."""
    return Drive(np.asarray(unit), RATE, 0, (3, 0), 1.0, 1.0, resonance, ())


def swing(samples: int = 20_000) -> Drive:
    """Two sines between 0 and 1."""
    t = np.arange(samples) / RATE
    return drive_of(0.5 - 0.3 * np.cos(2 * np.pi * 0.7 * t) - 0.2 * np.cos(2 * np.pi * 3.1 * t))


def besides(simulate, drive: Drive, seed: int = 2) -> tuple[Array, Run]:
    """What a stage adds to the ordinary stage of the same random numbers."""
    run = simulate(stream("test", seed), drive)
    return run.y - ordinary(stream("test", seed), drive), run


def left_by(target: Array, columns: Array) -> float:
    """The rms that least squares leave."""
    fit = np.linalg.lstsq(columns, target, rcond=None)[0]
    return float(np.sqrt(np.mean((target - columns @ fit) ** 2)))


def test_the_simulator_does_not_know_the_package() -> None:
    for path in Path(textbook.__file__).parent.glob("*.py"):
        assert "import gpi_hammerstein" not in path.read_text()
    assert len(textbook.STAGES) >= 21


@pytest.mark.parametrize("name", [*textbook.ORDINARY, *textbook.MECHANICS])
def test_a_seed_is_one_stage_and_one_experiment(name: str) -> None:
    one, same, again, other = (textbook.draw(name, *seeds) for seeds in ((4,), (4,), (4, 1), (5,)))
    assert np.array_equal(one.u, same.u) and np.array_equal(one.y, same.y)
    assert one.noise == again.noise and one.rate == again.rate and len(one.u) == len(again.u)
    assert not np.array_equal(one.u, again.u)
    assert len(one.u) == len(one.y) and 7_000 <= len(one.u) <= 40_000
    assert 5e-5 < one.noise / one.y.std() < 2e-2
    assert not one.in_motion and other.in_motion
    if name != "feedback":  # whose noise moves it
        assert not np.any(one.u[: round(0.2 * one.rate)])
    assert np.ptp(other.u[: round(other.rate)]) > 0.01 * np.ptp(other.u)


def test_a_mode_answers_a_step_as_the_differential_equation_says() -> None:
    mode = Mode(40.0, 0.1, 0.7)
    t, w = np.arange(400) / RATE, 2 * np.pi * 40.0
    damped = w * np.sqrt(1 - 0.01)
    exact = 0.7 * (1 - np.exp(-0.1 * w * t) * (np.cos(damped * t) + 0.1 * w / damped * np.sin(damped * t)))
    assert modal_sum(np.ones(400), RATE, [mode]) == pytest.approx(exact, abs=1e-9)
    assert lag(np.concatenate([[0.0], np.ones(399)]), RATE, 0.05)[1:] == pytest.approx(
        -np.expm1(-t[:-1] / 0.05)
    )


class Nothing:
    """An element without a force."""

    def step(self, dx: float, seconds: float) -> float:
        """No force."""
        return 0.0


def test_a_mass_without_friction_is_a_mode() -> None:
    drive = swing(3000)
    linear = modal_sum(drive.unit, RATE, [Mode(drive.resonance, 0.05)])
    found = mechanics.sprung(drive, 0.05, Nothing(), 0.0)
    assert np.abs(found - linear).max() < 5e-3 * np.ptp(linear)


def test_a_cubic_spring_gives_way_as_the_equation_of_its_rest_says() -> None:
    element = friction.Power(0.1, 0.5)
    rest = mechanics.sprung(drive_of(np.full(4000, 0.8)), 0.2, element, 6.0)[-1]
    assert rest + 0.1 * rest**2 + 0.5 * rest**3 == pytest.approx(0.8, rel=1e-3)


def test_what_is_put_beside_a_force_is_added_to_its_record() -> None:
    drive = swing()
    for name, (force, _) in combined.FORCES.items():
        alone = force(stream(name, 1), drive)
        warm, humming = (put(force)(stream(name, 1), drive) for put in (combined.warming, combined.humming))
        random = stream(name, 1)
        size = random.uniform(8, 25)
        cold = force(random, drive)
        assert (warm.y - cold.y).std() == pytest.approx(size * cold.noise)
        assert np.array_equal(warm.u, drive.u) and np.array_equal(humming.u, drive.u)
        # the numbers of the mains are drawn behind those of the element, those of heat and creep before
        added = humming.y - alone.y
        line = np.abs(np.fft.rfft(added)).argmax() * RATE / len(added)
        assert min(abs(line - 50), abs(line - 60)) < 0.2 and 2.5 < added.std() / alone.noise < 12
    step = drive_of(np.concatenate([np.zeros(500), np.full(11_500, 0.5)]))
    slow_part = combined.creeping(mechanics.dahl)(stream("dahl", 1), step).y
    gone = (slow_part[11_000:].mean() - slow_part[2500:3500].mean()) / slow_part[11_000:].mean()
    assert 0.001 < gone < 0.04


def test_a_motor_sticks_below_its_friction_and_an_integrator_keeps_its_place() -> None:
    square = np.sign(np.sin(2 * np.pi * 0.5 * np.arange(8000) / RATE + 1e-9))
    weak, strong = (mechanics.motor(stream("motor", 1), drive_of(size * square)).y for size in (0.02, 0.8))
    assert np.ptp(weak) / 0.02 < 0.1 * np.ptp(strong) / 0.8
    pulse = np.zeros(8000)
    pulse[1000:2000], pulse[4000:5000] = 0.5, -0.5
    moved = mechanics.hydraulic(stream("valve", 1), drive_of(pulse)).y
    assert moved[3500] == pytest.approx(mechanics.REACH * 0.5, rel=0.1)
    assert abs(moved[3900] - moved[3000]) < 0.01 * moved[3500]
    assert abs(moved[-1]) < 0.01 * moved[3500]


def test_a_tank_empties_as_torricelli_says_and_overflows_at_its_top() -> None:
    inflow = np.concatenate([np.full(4000, 0.8), np.zeros(500)])
    level = process.levels(inflow, RATE, (1e-2, 0.4), (2.0, 2.0))
    assert level[3999] == pytest.approx(0.64)
    # with the upper tank soon empty, sqrt(x) falls by 1 / (2 T) in a second
    assert np.sqrt(level[4100]) - np.sqrt(level[4300]) == pytest.approx(0.2 / (2 * 0.4), rel=1e-2)
    assert process.levels(inflow, RATE, (1e-2, 0.4), (2.0, 0.5))[:4000] == pytest.approx(0.5)
    assert process.levels(inflow, RATE, (1e-2, 0.4), (0.25, 2.0))[3999] == pytest.approx(0.25, rel=1e-3)


def test_a_heater_is_two_lags_behind_a_bent_curve() -> None:
    drive = drive_of(np.concatenate([np.zeros(500), np.full(9500, 0.5)]))
    run = process.heater(stream("heater", 1), drive)
    assert abs(run.y[400]) < 5 * run.noise
    assert 0.5 <= run.y[-500:].mean() < 0.9
    t = np.arange(9500) / RATE
    rest = (run.y[-500:].mean() - run.y[500:]) / run.y[-500:].mean()
    taus = np.geomspace(0.03, 0.3, 60)
    fits = [
        left_by(rest, np.stack([np.exp(-t / one), np.exp(-t / other)], axis=1))
        for one in taus
        for other in taus[taus > one]
    ]
    assert min(fits) < 2 * run.noise / run.y[-500:].mean()


@pytest.mark.parametrize("wanted", [0.8, 1.0, 1.2])
def test_flicker_has_the_slope_of_its_spectrum(wanted: float) -> None:
    f, power = scipy.signal.welch(
        sensing.power_law(np.random.default_rng(1), 1 << 18, wanted), nperseg=1 << 14
    )
    inside = (f > 1e-3) & (f < 0.4)
    slope = np.polyfit(np.log(f[inside]), np.log(power[inside]), 1)[0]
    assert slope == pytest.approx(-wanted, abs=0.06)


def test_a_telegraph_has_two_levels_its_dwell_times_and_a_lorentzian_spectrum() -> None:
    up, down = 0.03, 0.09
    signal = sensing.telegraph(np.random.default_rng(1), 1 << 20, RATE, up, down)
    assert set(np.unique(signal)) == {-1.0, 1.0}
    assert np.mean(signal > 0) == pytest.approx(up / (up + down), abs=0.01)
    edges = np.flatnonzero(np.diff(signal))
    stays = np.diff(edges) / RATE
    assert stays[signal[edges[:-1] + 1] > 0].mean() == pytest.approx(up, rel=0.05)
    f, power = scipy.signal.welch(signal, RATE, nperseg=1 << 14)
    share, time = up / (up + down), 1 / (1 / up + 1 / down)
    lorentz = 16 * share * (1 - share) * time / (1 + (2 * np.pi * f * time) ** 2)
    inside = (f > 0.5) & (f < 50)
    assert np.mean(power[inside] / lorentz[inside]) == pytest.approx(1, abs=0.1)


def test_a_converter_errs_by_at_most_half_a_step_and_evenly() -> None:
    x = np.random.default_rng(1).uniform(0, 100, 50_000)
    error = sensing.quantise(x, 0.5) - x
    assert np.abs(error).max() <= 0.25
    assert error.std() == pytest.approx(0.5 / np.sqrt(12), rel=0.02)
    run = textbook.draw("quantised", 2)
    gaps = np.diff(np.unique(run.y))
    # levels are whole multiples of the step apart
    assert gaps / gaps.min() == pytest.approx(np.round(gaps / gaps.min()), abs=1e-3)


def test_a_sensor_clips_and_another_one_bends() -> None:
    clipped, run = besides(sensing.clipped, swing())
    top = run.y == run.y.max()
    assert 0.02 < top.mean() < 0.6
    assert np.abs(clipped[(run.y < run.y.max()) & (run.y > run.y.min())]).max() < 6 * run.noise
    bend, run = besides(sensing.bent, swing())
    e = 2 * (run.y - bend) - 1
    powers = np.stack([np.ones_like(e), e**2, e**3], axis=1)
    assert left_by(bend, powers) == pytest.approx(run.noise, rel=0.05)
    assert bend.std() > 3 * run.noise


def test_creep_is_the_same_in_every_decade() -> None:
    step = np.ones(40_000)
    crept = slow.log_creep(step, RATE, 0.02, 1e-3) - 1
    assert crept[[9, 99, 999, 9999]] == pytest.approx(0.02 * np.log10(np.array([10, 100, 1000, 10_000])))
    assert slow.log_creep(2 * step, RATE, 0.02, 1e-3) == pytest.approx(2 * crept + 2)


def test_heat_is_a_smooth_function_of_time() -> None:
    drift, run = besides(slow.thermal, swing())
    knots = np.linspace(-1, 1, len(drift))
    assert left_by(drift, np.polynomial.chebyshev.chebvander(knots, 9)) == pytest.approx(run.noise, rel=0.05)
    assert drift.std() > 7 * run.noise
    change, run = besides(slow.gain, swing())
    x = run.y - change
    smooth = x[:, None] * np.polynomial.chebyshev.chebvander(knots, 9)
    assert left_by(change, smooth) == pytest.approx(run.noise, rel=0.05)
    assert change.std() > 4 * run.noise


def test_columns_leak_at_once_through_a_lag_or_not_at_all() -> None:
    drive = swing()
    leaked, run = besides(slow.leak, drive)
    assert run.columns is not None and run.columns.shape == (20_000, 2)
    assert left_by(leaked, run.columns[:, :1]) == pytest.approx(run.noise, rel=0.05)
    assert left_by(leaked, run.columns[:, 1:]) > 4 * run.noise
    late, run = besides(slow.lagged_leak, drive)
    assert run.columns is not None
    lags = [lag(run.columns[:, 0], RATE, tau) for tau in np.geomspace(0.1, 0.6, 40)]
    assert left_by(late, run.columns) > 1.5 * run.noise
    assert min(left_by(late, theta[:, None]) for theta in lags) == pytest.approx(run.noise, rel=0.05)
    idle, run = besides(slow.idle_columns, drive)
    assert run.columns is not None
    assert left_by(idle, run.columns) == pytest.approx(run.noise, rel=0.05)
    assert idle.std() == pytest.approx(run.noise, rel=0.05)


def test_the_mains_are_a_line_and_its_odd_harmonics() -> None:
    hum, run = besides(slow.hum, swing())
    t = np.arange(len(hum)) / RATE
    f, power = scipy.signal.periodogram(hum, RATE)
    base = f[np.argmax(power)]
    assert min(abs(base - 50), abs(base - 60)) < 0.15
    fits = []
    for hertz in np.linspace(base - 0.05, base + 0.05, 41):
        phases = 2 * np.pi * hertz * np.outer(t, [1, 3, 5])
        fits.append(left_by(hum, np.concatenate([np.cos(phases), np.sin(phases)], axis=1)))
    assert min(fits) == pytest.approx(run.noise, rel=0.05)
    assert hum.std() > 3 * run.noise


def test_feedback_makes_the_input_depend_on_the_past_output() -> None:
    w = 2 * np.pi * 50
    top, bottom, _ = scipy.signal.cont2discrete(([w * w], [1.0, 0.3 * w, w * w]), 1 / RATE)
    half_widths, weights = np.array([0.0, 0.1, 0.2]), np.array([0.6, 0.25, 0.15])
    setting = (half_widths, weights, (np.ravel(top), bottom), 0.03)
    reference = np.full(3000, 0.5)
    quiet, struck = np.zeros(3000), np.zeros(3000)
    struck[2000] = 0.1
    (u, y), (other, _) = (loops.closed_loop(reference, noise, *setting) for noise in (quiet, struck))
    assert np.array_equal(u[:2000], other[:2000])
    assert other[2000] - u[2000] == pytest.approx(-0.03 * 0.1)
    assert y[-1] == pytest.approx(0.5, abs=1e-3)  # integral control
    # y is what the open stage gives for the same u
    assert modal_sum(play_bank(u, half_widths) @ weights, RATE, [Mode(50.0, 0.15)]) == pytest.approx(
        y, abs=1e-9
    )


def test_two_modes_are_linear_and_late() -> None:
    impulse = np.zeros(3000)
    impulse[500] = 1.0
    one, two = (loops.two_modes(stream("modes", 3), drive_of(size * impulse, 40.0)) for size in (1.0, 2.0))
    assert two.y - one.y == pytest.approx(one.y, abs=20 * one.noise)
    strength = np.abs(scipy.signal.periodogram(one.y[500:], RATE)[1])
    assert len(scipy.signal.find_peaks(strength, prominence=0.02 * strength.max())[0]) >= 2
    assert np.abs(one.y[:502]).max() < 6 * one.noise < np.abs(one.y).max()
