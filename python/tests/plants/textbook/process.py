"""Processes that are slow themselves: their lags are their dynamics and not creep."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from ..excitation import Array
from .drives import Drive
from .run import Run, measured


def levels(inflow: Array, rate: float, times: tuple[float, float], tops: tuple[float, float]) -> Array:
    """The level of the lower of two tanks, which the upper one fills [1], by explicit Euler.

        T_1 x_1' = q - sqrt(x_1),    T_2 x_2' = sqrt(x_1) - sqrt(x_2),    x_i <= top_i

    q is the inflow. Water above the top overflows; the tanks begin in equilibrium.

    1. Johansson, The quadruple-tank process, IEEE Transactions on Control Systems Technology 8, 2000 (two of
       its tanks); Schoukens, Mattsson, Wigren, Noel, Cascaded tanks benchmark, 2016 (the overflow).
    """
    (fill, drain), (first, second), step = times, tops, 1 / rate
    upper, lower = min(inflow[0] ** 2, first), min(inflow[0] ** 2, second)
    found = []
    for q in inflow.tolist():
        found.append(lower)
        between, out = math.sqrt(upper), math.sqrt(lower)
        upper = min(max(upper + step / fill * (q - between), 0.0), first)
        lower = min(max(lower + step / drain * (between - out), 0.0), second)
    return np.array(found)


def tanks(random: Generator, drive: Drive) -> Run:
    """Two tanks in a row, which may overflow. A small stream flows even at a drive of 0."""
    base = random.uniform(0.2, 0.4)
    times = random.uniform(0.08, 0.2), random.uniform(0.08, 0.2)
    tops = random.uniform(0.6, 1.2), random.uniform(0.6, 1.2)
    level = levels(base + (1 - base) * drive.unit, drive.rate, times, tops)
    return measured(random, drive, drive.travel * level)


def heater(random: Generator, drive: Drive) -> Run:
    """A body that is heated and that the air cools; its heat reaches a sensor through a wall [1, ch. 5].

        T theta' = P - theta,    T_s s' = theta - s,    P = (1 + b) u / (1 + b u) the power of a bent valve

    1. Incropera, DeWitt, Fundamentals of Heat and Mass Transfer, 5th ed., Wiley, 2002.
    """
    bend = random.uniform(0.0, 0.8)
    power = (1 + bend) * drive.unit / (1 + bend * drive.unit)
    body, sensor = (1 / drive.rate / random.uniform(low, 2.5 * low) for low in (0.1, 0.04))
    theta = shown = float(power[0])
    found = []
    for value in power.tolist():
        found.append(shown)
        shown += sensor * (theta - shown)
        theta += body * (value - theta)
    return measured(random, drive, drive.travel * np.array(found))
