"""Documentation that runs: every example in a docstring, and a docstring on every public name."""

import doctest
import inspect
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

import gpi_hammerstein as gpi


def public() -> Iterator[tuple[str, Any]]:
    for name in sorted(set(gpi.__all__) - {"__version__"}):
        thing = getattr(gpi, name)
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
    assert runner.failures == 0, f"{runner.failures} examples of {name} fail"
