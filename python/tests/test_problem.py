"""The cost and its derivatives for other optimisers."""

import numpy as np
import pytest
from conftest import MODELS

import kmcfit as km


@pytest.fixture(scope="module")
def problem(record):
    time, force, acceleration = record
    data = km.Experiment(time=time, force=force, acceleration=acceleration, sigma=0.02)
    stiffness = km.PiecewiseLinear(knots=3, start=1480.0)
    return km.Model(mass=2.4, damping=km.Constant(start=1.2), stiffness=stiffness).problem(data)


def differences(function, theta, along, step):
    """Central difference of order 2."""
    return (function(theta + step * along) - function(theta - step * along)) / (2 * step)


def test_derivatives_are_those_of_finite_differences(problem):
    theta = problem.start
    assert len(problem.names) == len(theta) and problem.names[0] == "damping"
    cost, gradient = problem.cost_and_gradient(theta)
    assert cost == pytest.approx(problem.cost(theta), rel=1e-12)
    scales = np.maximum(np.abs(theta), 0.01)
    rng = np.random.default_rng(3)
    for _ in range(4):
        along = scales * rng.standard_normal(len(theta))
        # Truncation of order step^2 and rounding of order 1e-16/step: 1e-6 of the scale of each term.
        expected = differences(problem.cost, theta, along, 1e-6)
        assert gradient @ along == pytest.approx(expected, rel=2e-5, abs=1e-5 * np.abs(gradient * along).max())
        change = problem.jvp(theta, along)
        by_difference = differences(problem.predict, theta, along, 1e-6)
        assert np.max(np.abs(change - by_difference)) < 1e-6 * np.max(np.abs(change))


@pytest.fixture(scope="module")
def constants(record):
    """Constants only, and two records of several channels."""
    time, force, acceleration = record
    given = dict(time=time, force=force, sigma=0.02)
    first = km.Experiment(**given, acceleration=acceleration)
    second = km.Experiment(
        **{**given, "sigma": {"acceleration": 0.02, "displacement": 1e-5}}, acceleration=acceleration, displacement=acceleration * 1e-3
    )
    return km.Model(mass=2.4, damping=km.Constant(start=1.2), stiffness=km.Constant(start=1480.0)).problem(first, second)


@pytest.mark.parametrize("name", ["problem", "constants"])
def test_products_with_the_jacobian_agree(name, request):
    problem = request.getfixturevalue(name)
    theta = problem.start
    rng = np.random.default_rng(4)
    along, slopes = rng.standard_normal(len(theta)), rng.standard_normal(len(problem.observed))
    jacobian = problem.jacobian(theta)
    assert jacobian.shape == (len(problem.observed), len(theta))
    # Products of 401 terms: rounding of 1e-12 relative to the sum of their magnitudes.
    assert problem.jvp(theta, along) == pytest.approx(jacobian @ along, rel=1e-9, abs=1e-9 * np.abs(jacobian @ along).max())
    assert problem.vjp(theta, slopes) == pytest.approx(slopes @ jacobian, rel=1e-9)
    residuals, weights = problem.residuals(theta), problem.weights(theta)
    assert problem.cost(theta) == pytest.approx(np.sum(weights * residuals**2), rel=1e-12)
    assert problem.gradient(theta) == pytest.approx(2 * problem.vjp(theta, weights * residuals), rel=1e-8)
    assert len(problem.observed) == (401 if name == "problem" else 3 * 401)


def test_scipy_finds_the_optimum_of_the_fit(record):
    optimize = pytest.importorskip("scipy.optimize")
    time, force, acceleration = record
    data = km.Experiment(time=time, force=force, acceleration=acceleration, sigma=0.02, noise={"acceleration": "white"})
    stiffness = km.PiecewiseLinear(knots=3, start=1480.0)
    # An automatic grid is refined by the fit and not by the problem.
    grid = {"nodes": 2001, "method": "rk4"}
    model = km.Model(mass=2.4, damping=km.Constant(start=1.2), stiffness=stiffness, grid=grid)
    fit, problem = model.fit(data), model.problem(data)
    scales = np.maximum(np.abs(problem.start), 0.01)
    root = np.sqrt(problem.weights(problem.start))
    found = optimize.least_squares(
        lambda x: root * problem.residuals(scales * x),
        problem.start / scales,
        jac=lambda x: root[:, None] * problem.jacobian(scales * x) * scales,
        xtol=1e-12,
        ftol=1e-12,
        gtol=1e-12,
    )
    errors = np.sqrt(np.diag(fit.covariance))
    assert np.all(np.abs(scales * found.x - list(fit.parameters.values())) < 1e-3 * errors)


def test_a_point_without_a_response_is_a_numerical_error():
    problem = km.Model.from_yaml(MODELS / "linear-mass.yaml").problem()
    theta = problem.start.copy()
    theta[0] = -1.0
    with pytest.raises(km.NumericalError, match="no response"):
        problem.cost(theta)
    with pytest.raises(km.InputError, match="wrong length"):
        problem.cost(theta[:-1])
    with pytest.raises(km.InputError, match="not finite"):
        problem.cost(theta * np.nan)
