#!/usr/bin/env python3
"""Races kmcfit against its peers in one sitting, and prints and writes a table of targets, met or missed.

    python3 benches/race.py                     every row; writes benches/RESULTS.md and benches/figures/
    python3 benches/race.py --rows knots,3      some rows, by name or number; writes to target/race
    python3 benches/race.py --quick             fewer repetitions and starts; writes to target/race

Needs nothing but Python and the Rust toolchain. The peers are looked for in the folder KMCFIT_SHARED (by
default ../shared); a row whose peer cannot run is skipped and says what it needs.

In each row kmcfit and its peer take turns, and medians are compared. Times of whole fits are those of the
solver ("seconds" in result.json: no reading, no writing); the wall clock of the process is shown beside
them. Peers count what they count themselves: neither imports, nor compilation, nor building a problem.
Of several builds or settings of a peer the fastest counts.
"""
import argparse
import csv
import datetime
import functools
import json
import os
import platform
import random
import re
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path

import figures

ROOT = Path(__file__).resolve().parent.parent
WORK = ROOT / "target" / "race"
SHARED = Path(os.environ.get("KMCFIT_SHARED", ROOT.parent / "shared"))
ROWS = ["evaluation", "million", "paper", "lbfgs", "smooth", "scaling", "knots", "starts", "duffing", "start-up", "contention", "noisy", "noisy-500", "noisy-long", "noisy-costs", "bounded", "bounded-kinds", "bounded-long", "defaults", "whole", "whole-long", "studies", "chain"]
DURATION = 25.0
SCALING = [2000, 8000, 40_000, 200_000]
KNOTS = [4, 8, 16, 32, 64, 128, 256, 512, 1024]
EVALUATIONS = [1000, 2000, 5000, 10_000, 20_000, 50_000, 100_000, 200_000, 500_000, 1_000_000]
BYTES_PER_STEP = 200
# The device behind the data of peers/duffing_scipy.py.
DUFFING = {"mass": 1.0, "damping": 1.2, "stiffness": 20.0, "cubic_stiffness": 15.0}
# A fit is accurate if its errors are within this of the device; on more nodes also if they are within ten times those
# on 2000.
ACCURATE = 1e-9
# A peer in Python takes seconds; one that takes so long hangs.
HANGS = 600.0
# A round of a row begins only within so many seconds of its first.
PATIENCE = 60.0


class Skip(Exception):
    """Why a row cannot be run here."""


class TooSlow(Skip):
    """A fit that was given up."""


class Row:
    """One row of the table."""

    def __init__(self, name, what, peer, target):
        self.name, self.what, self.peer, self.target = name, what, peer, target
        self.peer_result = self.result = self.ratio = ""
        self.met = self.skipped = None
        self.notes = []

    @property
    def verdict(self):
        return "skipped" if self.skipped else {True: "met", False: "missed", None: "not judged"}[self.met]

    def cells(self):
        number = str(ROWS.index(self.name) + 1)
        return [number, self.what, self.peer_result or self.peer, self.result, self.ratio, self.target, self.verdict]


# ---------------------------------------------------------------------------------------------- tools


def run(command, **more):
    """Output, exit code and wall clock of a command."""
    clock = time.perf_counter()
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, cwd=ROOT, **more)
    return done.stdout, done.stderr, done.returncode, time.perf_counter() - clock


def pinned(command):
    """The command on one core, where the system can do that."""
    if not shutil.which("taskset") or not hasattr(os, "sched_getaffinity"):
        return command
    return ["taskset", "-c", str(max(os.sched_getaffinity(0))), *command]


def seconds(value):
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if value >= size:
            return f"{value / size:.3g} {unit}"
    return f"{value * 1e9:.3g} ns"


def share(ours, peer):
    return f"1/{peer / ours:.3g}" if ours < peer else f"{ours / peer:.3g} times"


def spread(values):
    """The median, and how far the values lie apart."""
    middle = statistics.median(values)
    return f"{seconds(middle)} ({seconds(min(values))} to {seconds(max(values))}, {len(values)} runs)"


def first_line(command):
    try:
        return run(command)[0].strip().splitlines()[0]
    except (OSError, IndexError):
        return None


class Race:
    """What the rows share: the programs, the repetitions, what has been measured."""

    def __init__(self, repetitions, quick, limit):
        self.repetitions, self.quick, self.longest = repetitions, quick, limit
        self.kmcfit, self.measure_program = build()
        self.threads_known = None
        self.cache = {}
        self.data = {}

    def rounds(self):
        """As many rounds as asked for, unless they are long."""
        clock = time.perf_counter()
        for i in range(self.repetitions):
            if i > 0 and time.perf_counter() - clock > PATIENCE:
                return
            yield i

    def once(self, key, work):
        if key not in self.cache:
            try:
                self.cache[key] = work()
            except Skip as reason:
                self.cache[key] = reason
        if isinstance(self.cache[key], Skip):
            raise self.cache[key]
        return self.cache[key]

    def measure(self, *words, one_core=True):
        command = [self.measure_program, *words]
        out, trouble, code, _ = run(pinned(command) if one_core else command)
        if code != 0:
            raise Skip(f"measure {' '.join(map(str, words))} failed: {trouble.strip()[-200:]}")
        return json.loads(out)

    def limit(self):
        return self.once("limit", lambda: min(self.measure("limit")["ns_per_link"] for _ in range(3)))

    def evaluation(self, nodes, one_core=True):
        return self.measure("evaluation", nodes, 0.3 if self.quick else 1.0, one_core=one_core)

    def fit(self, model, name, threads=None, report=False, overrides=()):
        """Fits a model, on so many threads or as many as the program likes; its result document, with the
        wall clock of the process. The first process after some seconds without one waits for fresh memory on
        some machines, which peers that run for long do not show: the same fit before it is not measured."""
        out = WORK / "runs" / name
        command = [self.kmcfit, "fit", model, "--out", out] + ([] if report else ["--no-report"])
        command += [word for override in overrides for word in ("--set", override)]
        if threads is not None and self.knows_threads():
            command += ["--threads", threads]
        try:
            for _ in range(2):
                shutil.rmtree(out, ignore_errors=True)
                _, trouble, code, wall = run(pinned(command) if threads == 1 else command, timeout=self.longest)
        except subprocess.TimeoutExpired:
            raise TooSlow(f"kmcfit fit {name} was given up after {seconds(self.longest)}") from None
        document = out / "result.json"
        if not document.exists():
            raise Skip(f"kmcfit fit {name} ended with {code}: {trouble.strip()[-300:]}")
        return {**json.loads(document.read_text()), "wall": wall}

    def knows_threads(self):
        if self.threads_known is None:
            self.threads_known = "--threads" in run([self.kmcfit, "fit", "--help"])[0]
        return self.threads_known


def build():
    print("building …", flush=True)
    subprocess.run(["cargo", "build", "--release", "--quiet"], cwd=ROOT, check=True)
    command = ["cargo", "bench", "--quiet", "--bench", "measure", "--no-run", "--message-format=json"]
    messages = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    artifacts = [json.loads(line) for line in messages.splitlines() if line.startswith("{")]
    named = [a for a in artifacts if a.get("executable") and a.get("target", {}).get("name") == "measure"]
    metadata = run(["cargo", "metadata", "--format-version", "1", "--no-deps"])[0]
    target = Path(json.loads(metadata)["target_directory"])
    program = target / "release" / ("kmcfit.exe" if os.name == "nt" else "kmcfit")
    return program, named[-1]["executable"]


def peer_file(name):
    path = SHARED / "peers" / name
    if not path.exists():
        raise Skip(f"the peer {name} is not there: set KMCFIT_SHARED to the folder that has peers/{name}")
    return path


def python_peer(path, packages, *words, one_thread=False):
    """Output of a peer in Python, with the threads that its linear algebra likes or with one; each run is a
    process of its own."""
    missing = [p for p in packages if not importable(p)]
    if missing:
        raise Skip(f"its peer needs {', '.join(missing)}: pip install {' '.join(missing)}")
    threads = {name: "1" for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
    environment = {**os.environ, **(threads if one_thread else {})}
    try:
        out, trouble, code, _ = run([sys.executable, path, *words], env=environment, timeout=HANGS)
    except subprocess.TimeoutExpired:
        raise TooSlow(f"its peer takes more than {HANGS:.0f} s") from None
    if code != 0:
        raise Skip(f"its peer failed: {trouble.strip()[-300:]}")
    return out


@functools.cache
def importable(package):
    return run([sys.executable, "-c", f"import {package}"])[2] == 0


# What the linear algebra of a peer may do: on small problems its own threads cost it more than they bring.
THREADS = {"threads as it likes": False, "one thread": True}


def fastest(times):
    """The name and the times of the fastest of several ways."""
    name = min(times, key=lambda name: statistics.median(times[name]))
    return name, times[name]


def found(pattern, text):
    match = re.search(pattern, text)
    if not match:
        raise Skip(f"the peer printed something else than expected: {text.strip()[-300:]}")
    return [float(g) for g in match.groups()]


# ------------------------------------------------------------------------------------- models and data


def changed(name, label, changes):
    """A model of models/ with some of its text replaced, in a folder of its own."""
    text = (ROOT / "models" / f"{name}.yaml").read_text(encoding="utf-8")
    changes = [("../data/", f"{(ROOT / 'data').as_posix()}/"), *changes]
    for old, new in changes:
        if old not in text:
            raise Skip(f"models/{name}.yaml has no `{old}`")
        text = text.replace(old, new)
    path = WORK / f"{label}.yaml"
    path.write_text(text, encoding="utf-8")
    return path


def paper_data(nodes):
    """The paper's record on other grids: readings and true device, by the midpoint rule."""
    readings, truth = WORK / f"paper-{nodes}.csv", WORK / f"paper-{nodes}-truth.csv"
    if readings.exists() and truth.exists():
        return readings, truth
    dt = DURATION / (nodes - 1)
    mass = [1 - 0.5 * (i + 1) / nodes for i in range(nodes)]
    y, v = 3.3, 1.0
    with open(readings, "w") as out, open(truth, "w") as device:
        out.write("t_s,y_m\n")
        device.write("t_s,mass_kg,damping_N_s_per_m,stiffness_N_per_m\n")
        for i in range(nodes):
            out.write(f"{i * dt!r},{y!r}\n")
            device.write(f"{i * dt!r},{mass[i]!r},0.0,1.0\n")
            if i + 1 < nodes:
                middle_y, middle_v = y + 0.5 * dt * v, v - 0.5 * dt * y / mass[i]
                y, v = y + dt * middle_v, v - dt * middle_y / (0.5 * (mass[i] + mass[i + 1]))
    return readings, truth


def smooth_model(nodes):
    if nodes == 2000:
        return ROOT / "models" / "paper-smooth.yaml"
    readings, truth = paper_data(nodes)
    return changed(
        "paper-smooth",
        f"smooth-{nodes}",
        [
            (f"{(ROOT / 'data').as_posix()}/paper.csv", readings.name),
            (f"{(ROOT / 'data').as_posix()}/paper_truth.csv", truth.name),
            ("nodes: 2000", f"nodes: {nodes}"),
        ],
    )


def small_model():
    readings, _ = paper_data(100)
    path = WORK / "small.yaml"
    path.write_text(
        f"format: 1\nexperiments:\n  - {{data: {readings.name}, initial: {{displacement: 3.3, velocity: 1.0}}}}\n"
        "grid: {method: midpoint}\nfunctions:\n"
        "  mass:      {basis: polynomial, degree: 1, start: 2.0}\n"
        "  damping:   {basis: constant, start: 1.0}\n  stiffness: {fixed: 1.0}\n"
    )
    return path


def errors(document):
    """The largest error of each function."""
    return {name: f["truth_max_error"] for name, f in document["functions"].items() if "truth_max_error" in f}


def described(document):
    counts = document["counts"]
    worst = ", ".join(f"{name} {error:.0e}" for name, error in sorted(errors(document).items()))
    text = f"kmcfit {document['outcome']['status']}, J/J0 {document['cost']['ratio']:.1e}, {counts['iterations']} iterations"
    return f"{text}; largest errors: {worst}" if worst else text


def compare_fits(row, peer, fits, factor):
    """Fills a row in which kmcfit should take 1/factor of the time of the peer's fastest way."""
    way, fast = fastest(peer)
    ours = [f["seconds"] for f in fits]
    wall = statistics.median(f["wall"] for f in fits)
    middle, theirs = statistics.median(ours), statistics.median(fast)
    row.peer_result = f"{row.peer}: {seconds(theirs)}"
    row.result = f"{seconds(middle)} (process {seconds(wall)})"
    row.ratio = share(middle, theirs)
    row.met = middle * factor <= theirs and all(f["outcome"]["status"] in ("converged", "completed") for f in fits)
    row.notes += [f"peer{name and ', '}{name}: {spread(times)}" for name, times in peer.items()]
    row.notes += [f"the peer's fastest way: {way}"] if len(peer) > 1 else []
    row.notes += [f"kmcfit: {spread(ours)}", described(fits[-1])]


# ------------------------------------------------------------------------------------------------ rows


def jax_rounds(race):
    """Rounds of what jax_nodal.py measures: an evaluation, and the fit by L-BFGS."""

    def work():
        peer = peer_file("jax_nodal.py")
        model = changed("paper-lbfgs", "lbfgs", [("cost_ratio: 1.0e-6", "cost_ratio: 1.0e-4")])
        steps, times, ours, fits = [], [], [], []
        for _ in race.rounds():
            out = python_peer(peer, ["numpy", "scipy", "jax", "optax"])
            steps += found(r"value_and_grad ([\d.]+) us", out)
            iterations, elapsed = found(r"optax lbfgs: .*J/J0<1e-4 at \((\d+), ([\d.e-]+)\)", out)
            times.append(elapsed)
            ours.append(race.evaluation(2000))
            fits.append(race.fit(model, "lbfgs"))
        return [s * 1e-6 for s in steps], times, iterations, ours, fits

    return race.once("jax", work)


def evaluation(race, row):
    steps, _, _, ours, _ = jax_rounds(race)
    theirs, mine = statistics.median(steps), statistics.median(o["seconds"] for o in ours)
    limit = 2 * race.limit()
    per_step = mine / 2000 * 1e9
    race.data["peer_ns_per_step"] = theirs / 2000 * 1e9
    row.peer_result = f"{row.peer}: {theirs / 2000 * 1e9:.3g} ns a step"
    row.result = f"{per_step:.3g} ns a step; limit {limit:.3g} ns, so {100 * limit / per_step:.0f} % of it"
    row.ratio = share(mine, theirs)
    row.met = mine * 5 <= theirs
    cost, gradient = (statistics.median(o[k] for o in ours) / 2000 * 1e9 for k in ("cost_seconds", "gradient_seconds"))
    row.notes += [
        f"peer {spread(steps)}; kmcfit {spread([o['seconds'] for o in ours])}",
        f"in two calls, as fits make them: cost {cost:.3g}, gradient in both inner products {gradient:.3g} ns a step",
        f"limit: two sweeps in which a step waits for the one before through a multiply and a multiply-add, {race.limit():.3g} ns here",
    ]


def million(race, row):
    triad = max(race.measure("triad")["bytes_per_second"] for _ in range(2))
    rounds = [
        (race.evaluation(2000), race.evaluation(1_000_000), race.evaluation(1_000_000, one_core=False))
        for _ in race.rounds()
    ]
    small, one, two = (statistics.median(r[i]["seconds"] / r[i]["nodes"] for r in rounds) for i in range(3))
    pair = [statistics.median(r[1][k] for r in rounds) for k in ("cost_seconds", "gradient_seconds")]
    row.peer_result = f"{row.peer}: {small * 1e9:.3g} ns a step"
    row.result = f"{two * 1e9:.3g} ns a step on two cores, {one * 1e9:.3g} ns on one"
    row.ratio = f"{two / small:.3g} times ({one / small:.3g} on one core)"
    row.met = two <= 1.3 * small
    peaks = [r[2]["peak_bytes"] and (r[2]["peak_bytes"] - r[0]["peak_bytes"]) / 998_000 for r in rounds]
    row.met = row.met if all(peaks) or not row.met else None
    if all(peaks):
        memory = statistics.median(peaks)
        bandwidth = memory / one / triad
        row.result += f"; {memory:.0f} bytes a step, {100 * bandwidth:.0f} % of the triad on one core"
        row.met = (two <= 1.3 * small or bandwidth >= 0.8) and memory <= BYTES_PER_STEP
        row.notes.append("the share of the triad counts each byte that an evaluation holds as moved once: more are moved")
    row.notes += [
        f"in two calls, as fits make them, on one core: cost {pair[0] / 1e6 * 1e9:.3g}, gradient in both inner products "
        f"{pair[1] / 1e6 * 1e9:.3g} ns a step",
        f"on two cores {spread([r[2]['seconds'] for r in rounds])}; on one {spread([r[1]['seconds'] for r in rounds])}",
        f"triad: {triad / 1e9:.3g} GB/s on one core, 24 bytes an element",
    ]


def paper(race, row):
    source = peer_file("paper_run.c")
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    if not compiler:
        raise Skip("its peer needs a C compiler")
    flags = {"strict": ["-O2", "-ffp-contract=off"], "fast": ["-O3", "-march=native", "-ffast-math"]}
    programs = {}
    for name, words in flags.items():
        programs[name] = WORK / f"paper_run_{name}"
        if run([compiler, *words, source, "-o", programs[name], "-lm"])[2] != 0:
            raise Skip(f"the {name} build of paper_run.c failed")
    peers, fits = {name: [] for name in programs}, []
    for _ in race.rounds():
        for name, program in programs.items():
            peers[name] += found(r"seconds ([\d.]+)", run(pinned([program]))[0])
        fits.append(race.fit(ROOT / "models" / "paper.yaml", "paper", threads=1))
    compare_fits(row, peers, fits, 7)
    same, text = history("paper")
    # Without the reference history the row is not judged.
    row.met = None if row.met and same is None else row.met and same
    row.notes.append(text)


def history(name):
    """Whether the run of this name has the reference history, to every digit of that."""
    path = SHARED / "reference" / "paper_history.csv"
    if not path.exists():
        return None, "no reference history to compare with"
    with open(path) as reference, open(WORK / "runs" / name / "history.csv") as ours:
        expected, rows = list(csv.DictReader(reference)), list(csv.DictReader(ours))
    names = {"cost_after": "cost", "cost_ratio": "cost_ratio", "gradient_norm_squared_ratio": "gradient_norm_squared_ratio"}
    if len(expected) != len(rows):
        return False, f"history: {len(rows)} rows instead of {len(expected)}"
    for theirs, mine in zip(expected, rows):
        for column, own in names.items():
            if f"{float(mine[own]):.15g}" != theirs[column]:
                return False, f"history: {column} in row {theirs['iteration']} is {mine[own]}, not {theirs[column]}"
    return True, f"the {len(rows)} rows of the history are those of the reference to every printed digit"


def lbfgs(race, row):
    _, times, iterations, _, fits = jax_rounds(race)
    compare_fits(row, {"": times}, fits, 50)
    row.notes.append(f"the peer takes {iterations:.0f} iterations")


def smooth(race, row):
    peer = peer_file("casadi_nodal.py")
    times, fits, accuracy = {name: [] for name in THREADS}, [], None
    for _ in race.rounds():
        for name, one in THREADS.items():
            out = python_peer(peer, ["numpy", "casadi"], 2000, 1, one_thread=one)
            times[name] += found(r"solve ([\d.]+)s", out)
            accuracy = found(r"J/J0 (\S+) err m (\S+) k (\S+) c (\S+)", out)
        fits.append(race.fit(smooth_model(2000), "smooth"))
    compare_fits(row, times, fits, 10)
    row.met = row.met and max(errors(fits[-1]).values()) <= max(ACCURATE, *accuracy[1:])
    row.notes.append("kmcfit starts as its model says, from the equation error of the readings; the peer from (2, 1, 1) and differences")
    row.notes.append("peer: J/J0 {:.1e}; largest errors: mass {:.0e}, stiffness {:.0e}, damping {:.0e}".format(*accuracy))


def scaling(race, row):
    fits = {nodes: [] for nodes in (SCALING[:3] if race.quick else SCALING)}
    given_up = []
    for _ in race.rounds():
        for nodes in [n for n in fits if n not in given_up]:
            try:
                fits[nodes].append(race.fit(smooth_model(nodes), f"smooth-{nodes}"))
            except TooSlow as reason:
                given_up.append(nodes)
                row.notes.append(str(reason))
    fits = {nodes: runs for nodes, runs in fits.items() if nodes not in given_up}
    time_of = {nodes: statistics.median(f["seconds"] for f in runs) for nodes, runs in fits.items()}
    ratios = {nodes: time_of[nodes] / nodes / (time_of[2000] / 2000) for nodes in fits}
    worst = {nodes: max(errors(runs[-1]).values()) for nodes, runs in fits.items()}
    row.peer_result = f"{row.peer}: {seconds(time_of[2000])}"
    row.result = "; ".join(f"{nodes:,}: {seconds(time_of[nodes])}" for nodes in fits if nodes != 2000)
    row.ratio = "; ".join(f"{ratios[nodes]:.3g}" for nodes in fits if nodes != 2000) + " per node"
    accurate = all(error <= max(ACCURATE, 10 * worst[2000]) for error in worst.values())
    converged = all(f["outcome"]["status"] == "converged" for runs in fits.values() for f in runs)
    row.met = accurate and converged and max(ratios.values()) <= 1.5 and not given_up
    row.notes += [f"{nodes:,} nodes: {described(runs[-1])}; process {seconds(runs[-1]['wall'])}" for nodes, runs in fits.items()]
    row.result += "".join(f"; {nodes:,}: given up" for nodes in given_up)
    if race.quick and row.met:
        row.met = None
        row.notes.append("quick: without 200,000 nodes")


def knots(race, row):
    peer = peer_file("scipy_knots.py")
    times, fits = {name: [] for name in THREADS}, []
    for _ in race.rounds():
        for name, one in THREADS.items():
            out = python_peer(peer, ["numpy", "scipy", "numba"], one_thread=one)
            times[name] += found(r"scipy knots: ([\d.]+) s", out)
        fits.append(race.fit(ROOT / "models" / "knots.yaml", "knots"))
    compare_fits(row, times, fits, 50)
    row.met = row.met and max(errors(fits[-1]).values()) <= ACCURATE
    row.notes.append(f"peer: {out.strip().splitlines()[-1].split(', ', 1)[-1]}; it has a weight of its own for the penalty")
    race.data["peer_knots"] = statistics.median(fastest(times)[1])


def starts(race, row):
    count = 40 if race.quick else 1000
    program = [str(race.measure_program), "starts", str(count)]
    together, alone = [], []
    for _ in race.rounds():
        clock = time.perf_counter()
        two = [subprocess.Popen([*program, "1"], stdout=subprocess.PIPE, text=True, cwd=ROOT) for _ in range(2)]
        documents = [json.loads(process.communicate()[0]) for process in two]
        together.append(2 * count / max(d["seconds"] for d in documents))
        wall = time.perf_counter() - clock
        alone.append(race.measure("starts", count, 2, one_core=False))
    single = race.measure("starts", count, 1, one_core=False)
    two_threads = statistics.median(a["seconds"] for a in alone)
    rate, reference = count / two_threads, statistics.median(together)
    row.peer_result = f"{row.peer}: {reference:.3g} fits/s"
    row.result = f"{rate:.3g} fits/s on two threads, {count / single['seconds']:.3g} on one"
    row.ratio = f"{100 * rate / reference:.0f} %"
    row.met = rate >= 0.9 * reference
    row.notes += [
        f"{count} starts a run, {len(alone)} rounds, the last two processes took {seconds(wall)}",
        f"{alone[-1]['iterations']} iterations, {alone[-1]['failures']} starts led nowhere",
    ]
    race.data["cores_starts"] = [(1, single["seconds"] * 1000 / count), (2, two_threads * 1000 / count)]


def duffing(race, row):
    times, fits, cost = {}, [], None
    for _ in race.rounds():
        for threads, one in THREADS.items():
            peer = ROOT / "benches" / "peers" / "duffing_scipy.py"
            out = python_peer(peer, ["numpy", "scipy", "numba"], WORK, one_thread=one)
            for name, value, j in re.findall(r"scipy duffing \((.*?)\): ([\d.]+) s, nfev \d+, J (\S+),", out):
                times.setdefault(f"{name}, {threads}", []).append(float(value))
                cost = min(float(j), cost or float(j))
        # As the peer: no correlation of the noise is estimated, and the basis is not tested.
        plain = ["fit.refinement=false", *(f"experiments.0.noise.{kind}=white" for kind in ("displacement", "acceleration"))]
        fits.append(race.fit(WORK / "duffing_long.yaml", "duffing", overrides=plain))
    compare_fits(row, times, fits, 10)
    ours = fits[-1]["cost"]["final"]
    row.met = row.met and abs(ours - cost) <= 1e-6 * cost
    off = ", ".join(f"{q} {abs(fits[-1]['functions'][q]['min'] - true):.1e}" for q, true in DUFFING.items())
    row.notes.append(f"J {cost:.8g} of the peer, {ours:.8g} of kmcfit, whose errors are: {off}")


def start_up(race, row):
    model, repetitions = small_model(), 5 if race.quick else 25
    nothing, short, fit, figures_too = [], [], [], []
    for _ in range(repetitions):
        nothing.append(run(["true"])[3] if shutil.which("true") else 0.0)
        short.append(run([race.kmcfit, "--help"])[3])
        fit.append(race.fit(model, "small")["wall"])
        figures_too.append(race.fit(model, "small-report", report=True)["wall"])
    row.result = f"--help {seconds(statistics.median(short))}; fit {seconds(statistics.median(fit))}"
    row.met = statistics.median(short) <= 10e-3 and statistics.median(fit) <= 30e-3
    row.notes.append(
        f"wall clock of the process, as Python sees it ({seconds(statistics.median(nothing))} for a program that does "
        f"nothing); with figures {seconds(statistics.median(figures_too))}"
    )


def contention(race, row):
    """Fits while another process keeps one core busy: free to use both cores, and pinned to the other one."""
    if not shutil.which("taskset") or not hasattr(os, "sched_getaffinity") or len(os.sched_getaffinity(0)) < 2:
        raise Skip("it needs taskset and two cores")
    models = {"the paper's run": ROOT / "models" / "paper.yaml", "40,000 nodes, smooth": smooth_model(40_000)}
    free, one = {name: [] for name in models}, {name: [] for name in models}
    busy = ["taskset", "-c", str(min(os.sched_getaffinity(0))), sys.executable, "-c", "while True: pass"]
    with subprocess.Popen(busy) as other:
        try:
            for _ in race.rounds():
                for name, model in models.items():
                    free[name].append(race.fit(model, "contention")["seconds"])
                    one[name].append(race.fit(model, "contention", threads=1)["seconds"])
        finally:
            other.kill()
    ratios = {name: statistics.median(free[name]) / statistics.median(one[name]) for name in models}
    row.peer_result = "; ".join(f"{name}: {seconds(statistics.median(one[name]))}" for name in models)
    row.result = "; ".join(seconds(statistics.median(free[name])) for name in models)
    row.ratio = "; ".join(f"{ratio:.3g}" for ratio in ratios.values())
    row.met = max(ratios.values()) <= 1.1
    row.notes += [f"{name}: free {spread(free[name])}; pinned {spread(one[name])}" for name in models]


def noisy_data(nodes):
    """The record of noisy.yaml on another grid: the paper's response, and Gaussian noise of 0.1 m with seed 1."""
    if nodes == 2000:
        return ROOT / "data" / "noisy.csv"
    path = WORK / f"noisy-{nodes}.csv"
    if not path.exists():
        clean, _ = paper_data(nodes)
        draw = random.Random(1)
        with open(clean, newline="") as source, open(path, "w", newline="") as out:
            rows = csv.reader(source)
            writer = csv.writer(out)
            writer.writerow(next(rows))
            writer.writerows((t, repr(float(y) + draw.gauss(0.0, 0.1))) for t, y in rows)
    return path


def noisy_model(nodes, label="noisy", more=()):
    """noisy.yaml on another grid, with its own readings."""
    _, truth = paper_data(nodes)
    data = (ROOT / "data").as_posix()
    return changed(
        "noisy",
        f"{label}-{nodes}",
        [
            (f"{data}/noisy.csv", noisy_data(nodes).as_posix()),
            (f"{data}/paper_truth.csv", truth.as_posix()),
            ("nodes: 2000", f"nodes: {nodes}"),
            *more,
        ],
    )


def path_of_weights(race, row, nodes, peers, factor):
    """A path of nine weights; per weight IPOPT's cold or warm start, whichever is faster, and FATROP's cold start."""
    times, fits = {}, []
    for _ in race.rounds():
        for name, file in peers.items():
            for threads, one in THREADS.items():
                out = python_peer(peer_file(file), ["numpy", "casadi"], noisy_data(nodes), one_thread=one)
                times.setdefault(f"{name}, {threads}", []).extend(found(r"path ([\d.]+)s", out))
        fits.append(race.fit(noisy_model(nodes), f"noisy-{nodes}"))
    compare_fits(row, times, fits, factor)


PATH_PEERS = {"IPOPT": "casadi_noisy_path.py", "FATROP": "casadi_fatrop_noisy_path.py"}


def noisy(race, row):
    path_of_weights(race, row, 2000, PATH_PEERS, 12)


def noisy_500(race, row):
    path_of_weights(race, row, 500, PATH_PEERS, 12)


def noisy_long(race, row):
    """Cost per node against that on 2000 nodes; FATROP's path on 8000, where IPOPT fails."""
    sizes = [2000, 8000] if race.quick else [2000, 8000, 40_000]
    fits = {nodes: [] for nodes in sizes}
    for _ in race.rounds():
        for nodes in sizes:
            fits[nodes].append(race.fit(noisy_model(nodes), f"noisy-{nodes}"))
    time_of = {nodes: statistics.median(f["seconds"] for f in runs) for nodes, runs in fits.items()}
    ratios = {nodes: time_of[nodes] / nodes / (time_of[2000] / 2000) for nodes in sizes}
    row.peer_result = f"2000 nodes: {seconds(time_of[2000])}"
    row.result = "; ".join(f"{nodes:,}: {seconds(time_of[nodes])}" for nodes in sizes[1:])
    row.ratio = "; ".join(f"{ratios[nodes]:.3g}" for nodes in sizes[1:]) + " per node"
    row.met = max(ratios.values()) <= 1.5 and all(f["outcome"]["status"] == "converged" for runs in fits.values() for f in runs)
    row.notes += [f"{nodes:,} nodes: {described(runs[-1])}" for nodes, runs in fits.items()]
    for nodes in sizes[1:] if not race.quick else []:
        try:
            out = python_peer(peer_file(PATH_PEERS["FATROP"]), ["numpy", "casadi"], noisy_data(nodes), one_thread=True)
            row.notes.append(f"FATROP on {nodes:,} nodes, one thread, one run: {seconds(found(r'path ([0-9.]+)s', out)[0])}")
        except Skip as reason:
            row.notes.append(f"FATROP on {nodes:,} nodes: {reason}")


def noisy_costs(race, row):
    """J of every weight of the path, with a stopping tolerance of 1e-9, against an independent solution."""
    sizes = [500] if race.quick else [500, 2000, 8000]
    worst = {}
    for nodes in sizes:
        fit = race.fit(noisy_model(nodes, "costs", [("tolerance: 1.0e-5", "tolerance: 1.0e-9")]), f"costs-{nodes}")
        path = fit["weights"]["path"]
        peer = ROOT / "benches" / "peers" / "noisy_costs.py"
        out = python_peer(peer, ["casadi"], noisy_data(nodes), *(repr(point["weight"]) for point in path))
        theirs = [float(j) for j in re.findall(r" J (\S+) ", out)]
        ours = [point["misfit"] + point["weight"] * point["roughness"] for point in path]
        if len(theirs) != len(ours):
            raise Skip(f"its peer solved {len(theirs)} of {len(ours)} weights on {nodes} nodes")
        excess = [(a - b) / b for a, b in zip(ours, theirs)]
        worst[nodes] = max(excess, key=abs)
        row.notes.append(f"{nodes:,} nodes, {seconds(fit['seconds'])}, relative excess of J: " + ", ".join(f"{e:.0e}" for e in excess))
    row.result = "; ".join(f"{nodes:,} nodes: {value:.0e}" for nodes, value in worst.items())
    row.ratio = f"{max(map(abs, worst.values())):.0e}"
    row.met = max(worst.values()) <= 1e-9


def bounded(race, row):
    """Positive, smooth, normalised, without noise, against a structured interior point."""
    peer = peer_file("casadi_fatrop.py")
    ratios = []
    for nodes in (2000, 8000):
        times, fits = {name: [] for name in THREADS}, []
        for _ in race.rounds():
            for name, one in THREADS.items():
                out = python_peer(peer, ["numpy", "casadi"], nodes, 1, one_thread=one)
                times[name] += found(r"solve ([\d.]+)s", out)
            fits.append(race.fit(smooth_model(nodes), f"smooth-{nodes}"))
        _, fast = fastest(times)
        ours, theirs = statistics.median(f["seconds"] for f in fits), statistics.median(fast)
        ratios.append((nodes, ours, theirs))
        row.notes += [f"{nodes} nodes, peer, {name}: {spread(runs)}" for name, runs in times.items()]
        row.notes += [f"{nodes} nodes, kmcfit: {described(fits[-1])}"]
    row.peer_result = row.peer + ": " + "; ".join(f"{n}: {seconds(t)}" for n, _, t in ratios)
    row.result = "; ".join(f"{n}: {seconds(o)}" for n, o, _ in ratios)
    row.ratio = "; ".join(share(o, t) for _, o, t in ratios)
    row.met = all(o * 15 <= t for _, o, t in ratios)


KINDS = {
    "passive": [("  - {function: stiffness, at: 0.0, value: 1.0}", "  - {function: stiffness, at: 0.0, value: 1.0}\n  - {passive: true}")],
    "damping ratio": [("  - {function: stiffness, at: 0.0, value: 1.0}", "  - {function: stiffness, at: 0.0, value: 1.0}\n  - {damping_ratio: {max: 0.02}}")],
    "two records": [
        (
            "grid: {",
            "  - name: second record\n    data: @data/paper_second.csv\n    columns: {time: t_s, displacement: y_m}\n"
            "    sigma: {displacement: 0.1}\n    initial: {displacement: 0.0, velocity: 3.0}\ngrid: {",
        )
    ],
}


def bounded_kinds(race, row):
    """noisy.yaml with further constraints and records, against itself."""
    plain = statistics.median(race.fit(noisy_model(2000), "noisy-2000")["seconds"] for _ in race.rounds())
    row.peer_result = f"{row.peer}: {seconds(plain)}"
    results, ratios = [], []
    for kind, changes in KINDS.items():
        changes = [(old, new.replace("@data", (ROOT / "data").as_posix())) for old, new in changes]
        model = noisy_model(2000, kind.replace(" ", "-"), changes)
        fits = [race.fit(model, kind.replace(" ", "-")) for _ in race.rounds()]
        ours = statistics.median(f["seconds"] for f in fits)
        results.append(f"{kind}: {seconds(ours)}")
        ratios.append(f"{ours / plain:.3g}")
        row.notes.append(f"{kind}: {described(fits[-1])}")
    row.result, row.ratio = "; ".join(results), "; ".join(ratios) + " times"


def bounded_long(race, row):
    """A bounded, smoothed fit with noise on 200,000 nodes: time per node, and memory."""
    sizes = [2000, 20_000] if race.quick else [2000, 20_000, 200_000]
    results = {}
    for nodes in sizes:
        model = noisy_model(nodes, "one-weight", [("weight: discrepancy", "weight: 1.0e6")])
        out = WORK / "runs" / f"one-weight-{nodes}"
        shutil.rmtree(out, ignore_errors=True)
        process = subprocess.Popen([str(c) for c in (race.kmcfit, "fit", model, "--out", out, "--no-report")], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(process.pid, 0)
        if status != 0:
            raise Skip(f"kmcfit fit on {nodes} nodes ended with {status}")
        document = json.loads((out / "result.json").read_text())
        results[nodes] = (document["seconds"], used.ru_maxrss / 1024)
        row.notes.append(f"{nodes:,} nodes: {described({**document, 'wall': 0.0})}; {used.ru_maxrss / 1024:.0f} MB")
    per_node = {nodes: elapsed / nodes for nodes, (elapsed, _) in results.items()}
    most = max(sizes)
    row.peer_result = f"{row.peer}: {seconds(results[2000][0])}"
    row.result = f"{most:,}: {seconds(results[most][0])}, {results[most][1]:.0f} MB"
    row.ratio = f"{per_node[most] / per_node[2000]:.3g} per node"
    row.met = per_node[most] <= 1.5 * per_node[2000]


def without_tests(name):
    """A shipped model with white noise and without the test of its bases, if that changes the model."""
    text = (ROOT / "models" / f"{name}.yaml").read_text(encoding="utf-8")
    overrides = ["fit.refinement=false"]
    for i, experiment in enumerate(re.split(r"^  - ", text.split("experiments:")[1].split("\ngrid:")[0], flags=re.M)[1:]):
        channels = re.search(r"sigma: *\{([^}]*)\}", experiment)
        kinds = re.findall(r"(displacement|velocity|acceleration)", channels.group(1)) if channels else []
        overrides += [f"experiments.{i}.noise.{kind}=white" for kind in dict.fromkeys(kinds)]
    return overrides


def defaults(race, row):
    """Every shipped model as it is, against white noise and no test of its bases: times of the whole command without reports."""
    worst, total = [], {"as shipped": 0.0, "plain": 0.0}
    for path in sorted((ROOT / "models").glob("*.yaml")):
        name = path.stem
        times = {"as shipped": [], "plain": []}
        for _ in race.rounds():
            for way, overrides in (("as shipped", []), ("plain", without_tests(name))):
                try:
                    fit = race.fit(path, f"defaults-{name}", overrides=overrides)
                except Skip as reason:
                    # Models that only simulate.
                    if "has no data" not in str(reason):
                        raise
                    continue
                times[way].append(fit["timings"]["total"]["seconds"])
        if not times["plain"]:
            continue
        middle = {way: statistics.median(values) for way, values in times.items()}
        worst.append((middle["as shipped"] / middle["plain"], name, middle))
        for way in total:
            total[way] += middle[way]
    worst.sort(reverse=True)
    row.peer_result = f"{row.peer}: {seconds(total['plain'])}"
    row.result = f"{seconds(total['as shipped'])} for all {len(worst)} models"
    row.ratio = f"{worst[0][0]:.3g} times at most ({worst[0][1]})"
    row.met = worst[0][0] <= 2.0
    row.notes += [f"{name}: {seconds(m['as shipped'])}, {seconds(m['plain'])} plain, {ratio:.3g} times" for ratio, name, m in worst]


def whole_command(race, model, name, row):
    """Wall clock of a fit with all results and its page, the seconds of its search, and its peak memory in bytes."""
    walls, searches, peak = [], [], 0
    for _ in race.rounds():
        out = WORK / "runs" / name
        shutil.rmtree(out, ignore_errors=True)
        clock = time.perf_counter()
        process = subprocess.Popen([race.kmcfit, "fit", model, "--out", out], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, _, usage = os.wait4(process.pid, 0)
        walls.append(time.perf_counter() - clock)
        peak = max(peak, usage.ru_maxrss * 1024)
        document = json.loads((out / "result.json").read_text())
        searches.append(document["seconds"])
        if document["outcome"]["status"] != "converged":
            raise Skip(f"{name}: {document['outcome']}")
    wall, search = statistics.median(walls), statistics.median(searches)
    row.notes.append(f"{name}: {spread(walls)} for the whole, {seconds(search)} for the search, {peak / 1e6:.0f} MB at the peak")
    return wall, search, peak


def whole(race, row):
    """65,000 samples of two sensors: the model of the row `duffing`, with analysis, tables and page."""
    peer = ROOT / "benches" / "peers" / "duffing_scipy.py"
    race.once("duffing data", lambda: python_peer(peer, ["numpy", "scipy", "numba"], WORK, one_thread=True))
    wall, search, _ = whole_command(race, WORK / "duffing_long.yaml", "whole-65000", row)
    row.peer_result = f"search {seconds(search)}"
    row.result = seconds(wall)
    row.ratio = f"60 ms + {(wall - 0.06) / search:.3g} times"
    row.met = wall <= 0.06 + 3 * search


def whole_long(race, row):
    """10⁶ and 5·10⁶ samples of an acceleration and a force, eight parameters, sigma and grid automatic."""
    limits = []
    for samples in (100_000,) if race.quick else (1_000_000, 5_000_000):
        make = ROOT / "benches" / "long_record.py"
        race.once(f"long {samples}", lambda: python_peer(make, ["numpy", "numba"], WORK, samples, one_thread=True))
        wall, search, peak = whole_command(race, WORK / f"long-{samples}.yaml", f"whole-{samples}", row)
        limits.append((samples, wall, search, peak))
    _, wall, search, _ = limits[0]
    row.peer_result = f"search {seconds(search)}"
    row.result = f"{seconds(wall)}; {limits[-1][3] / 1e9:.3g} GB for {limits[-1][0]:,}"
    row.ratio = f"60 ms + {(wall - 0.06) / search:.3g} times"
    row.met = wall <= 0.06 + 3 * search and limits[-1][3] <= 1.5e9


def studies(race, row):
    """Studies of the smooth model of 6000 parameters, and of splines with 12."""
    few = ["--set", "functions.mass.knots=4", "--set", "functions.damping.knots=4"]
    times = {}
    for name, model, more in (("smooth", "paper-smooth", []), ("twelve", "spline", few)):
        for _ in race.rounds():
            out = WORK / "runs" / f"study-{name}"
            shutil.rmtree(out, ignore_errors=True)
            _, trouble, code, wall = run([race.kmcfit, "study", ROOT / "models" / f"{model}.yaml", "--out", out, *more], timeout=race.longest)
            if code not in (0, 3):
                raise Skip(trouble[-300:])
            times.setdefault(name, []).append(wall)
    row.notes += [f"{name}: {spread(values)}" for name, values in times.items()]
    smooth, twelve = (statistics.median(times[name]) for name in ("smooth", "twelve"))
    row.result = f"{seconds(smooth)}; {seconds(twelve)}"
    row.met = smooth <= 15 and twelve <= 1


def chain(race, row):
    """A chain of 50 masses by the implicit rule: response and gradient over the response alone."""
    rounds = [race.measure("chain", 50, 10_000, "implicit-midpoint") for _ in race.rounds()]
    forward, both = (statistics.median(r[key] for r in rounds) for key in ("forward_seconds", "seconds"))
    row.peer_result = f"response: {forward / 1e4 * 1e6:.3g} µs a step"
    row.result = f"response and gradient: {both / 1e4 * 1e6:.3g} µs a step"
    row.ratio = f"{both / forward:.3g} times"
    row.met = both <= 3.5 * forward


def table(race):
    """The rows of the issue: what, peer, target, and the function that fills them."""
    return [
        (Row("evaluation", "J and its discrete gradient, 2000 nodes", "JAX", "1/5"), evaluation),
        (Row("million", "the same, 10⁶ nodes", "2000 nodes", "1.3 times the time on 2000, which is on one core, or 80 % of the triad; 200 bytes a step"), million),
        (Row("paper", "the paper's 1000 iterations", "C, better of two builds", "1/7 on one core; the same history"), paper),
        (Row("lbfgs", "nodal fit to J/J0 = 1e-4", "optax L-BFGS", "1/50"), lbfgs),
        (Row("smooth", "positive, smooth, normalised, 2000 nodes", "CasADi and IPOPT", "1/10"), smooth),
        (Row("scaling", "the same on more nodes", "2000 nodes", "as accurate; 1.5 per node"), scaling),
        (Row("knots", "32 parameters on knots", "SciPy", "1/50"), knots),
        (Row("starts", "a study of 1000 starts of it", "two processes", "90 % of their throughput"), starts),
        (Row("duffing", "forced, nonlinear, 65,000 samples, two sensors", "SciPy and Numba", "1/10"), duffing),
        (Row("start-up", "start-up", "", "--help 10 ms; fit of 100 readings 30 ms"), start_up),
        (Row("contention", "fits with one of two cores busy", "pinned to the other core", "1.1 times"), contention),
        (Row("noisy", "noise, bounds, a path of nine weights, 2000 nodes", "CasADi", "1/12"), noisy),
        (Row("noisy-500", "the same on 500 nodes", "CasADi", "1/12"), noisy_500),
        (Row("noisy-long", "the same on more nodes", "2000 nodes", "1.5 per node"), noisy_long),
        (Row("noisy-costs", "J of every weight of that path", "CasADi and FATROP", "1e-9 above it"), noisy_costs),
        (Row("bounded", "positive, smooth, normalised, without noise", "CasADi and FATROP", "1/15"), bounded),
        (Row("bounded-kinds", "noisy with other constraints and records", "noisy", "none"), bounded_kinds),
        (Row("bounded-long", "noise, bounds, one weight, 200,000 nodes", "2000 nodes", "1.5 per node; memory"), bounded_long),
        (Row("whole", "the whole command on 65,000 samples, with page", "its search", "60 ms + 3 times"), whole),
        (Row("whole-long", "the same on 10⁶ samples", "its search", "60 ms + 3 times; 5·10⁶ in 1.5 GB"), whole_long),
        (Row("studies", "studies of 6000 parameters, and of 12", "", "15 s; 1 s"), studies),
        (Row("chain", "implicit steps of a chain of 50 masses, gradient", "its response", "3.5 times"), chain),
        (Row("defaults", "the shipped models with their intervals and tests", "white noise, no test of bases", "2 times"), defaults),
    ]


# ---------------------------------------------------------------------------------------------- figures


def draw(race, chosen, folder):
    """Draws the figures of the chosen rows; their files."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = []

    def write(figure, name):
        figure.write(folder / name)
        drawn.append(folder / name)

    if {"evaluation", "million"} & chosen:
        sizes = EVALUATIONS[::3] if race.quick else EVALUATIONS
        all_sizes = [race.evaluation(nodes) for nodes in sizes]
        figure = figures.Figure("Cost and discrete gradient of the paper's problem", "time nodes N", "time per step, ns")
        for name, key in (("cost and gradient", "seconds"), ("cost alone", "cost_seconds")):
            figure.add(name, [(e["nodes"], e[key] / e["nodes"] * 1e9) for e in all_sizes])
        figure.level("limit of two sequential sweeps", 2 * race.limit())
        figure.level("JAX, N = 2000", race.data.get("peer_ns_per_step"))
        write(figure, "time-per-step.svg")
    if "knots" in chosen:
        points = []
        for count in KNOTS[::3] if race.quick else KNOTS:
            model = changed("knots", f"knots-{count}", [("knots: 11", f"knots: {count}")])
            fits = [race.fit(model, f"knots-{count}") for _ in range(1 if race.quick else 3)]
            points.append((3 * count - 1, statistics.median(f["seconds"] for f in fits)))
            print(f"  {3 * count - 1} parameters: {seconds(points[-1][1])}, {fits[-1]['outcome']['status']}", flush=True)
        figure = figures.Figure("A fit on knots, 2000 nodes", "parameters", "time of the solver, s")
        figure.add("kmcfit", points)
        if "peer_knots" in race.data:
            figure.add("SciPy, 32 parameters", [(32, race.data["peer_knots"])], line=False)
        write(figure, "time-against-parameters.svg")
    figure = figures.Figure("Time against cores (dotted: half the time on two)", "cores", "time, s", x_ticks=[1, 2])
    if "cores_starts" in race.data:
        figure.add("1000 starts of the knots model", race.data["cores_starts"])
        first = race.data["cores_starts"][0][1]
        figure.add("ideal", [(1, first), (2, first / 2)], dashed=True)
    write(figure, "time-against-cores.svg")


# ----------------------------------------------------------------------------------------------- report
    return drawn


def commit():
    """What was measured."""
    changed = first_line(["git", "status", "--porcelain", "--", "src", "crates", "benches/common", "Cargo.toml"])
    return (first_line(["git", "rev-parse", "--short", "HEAD"]) or "unknown") + (" and changes" if changed else "")


def machine(load):
    """What ran, without what names it."""
    cpu = platform.processor() or platform.machine()
    try:
        about = Path("/proc/cpuinfo").read_text()
        cpu = re.search(r"model name\s*:\s*(.*)", about).group(1)
        # Processors of several generations have one name.
        family, model = (re.search(rf"{key}\s*:\s*(\d+)", about).group(1) for key in ("cpu family", "model"))
        lanes = "AVX-512" if "avx512f" in about else "AVX2" if "avx2" in about else "neither AVX2 nor AVX-512"
        cpu += f" (family {family}, model {model}; {lanes})"
        memory = int(re.search(r"MemTotal:\s*(\d+)", Path("/proc/meminfo").read_text()).group(1)) / 2**20
    except (OSError, AttributeError):
        memory = None
    try:
        system = re.search(r'PRETTY_NAME="(.*)"', Path("/etc/os-release").read_text()).group(1)
    except (OSError, AttributeError):
        system = platform.system()
    packages = []
    for package in ("numpy", "scipy", "jax", "optax", "numba", "casadi"):
        code = f"import importlib.metadata as m; print(m.version({package!r}))"
        version = first_line([sys.executable, "-c", code])
        packages += [f"{package} {version}"] if version else []
    return [
        ("processor", f"{cpu}, {os.cpu_count()} cores"),
        ("memory", f"{memory:.0f} GiB" if memory else "unknown"),
        ("system", f"{system}, {platform.system()} {platform.release().split('-')[0]}"),
        ("compilers", "; ".join(filter(None, [first_line(["rustc", "--version"]), first_line(["cc", "--version"])]))),
        ("Python", "; ".join([platform.python_version(), *packages])),
        ("commit", commit()),
        ("date", datetime.date.today().isoformat()),
        ("other work", "unknown" if load is None else f"load {load:.1f} before the race"),
    ]


def markdown(rows, about, repetitions, drawn):
    heads = ["row", "what", "peer", "kmcfit", "ratio", "target", ""]
    lines = ["# Results of the race", "", "Made by `python3 benches/race.py`, but for the last section.", ""]
    lines += ["| | |", "|---|---|", *(f"| {name} | {value} |" for name, value in about), ""]
    lines += [f"Medians of up to {repetitions} rounds in which kmcfit and its peer take turns; before each of its fits the same one is run and not measured.", ""]
    lines += ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for row in rows:
        cells = row.cells()
        cells[-1] = f"**{cells[-1]}**" if row.verdict != "met" else cells[-1]
        lines.append("| " + " | ".join(cells) + " |")
    if drawn:
        lines += ["", "## Scaling", "", *(f"![{path.stem.replace('-', ' ')}](figures/{path.name})" for path in drawn)]
    return "\n".join(lines) + "\n"


def details(rows):
    """The notes of each row."""
    lines = ["# Row by row", ""]
    for row in rows:
        notes = [f"skipped: {row.skipped}"] if row.skipped else row.notes
        lines.append(f"{ROWS.index(row.name) + 1}. `{row.name}`")
        lines += [f"   - {note}" for note in notes]
    return "\n".join(lines) + "\n"


def write_results(path, text):
    """Writes the results; the last section of those that are there, which is written by hand, stays."""
    before = path.read_text(encoding="utf-8") if path.exists() else ""
    _, heading, rest = before.partition("\n## Whole commands\n")
    path.write_text(text + heading + rest, encoding="utf-8")


def load_average():
    return os.getloadavg()[0] if hasattr(os, "getloadavg") else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rows", help=f"names or numbers, separated by commas: {', '.join(ROWS)}")
    parser.add_argument("--quick", action="store_true", help="fewer repetitions, starts and sizes")
    parser.add_argument("--repetitions", type=int, help="rounds of each row [default: 5, or 1 with --quick]")
    parser.add_argument("--limit", type=float, default=600.0, help="give a fit up after so many seconds [default: 600]")
    parser.add_argument("--out", type=Path, help="folder for RESULTS.md and figures/")
    parser.add_argument("--no-figures", action="store_true", help="draw no figures")
    options = parser.parse_args()
    chosen = set(ROWS)
    if options.rows:
        words = options.rows.split(",")
        chosen = {ROWS[int(w) - 1] if w.isdigit() and 0 < int(w) <= len(ROWS) else w for w in words}
        if not chosen <= set(ROWS):
            parser.error(f"no such row: {', '.join(sorted(chosen - set(ROWS)))}")
    whole = chosen == set(ROWS) and not options.quick
    repetitions = options.repetitions or (1 if options.quick else 5)
    WORK.mkdir(parents=True, exist_ok=True)
    load = load_average()
    if load is not None and load > 0.5:
        print(f"note: the load is {load:.1f} already: other work makes the numbers noisy")
    race = Race(repetitions, options.quick, options.limit)
    rows = []
    for row, fill in table(race):
        if row.name not in chosen:
            continue
        print(f"\n{ROWS.index(row.name) + 1} {row.name}: {row.what}", flush=True)
        try:
            fill(race, row)
        except (Skip, OSError, ValueError, KeyError) as reason:
            row.skipped = str(reason) if isinstance(reason, Skip) else f"{type(reason).__name__}: {reason}"
            print(f"  SKIPPED: {row.skipped}", flush=True)
        else:
            print(f"  {row.peer_result}\n  kmcfit: {row.result}\n  {row.ratio} (target {row.target}): {row.verdict}")
            print("\n".join(f"  - {note}" for note in row.notes), flush=True)
        rows.append(row)
    # A race without some of the peers is not to take the place of one with all.
    whole = whole and not any(row.skipped for row in rows)
    out = options.out or (ROOT / "benches" if whole else WORK)
    out.mkdir(parents=True, exist_ok=True)
    text = markdown(rows, machine(load), repetitions, [])
    write_results(out / "RESULTS.md", text)
    WORK.mkdir(parents=True, exist_ok=True)
    (WORK / "rows.md").write_text(details(rows), encoding="utf-8")
    if not options.no_figures:
        print("\nfigures …", flush=True)
        try:
            drawn = draw(race, chosen, out / "figures")
            text = markdown(rows, machine(load), repetitions, drawn)
            write_results(out / "RESULTS.md", text)
        except (Skip, OSError, ValueError, KeyError) as reason:
            print(f"  no figures: {reason}", flush=True)
    print("\n" + text)


if __name__ == "__main__":
    main()
