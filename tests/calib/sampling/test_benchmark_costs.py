"""What `benchmarks/sampling.py` says an effective sample size costs, and the targets that are built to fool a sampler."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "benchmarks"))

from samplers.known import shares
from samplers.shipped import Budget, Cost, longer
from samplers.traps import traps
from sampling import print_shipped

from calib.sampling.diagnostics import Convergence, Gate

TRAPS = traps()


def state(r_hat: float, ess: float, tau: float, steps: int) -> Convergence:
    n = np.ones(3)
    return Convergence(r_hat * n, ess * n, ess * n, tau * n, steps)


def test_what_a_gate_would_cost_is_told_by_what_is_furthest_from_it() -> None:
    gate = Gate(r_hat=1.01, ess=400, length=10)
    assert longer(state(1.001, 100, 2, 100), gate) == pytest.approx(4)
    assert longer(state(1.001, 4000, 30, 100), gate) == pytest.approx(3)
    assert longer(state(1.05, 4000, 2, 100), gate) == pytest.approx(5)
    assert longer(state(1.001, 4000, 2, 100), gate) == 1


def test_a_guess_is_not_told_as_if_it_were_measured() -> None:
    assert str(Cost(400, 32.34, 4728.4)) == "400 | 32.3 | 4728"
    assert str(Cost(400, 1234.5, 97.2, stopped=300.1)) == "400 | about 1234 | 97 after 300 s"
    assert str(Cost(400, np.inf, 1.2, stopped=300.1)) == "400 | more than 300 | 1 after 300 s"


def test_a_peer_that_is_not_installed_is_left_out(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr("samplers.shipped.CONTENDERS", {"nuts": "no_such_package", "zeus": "no_such_package_either"})
    print_shipped(["nuts", "zeus"], [400.0], 1, Budget(100, 10.0))
    said = capsys.readouterr().out
    assert "nuts is left out: it is not installed" in said
    assert "zeus is left out: it is not installed" in said


@pytest.mark.parametrize("name", TRAPS)
def test_draws_of_a_trap_are_of_its_density(name: str) -> None:
    """Widening exact draws by a factor about zero changes their mean density ratio by the factor's volume, if both are one."""
    target = TRAPS[name]
    x = target.exact(np.random.default_rng(1), 20_000)
    factor = 1.01
    ratio = np.exp(target.density(x * factor) - target.density(x)) * factor**target.n
    kept = np.isfinite(ratio)
    assert np.mean(ratio[kept]) == pytest.approx(1, abs=0.05)


def test_shares_of_the_modes_of_a_trap_are_its_weights() -> None:
    target = TRAPS["two funnels"]
    assert shares(target, target.exact(np.random.default_rng(2), 5000), 2) == pytest.approx([0.6, 0.4], abs=0.03)
