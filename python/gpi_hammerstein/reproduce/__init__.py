"""Reproduction of published examples and benchmarks."""
