"""Shared by all tests: property tests repeat themselves in CI and explore elsewhere."""

import os

from hypothesis import settings

settings.register_profile("explore", deadline=None, max_examples=100)
settings.register_profile("repeat", deadline=None, max_examples=100, derandomize=True)
settings.load_profile("repeat" if os.environ.get("CI") else "explore")
