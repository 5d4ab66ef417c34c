"""Springs and friction elements, as forces that follow an imposed displacement.

Each has `step(dx, seconds)`: the force after a displacement dx within some seconds, at constant speed.
"""

from __future__ import annotations

import math
from typing import Protocol


class Element(Protocol):
    """A force with memory."""

    def step(self, dx: float, seconds: float) -> float:
        """The force after the displacement `dx`."""
        ...


class Power:
    """F = square x^2 + cube x^3: a spring beside the linear one [1].

    1. Nayfeh, Mook, Nonlinear Oscillations, Wiley, 1979, ch. 2.
    """

    def __init__(self, square: float, cube: float) -> None:
        self.square, self.cube, self.x = square, cube, 0.0

    def step(self, dx: float, seconds: float) -> float:
        """The force after the displacement `dx`."""
        self.x += dx
        return (self.square + self.cube * self.x) * self.x * self.x


class Dahl:
    """dF/dx = stiffness (1 - F sgn(x') / limit) [1]: rate independent, solved exactly over each step.

    1. Dahl, A solid friction model, Aerospace Corporation TOR-0158(3107-18), 1968.
    """

    def __init__(self, stiffness: float, limit: float) -> None:
        self.stiffness, self.limit, self.force = stiffness, limit, 0.0

    def step(self, dx: float, seconds: float) -> float:
        """The force after the displacement `dx`."""
        end = math.copysign(self.limit, dx)
        self.force = end + (self.force - end) * math.exp(-self.stiffness * abs(dx) / self.limit)
        return self.force


class LuGre:
    """Bristles: z' = v - s0 |v| z / g(v), F = s0 z + s1 z' + s2 v [1].

    g(v) = coulomb + extra exp(-(v / v_s)^2), s0 the stiffness, s1 the micro-damping, s2 the viscous friction.
    coulomb + extra is the force at which it breaks away when the force grows slowly. The equation of z is
    solved exactly for the constant speed of a step; z' is the mean over the step.

    1. Canudas de Wit, Olsson, Astrom, Lischinsky, A new model for control of systems with friction, IEEE
       Trans. Automatic Control 40, 1995.
    """

    def __init__(
        self, stiffness: float, micro: float, viscous: float, coulomb: float, extra: float, stribeck: float
    ) -> None:
        self.stiffness, self.micro, self.viscous = stiffness, micro, viscous
        self.coulomb, self.extra, self.stribeck, self.z = coulomb, extra, stribeck, 0.0

    def steady(self, speed: float) -> float:
        """The force of steady sliding."""
        ratio = speed / self.stribeck
        level = self.coulomb + self.extra * math.exp(-ratio * ratio)
        return math.copysign(level, speed) + self.viscous * speed

    def step(self, dx: float, seconds: float) -> float:
        """The force after the displacement `dx`."""
        speed = dx / seconds
        ratio = speed / self.stribeck
        level = self.coulomb + self.extra * math.exp(-ratio * ratio)
        end, before = math.copysign(level, dx) / self.stiffness, self.z
        self.z = end + (before - end) * math.exp(-self.stiffness * abs(dx) / level)
        return self.stiffness * self.z + self.micro * (self.z - before) / seconds + self.viscous * speed


class MaxwellSlip:
    """Springs in series with Coulomb blocks, side by side: F_i <- clip(F_i + k_i dx, -f_i, f_i) [1].

    1. Goldfarb, Celanovic, Modeling piezoelectric stack actuators for control of micromanipulation, IEEE
       Control Systems 17, 1997.
    """

    def __init__(self, stiffnesses: list[float], limits: list[float]) -> None:
        self.blocks = list(zip(stiffnesses, limits, strict=True))
        self.forces = [0.0] * len(limits)

    def step(self, dx: float, seconds: float) -> float:
        """The force after the displacement `dx`."""
        pairs = zip(self.forces, self.blocks, strict=True)
        self.forces = [max(-limit, min(limit, force + k * dx)) for force, (k, limit) in pairs]
        return sum(self.forces)


class BoucWen:
    """F = stiffness z, z' = x' - beta |x'| |z|^(n-1) z - gamma x' |z|^n: Wen's restoring force [1].

    It is solved by the midpoint rule over each step.

    1. Wen, Method for random vibration of hysteretic systems, J. Eng. Mech. Div. ASCE 102, 1976.
    """

    def __init__(self, stiffness: float, beta: float, gamma: float, power: float) -> None:
        self.stiffness, self.beta, self.gamma, self.power, self.z = stiffness, beta, gamma, power, 0.0

    def change(self, z: float, dx: float) -> float:
        """dz for a small dx."""
        size = math.pow(abs(z), self.power)
        return dx - abs(dx) * self.beta * math.copysign(size, z) - dx * self.gamma * size

    def step(self, dx: float, seconds: float) -> float:
        """The force after the displacement `dx`."""
        half = self.z + 0.5 * self.change(self.z, dx)
        self.z += self.change(half, dx)
        return self.stiffness * self.z
