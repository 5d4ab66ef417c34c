"""Arrays that Rust reads without the interpreter's lock keep their memory."""

import threading
import weakref

import numpy as np
import pytest

import gpi_hammerstein as gpi


@pytest.mark.parametrize("is_view", [False, True])
def test_no_other_thread_can_free_an_array_that_is_read(is_view: bool) -> None:
    bank = gpi.PlayBank(np.linspace(0.0, 1.0, 64), np.ones(64))
    owner = np.random.default_rng(1).normal(size=3_000_000)
    z = owner[1:] if is_view else owner
    found: list[np.ndarray] = []
    reader = threading.Thread(target=lambda: found.append(bank(z)))
    reader.start()
    while not weakref.getweakrefcount(owner):
        assert reader.is_alive(), "the array was read before it could be attacked"
    # `refcheck=False` would free the memory under the reader
    with pytest.raises(ValueError, match="cannot resize"):
        owner.resize(10 * owner.size, refcheck=False)
    assert reader.is_alive()
    reader.join()
    assert weakref.getweakrefcount(owner) == 0
    np.testing.assert_array_equal(found[0], bank(z.copy()))
