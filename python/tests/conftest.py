"""Shared by all tests: property tests repeat themselves in CI, and what is written is as its JSON Schema."""

import os
from collections.abc import Iterator

import matplotlib.pyplot as plt
import pytest
from hypothesis import settings

import schemas

settings.register_profile("explore", deadline=None, max_examples=100)
settings.register_profile("repeat", deadline=None, max_examples=100, derandomize=True)
settings.load_profile("repeat" if os.environ.get("CI") else "explore")


@pytest.fixture(autouse=True)
def no_open_figures() -> Iterator[None]:
    """Close the figures of a test: pyplot keeps them, and tests of the same process count them."""
    yield
    plt.close("all")


@pytest.fixture(scope="session", autouse=True)
def every_file_is_as_its_schema() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        schemas.watch(patch)
        yield
