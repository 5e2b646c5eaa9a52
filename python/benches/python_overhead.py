"""Import time and call overhead of the Python package.

    python benches/python_overhead.py

Import: time of `import kmcfit` after `import numpy`, in new interpreters. Overhead: time of `Model.fit` beside the time between start and end
of the fit in Rust (`timings`), for a fit of 400 samples.
"""

import statistics
import subprocess
import sys
import time

import numpy as np

import kmcfit as km

IMPORT = "import time, numpy; start = time.perf_counter(); import kmcfit; print(time.perf_counter() - start)"
ROUNDS = 15


def main():
    imports = [float(subprocess.run([sys.executable, "-c", IMPORT], capture_output=True, text=True, check=True).stdout) for _ in range(ROUNDS)]
    print(f"import kmcfit beside NumPy: {1e3 * statistics.median(imports):.1f} ms (limit 100 ms)")
    t = np.linspace(0.0, 2.0, 401)
    y = 0.010 * np.sin(20 * t) + 0.005 * np.sin(31 * t)
    v = 0.200 * np.cos(20 * t) + 0.155 * np.cos(31 * t)
    a = -4.00 * np.sin(20 * t) - 4.805 * np.sin(31 * t)
    f = 2.4 * a + 1.0 * v + 1500.0 * y
    model = km.Model(mass=2.4)
    overheads, fits, records = [], [], []
    for _ in range(2 * ROUNDS):
        start = time.perf_counter()
        data = km.Experiment(time=t, force=f, acceleration=a)
        records.append(time.perf_counter() - start)
        start = time.perf_counter()
        fit = model.fit(data)
        whole = time.perf_counter() - start
        total = fit.result["timings"]["total"]["seconds"]
        fits.append(total)
        overheads.append(whole - total)
    print(f"a fit of {len(t)} samples: {1e3 * statistics.median(fits):.2f} ms")
    print(f"overhead of the call: {1e6 * statistics.median(overheads):.0f} us, at least {1e6 * min(overheads):.0f} us (limit 200 us)")
    print(f"the record with the choices of `kmcfit init`: {1e3 * statistics.median(records):.2f} ms")


if __name__ == "__main__":
    main()
