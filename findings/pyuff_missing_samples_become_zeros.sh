#!/usr/bin/env bash
# pyuff 2.5.8: a missing sample (NaN) is written as 0, an infinite one as the largest double, in the file and in the caller's own data.
#
# Written down before the run: "NaN in the samples of a set 58 is written as text that readers refuse, or the set is refused."
#
# Seen: write_sets passes the samples through nan_to_num without a word and puts the result into the dictionary it was given. Gaps of a record
# become samples at zero, which a fit takes as measured, and an overflow becomes 1.8e308. The dictionary holds the changed samples afterwards.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet pyuff==2.5.8 numpy==2.4.6
cd "$place"
venv/bin/python - <<'PYTHON'
import os

import numpy as np
import pyuff


def set_58(data, binary):
    count = len(data)
    one = {
        "type": 58, "binary": binary, "func_type": 1, "ver_num": 1, "load_case_id": 0, "rsp_ent_name": "NONE", "rsp_node": 1, "rsp_dir": 3,
        "ref_ent_name": "NONE", "ref_node": 1, "ref_dir": 3, "ord_data_type": 4, "num_pts": count, "abscissa_spacing": 1,
        "abscissa_min": 0.0, "abscissa_inc": 0.002, "z_axis_value": 0.0, "id1": "a", "id2": "NONE", "id3": "NONE", "id4": "NONE",
        "id5": "NONE", "x": 0.002 * np.arange(count), "data": data,
    }
    for axis, kind in (("abscissa", 17), ("ordinate", 12), ("orddenom", 0), ("z_axis", 0)):
        one.update({f"{axis}_spec_data_type": kind, f"{axis}_axis_lab": "NONE", f"{axis}_axis_units_lab": "NONE"})
        one.update({f"{axis}_{which}_unit_exp": 0 for which in ("len", "force", "temp")})
    return one


data = np.sin(0.1 * np.arange(500)) + 3.0
data[100:103] = np.nan
data[200] = np.inf
for binary in (0, 1):
    one = set_58(data.copy(), binary)
    name = f"{binary}.uff"
    pyuff.UFF(name).write_sets(one, mode="add")
    read = pyuff.UFF(name).read_sets()["data"]
    print(f"pyuff {pyuff.__version__}, {'binary' if binary else 'text'}: gap {read[100:103]}, overflow {read[200]}, in the caller's set {one['data'][100]}")
    assert np.all(read[100:103] == 0.0) and one["data"][100] == 0.0 and read[200] > 1e307
PYTHON
