#!/usr/bin/env bash
# pyuff 2.5.8: the times of an even set 58 come back stretched, because its step is written with six digits.
#
# Written down before the run: "a record at 512 Hz that pyuff writes and reads again has the times it was given, to 1e-9 s; binary sets (58b)
# and sets in double precision in any case."
#
# Seen: the step 0.001953125 s is written as 1.95312e-03 in text and binary sets alike (the layout of record 7 asks for E13.5), and the array
# `x` that was given is not stored. After 65,536 samples (128 s) the times are 0.33 ms early, a sixth of a sample, and a frequency is 2.6e-6 too
# high; at 2048 and 3000 Hz a thirtieth and a fifteenth of a sample are lost. Beside a set that keeps its times an even one drifts by a sample in
# some minutes. Steps of at most six digits, such as 0.002 s, are exact.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet pyuff==2.5.8 numpy==2.4.6
cd "$place"
venv/bin/python - <<'PYTHON'
import numpy as np
import pyuff


def read_back(rate, binary, count=65536):
    times = np.arange(count) / rate
    one = {
        "type": 58, "binary": binary, "func_type": 1, "ver_num": 1, "load_case_id": 0, "rsp_ent_name": "NONE", "rsp_node": 1, "rsp_dir": 3,
        "ref_ent_name": "NONE", "ref_node": 1, "ref_dir": 3, "ord_data_type": 4, "num_pts": count, "abscissa_spacing": 1,
        "abscissa_min": 0.0, "abscissa_inc": 1 / rate, "z_axis_value": 0.0, "id1": "a", "id2": "NONE", "id3": "NONE", "id4": "NONE",
        "id5": "NONE", "x": times, "data": np.sin(times),
    }
    for axis, kind in (("abscissa", 17), ("ordinate", 12), ("orddenom", 0), ("z_axis", 0)):
        one.update({f"{axis}_spec_data_type": kind, f"{axis}_axis_lab": "NONE", f"{axis}_axis_units_lab": "NONE"})
        one.update({f"{axis}_{which}_unit_exp": 0 for which in ("len", "force", "temp")})
    name = f"{rate}-{binary}.uff"
    pyuff.UFF(name).write_sets(one, mode="add")
    again = pyuff.UFF(name).read_sets()
    return times[-1] - again["x"][-1], np.max(np.abs(again["data"] - one["data"]))


print(f"pyuff {pyuff.__version__}: time lost at the end of 65,536 samples, and error of the values")
for rate in (500, 512, 2048, 3000):
    for binary in (0, 1):
        lost, error = read_back(rate, binary)
        print(f"  {rate} Hz, {'binary' if binary else 'text'}: {1e3 * lost:+.4f} ms ({lost * rate:+.3f} samples), {error:.0e}")
        assert error < 1e-11
        assert (abs(lost) < 1e-9) == (rate == 500)
        if rate == 512:
            assert 0.32e-3 < lost < 0.34e-3
PYTHON
