#!/usr/bin/env bash
# pyuff 2.5.8: neither of the two dictionaries that prepare_58 makes of the same arguments can be written.
#
# Written down before the run: "prepare_58 with the mandatory arguments gives a set that write_sets takes; return_full_dict=True adds the
# optional fields with their defaults."
#
# Seen: the short dictionary ends in KeyError 'orddenom_spec_data_type' and the full one, in which every optional field is None, in TypeError
# (%i of None), both reported as an Exception of write_sets. The file then exists and holds the head of an unfinished set: a second try with
# mode="add" writes behind it, and readers meet a set 58 within a set 58.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet pyuff==2.5.8 numpy==2.4.6
cd "$place"
venv/bin/python - <<'PYTHON'
import numpy as np
import pyuff

times = np.arange(8) / 4.0
for full in (False, True):
    one = pyuff.prepare_58(
        binary=0, func_type=1, rsp_node=1, rsp_dir=1, ref_node=1, ref_dir=1, data=np.sin(times), x=times, id1="a",
        abscissa_spec_data_type=17, ordinate_spec_data_type=12, return_full_dict=full,
    )
    name = f"{full}.uff"
    try:
        pyuff.UFF(name).write_sets(one, mode="add")
        refused = None
    except Exception as error:
        refused = error
    left = open(name).read().count("\n")
    print(f"pyuff {pyuff.__version__}, return_full_dict={full}: {refused}; {left} lines are left in the file")
    assert refused is not None and left > 5
PYTHON
