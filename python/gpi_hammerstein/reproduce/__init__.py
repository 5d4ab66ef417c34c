"""Published examples and benchmarks, run again."""
