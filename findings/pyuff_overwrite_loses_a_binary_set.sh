#!/usr/bin/env bash
# pyuff 2.5.8: write_sets(mode="overwrite") of a binary set 58 leaves a file of seven bytes, without an error.
#
# Written down before the run: "a binary set written with mode='overwrite' is read back as it was, as one written with mode='add' is."
#
# Seen: the file holds an end mark ("    -1" and a newline) alone, get_set_types() is empty, nothing is raised. The writer opens the file three
# times, for the head, the samples and the end mark, each time as the mode says, so the last opening empties it. A set of text is kept, and so
# is a binary one with mode="add". The record that was in the file before is gone in any case.
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


data = np.sin(0.1 * np.arange(500))
for mode, binary in (("add", 1), ("overwrite", 0), ("overwrite", 1)):
    name = f"{mode}-{binary}.uff"
    pyuff.UFF(name).write_sets(set_58(data, binary), mode=mode)
    types, size = list(pyuff.UFF(name).get_set_types()), os.path.getsize(name)
    print(f"pyuff {pyuff.__version__}, mode={mode!r}, {'binary' if binary else 'text'}: {size} bytes, sets {types}")
    assert (size == 7 and types == []) == (mode == "overwrite" and binary == 1)
PYTHON
