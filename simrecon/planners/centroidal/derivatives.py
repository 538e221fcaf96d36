"""Exact derivatives of a program that is written in samples of curves, for IPOPT.

With unknowns x, samples y(x), and the Lagrangian L(x, y) = s f + λ · g,

    ∇f = f_x + Jᵀ f_y,   ∇g = g_x + g_y J,   ∇²L = L_xx + Jᵀ L_yy J + Σ_k L_y[k] ∇²y_k,   J = ∂y/∂x

L has no term with both x and y. L_yy is simple and sparse, J has few entries, and neither knows the other's
formulas, while derivatives of L by x as one formula took longer to write down than IPOPT takes to search.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from simrecon.planners.centroidal.curves import Symbols


@dataclass(eq=False)
class Written:
    """A program as formulas.

    Attributes:
        x: unknowns (n,).
        f, g: cost, and constraints (m,), in unknowns and samples.
        samples: y as symbols (k,); values: y in the unknowns.
    """

    x: Symbols
    f: Symbols
    g: Symbols
    samples: Symbols
    values: Symbols


def problem(written: Written) -> tuple[dict[str, Symbols], dict[str, ca.Function]]:
    """A program for `casadi.nlpsol`, and its derivatives as options of it."""
    x, y = written.x, written.samples
    unknowns, none = ca.MX.sym("x", *x.shape), ca.MX.sym("p", 0)
    sampled = ca.Function("sampled", [x], [written.values])
    slope = ca.Function("slope", [x], [ca.jacobian(written.values, x)])
    at, j = sampled(unknowns), slope(unknowns)
    direct = ca.Function("direct", [x, y], [written.f, written.g])
    f, g = direct(unknowns, at)
    gradient = ca.Function("gradient", [x, y], [ca.gradient(written.f, x), ca.gradient(written.f, y)])
    rows = ca.Function("rows", [x, y], [ca.jacobian(written.g, x), ca.jacobian(written.g, y)])
    (f_x, f_y), (g_x, g_y) = gradient(unknowns, at), rows(unknowns, at)
    return {"x": unknowns, "f": f, "g": g}, {
        "grad_f": ca.Function(
            "grad_f", [unknowns, none], [f, f_x + j.T @ f_y], ["x", "p"], ["f", "grad_f_x"]
        ),
        "jac_g": ca.Function("jac_g", [unknowns, none], [g, g_x + g_y @ j], ["x", "p"], ["g", "jac_g_x"]),
        "hess_lag": _hessian(written, unknowns, none, at, j),
    }


def _hessian(written: Written, unknowns: Symbols, none: Symbols, at: Symbols, j: Symbols) -> ca.Function:
    """Upper triangle of ∇²L."""
    x, y = written.x, written.samples
    s, weights = ca.SX.sym("s"), ca.SX.sym("weights", written.g.shape[0])
    lagrangian = s * written.f + ca.dot(weights, written.g)
    by_x, _ = ca.hessian(lagrangian, x)
    by_y, first = ca.hessian(lagrangian, y)
    inner = ca.Function("inner", [x, y, s, weights], [by_x, by_y, first])
    share = ca.SX.sym("share", *y.shape)
    bent = ca.Function("bent", [x, share], [ca.hessian(ca.dot(share, written.values), x)[0]])
    of_f, of_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", written.g.shape[0])
    own, among, slopes = inner(unknowns, at, of_f, of_g)
    whole = own + j.T @ (among @ j) + bent(unknowns, slopes)
    return ca.Function(
        "hess_lag", [unknowns, none, of_f, of_g], [ca.triu(whole)],
        ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"],
    )  # fmt: skip
