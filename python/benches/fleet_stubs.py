"""The scheduler of Dask and the driver of a fleet alone: stubs in place of fits, in the batches of the recipe of docs/fleets.md.

usage: fleet_stubs.py [RECORDS] [WORKERS] [SECONDS]   needs: kmcfit, distributed

WORKERS and SECONDS (of a fit) make the batches as on a cluster of that size; two local workers return the rows at once. The time is then
that of the scheduler, of the connections and of the driver.
"""

import resource
import sys
import tempfile
import time
from pathlib import Path

import distributed
import numpy as np

import kmcfit as km
from kmcfit import _batches, _fleet


def stub(job, blocks, template, seconds):
    line, curves = template
    names = [record.name for block in blocks for record in block]
    return [(line.replace("NAME", name), [curve.replace("NAME", name) for curve in curves]) for name in names], seconds * len(names)


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    workers = int(sys.argv[2]) if len(sys.argv) > 2 else 100
    seconds = float(sys.argv[3]) if len(sys.argv) > 3 else 0.02
    model = km.Model(mass=1.0, damping=km.Constant(start=0.2), stiffness=km.Constant(start=4.0))
    t = 0.1 * np.arange(101)
    y = np.exp(-0.1 * t) * np.cos(2 * t) + 0.01 * np.random.default_rng(1).standard_normal(101)
    fleet, source = _fleet._source(model, None)
    job = _fleet.Job(km.__version__, source, False, None)
    [template], _ = _fleet.fit_blocks(fleet, job, [[_fleet.item(("NAME", {"time": t, "displacement": y}), 1)]])
    tasks = 0

    def task(job, blocks):
        return stub(job, blocks, template, seconds)

    options = dict(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        # The functions of this script are sent by value.
        _fleet.fit_batch = task
        size = int(_batches._WORK * workers / seconds) + 1
        with tempfile.TemporaryDirectory() as folder:
            records = (f"records/{i:07}.csv" for i in range(count))
            begin = time.perf_counter()
            rows = sum(1 for _ in km.fit_many(model, records, client, out=Path(folder, "fleet"), batch=size))
            elapsed = time.perf_counter() - begin
            journal = Path(folder, "fleet/rows-1-of-1.jsonl").stat().st_size
            written = len(km.read_fleet(Path(folder, "fleet"))) if count <= 100_000 else None
    tasks = -(-count // size)
    assert rows == count and written in (None, count)
    work = count * seconds / workers
    print(f"{count} rows of {journal / count:.0f} bytes in {tasks} tasks of {size} records: {elapsed:.1f} s")
    print(f"{elapsed / tasks * 1e3:.1f} ms a task, {elapsed / count * 1e6:.0f} us a row, with journal, tables and page")
    print(f"work of {workers} workers at {seconds * 1e3:g} ms a fit: {work:.1f} s")
    print(f"peak memory of the driver: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")


if __name__ == "__main__":
    main()
