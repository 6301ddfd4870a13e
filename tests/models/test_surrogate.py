"""The surrogate against the finite elements it stands in for, its range, and its file."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from models import training
from models.response import OutOfRangeError
from models.sensor import design_from
from models.surrogate import closed_force, fit_surrogate, load_surrogate, plate_form
from models.training import DIELECTRIC_POINTS, ELECTRODE_POINTS, PATH, TrainingSet, design_points
from models.validation import random_designs, validate

PAPER = {
    "indenter_radius": 5e-3,
    "sensor_thickness": 0.74e-3,
    "sensor_radius": 10e-3,
    "young_modulus": 0.62e6,
    "relative_permittivity": 2.8,
    "padding_thickness": 1.10e-3,
}


@pytest.fixture(scope="module")
def shipped():
    return load_surrogate()


def test_shipped_surrogate_agrees_with_fresh_finite_elements(shipped):
    with ThreadPoolExecutor(2) as executor:
        result = validate(shipped, random_designs(8, seed=20261121), executor, accuracy=1e-3)
    assert not result.failures
    assert np.quantile(np.abs(result.force_error), 0.95) < 0.01
    assert np.quantile(np.abs(result.change_error), 0.95) < 0.02
    assert [row[0] for row in result.table()] == ["force", "capacitance change"]


def test_shipped_surrogate_says_where_it_comes_from(shipped):
    info = shipped.info()
    assert len(info["training hash (SHA-256)"]) == 64
    assert info["range of h_p/R"] == "0 to 3.6"
    assert {"finite elements", "training paths", "date", "numpy"} <= set(info)


def test_shipped_surrogate_covers_what_a_gripper_lab_asks_for(shipped):
    # R 5 mm, a 10 mm, h_s 0.5-1.2 mm, h_p 0-9 mm, E_p/E 0.5-2: 10 N at E = 0.5 MPa, or 55 % of the stack where that is first.
    h_s, h_p, ratio = (
        g.ravel()
        for g in np.meshgrid(
            np.linspace(0.5e-3, 1.2e-3, 6), np.array([0, 0.5, 1, 2, 4, 6.5, 9]) * 1e-3, [0.5, 1, 2], indexing="ij"
        )
    )
    design = design_from(
        PAPER
        | {"sensor_thickness": h_s, "padding_thickness": h_p, "young_modulus": 0.5e6, "padding_young_modulus": ratio * 0.5e6}
    )
    limit = shipped.max_depth(design)
    assert np.all(limit > 0)
    force = shipped.respond(design, limit[:, None] * (1 - 1e-9)).force[:, 0]
    assert np.all((force > 10) | (limit > 0.55 * (h_s + h_p)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"sensor_thickness": 3e-3}, r"h_s/R from 0\.06 to 0\.5, got 0\.6"),
        ({"padding_thickness": 19e-3}, r"h_p/R from 0 to 3\.6, got 3\.8"),
        ({"indenter_radius": 9e-3}, r"a/R from 1\.25 to 4, got 1\.111"),
        ({"padding_young_modulus": 0.062e6}, r"E_p/E from 0\.25 to 4, got 0\.1"),
        ({"dielectric_thickness": 0.05e-3}, r"t_d/h_s from 0\.1 to 0\.5, got 0\.06757"),
        ({"electrode_radius": 4e-3}, r"a_e/a from 0\.5 to 1, got 0\.4"),
    ],
)
def test_designs_outside_the_training_range_are_refused_with_the_bound(shipped, change, words):
    design = design_from(PAPER | change)
    assert shipped.max_depth(design) == 0
    with pytest.raises(OutOfRangeError, match=words):
        shipped.respond(design, np.array([0.1e-3]))


def test_curves_are_smooth_and_rising_over_the_whole_range(shipped):
    for design in random_designs(60, seed=3):
        depth = float(shipped.max_depth(design)[0]) * np.linspace(0.001, 0.999, 300)
        slope = np.gradient(np.log(shipped.respond(design, depth).force), np.log(depth))[1:-1]
        assert np.all(slope > 1.2)
        assert np.all(slope < 8)


def test_padding_without_thickness_has_no_modulus(shipped):
    depth = np.array([0.2e-3])
    bare = PAPER | {"padding_thickness": 0.0}
    soft, stiff = (shipped.respond(design_from(bare | {"padding_young_modulus": e}), depth) for e in (0.2e6, 2e6))
    assert soft.force == stiff.force


def synthetic_training(n, noise, seed=0):
    """Paths whose three ratios to the closed forms are known smooth functions, plus noise: fast, with a known answer."""
    rng = np.random.default_rng(seed)
    groups = design_points(n, seed)
    x = training.to_unit(groups)
    depth = training.reach(*groups[:, :3].T)[:, None] * PATH**2
    wave = np.cos(x @ [0.4, -0.6, 0.0, 0.5])[:, None]
    force = closed_force(groups, depth) * np.exp(0.3 * wave * PATH + noise * rng.normal(size=(n, 1)) * PATH)
    change = (0.9 + 0.2 * wave * PATH)[:, :, None, None] * (1 + DIELECTRIC_POINTS[:, None]) * ELECTRODE_POINTS**-1.0
    change = change * (1 + noise * rng.normal(size=(n, 1, 1, 1)))
    change = change * plate_form(groups, depth)[:, :, None, None] / ((ELECTRODE_POINTS * groups[:, 2:3]) ** 2)[:, None, None]
    return TrainingSet(groups, force, np.sqrt(depth) * np.exp(0.1 * PATH), change, (), 1.0, seed)


def test_fit_recovers_smooth_functions_and_knows_its_error():
    exact = fit_surrogate(synthetic_training(1200, 0.0), degree=7)
    noisy = fit_surrogate(synthetic_training(1200, 0.01), degree=7)
    design = design_from(PAPER | {"padding_young_modulus": 0.9e6})
    depth = exact.max_depth(design) * np.array([0.3, 0.999])
    truth, guess = exact.respond(design, depth), noisy.respond(design, depth)
    assert np.all(np.linalg.norm(truth.force_error, axis=-1) < 2e-3 * truth.force)
    # 1 % of noise in the paths: the fit averages it away, the leave-one-out error still sees it.
    np.testing.assert_allclose(guess.force, truth.force, rtol=1.5e-2)
    sd = np.linalg.norm(guess.force_error, axis=-1) / guess.force
    np.testing.assert_allclose(sd, 0.01 * np.sqrt([0.3, 0.999]), rtol=0.35)


def test_surrogate_file_round_trip_is_exact_and_foreign_files_are_refused(tmp_path):
    surrogate = fit_surrogate(synthetic_training(300, 0.01), degree=4)
    surrogate.save(tmp_path / "s.npz")
    again = load_surrogate(tmp_path / "s.npz")
    design, depth = design_from(PAPER), np.array([0.1e-3, 0.5e-3])
    np.testing.assert_array_equal(again.respond(design, depth).capacitance, surrogate.respond(design, depth).capacitance)
    assert again.info() == surrogate.info()
    (tmp_path / "foreign.npz").write_bytes(b"not a surrogate")
    for path in (tmp_path / "foreign.npz", tmp_path / "missing.npz"):
        with pytest.raises(ValueError, match="is not a surrogate file"):
            load_surrogate(path)


def test_too_few_paths_for_the_polynomials_are_refused():
    with pytest.raises(ValueError, match="50 training paths are too few for 42 terms; give at least 63"):
        fit_surrogate(synthetic_training(50, 0.0), degree=4)
