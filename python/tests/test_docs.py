"""Documentation that runs: every example in a docstring, and a docstring on every public name."""

import doctest
import inspect
from collections.abc import Iterator
from typing import Any

import matplotlib
import numpy as np
import pytest

import api_walk
import gpi_hammerstein as gpi

matplotlib.use("Agg")

import matplotlib.pyplot as plt  # noqa: E402


def public() -> Iterator[tuple[str, Any]]:
    own = [(name, getattr(gpi, name)) for name in sorted(set(gpi.__all__) - {"__version__"})]
    for name, thing in own + [one for one in api_walk.public() if "." in one[0]]:
        yield name, thing
        if inspect.isclass(thing):
            for member in sorted(vars(thing)):
                if not member.startswith("_"):
                    yield f"{name}.{member}", getattr(thing, member)


@pytest.mark.parametrize(("name", "thing"), list(public()), ids=[name for name, _ in public()])
def test_public_names_are_documented_and_their_examples_run(name: str, thing: Any) -> None:
    doc = inspect.getdoc(thing)
    assert doc, f"{name} has no docstring"
    test = doctest.DocTestParser().get_doctest(doc, {"gpi": gpi, "np": np}, name, None, None)
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE, verbose=False)
    runner.run(test)
    plt.close("all")
    assert runner.failures == 0, f"{runner.failures} examples of {name} fail"
