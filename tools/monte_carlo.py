"""Print the scatter of estimates and the coverage of their confidence intervals over repeated refinements.

The simulated plant has four plays, two deadzones and a resonance. The output contains noise at a
signal-to-noise ratio of 40 dB. Every refinement starts from perturbed parameters. Run it from the root of the
project: `python tools/monte_carlo.py`.
"""

import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "tests"))

import trials  # noqa: E402  the tests repeat these trials with fewer runs

RUNS = 2000
LARGEST_RATIO = 1.15
COVERAGE = (0.93, 0.97)


def efficiency(found: trials.Trials) -> None:
    """Print the errors next to the Cramer-Rao bound."""
    print(f"root mean square error over the Cramer-Rao bound, {RUNS} runs under white noise")
    print(f"  {'parameter':24s} {'value':>9s} {'bound':>9s} {'ratio':>6s} {'coverage':>9s}")
    ratios, inside = found.efficiency(), found.parameters.inside().mean(axis=0)
    for name, value, bound, ratio, share in zip(
        found.names, found.truth, found.cramer_rao, ratios, inside, strict=True
    ):
        print(f"  {name:24s} {value:9.4f} {bound:9.2e} {ratio:6.3f} {100 * share:7.1f} %")
    print(f"  largest ratio {ratios.max():.3f} (limit {LARGEST_RATIO})")


def coverage(name: str, found: trials.Trials) -> None:
    """Print the shares of the 95 % intervals that contain the true value."""
    print(f"95 % intervals that contain the true value, {name}, {RUNS} runs, Huber's loss in {found.robust}")
    low, high = (100 * limit for limit in COVERAGE)
    for quantity in ("parameters", "markov", "magnitude", "loop"):
        scatter: trials.Scatter = getattr(found, quantity)
        single = 100 * scatter.inside().mean(axis=0)
        pooled = 100 * scatter.coverage()
        verdict = "" if low <= pooled <= high else f"  OUTSIDE {low:.0f} to {high:.0f} %"
        print(
            f"  {quantity:12s} {pooled:5.1f} %, single {single.min():5.1f} to {single.max():5.1f} %{verdict}"
        )


if __name__ == "__main__":
    start = time.perf_counter()
    white = trials.run(RUNS, trials.white)
    efficiency(white)
    coverage("white noise", white)
    coverage("autocorrelated noise", trials.run(RUNS, trials.coloured))
    coverage("white noise, robust", trials.run(RUNS, trials.white, robust=True))
    print(f"{time.perf_counter() - start:.0f} s")
