#!/usr/bin/env bash
# lvm_read 1.26: of a file with a column of times for each channel (X_Columns Multi) the last channel is lost without a word.
#
# Written down before the run: "read() of two channels with X_Columns Multi has four columns: times and samples of each."
#
# Seen: N + 1 columns for N channels, as with one column of times: of two channels the second has its times and no samples. The last column of
# the array, which is that of the samples with X_Columns No and One, is then one of times.
set -euo pipefail
place=$(mktemp -d)
trap 'rm -rf "$place"' EXIT
python3 -m venv "$place/venv"
"$place/venv/bin/pip" install --quiet lvm_read==1.26 numpy==2.4.6
cd "$place"
venv/bin/python - <<'PYTHON'
import lvm_read

HEAD = (
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\t{}\n***End_of_Header***\t\n\t\n"
    "Channels\t2\nSamples\t3\t3\nY_Unit_Label\tN\tg\nX0\t0\t0\nDelta_X\t0.5\t0.5\n***End_of_Header***\t\t\n"
)


def read(columns, rows):
    with open("record.lvm", "w") as file:
        file.write(HEAD.format(columns) + rows)
    return lvm_read.read("record.lvm", read_from_pickle=False, dump_file=False)[0]["data"]


one = read("One", "X_Value\tforce\tacc\tComment\n0.0\t1\t10\n0.5\t2\t20\n1.0\t3\t30\n")
print(f"one column of times:\n{one}\n")
assert one[:, -1].tolist() == [10, 20, 30]

multi = read("Multi", "X_Value\tforce\tX_Value\tacc\tComment\n0.0\t1\t0.0\t10\n0.5\t2\t0.5\t20\n1.0\t3\t1.0\t30\n")
print(f"one for each channel:\n{multi}")
assert multi.shape == (3, 3) and multi[:, -1].tolist() == [0.0, 0.5, 1.0]
PYTHON
