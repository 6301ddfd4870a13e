"""The crosshead without the noise of its readings."""

from __future__ import annotations

import numpy as np
from scipy.signal import savgol_filter

from calib.lab.signal import smoothed_record


def test_a_smooth_record_becomes_the_parabolas_of_savitzky_and_golay_also_at_its_ends() -> None:
    time = np.cumsum(np.random.default_rng(1).uniform(0.08, 0.12, 300))
    x = 1e-3 + 2e-5 * time + 1e-7 * time**2 + 1e-6 * np.random.default_rng(2).standard_normal(time.size)
    smooth_time, smooth_x = smoothed_record(time, x, 21)
    alike = np.abs(smooth_x - savgol_filter(x, 21, 2)) < 1e-12
    assert np.mean(alike) > 0.9
    assert alike[0]
    assert alike[-1]
    np.testing.assert_allclose(smooth_time[alike], savgol_filter(time, 21, 2)[alike], rtol=1e-9)
