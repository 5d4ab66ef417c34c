"""The closed loop: a stage that has changed since follows again once it is explained."""

import pytest

import tracking


@pytest.mark.slow
def test_what_explain_finds_makes_the_stage_follow(monkeypatch):
    monkeypatch.setattr(tracking, "SECONDS", 6.0)
    monkeypatch.setattr(tracking, "RATE", 1000.0)
    static_curve, as_it_was, anew, explained, gain, share, noise = tracking.track(2)
    assert explained < noise and explained < anew < static_curve
    assert as_it_was < static_curve
    assert gain == static_curve / explained > 10
    # what the old model misses is what has changed
    assert share > 99
