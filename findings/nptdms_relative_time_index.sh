#!/usr/bin/env bash
# npTDMS 1.11.0: a data frame with a relative time index joins channels that began at different times.
#
# Written down before the run: "as_dataframe(time_index=True) of two channels whose wf_start_time differ by 5 ms has their samples on different
# rows, 5 ms apart, as wf_start_offset has."
#
# Seen: the rows of both channels share the same index, 0.00, 0.01, ...; the 5 ms are lost without a word. A difference in wf_start_offset is
# kept, and so is that in wf_start_time with absolute_time=True. A force and an acceleration read in this way are 5 ms apart in phase: at 10 Hz a
# lag of 18 degrees, which an identification turns into damping.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet npTDMS==1.11.0 numpy==2.4.6 pandas==3.1.1
cd "$place"
venv/bin/python - <<'PYTHON'
import nptdms
import numpy as np
from nptdms import ChannelObject, TdmsFile, TdmsWriter

start = np.datetime64("2024-01-01T00:00:00", "us")
late = np.timedelta64(5000, "us")


def channel(name, first, time, offset=0.0):
    properties = {"wf_increment": 0.01, "wf_start_offset": offset, "wf_samples": 1, "wf_start_time": time}
    return ChannelObject("rig", name, first + np.arange(4.0), properties=properties)


def frame(second, **options):
    with TdmsWriter("record.tdms") as writer:
        writer.write_segment([channel("force", 0.0, start), second])
    return TdmsFile.read("record.tdms").as_dataframe(time_index=True, **options)


joined = frame(channel("acceleration", 10.0, start + late))
print(f"npTDMS {nptdms.__version__}, wf_start_time 5 ms apart, relative index:\n{joined}\n")
assert joined.index.tolist() == [0.0, 0.01, 0.02, 0.03] and not joined.isna().any().any()

apart = frame(channel("acceleration", 10.0, start + late), absolute_time=True)
print(f"the same, absolute index: {len(apart)} rows\n")
assert len(apart) == 8

offset = frame(channel("acceleration", 10.0, start, offset=0.005))
print(f"wf_start_offset 5 ms apart, relative index: {len(offset)} rows")
assert len(offset) == 8
PYTHON
