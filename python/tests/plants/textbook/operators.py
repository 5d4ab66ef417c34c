"""Hysteresis between the input and a mode that is no sum of plays."""

from __future__ import annotations

import numpy as np
from numpy.random import Generator

from ..excitation import Array
from .drives import Drive
from .linear import first_mode, modal_sum
from .run import Run, measured


def relay_sum(u: Array, up: Array, down: Array, weights: Array) -> Array:
    """v = sum_i weights_i R_i[u]; R_i becomes 1 above `up`, -1 below `down`, and starts at -1 [1, ch. 1].

    1. Mayergoyz, Mathematical Models of Hysteresis, Springer, 1991.
    """
    state, v = np.full(len(up), -1.0), np.empty_like(u)
    for k, value in enumerate(u):
        state[value > up] = 1.0
        state[value < down] = -1.0
        v[k] = weights @ state
    return v


def ramp_sum(u: Array, up: Array, down: Array, rise: float, weights: Array) -> Array:
    """v = sum_i weights_i K_i[u], K_i a relay whose flanks rise over `rise`, a half-relay or a slope [1].

    K <- min(max(K, c(u - up)), c(u - down)), c(x) = clip(2 x / rise - 1, -1, 1), down < up: c(u - up) is
    the flank on which K rises, c(u - down) that on which it falls. It starts at -1.

    1. Banks, Kurdila, Webb, Identification of hysteretic control influence operators representing smart
       actuators, Mathematical Problems in Engineering 3, 1997.
    """
    state, v = np.full(len(up), -1.0), np.empty_like(u)
    for k, value in enumerate(u):
        np.maximum(state, np.clip(2 * (value - up) / rise - 1, -1, 1), out=state)
        np.minimum(state, np.clip(2 * (value - down) / rise - 1, -1, 1), out=state)
        v[k] = weights @ state
    return v


def bouc_wen_path(u: Array, a: float, beta: float, gamma: float) -> Array:
    """The hysteretic variable z' = a u' - beta |u'| z - gamma u' |z|, z(0) = 0 [1].

    Between samples u moves straight and z keeps its sign in each small step, in which the equation is linear
    in z and is solved exactly.

    1. Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102, 1976.
    """
    z, before, path = 0.0, u[0], np.empty_like(u)
    for k, value in enumerate(u.tolist()):
        steps = max(1, int(np.ceil(abs(value - before) / 0.005)))
        du = (value - before) / steps
        for _ in range(steps):
            rate = beta * np.sign(du) + gamma * np.sign(z if z else du)
            # dz = (a - rate z) du
            z += (a - rate * z) * (-np.expm1(-rate * du) / rate if rate else du)
        path[k], before = z, value
    return path


def duhem_path(u: Array, alpha: float, slope: float, b: float) -> Array:
    """v' = alpha |u'| (slope u - v) + b u', v(0) = b u(0): the Coleman-Hodgdon case of Duhem's model [1].

    It is solved exactly for a straight u between samples.

    1. Coleman, Hodgdon, A constitutive relation for rate-independent hysteresis in ferromagnetically soft
       materials, Int. J. Eng. Science 24, 1986.
    """
    v, before, path = b * u[0], u[0], np.empty_like(u)
    for k, value in enumerate(u.tolist()):
        way = abs(value - before)
        if way:
            side = np.sign(value - before)
            # dv/ds = alpha (slope (before + side s) - v) + b side, over the way s
            shift = side * (b - slope) / alpha
            v = slope * value + shift + (v - slope * before - shift) * np.exp(-alpha * way)
        path[k], before = v, value
    return path


def behind(random: Generator, drive: Drive, v: Array) -> Run:
    """The hysteresis before a mode, scaled to um; the first value of v holds it at rest."""
    return measured(
        random, drive, modal_sum(drive.travel * (v - v[0]), drive.rate, [first_mode(random, drive)])
    )


def relays(random: Generator, drive: Drive) -> Run:
    """30 to 60 relays of random thresholds before a mode (`relay_sum`)."""
    count = int(random.integers(30, 61))
    centre, half = random.uniform(0.15, 0.85, count), random.uniform(0.02, 0.3, count)
    weights = random.uniform(0.5, 1.5, count) / count
    return behind(random, drive, relay_sum(drive.unit, centre + half, centre - half, weights))


def ramps(random: Generator, drive: Drive) -> Run:
    """40 to 80 Krasnoselskii-Pokrovskii kernels before a mode (`ramp_sum`)."""
    count = int(random.integers(40, 81))
    centre, half = random.uniform(0.1, 0.7, count), random.uniform(0.02, 0.25, count)
    weights = random.uniform(0.5, 1.5, count) / count
    rise = float(random.uniform(0.1, 0.3))
    return behind(random, drive, ramp_sum(drive.unit, centre + half, centre - half, rise, weights))


def bouc_wen(random: Generator, drive: Drive) -> Run:
    """A piezo ceramic: v = d u - z, z a Bouc-Wen variable (`bouc_wen_path`) [1], before a mode.

    1. Low, Guo, Modeling of a three-layer piezoelectric bimorph beam with hysteresis, J. MEMS 4, 1995.
    """
    beta, gamma = random.uniform(3, 8), random.uniform(-2, 2)
    z = bouc_wen_path(drive.unit, random.uniform(0.3, 0.7), beta, gamma)
    return behind(random, drive, drive.unit - z)


def duhem(random: Generator, drive: Drive) -> Run:
    """The Coleman-Hodgdon hysteresis (`duhem_path`) before a mode."""
    v = duhem_path(drive.unit, random.uniform(1.0, 6.0), 1.0, random.uniform(0.4, 0.8))
    return behind(random, drive, v)
