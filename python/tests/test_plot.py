"""Pictures: drawn on the axes given, labelled with units, no state left behind."""

import re
from collections.abc import Iterator

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection

import gpi_hammerstein as gpi
from records import RATE, actuator, drive

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402


@pytest.fixture(scope="module")
def record() -> gpi.Record:
    u = drive()
    return gpi.Record(
        u,
        actuator(u),
        RATE,
        warmup=100,
        input_names=["u"],
        input_units=["V"],
        output_names=["y"],
        output_units=["um"],
    )


@pytest.fixture(scope="module")
def model(record: gpi.Record) -> gpi.Model:
    return gpi.identify(record)


@pytest.fixture(autouse=True)
def closed() -> Iterator[None]:
    yield
    plt.close("all")


def labelled(ax: Axes) -> bool:
    ax.figure.canvas.draw()
    return all("[" in label and "]" in label for label in (ax.get_xlabel(), ax.get_ylabel()))


def test_given_axes_are_drawn_on_and_returned(record: gpi.Record, model: gpi.Model) -> None:
    figure = matplotlib.figure.Figure()
    u = record.u[0][:, 0]
    impulse_response = gpi.fir(u, record.y[0], 31)
    system = gpi.era(impulse_response.markov)
    left = gpi.plot.Residuals.of_model(model, record)
    for draw in (
        lambda ax: gpi.plot.loop(u, model.intermediate(u), model, ax=ax),
        lambda ax: gpi.plot.markov(impulse_response, ax=ax),
        lambda ax: gpi.plot.bode(system, RATE, ax=ax),
        lambda ax: gpi.plot.bode(system, ax=ax),
        lambda ax: gpi.plot.bode(model.linear, RATE, ax, refinement=model.refinement),
        lambda ax: gpi.plot.markov(model, ax=ax),
        lambda ax: gpi.plot.candidates(model, ax=ax),
        lambda ax: gpi.plot.history(model, ax=ax),
        lambda ax: gpi.plot.singular_values(system, ax=ax),
        lambda ax: gpi.plot.fit(model, record, ax=ax),
        lambda ax: gpi.plot.residual(model, record, ax=ax),
        lambda ax: gpi.plot.residual_in_time(left, ax),
        lambda ax: gpi.plot.residual_spectrum(left, ax),
        lambda ax: gpi.plot.residual_over_input(left, ax),
        lambda ax: gpi.plot.residual_over_speed(left, ax),
        lambda ax: gpi.plot.response(model, ax),
        lambda ax: gpi.plot.record(record, ax),
    ):
        ax = figure.add_subplot()
        assert draw(ax) is ax
        assert ax.lines and labelled(ax)
        figure.clear()
    assert plt.get_fignums() == []


def test_without_axes_a_figure_is_made(record: gpi.Record, model: gpi.Model) -> None:
    u = record.u[0][:, 0]
    axes = [
        gpi.plot.loop(u, record.y[0]),
        gpi.fir(u, record.y[0], 31).plot(),
        model.linear.plot(),
        model.plot(record),
        record.plot(),
        model.refinement.plot(),
        model.identification.plot(),
        model.compensate(record.y[0][:, 0]).plot(),
    ]
    assert all(isinstance(ax, Axes) and ax.lines for ax in axes)
    assert len(plt.get_fignums()) == len(axes)


def test_what_is_drawn_is_the_data(record: gpi.Record, model: gpi.Model) -> None:
    measured, simulated, *_ = gpi.plot.fit(model, record).lines
    np.testing.assert_array_equal(measured.get_ydata(), record.y[0][:, 0])
    np.testing.assert_allclose(simulated.get_ydata(), np.ravel(model.simulate(record.u[0])), atol=1e-9)
    drawn = gpi.plot.residual(model, record).lines[0].get_ydata()
    np.testing.assert_allclose(drawn, record.y[0][:, 0] - np.ravel(model.simulate(record.u[0])), atol=1e-9)
    bode = gpi.plot.bode(model.linear, RATE).lines[0]
    assert bode.get_xdata()[-1] == pytest.approx(RATE / 2)
    assert bode.get_ydata()[0] == pytest.approx(20 * np.log10(abs(model.linear.dc_gain.item())), abs=0.1)


def test_the_autocorrelation_is_that_of_the_scored_residual(record: gpi.Record, model: gpi.Model) -> None:
    left = gpi.plot.Residuals.of_model(model, record, remove_mean=True)
    ax = gpi.plot.residual_autocorrelation(left, lags=5)
    scored = (record.y[0] - model.simulate(record.u[0]).reshape(-1, 1))[record.warmup[0] :, 0]
    scored = scored - scored.mean()
    expected = [scored[k:] @ scored[:-k] / (scored @ scored) for k in range(1, 6)]
    np.testing.assert_allclose(ax.lines[0].get_ydata(), expected, atol=1e-9)
    [bounds] = ax.patches
    assert bounds.get_height() == pytest.approx(2 * 1.96 / np.sqrt(len(scored)))


def test_units_of_the_record_are_on_the_axes(record: gpi.Record, model: gpi.Model) -> None:
    assert gpi.plot.fit(model, record).get_ylabel() == "y [um]"
    assert "[um]" in gpi.plot.residual(model, record).get_ylabel()
    assert gpi.plot.loop(record.u[0], record.y[0], model).get_xlabel() == "input u [V]"


def test_a_system_without_singular_values_says_so() -> None:
    ax = gpi.plot.singular_values(gpi.StateSpace.from_transfer_function([0.5], [1.0, -0.5]))
    assert "no singular values" in ax.texts[0].get_text()


def test_several_channels_have_a_line_each() -> None:
    u = np.random.default_rng(0).normal(size=(400, 2))
    y = np.column_stack([u[:, 0], u[:, 1] - u[:, 0]])
    ax = gpi.plot.markov(gpi.fir(u, y, 5))
    assert ax.get_legend() is not None and len(ax.get_legend().get_texts()) == 4
    system = gpi.StateSpace(0.5 * np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))
    assert len(gpi.plot.bode(system).lines) == 4


def half_widths_of(band: PolyCollection) -> np.ndarray:
    """Half the height of a shaded band at every x."""
    corners = band.get_paths()[0].vertices
    return np.array([np.ptp(corners[corners[:, 0] == x, 1]) / 2 for x in np.unique(corners[:, 0])])


def test_bands_are_95_percent(model: gpi.Model) -> None:
    angles = np.geomspace(1e-3 * np.pi, np.pi, 1000)
    magnitude, phase = model.refinement.response_std(angles)
    ax = gpi.plot.bode(model.linear, refinement=model.refinement)
    right = ax.figure.axes[1]
    decibels = 1.96 * 20 / np.log(10) * magnitude.ravel()
    np.testing.assert_allclose(half_widths_of(ax.collections[0]), decibels, atol=1e-9)
    degrees = 1.96 * np.degrees(phase.ravel())
    np.testing.assert_allclose(half_widths_of(right.collections[0]), degrees, atol=1e-9)
    ax = gpi.plot.markov(model)
    taps = len(ax.lines[0].get_xdata())
    np.testing.assert_allclose(ax.lines[0].get_ydata(), model.linear.markov(taps).ravel())
    deviations = model.refinement.markov_std(taps).ravel()
    np.testing.assert_allclose(half_widths_of(ax.collections[0]), 1.96 * deviations, atol=1e-12)


def test_the_loop_has_the_band_of_the_model(record: gpi.Record, model: gpi.Model) -> None:
    u = record.u[0][:, 0]
    ax = gpi.plot.loop(u, record.y[0], model)
    [band] = ax.collections
    heights = [np.ptp(path.vertices[:, 1]) for path in band.get_paths()]
    assert len(heights) == len(u) - 1
    widest = 1.96 * model.refinement.loop_std(u).max()
    [text] = [text.get_text() for text in ax.get_legend().get_texts() if "band" in text.get_text()]
    assert text == f"95 % band, at most \u00b1{widest:.2g} um"


def test_every_candidate_is_drawn_and_the_chosen_one_marked(model: gpi.Model) -> None:
    rows = model.identification.candidates
    ax = gpi.plot.candidates(model)
    points, ring = ax.lines
    np.testing.assert_allclose(points.get_xdata(), [row["used"] for row in rows])
    assert np.nanmin(points.get_ydata()) == 0
    [chosen] = [row for row in rows if row["chosen"]]
    assert list(ring.get_xdata()) == [chosen["used"]]
    *_, text = (text.get_text() for text in ax.get_legend().get_texts())
    numbers = [int(number) for number in re.findall(r"\d+", text)]
    assert numbers == [chosen[name] for name in ("order", "plays", "deadzones", "delay")]
    squares = ax.figure.axes[1].lines[0]
    np.testing.assert_allclose(squares.get_ydata(), [row["rms"] for row in rows])


def test_history_ends_at_the_residual_above_the_floor(model: gpi.Model) -> None:
    steps, floor = gpi.plot.history(model).lines
    np.testing.assert_array_equal(steps.get_ydata(), model.refinement.history)
    assert floor.get_ydata()[0] == model.refinement.noise_floor["rms"][0]


def test_a_loaded_model_has_no_bands_and_says_so(record: gpi.Record, model: gpi.Model) -> None:
    loaded = gpi.Model.from_json(model.to_json())
    assert "only models that `identify` returns" in gpi.plot.candidates(loaded).texts[0].get_text()
    assert "do not contain" in gpi.plot.history(loaded).texts[0].get_text()
    assert not gpi.plot.markov(loaded).collections
    assert not gpi.plot.loop(record.u[0], record.y[0], loaded).collections
    assert gpi.plot.bode(loaded.linear, refinement=loaded.refinement).lines


def test_a_refinement_of_other_channels_is_refused(model: gpi.Model) -> None:
    system = gpi.StateSpace(0.5 * np.eye(2), np.eye(2), np.eye(2), np.zeros((2, 2)))
    with pytest.raises(gpi.ParameterError, match="`refinement` belongs to 1 outputs"):
        gpi.plot.bode(system, refinement=model.refinement)
