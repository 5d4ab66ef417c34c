"""The operations on one sample of which an exported model consists."""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

#: Where an operation acts, in the order of the signal chain.
Place = Literal["input", "widths", "curves", "parallel", "loops", "displaced", "output", "added"]


@dataclass(frozen=True)
class Operation:
    """One operation: a function of the templates with its arguments, and what it remembers.

    The functions take the memory, the signal, the numbers, the arrays and the number of the sample, in this
    order, as far as the operation has them. The templates of each language contain one function of each kind.
    """

    #: The name of the function.
    kind: str
    place: Place
    #: The channel on which it acts: of the inputs before the dynamics, of the outputs behind them.
    channel: int = 0
    numbers: dict[str, float | int] = field(default_factory=dict)
    arrays: dict[str, Array] = field(default_factory=dict)
    #: Its number among all operations.
    number: int = 0
    #: How many numbers it remembers, and from which place of the model's memory on.
    memory: int = 0
    first: int = 0
    #: What it remembers at rest for a signal of 1, where that is not zero.
    standing: Array | None = None
    #: Whether it needs the number of the sample.
    timed: bool = False
    #: The column of the covariates that it reads.
    column: int | None = None
    #: The name of that column.
    label: str = ""
    #: The dead time of v in samples before it.
    late: int = 0
    #: A loop: the row that makes its signal of the states and v, unless it sees an output.
    seen: Array | None = None
    #: A loop: what its result adds to each state.
    drives: Array | None = None
