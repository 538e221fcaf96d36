"""Derivatives of programs that are written in samples: those of CasADi for the whole formula."""

from __future__ import annotations

import numpy as np
import pytest

ca = pytest.importorskip("casadi", reason="needs CasADi: install the extra centroidal")

from simrecon.planners.centroidal.derivatives import Written, problem  # noqa: E402


@pytest.fixture
def written() -> Written:
    """Samples that bend with the unknowns, in a cost and laws that bend with the samples."""
    x, y = ca.SX.sym("x", 4), ca.SX.sym("y", 3)
    values = ca.vertcat(x[0] * x[1] ** 2, ca.sin(x[2]) + x[3], x[0] / (2 + x[3] ** 2))
    f = ca.sumsqr(y) + x[1] ** 3
    g = ca.vertcat(y[0] * y[1] * y[2], ca.exp(y[1]) - y[2], x[3] ** 2 * x[0], x[1])
    return Written(x, f, g, y, values)


def test_they_are_those_of_the_whole_formula(written: Written) -> None:
    found, derivatives = problem(written)
    f, g = ca.substitute([written.f, written.g], [written.samples], [written.values])
    x, of_f, of_g = written.x, ca.SX.sym("f"), ca.SX.sym("g", 4)
    rng = np.random.default_rng(0)
    at, weight, weights = rng.standard_normal(4), 0.7, rng.standard_normal(4)
    expected = {
        "grad_f": ca.Function("grad_f", [x], [ca.gradient(f, x)])(at),
        "jac_g": ca.Function("jac_g", [x], [ca.jacobian(g, x)])(at),
        "hess_lag": ca.Function(
            "second", [x, of_f, of_g], [ca.triu(ca.hessian(of_f * f + ca.dot(of_g, g), x)[0])]
        )(at, weight, weights),
    }
    own = {
        "grad_f": derivatives["grad_f"](at, [])[1],
        "jac_g": derivatives["jac_g"](at, [])[1],
        "hess_lag": derivatives["hess_lag"](at, [], weight, weights),
    }
    for name, value in expected.items():
        np.testing.assert_allclose(np.array(own[name]), np.array(value), atol=1e-12, err_msg=name)
    values = ca.Function("values", [found["x"]], [found["f"], found["g"]])(at)
    for value, formula in zip(values, (f, g), strict=True):
        np.testing.assert_allclose(np.array(value), np.array(ca.Function("own", [x], [formula])(at)))
