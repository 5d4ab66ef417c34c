"""Pictures: drawn on the axes given, labelled with units, no state left behind."""

from collections.abc import Iterator

import matplotlib
import numpy as np
import pytest
from matplotlib.axes import Axes

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
    for draw in (
        lambda ax: gpi.plot.loop(u, model.intermediate(u), model, ax=ax),
        lambda ax: gpi.plot.markov(impulse_response, ax=ax),
        lambda ax: gpi.plot.bode(system, RATE, ax=ax),
        lambda ax: gpi.plot.bode(system, ax=ax),
        lambda ax: gpi.plot.singular_values(system, ax=ax),
        lambda ax: gpi.plot.fit(model, record, ax=ax),
        lambda ax: gpi.plot.residual(model, record, ax=ax),
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
