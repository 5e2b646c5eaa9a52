"""Import time and call overhead of the Python package.

    python benches/python_overhead.py

Import: time of `import kmcfit` after `import numpy`, in new interpreters. Overhead: time of `Model.fit` beside the time between start and end
of the fit in Rust (`timings`), for a fit of 401 samples; the medians of several rounds, since other work on the machine adds to them.
"""

import statistics
import subprocess
import sys
import time

import numpy as np

import kmcfit as km

IMPORT = "import time, numpy; start = time.perf_counter(); import kmcfit; print(time.perf_counter() - start)"
ROUNDS, FITS = 5, 100


def main():
    imports = [float(subprocess.run([sys.executable, "-c", IMPORT], capture_output=True, text=True, check=True).stdout) for _ in range(15)]
    print(f"import kmcfit beside NumPy: {1e3 * statistics.median(imports):.1f} ms (limit 100 ms)")
    t = np.linspace(0.0, 2.0, 401)
    y = 0.010 * np.sin(20 * t) + 0.005 * np.sin(31 * t)
    v = 0.200 * np.cos(20 * t) + 0.155 * np.cos(31 * t)
    a = -4.00 * np.sin(20 * t) - 4.805 * np.sin(31 * t)
    f = 2.4 * a + 1.0 * v + 1500.0 * y
    a = a + 0.02 * np.random.default_rng(2).standard_normal(len(a))
    model = km.Model(mass=2.4)
    data = km.Experiment(time=t, force=f, acceleration=a)
    medians, fits, least = [], [], 1.0
    for _ in range(ROUNDS):
        overheads = []
        for _ in range(FITS):
            start = time.perf_counter()
            fit = model.fit(data)
            whole = time.perf_counter() - start
            fits.append(fit.result["timings"]["total"]["seconds"])
            overheads.append(whole - fits[-1])
            del fit
        medians.append(statistics.median(overheads))
        least = min(least, *overheads)
    print(f"a fit of {len(t)} samples: {1e3 * statistics.median(fits):.2f} ms")
    each = ", ".join(f"{1e6 * median:.0f}" for median in medians)
    print(f"overhead of the call: {each} us (medians of {FITS}), at least {1e6 * least:.0f} us (limit 200 us)")
    records, firsts = [], []
    for _ in range(30):
        start = time.perf_counter()
        data = km.Experiment(time=t, force=f, acceleration=a)
        records.append(time.perf_counter() - start)
        start = time.perf_counter()
        fit = model.fit(data)
        firsts.append(time.perf_counter() - start - fit.result["timings"]["total"]["seconds"])
    print(f"the first fit of a record, for the text of its model: {1e6 * statistics.median(firsts):.0f} us")
    print(f"the record with the choices of `kmcfit init`: {1e3 * statistics.median(records):.2f} ms")


if __name__ == "__main__":
    main()
