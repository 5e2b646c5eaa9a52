#!/usr/bin/env python3
"""Certified least-squares problems of an oscillator: data, estimates and standard errors to 40 digits.

    python3 -m venv venv && venv/bin/pip install gmpy2
    venv/bin/python tests/certified/certify.py            # writes data, models and certified.json
    venv/bin/python tests/certified/certify.py --check    # computes them again and compares
    venv/bin/python tests/certified/certify.py duffing    # one problem, printed only

The program shares no code with kmcfit. The differential equation

    m(t) y'' + c(t) y' + k(t) y + k3 y^3 + c2 |y'| y' + fc y'/sqrt(y'^2 + w^2) + fs = f(t)

and its derivatives with respect to the parameters are integrated by Taylor series of order ORDER with an automatic step,
in arithmetic of DIGITS digits. f(t) is linear between the samples, the time-varying coefficients are linear between their
knots, and no step crosses a sample; a change of sign of y' under quadratic damping is located, and no step crosses it.
The minimum of the sum of weighted squares is found from the equation J' W r = 0 by Gauss-Newton steps with Broyden's
correction, until a step is below 10^-(DIGITS - 10) of each parameter.

Proof of the digits: the solution is evaluated once more with CHECK_DIGITS digits, order CHECK_ORDER and therefore other steps. The
Gauss-Newton step from the certified point, relative to each parameter, and the relative difference of the standard errors
must be below 10^-41; both are in certified.json. For linear systems with constant coefficients the response is also compared with
the closed form (exponentials of the two roots), which must agree to the same accuracy.

Standard errors: with W the weights of the samples and r the residuals,
    sigma estimated:  W = 1,         covariance (J' J)^-1 * RSS/(n - p)
    sigma given:      W = 1/sigma^2, covariance (J' W J)^-1
    no sigma:         W = trapezoid weights (the cost is the integral of r^2), covariance (J' W J)^-1 * (r' W r)/(n - p)
"""

import json
import pathlib
import sys
from decimal import Decimal

import gmpy2
from gmpy2 import mpfr

HERE = pathlib.Path(__file__).resolve().parent
DIGITS, ORDER = 64, 50
CHECK_DIGITS, CHECK_ORDER = 80, 64
AGREEMENT = "1e-41"

TERMS = ["mass", "damping", "stiffness", "cubic_stiffness", "quadratic_damping", "coulomb_friction", "static_force"]


def lcg(seed):
    """Uniform numbers in [0, 1): the generator of Numerical Recipes, x = 1664525 x + 1013904223 modulo 2^32."""
    x = seed
    while True:
        x = (1664525 * x + 1013904223) % 2**32
        yield x


def normal(seed):
    """Sums of 12 uniform numbers less 6, as exact fractions of 2^32: nearly Gaussian, variance 1."""
    uniform = lcg(seed)
    while True:
        yield sum(next(uniform) for _ in range(12)) - 6 * 2**32


def rounded(value, digits):
    """Text of an mpfr with a fixed number of decimals."""
    return format(Decimal(format(value, ".40e")).quantize(Decimal(1).scaleb(-digits)), "f" if digits < 15 else "e")


# --- problems ---------------------------------------------------------------------------------------------------------


def noise_force(count, seed, size, digits):
    """A smoothed random force, rounded."""
    draws = normal(seed)
    raw = [Decimal(next(draws)) / 2**32 for _ in range(count + 2)]
    values = [(raw[i] + 2 * raw[i + 1] + raw[i + 2]) / 4 * Decimal(size) for i in range(count)]
    return [str(v.quantize(Decimal(1).scaleb(-digits))) for v in values]


def sines_force(count, seed, size, digits):
    """Triangle waves of two periods, rounded."""

    def triangle(i, period):
        x = Decimal((i * 4) % (4 * period)) / period
        return x if x <= 1 else (2 - x if x <= 3 else x - 4)

    values = [Decimal(size) * (triangle(i, 23) + triangle(i + seed, 37) / 2) for i in range(count)]
    return [str(v.quantize(Decimal(1).scaleb(-digits))) for v in values]


def problem(name, title, **other):
    other.setdefault("channel", "displacement")
    other.setdefault("sigma", "estimate")
    other.setdefault("force", None)
    return dict(name=name, title=title, **other)


# `terms`: a text is fixed; a list has the true value (or values at the knots) and the two starts.
PROBLEMS = [
    problem(
        "free-decay", "Free decay with light damping",
        spacing="0.05", count=241, noise="0.01", digits=6, seed=11, nodes=24001,
        terms=dict(mass="2.5", damping=["0.3", "0.9", "0.25"], stiffness=["40", "60", "42"]),
        initial=["0.8", "-1.5"], estimate=True,
    ),
    problem(
        "free-velocity", "Free decay of a measured velocity, sigma given",
        spacing="0.02", count=201, noise="0.05", digits=6, seed=12, nodes=40001, channel="velocity", sigma="0.05",
        terms=dict(mass="0.8", damping=["0.5", "0.1", "0.45"], stiffness=["75", "100", "80"]),
        initial=["0.25", "0"],
    ),
    problem(
        "forced", "Forced response, mass, damping and stiffness",
        spacing="0.1", count=301, noise="0.002", digits=7, seed=13, nodes=30001,
        force=(noise_force, 113, "8", 4),
        terms=dict(mass=["3", "6", "3.2"], damping=["1.2", "0.2", "1"], stiffness=["28", "50", "30"]),
        initial=["0", "0"],
    ),
    problem(
        "acceleration", "Forced response of a measured acceleration",
        spacing="0.02", count=251, noise="0.05", digits=5, seed=14, nodes=25001, channel="acceleration",
        force=(sines_force, 7, "20", 4),
        terms=dict(mass=["1.6", "3", "1.5"], damping=["2.4", "0.5", "2"], stiffness=["250", "400", "260"]),
        initial=["0", "0"],
    ),
    problem(
        "integral", "Forced response, the cost is the integral of the squared residual",
        spacing="0.1", count=201, noise="0.003", digits=7, seed=15, nodes=20001, sigma=None,
        force=(noise_force, 115, "5", 4),
        terms=dict(mass=["1", "2", "1.1"], damping=["0.4", "1.5", "0.5"], stiffness=["9", "5", "8"]),
        initial=["0.2", "0.1"],
    ),
    problem(
        "stiff", "Stiff: decay rates of 2 and 498 per second",
        spacing="0.01", count=201, noise="0.005", digits=7, seed=16, nodes=100001,
        terms=dict(mass="1", damping=["500", "900", "450"], stiffness=["1000", "2000", "1100"]),
        initial=["0", "500"],
    ),
    problem(
        "near-critical", "Critical damping, a double root at the true values",
        spacing="0.02", count=151, noise="0.005", digits=7, seed=17, nodes=15001,
        terms=dict(mass="1", damping=["6", "2", "5"], stiffness=["9", "15", "10"]),
        initial=["1", "0"],
    ),
    problem(
        "negative-damping", "Negative damping: growing oscillation",
        spacing="0.05", count=241, noise="0.02", digits=6, seed=18, nodes=24001,
        terms=dict(mass="1.2", damping=["-0.35", "0.2", "-0.3"], stiffness=["20", "28", "21"]),
        initial=["0.1", "0.2"], estimate=True,
    ),
    problem(
        "duffing", "Forced Duffing oscillator with a hardening spring",
        spacing="0.05", count=301, noise="0.01", digits=6, seed=19, nodes=30001,
        force=(sines_force, 11, "6", 4),
        terms=dict(
            mass=["1", "1.8", "1.1"], damping=["0.3", "0.6", "0.25"], stiffness=["4", "8", "4.4"],
            cubic_stiffness=["3", "0", "2.5"],
        ),
        initial=["0.5", "0"],
    ),
    problem(
        "softening", "Free decay with a softening spring",
        spacing="0.05", count=201, noise="0.01", digits=6, seed=20, nodes=20001,
        terms=dict(
            mass="1", damping=["0.15", "0.5", "0.2"], stiffness=["16", "12", "15"], cubic_stiffness=["-3", "0", "-2"],
        ),
        initial=["1.5", "0"],
    ),
    problem(
        "friction", "Free decay with smoothed Coulomb friction",
        spacing="0.02", count=301, noise="0.01", digits=6, seed=21, nodes=120001, width="0.05",
        terms=dict(
            mass="1", damping=["0.2", "0.5", "0.25"], stiffness=["36", "45", "37"],
            coulomb_friction=["0.9", "0.3", "0.7"],
        ),
        initial=["1", "0"],
    ),
    problem(
        "quadratic-damping", "Roll decay with linear and quadratic damping",
        spacing="0.1", count=241, noise="0.005", digits=6, seed=22, nodes=24001,
        terms=dict(
            mass="1", damping=["0.04", "0.2", "0.06"], stiffness=["2", "2.6", "2.1"],
            quadratic_damping=["0.3", "0", "0.2"],
        ),
        initial=["0.6", "0"],
    ),
    problem(
        "varying-stiffness", "Stiffness linear between four knots",
        spacing="0.05", count=241, noise="0.01", digits=6, seed=23, nodes=24001,
        terms=dict(
            mass="1", damping=["0.2", "0.5", "0.15"],
            stiffness=[["30", "24", "15", "20"], ["24", "24", "24", "24"], ["28", "25", "17", "19"]],
        ),
        initial=["1", "0"],
    ),
    problem(
        "varying-mass", "Forced response, mass linear between three knots",
        spacing="0.05", count=301, noise="0.002", digits=7, seed=24, nodes=30001,
        force=(noise_force, 124, "20", 4),
        terms=dict(
            mass=[["4", "3", "1.5"], ["3", "3", "3"], ["3.8", "3.1", "1.7"]], damping=["1.5", "3", "1.2"],
            stiffness=["60", "90", "63"],
        ),
        initial=["0", "0"],
    ),
    problem(
        "micro", "Badly scaled: a resonator of 2 nanograms at 25 kHz",
        spacing="0.000002", count=251, noise="2e-10", digits=14, seed=25, nodes=25001,
        force=(noise_force, 125, "0.000005", 12),
        terms=dict(
            mass=["2e-12", "4e-12", "2.2e-12"], damping=["2e-8", "6e-8", "1.5e-8"], stiffness=["0.05", "0.08", "0.053"],
        ),
        initial=["0", "0"],
    ),
    problem(
        "structure", "Badly scaled: a structure of 4000 t with an unknown static force",
        spacing="0.05", count=301, noise="0.00005", digits=9, seed=26, nodes=30001,
        force=(noise_force, 126, "3000000", 0),
        terms=dict(
            mass=["4e6", "7e6", "4.3e6"], damping=["2e6", "6e6", "1.7e6"], stiffness=["3e8", "5e8", "3.2e8"],
            static_force=["200000", "0", "150000"],
        ),
        initial=["0", "0"],
    ),
]


def parameters(p):
    """Parameters in kmcfit's order: (name, term, knot or None, true value, first start, second start)."""
    out = []
    for term in TERMS:
        spec = p["terms"].get(term)
        if spec is None or isinstance(spec, str):
            continue
        if isinstance(spec[0], list):
            out += [(f"{term}[{i}]", term, i, spec[0][i], spec[1][i], spec[2][i]) for i in range(len(spec[0]))]
        else:
            out.append((term, term, None, *spec))
    if p.get("estimate"):
        out.append(("initial displacement", "y0", None, p["initial"][0], None, None))
        out.append(("initial velocity", "v0", None, p["initial"][1], None, None))
    return out


# --- integration ------------------------------------------------------------------------------------------------------


def convolution(a, b, n):
    """Coefficient n of the product of two series."""
    total = a[0] * b[n]
    for i in range(1, n + 1):
        total += a[i] * b[n - i]
    return total


class Piece:
    """Coefficients p0 + p1 tau of all terms and the force on the interval that begins at a sample."""

    def __init__(self, terms, force, names):
        self.terms, self.force, self.names = terms, force, names

    def shifted(self, by):
        move = lambda q: (q[0] + q[1] * by, q[1])
        names = [(t, move(b)) for t, b in self.names]
        return Piece({t: move(q) for t, q in self.terms.items()}, move(self.force), names)


def series(piece, state, width, sign, order):
    """Taylor coefficients of y, v and their derivatives with respect to each parameter, and of y''."""
    zero = mpfr(0)
    terms = piece.terms
    m0, m1 = terms["mass"]
    c0, c1 = terms["damping"]
    k0, k1 = terms["stiffness"]
    k3 = terms.get("cubic_stiffness", (None,))[0]
    c2 = terms.get("quadratic_damping", (None,))[0]
    fc = terms.get("coulomb_friction", (None,))[0]
    fs = terms.get("static_force", (zero,))[0]
    count = len(piece.names)
    y, v = [state[0][0]], [state[0][1]]
    sy = [[s[0]] for s in state[1:]]
    sv = [[s[1]] for s in state[1:]]
    a, sa = [], [[] for _ in range(count)]
    y2, y3, v2, u, q, q2, q3, vq = [], [], [], [], [], [], [], []
    for n in range(order):
        if k3 is not None:
            y2.append(convolution(y, y, n))
            y3.append(convolution(y2, y, n))
        if c2 is not None or fc is not None:
            v2.append(convolution(v, v, n))
        if fc is not None:
            u.append(v2[n] + width * width if n == 0 else v2[n])
            if n == 0:
                q.append(1 / gmpy2.sqrt(u[0]))
            else:
                # q = u^(-1/2): u q' = -1/2 u' q.
                total = zero
                for i in range(1, n + 1):
                    total += (i - 2 * n) * (u[i] * q[n - i])
                q.append(total / (2 * n * u[0]))
            q2.append(convolution(q, q, n))
            q3.append(convolution(q2, q, n))
            vq.append(convolution(v, q, n))
        total = -c0 * v[n] - k0 * y[n]
        if n > 0:
            total -= c1 * v[n - 1] + k1 * y[n - 1] + m1 * a[n - 1]
        if n < 2:
            total += piece.force[n]
        if n == 0:
            total -= fs
        if k3 is not None:
            total -= k3 * y3[n]
        if c2 is not None:
            total -= sign * c2 * v2[n]
        if fc is not None:
            total -= fc * vq[n]
        a.append(total / m0)
        for j, (term, (b0, b1)) in enumerate(piece.names):
            z, w, b = sy[j], sv[j], sa[j]
            total = -c0 * w[n] - k0 * z[n]
            if n > 0:
                total -= c1 * w[n - 1] + k1 * z[n - 1] + m1 * b[n - 1]
            if k3 is not None:
                total -= 3 * k3 * convolution(y2, z, n)
            if c2 is not None:
                total -= 2 * sign * c2 * convolution(v, w, n)
            if fc is not None:
                total -= fc * width * width * convolution(q3, w, n)
            if term == "static_force":
                total -= b0 if n == 0 else zero
            elif term == "quadratic_damping":
                total -= sign * v2[n]
            elif term not in ("y0", "v0"):
                factor = {
                    "mass": a, "damping": v, "stiffness": y, "cubic_stiffness": y3, "coulomb_friction": vq,
                }[term]
                total -= b0 * factor[n]
                if n > 0:
                    total -= b1 * factor[n - 1]
            b.append(total / m0)
            w.append(b[n] / (n + 1))
            z.append(w[n] / (n + 1))
        v.append(a[n] / (n + 1))
        y.append(v[n] / (n + 1))
    return y, v, sy, sv, a, sa


def horner(coefficients, x):
    total = mpfr(0)
    for c in reversed(coefficients):
        total = total * x + c
    return total


def longest_step(lists, largest, tolerance, order):
    """Step at which the last terms of each series are below `tolerance` of its size."""
    step = None
    for coefficients, size in zip(lists, largest):
        if size == 0:
            continue
        for n in (order, order - 1):
            c = abs(coefficients[n])
            if c > 0:
                h = gmpy2.root(size * tolerance / c, n)
                step = h if step is None or h < step else step
    return step


def interval(piece, state, width, length, largest, order, tolerance):
    """State at the end of an interval between samples."""
    t = mpfr(0)
    quadratic = "quadratic_damping" in piece.terms
    while True:
        here = piece.shifted(t)
        sign = 0
        if quadratic:
            v = state[0][1]
            small = abs(v) <= largest[1] * tolerance * 1000
            # At a zero of the velocity, the sign of the acceleration decides.
            if small:
                force = here.force[0] - here.terms["stiffness"][0] * state[0][0]
                sign = 1 if force > 0 else -1
            else:
                sign = 1 if v > 0 else -1
        y, v, sy, sv, _, _ = series(here, state, width, sign, order)
        lists = [y, v] + [x for pair in zip(sy, sv) for x in pair]
        for i, x in enumerate(lists):
            reach = max(abs(x[0]), abs(x[1]) * length, abs(x[2]) * length * length)
            largest[i] = max(largest[i], reach)
        step = longest_step(lists, largest, tolerance, order)
        left = length - t
        last = step is None or step >= left
        step = left if last else step
        if quadratic and sign * horner(v, step) < 0:
            low, high = mpfr(0), step
            for _ in range(40):
                middle = (low + high) / 2
                low, high = (middle, high) if sign * horner(v, middle) > 0 else (low, middle)
            root = (low + high) / 2
            slope = [n * x for n, x in enumerate(v)][1:]
            for _ in range(8):
                root -= horner(v, root) / horner(slope, root)
            step, last = root, False
        state = [(horner(y, step), horner(v, step))]
        state += [(horner(z, step), horner(w, step)) for z, w in zip(sy, sv)]
        if last:
            return state
        t += step


class Setting:
    """A problem with its data as numbers."""

    def __init__(self, p, force):
        self.p = p
        self.names = parameters(p)
        self.spacing = mpfr(p["spacing"])
        self.force = [mpfr(f) for f in force] if force else None
        self.width = mpfr(p["width"]) if "width" in p else None

    def knots(self, term):
        spec = self.p["terms"][term]
        return len(spec[0]) if isinstance(spec, list) and isinstance(spec[0], list) else None

    def pieces(self, theta):
        """Coefficients on each interval between samples."""
        p = self.p
        intervals = p["count"] - 1
        by_term = {}
        for j, (_, term, _, *_) in enumerate(self.names):
            by_term.setdefault(term, []).append(j)
        zero, one = mpfr(0), mpfr(1)
        for i in range(intervals):
            terms, names = {}, [None] * len(self.names)
            for term in TERMS:
                spec = p["terms"].get(term)
                if spec is None:
                    continue
                if isinstance(spec, str):
                    terms[term] = (mpfr(spec), zero)
                    continue
                knots = self.knots(term)
                if knots is None:
                    j = by_term[term][0]
                    terms[term] = (theta[j], zero)
                    names[j] = (term, (one, zero))
                    continue
                each = intervals // (knots - 1)
                assert each * (knots - 1) == intervals, "knots are at samples"
                cell, inside = divmod(i, each)
                fraction = mpfr(inside) / each
                slope = 1 / (each * self.spacing)
                first, second = theta[by_term[term][cell]], theta[by_term[term][cell + 1]]
                terms[term] = (first + (second - first) * fraction, (second - first) * slope)
                for knot, j in enumerate(by_term[term]):
                    names[j] = (term, (zero, zero))
                    if knot == cell:
                        names[j] = (term, (1 - fraction, -slope))
                    if knot == cell + 1:
                        names[j] = (term, (fraction, slope))
            for term in ("y0", "v0"):
                for j in by_term.get(term, []):
                    names[j] = (term, (zero, zero))
            force = (zero, zero)
            if self.force:
                force = (self.force[i], (self.force[i + 1] - self.force[i]) / self.spacing)
            yield Piece(terms, force, names)

    def predict(self, theta, order, tolerance):
        """Predicted samples, and for each sample its derivatives."""
        start = [mpfr(x) for x in self.p["initial"]]
        for value, (_, term, *_) in zip(theta, self.names):
            if term in ("y0", "v0"):
                start[term == "v0"] = value
        state = [tuple(start)]
        for _, term, *_ in self.names:
            state.append((mpfr(term == "y0"), mpfr(term == "v0")))
        largest = [mpfr(0)] * (2 * len(state))
        rows = []
        for piece in self.pieces(theta):
            rows.append(self.observe(piece, state))
            state = interval(piece, state, self.width, self.spacing, largest, order, tolerance)
        rows.append(self.observe(piece.shifted(self.spacing), state))
        return [r[0] for r in rows], [r[1:] for r in rows]

    def observe(self, piece, state):
        channel = self.p["channel"]
        if channel != "acceleration":
            return [s[channel == "velocity"] for s in state]
        _, _, _, _, a, sa = series(piece, state, self.width, 0, 1)
        return [a[0]] + [x[0] for x in sa]

    def weights(self):
        sigma, count = self.p["sigma"], self.p["count"]
        if sigma is None:
            return [self.spacing / (2 if i in (0, count - 1) else 1) for i in range(count)]
        return [mpfr(1) if sigma == "estimate" else 1 / mpfr(sigma) ** 2] * count

    def linearise(self, theta, data, order, tolerance):
        """Gradient J' W r, matrix J' W J and r' W r."""
        predicted, rows = self.predict(theta, order, tolerance)
        weights = self.weights()
        residuals = [a - b for a, b in zip(predicted, data)]
        n = len(theta)
        gradient = [sum(w * row[j] * r for w, row, r in zip(weights, rows, residuals)) for j in range(n)]
        matrix = [[sum(w * row[i] * row[j] for w, row in zip(weights, rows)) for j in range(n)] for i in range(n)]
        squares = sum(w * r * r for w, r in zip(weights, residuals))
        return gradient, matrix, squares


def solve(matrix, right):
    """Gauss elimination with pivoting, for several right sides (a list of columns)."""
    n = len(matrix)
    rows = [list(matrix[i]) + [column[i] for column in right] for i in range(n)]
    for k in range(n):
        pivot = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[pivot] = rows[pivot], rows[k]
        for i in range(n):
            if i != k and rows[i][k] != 0:
                factor = rows[i][k] / rows[k][k]
                rows[i] = [a - factor * b for a, b in zip(rows[i], rows[k])]
    return [[rows[i][n + c] / rows[i][i] for i in range(n)] for c in range(len(right))]


def scaled(matrix, gradient, sizes):
    n = len(sizes)
    return (
        [[matrix[i][j] * sizes[i] * sizes[j] for j in range(n)] for i in range(n)],
        [gradient[i] * sizes[i] for i in range(n)],
    )


def minimise(setting, data, theta, tolerance):
    """Zero of J' W r: Gauss-Newton, with Broyden's correction from the third step on."""
    sizes = [abs(x) for x in theta]
    correction = None
    n = len(theta)
    before = None
    for iteration in range(60):
        gradient, matrix, _ = setting.linearise(theta, data, ORDER, tolerance)
        matrix, gradient = scaled(matrix, gradient, sizes)
        if iteration < 3:
            secant = matrix
        else:
            old, step = before
            change = [a - b for a, b in zip(gradient, old)]
            length = sum(x * x for x in step)
            error = [change[i] - sum(secant[i][j] * step[j] for j in range(n)) for i in range(n)]
            secant = [[secant[i][j] + error[i] * step[j] / length for j in range(n)] for i in range(n)]
        step = [-x for x in solve(secant, [gradient])[0]]
        before = (gradient, step)
        theta = [x + s * size for x, s, size in zip(theta, step, sizes)]
        size = max(abs(s * size / x) for s, size, x in zip(step, sizes, theta))
        print(f"  step {iteration + 1}: {float(size):.1e}", file=sys.stderr)
        if size < mpfr(10) ** (10 - DIGITS):
            return theta
    raise SystemExit("no convergence")


def standard_errors(setting, matrix, squares):
    n = len(matrix)
    sizes = [1 / gmpy2.sqrt(matrix[i][i]) for i in range(n)]
    shaped, _ = scaled(matrix, [mpfr(0)] * n, sizes)
    columns = solve(shaped, [[mpfr(i == j) for i in range(n)] for j in range(n)])
    scale = mpfr(1)
    if setting.p["sigma"] in (None, "estimate"):
        scale = squares / (setting.p["count"] - n)
    return [gmpy2.sqrt(columns[i][i] * scale) * sizes[i] for i in range(n)]


def closed_form(setting, theta):
    """Response of a linear system with constant coefficients: exponentials of its two roots; displacement and velocity."""
    p = setting.p
    values = {t: mpfr(s) for t, s in p["terms"].items() if isinstance(s, str)}
    start = [mpfr(x) for x in p["initial"]]
    for value, (_, term, *_) in zip(theta, setting.names):
        if term in ("y0", "v0"):
            start[term == "v0"] = value
        else:
            values[term] = value
    m, c, k = values["mass"], values["damping"], values["stiffness"]
    fs = values.get("static_force", mpfr(0))
    root = gmpy2.sqrt(gmpy2.mpc(c * c - 4 * m * k))
    r, s = (-c + root) / (2 * m), (-c - root) / (2 * m)
    h = setting.spacing
    e, g = gmpy2.exp(r * h), gmpy2.exp(s * h)
    y, v = start
    out = [(y, v)]
    for i in range(p["count"] - 1):
        f = [setting.force[i], setting.force[i + 1]] if setting.force else [mpfr(0)] * 2
        slope = (f[1] - f[0]) / h
        # Particular solution a + b tau.
        b = slope / k
        a = (f[0] - fs - c * b) / k
        y0, v0 = y - a, v - b
        first, second = (v0 - s * y0) / (r - s), (r * y0 - v0) / (r - s)
        y = (first * e + second * g).real + a + b * h
        v = (r * first * e + s * second * g).real + b
        out.append((y, v))
    return out


def text(x, digits=40):
    return format(x, f".{digits - 1}e")


def certify(p):
    """Data, and the entry of certified.json."""
    print(p["name"], file=sys.stderr)
    gmpy2.get_context().precision = int(DIGITS * 3.33) + 8
    tolerance = mpfr(10) ** (2 - DIGITS)
    force = None
    if p["force"]:
        make, seed, size, digits = p["force"]
        force = make(p["count"], seed, size, digits)
    setting = Setting(p, force)
    truth = [mpfr(x[3]) for x in setting.names]
    exact, _ = setting.predict(truth, ORDER, tolerance)
    draws = normal(p["seed"])
    samples = [rounded(z + mpfr(p["noise"]) * next(draws) / 2**32, p["digits"]) for z in exact]
    data = [mpfr(s) for s in samples]
    theta = minimise(setting, data, truth, tolerance)
    estimates = [text(x) for x in theta]
    # The check starts from more decimals, because rounding to 40 digits changes the standard errors in the last ones.
    point = [text(x, DIGITS - 8) for x in theta]
    _, matrix, squares = setting.linearise(theta, data, ORDER, tolerance)
    errors = standard_errors(setting, matrix, squares)

    gmpy2.get_context().precision = int(CHECK_DIGITS * 3.33) + 8
    tolerance = mpfr(10) ** (2 - CHECK_DIGITS)
    # Numbers with the precision of the check, from the same decimals.
    setting, data = Setting(p, force), [mpfr(s) for s in samples]
    point = [mpfr(t) for t in point]
    gradient, matrix, squares = setting.linearise(point, data, CHECK_ORDER, tolerance)
    step = solve(*(lambda m, g: (m, [g]))(*scaled(matrix, gradient, point)))[0]
    of_estimates = max(abs(s) for s in step)
    again = standard_errors(setting, matrix, squares)
    of_errors = max(abs(a / b - 1) for a, b in zip(errors, again))
    entry_checks = dict(step=f"{float(of_estimates):.1e}", standard_errors=f"{float(of_errors):.1e}")
    assert of_estimates < mpfr(AGREEMENT) and of_errors < mpfr(AGREEMENT), entry_checks
    nonlinear = {"cubic_stiffness", "quadratic_damping", "coulomb_friction"} & p["terms"].keys()
    varying = any(setting.knots(t) for t in p["terms"] if t != "static_force")
    if not nonlinear and not varying and p["channel"] != "acceleration":
        predicted, _ = setting.predict(point, CHECK_ORDER, tolerance)
        closed = [s[p["channel"] == "velocity"] for s in closed_form(setting, point)]
        size = max(abs(z) for z in closed)
        gap = max(abs(a - b) for a, b in zip(predicted, closed)) / size
        assert gap < mpfr(AGREEMENT), f"{p['name']}: closed form differs by {float(gap):.1e}"
        entry_checks["closed_form"] = f"{float(gap):.1e}"
    print("  checks", entry_checks, file=sys.stderr)

    rows = [
        dict(
            name=name, certified=estimate, standard_error=text(error),
            starts=[a, b] if a is not None else None,
        )
        for (name, _, _, _, a, b), estimate, error in zip(setting.names, estimates, errors)
    ]
    entry = dict(
        name=p["name"], title=p["title"], samples=p["count"], nodes=p["nodes"], parameters=rows,
        cost=text(squares), checks=entry_checks,
    )
    return samples, force, entry


# --- files ------------------------------------------------------------------------------------------------------------

UNITS = dict(displacement="y_m", velocity="v_m_per_s", acceleration="a_m_per_s2")


def table(p, samples, force):
    column = UNITS[p["channel"]]
    lines = [f"t_s,{'f_N,' if force else ''}{column}"]
    for i, sample in enumerate(samples):
        time = Decimal(p["spacing"]) * i
        lines.append(",".join([format(time, "f")] + ([force[i]] if force else []) + [sample]))
    return "\n".join(lines) + "\n"


def model(p, force):
    column = UNITS[p["channel"]]
    columns = f"time: t_s, {p['channel']}: {column}" + (", force: f_N" if force else "")
    y0, v0 = p["initial"]
    lines = [
        "# yaml-language-server: $schema=../../docs/kmcfit.schema.json",
        "# Written by certify.py; the first of the two starts.",
        "format: 1",
        f"title: '{p['title']}'",
        "experiments:",
        f"  - name: {p['name']}",
        f"    data: {p['name']}.csv",
        f"    columns: {{{columns}}}",
    ]
    if force:
        lines.append("    force: {interpolation: linear}")
    if p["sigma"] is not None:
        lines.append(f"    sigma: {{{p['channel']}: {p['sigma']}}}")
        lines.append(f"    noise: {{{p['channel']}: white}}")
    lines.append("    initial: estimate" if p.get("estimate") else f"    initial: {{displacement: {y0}, velocity: {v0}}}")
    lines += [f"grid: {{nodes: {p['nodes']}, method: rk4}}", "functions:"]
    for term in TERMS:
        spec = p["terms"].get(term)
        if spec is None:
            continue
        if isinstance(spec, str):
            lines.append(f"  {term}: {{fixed: {spec}}}")
        elif isinstance(spec[0], list):
            start = ", ".join(spec[1])
            lines.append(f"  {term}: {{basis: piecewise-linear, knots: {len(spec[0])}, start: [{start}]}}")
        else:
            width = f", width: {p['width']}" if term == "coulomb_friction" else ""
            lines.append(f"  {term}: {{basis: constant, start: {spec[1]}{width}}}")
    lines.append("fit: {stop: {iterations: 200, step: 1.0e-12}}")
    return "\n".join(lines) + "\n"


def main():
    words = sys.argv[1:]
    check = "--check" in words
    chosen = [w for w in words if not w.startswith("--")]
    entries = []
    files = {}
    for p in PROBLEMS:
        if chosen and p["name"] not in chosen:
            continue
        samples, force, entry = certify(p)
        entries.append(entry)
        files[p["name"] + ".csv"] = table(p, samples, force)
        files[p["name"] + ".yaml"] = model(p, force)
    about = f"40 digits, computed by certify.py with {DIGITS} and checked with {CHECK_DIGITS}"
    files["certified.json"] = json.dumps(dict(about=about, problems=entries), indent=1) + "\n"
    if chosen and "--write" not in words:
        print(files["certified.json"])
        return
    if chosen:
        del files["certified.json"]
    different = []
    for name, content in files.items():
        path = HERE / name
        if check:
            if not path.exists() or path.read_text() != content:
                different.append(name)
        else:
            path.write_text(content)
    if different:
        raise SystemExit(f"different: {', '.join(different)}")


if __name__ == "__main__":
    main()
