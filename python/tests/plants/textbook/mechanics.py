"""Masses that a force drives against an element with memory, or against nothing: presliding, integrators."""

from __future__ import annotations

import math

import numpy as np
from numpy.random import Generator

from ..excitation import Array
from .drives import Drive
from .friction import BoucWen, Dahl, Element, LuGre, MaxwellSlip, Power
from .linear import held
from .run import Run, measured

REACH = 5.0  # travels in a second at full speed
PHASE_PER_STEP = 0.06  # of the undamped mode, in rad, within one step of integration


def sprung(drive: Drive, damping: float, element: Element, stiffest: float) -> Array:
    """x'' + 2 damping w x' + w^2 (x + F[x] - u) = 0 from rest, F the element, in units of the spring.

    Symplectic Euler with steps short enough for the element's own `stiffest`, per unit of the spring.
    """
    w = 2 * np.pi * drive.resonance
    steps = math.ceil(w * math.sqrt(1 + stiffest) / drive.rate / PHASE_PER_STEP)
    h = 1 / drive.rate / steps
    fade, kick = math.exp(-2 * damping * w * h), w * w * h
    x = speed = force = 0.0
    motion = []
    for value in drive.unit.tolist():
        motion.append(x)
        for _ in range(steps):
            speed = fade * (speed + kick * (value - x - force))
            dx = speed * h
            x += dx
            force = element.step(dx, h)
    return np.array(motion)


def scaled(random: Generator, drive: Drive, x: Array) -> Run:
    """In um, with white noise."""
    return measured(random, drive, drive.travel * x)


def duffing(random: Generator, drive: Drive) -> Run:
    """A mass on a spring that is not linear (`Power`): Duffing's oscillator and a square."""
    cube, square = random.uniform(0.2, 1.0), random.uniform(-0.2, 0.2)
    element = Power(square, cube)
    # the spring is stiffest where the mass moves by two travels
    stiffest = 4 * abs(square) + 12 * cube
    return scaled(random, drive, sprung(drive, random.uniform(0.03, 0.15), element, stiffest))


def dahl(random: Generator, drive: Drive) -> Run:
    """A flexure stage on a guide with Dahl's friction (`Dahl`)."""
    stiffness, limit = random.uniform(0.5, 2.0), random.uniform(0.04, 0.12)
    element = Dahl(stiffness, limit)
    return scaled(random, drive, sprung(drive, random.uniform(0.03, 0.15), element, stiffness))


def lugre(random: Generator, drive: Drive) -> Run:
    """A flexure stage on a guide with LuGre friction (`LuGre`)."""
    w = 2 * np.pi * drive.resonance
    stiffness, coulomb = random.uniform(0.5, 2.0), random.uniform(0.03, 0.1)
    element = LuGre(
        stiffness,
        micro=random.uniform(0.02, 0.1) / w,
        viscous=random.uniform(0.0, 0.05) / w,
        coulomb=coulomb,
        extra=random.uniform(0.2, 0.6) * coulomb,
        stribeck=random.uniform(0.02, 0.1) * w,
    )
    return scaled(random, drive, sprung(drive, random.uniform(0.03, 0.15), element, stiffness))


def maxwell_slip(random: Generator, drive: Drive) -> Run:
    """A stack actuator: a mass on a spring and 4 to 8 elasto-slide elements (`MaxwellSlip`)."""
    count = int(random.integers(4, 9))
    stiffnesses = random.uniform(0.5, 1.5, count) * random.uniform(0.2, 0.8) / count
    limits = stiffnesses * random.uniform(0.03, 0.5, count)
    element = MaxwellSlip(stiffnesses.tolist(), limits.tolist())
    return scaled(random, drive, sprung(drive, random.uniform(0.02, 0.1), element, float(stiffnesses.sum())))


def bouc_wen_spring(random: Generator, drive: Drive) -> Run:
    """A mass on Wen's hysteretic restoring force (`BoucWen`)."""
    stiffness, largest = random.uniform(0.2, 0.8), random.uniform(0.1, 0.3)
    power, share = random.uniform(1.0, 2.0), random.uniform(0.4, 0.9)
    # z ends at (beta + gamma)^(-1 / power)
    total = largest**-power
    element = BoucWen(stiffness, share * total, (1 - share) * total, power)
    return scaled(random, drive, sprung(drive, random.uniform(0.02, 0.1), element, stiffness))


def motor(random: Generator, drive: Drive) -> Run:
    """A motor-driven slide: T v' = u - v - c tanh(v / v_0) - s exp(-(v / v_s)^2) tanh(v / v_0), x' = v [1].

    Viscous, Coulomb and Stribeck friction; nothing holds the slide's place.

    1. Olsson, Astrom, Canudas de Wit, Gafvert, Lischinsky, Friction models and friction compensation,
       European Journal of Control 4, 1998.
    """
    # so slow that the slide follows speed, not force
    time = random.uniform(3, 15) / drive.resonance
    coulomb = random.uniform(0.05, 0.2)
    extra, stribeck, smooth = random.uniform(0.0, 0.5) * coulomb, random.uniform(0.03, 0.1), 0.001
    steps = math.ceil(2 * coulomb / smooth / time / drive.rate) + 2
    h = 1 / drive.rate / steps
    speed = x = 0.0
    motion = []
    for value in drive.unit.tolist():
        motion.append(x)
        for _ in range(steps):
            ratio = speed / stribeck
            friction = (coulomb + extra * math.exp(-ratio * ratio)) * math.tanh(speed / smooth)
            speed += h / time * (value - speed - friction)
            x += h * speed
    return scaled(random, drive, REACH * np.array(motion))


def slide(random: Generator, drive: Drive) -> Run:
    """A motor-driven slide between end stops: T v' = u - v - k x - c sign(v), low <= x <= high.

    x' = `REACH` v. At rest, dry friction takes any value up to c. A stop gives a part of the speed back [1].

    1. Brogliato, Nonsmooth Mechanics, Springer, 2016.
    """
    time = random.uniform(1, 5) / drive.resonance
    coulomb, stiffness, back = random.uniform(0.1, 0.3), random.uniform(0.0, 1.0), random.uniform(0.0, 0.3)
    low, high = -random.uniform(0.2, 0.4), random.uniform(0.2, 0.4)
    steps = math.ceil(20 / time / drive.rate)
    h = 1 / drive.rate / steps
    rub = coulomb * h / time
    speed = x = 0.0
    motion = []
    for value in drive.unit.tolist():
        motion.append(x)
        for _ in range(steps):
            speed += h / time * (value - speed - stiffness * x)
            speed = math.copysign(max(abs(speed) - rub, 0.0), speed)
            x += REACH * h * speed
            if not low <= x <= high:
                x, speed = min(max(x, low), high), -back * speed
    return scaled(random, drive, np.array(motion))


def hydraulic(random: Generator, drive: Drive) -> Run:
    """A valve and a cylinder: x / q = 1 / (s (s^2 / w^2 + 2 damping s / w + 1)), q the flow [1, ch. 6].

    q = u outside of the valve's overlap, and 0 within.

    1. Merritt, Hydraulic Control Systems, Wiley, 1967.
    """
    w, damping = 2 * np.pi * drive.resonance, random.uniform(0.05, 0.3)
    overlap = random.uniform(0.0, 0.04)
    flow = np.sign(drive.unit) * np.maximum(np.abs(drive.unit) - overlap, 0)
    x = held([w * w], [1.0, 2 * damping * w, w * w, 0.0], drive.rate, flow)
    return scaled(random, drive, REACH * x)
