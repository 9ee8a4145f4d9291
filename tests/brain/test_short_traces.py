"""An eligibility trace far shorter than a call of the kernel: the lazy scale must not run out of its numbers."""

import dataclasses

import numpy as np
import pytest
from network_pair import PLASTICITY, build

from scla_mj.config import NetworkConfig


@pytest.mark.parametrize("tau_ms", [1.0, 12.0, 60.0])
def test_one_long_run_gives_the_weights_of_many_short_ones(tau_ms):
    plasticity = dataclasses.replace(PLASTICITY, eligibility_tau_ms=tau_ms)
    ends = []
    for pieces in (1, 300):
        network = build(NetworkConfig(), plasticity)
        start = network.weights.copy()
        network.release_dopamine(np.full(8, 0.5))
        for _ in range(pieces):
            network.run(1500 // pieces)
        ends.append(network.weights.copy())
    assert np.abs(ends[0] - start).max() > 5e-4
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=2e-5)
