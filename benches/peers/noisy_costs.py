#!/usr/bin/env python3
"""Minimum of the cost of noisy.yaml at given penalty weights, by CasADi and FATROP: an independent solution for benches/race.py.

    noisy_costs.py RECORD.csv WEIGHT...      prints one line a weight: the weight, J, and the status

The midpoint rule of the model on a stage for each node: states y, v, m, m', k, c; controls are the second difference of m and the
first differences of k and c, all over dt. J is chi-square for a sigma of 0.1 m plus the weight times the sum of the squares of the
controls times dt.
"""
import csv
import sys

import casadi as ca

SIGMA, LEAST_MASS = 0.1, 0.05


def record(path):
    with open(path, newline="") as file:
        rows = list(csv.DictReader(file))
    return [float(r["t_s"]) for r in rows], [float(r["y_m"]) for r in rows]


def stage(dt):
    """The next state from state and controls."""
    x, u = ca.SX.sym("x", 6), ca.SX.sym("u", 3)
    y, v, m, rate, k, c = ca.vertsplit(x)
    next_m, next_k, next_c = m + dt * rate, k + dt * u[1], c + dt * u[2]
    middle_y = y + dt / 2 * v
    middle_v = v - dt / 2 * (k * y + c * v) / m
    force = (k + next_k) / 2 * middle_y + (c + next_c) / 2 * middle_v
    following = ca.vertcat(y + dt * middle_v, v - dt * force / ((m + next_m) / 2), next_m, rate + dt * u[0], next_k, next_c)
    return ca.Function("stage", [x, u], [following])


def program(times, samples):
    """Solver in stages, its start, and the bounds of its rows."""
    n = len(times)
    dt = times[-1] / (n - 1)
    step = stage(dt)
    weight = ca.MX.sym("weight")
    variables, rows, low, high, equal, start, cost = [], [], [], [], [], [], 0.0
    state = ca.MX.sym("x0", 6)
    for i in range(n):
        near = samples[max(0, i - 12) : i + 13]
        variables.append(state)
        start += [sum(near) / len(near), 0.0, 1.0, 0.0, 1.0, 0.1]
        cost += ((state[0] - samples[i]) / SIGMA) ** 2
        if i + 1 < n:
            control = ca.MX.sym(f"u{i}", 3)
            variables.append(control)
            start += [0.0, 0.0, 0.0]
            # The last rate of the mass moves nothing.
            cost += weight * dt * ca.sumsqr(control)
            following = ca.MX.sym(f"x{i + 1}", 6)
            rows.append(following - step(state, control))
            low += [0.0] * 6
            high += [0.0] * 6
            equal += [True] * 6
        bounded = [(state[2], LEAST_MASS), (state[5], 0.0)]
        if i == 0:
            rows.append(ca.vertcat(state[0] - 3.3, state[1] - 1.0, state[4] - 1.0))
            low += [0.0] * 3
            high += [0.0] * 3
            equal += [True] * 3
        else:
            bounded.append((state[4], 0.0))
        rows.append(ca.vertcat(*(value for value, _ in bounded)))
        low += [least for _, least in bounded]
        high += [ca.inf] * len(bounded)
        equal += [False] * len(bounded)
        if i + 1 < n:
            state = following
    options = {
        "structure_detection": "auto", "equality": equal, "expand": True, "print_time": False,
        "fatrop.print_level": 0, "fatrop.tol": 1e-10, "fatrop.max_iter": 1000,
    }
    nlp = {"x": ca.vertcat(*variables), "f": cost, "g": ca.vertcat(*rows), "p": weight}
    return ca.nlpsol("solver", "fatrop", nlp, options), start, low, high


def main():
    solver, start, low, high = program(*record(sys.argv[1]))
    for word in sys.argv[2:]:
        found = solver(x0=start, p=float(word), lbg=low, ubg=high)
        # FATROP relaxes bounds by 1e-8: the cost at the bounds themselves, to first order.
        beyond = zip(low, found["g"].full().ravel(), found["lam_g"].full().ravel())
        cost = float(found["f"]) + sum((least - value) * abs(multiplier) for least, value, multiplier in beyond if value < least)
        print(f"weight {word} J {cost:.15e} {solver.stats().get('return_status')}", flush=True)


if __name__ == "__main__":
    main()
