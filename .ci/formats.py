#!/usr/bin/env python3
"""Writes 60 files of 12 kinds by their own libraries and compares what kmcfit reads with what the library reads back: the samples of the
response in SI, their times, and the mass that follows from the units of force and response.

Usage: .ci/formats.py KMCFIT     (in an environment with numpy, scipy, pandas, h5py, netCDF4, nptdms, pyuff, soundfile and lvm_read)
"""
import json
import pathlib
import subprocess
import sys
import tempfile

import h5py
import lvm_read
import netCDF4
import numpy as np
import pandas
import pyuff
import scipy.io
import scipy.signal
import soundfile
from nptdms import ChannelObject, GroupObject, RootObject, TdmsFile, TdmsWriter

MASS, DAMPING, STIFFNESS, RATE = 1.5, 3.0, 6000.0, 500
FORCES = {"N": 1.0, "kN": 1e3, "lbf": 4.4482216152605, "kgf": 9.80665, "mN": 1e-3}
ACCELERATIONS = {"m/s^2": 1.0, "g": 9.80665, "cm/s^2": 1e-2, "mm/s^2": 1e-3, "ft/s^2": 0.3048}


def record(seed):
    """Times, force (N) and acceleration (m/s^2)."""
    random = np.random.default_rng(seed)
    time = np.arange(1200) / RATE
    force = scipy.signal.lfilter([0.2], [1, -0.8], random.standard_normal(len(time))) * 50
    force[0] = 0
    system = ([1, 0, 0], [MASS, DAMPING, STIFFNESS])
    _, acceleration, _ = scipy.signal.lsim(system, force, time)
    return time, force, acceleration + 0.01 * acceleration.std() * random.standard_normal(len(time))


def tdms(path, i, units, time, force, acceleration):
    step = {"wf_increment": 1 / RATE, "wf_start_offset": 0.0, "wf_samples": len(time)}
    scale = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 0.01, "NI_Scale[0]_Linear_Y_Intercept": 0.5}
    scaled = i in (1, 2, 3)
    own, group, root = [dict(scale) if scaled and i == at else {} for at in (1, 2, 3)]
    write = (lambda x: (x - 0.5) / 0.01) if scaled else (lambda x: x)
    late = np.datetime64("2024-01-10T10:00:00.000000") + np.timedelta64(4000 if i == 4 else 0, "us")
    first = {"wf_start_time": np.datetime64("2024-01-10T10:00:00.000000")} if i == 4 else {}
    second = {"wf_start_time": late} if i == 4 else {}
    skip = 2 if i == 4 else 0
    with TdmsWriter(path) as file:
        file.write_segment([
            RootObject(root), GroupObject("run", group),
            ChannelObject("run", "force", write(force), {"unit_string": units[0], **step, **own, **first}),
            ChannelObject("run", "acceleration", write(acceleration)[skip:], {"unit_string": units[1], **step, **own, **second}),
        ])
    read = TdmsFile.read(path)["run"]["acceleration"]
    return read[:], time[skip:]


def uff(path, i, units, time, force, acceleration, binary):
    file = pyuff.UFF(path)
    for data, axis_type, unit in [(force, 13, units[0]), (acceleration, 12, units[1])]:
        axes = {f"{axis}_{kind}_unit_exp": 0 for axis in ("abscissa", "ordinate", "orddenom", "z_axis") for kind in ("len", "force", "temp")}
        units_of = {f"{axis}_axis_units_lab": "NONE" for axis in ("orddenom", "z_axis")}
        types = {"abscissa_spec_data_type": 17, "ordinate_spec_data_type": axis_type, "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0}
        sets = {
            "type": 58, "binary": binary, "func_type": 1, "rsp_node": 1, "rsp_dir": 3, "ref_node": 1, "ref_dir": 3, "data": data, "x": time,
            **{f"id{n}": "run" for n in range(1, 6)}, "num_pts": len(time), "ord_data_type": 4, "abscissa_spacing": 1, "abscissa_min": 0.0,
            "abscissa_inc": 1 / RATE, "abscissa_axis_units_lab": "s", "ordinate_axis_units_lab": unit, "ver_num": 0, "load_case_id": 0,
            "rsp_ent_name": "NONE", "ref_ent_name": "NONE", "z_axis_value": 0.0, **axes, **units_of, **types,
        }
        file.write_sets(sets, "add")
    read = pyuff.UFF(path).read_sets()
    return np.real(read[-1]["data"]), read[-1]["x"]


def mat(path, i, units, time, force, acceleration):
    names = [f"force_{units[0]}", f"acceleration_{units[1].replace('/', '_per_').replace('^', '')}"]
    content = dict(zip(names, [force, acceleration]))
    times = {"t": time} if i % 2 == 0 else {"fs": float(RATE)} if i == 1 else {"dt": 1 / RATE}
    content = {"run": {**content, **times}} if i > 2 else {**content, **times}
    scipy.io.savemat(path, content, do_compression=i % 2 == 1)
    read = scipy.io.loadmat(path, simplify_cells=True)
    return (read["run"] if i > 2 else read)[names[1]], time


def mat73(path, i, units, time, force, acceleration):
    with h5py.File(path, "w", userblock_size=512) as file:
        group = file.create_group("run") if i > 2 else file
        if i > 2:
            group.attrs["MATLAB_class"] = np.bytes_("struct")
        names = [f"force_{units[0]}", f"acceleration_{units[1].replace('/', '_per_').replace('^', '')}"]
        columns = [*zip(names, [force, acceleration]), ("t", time) if i % 2 == 0 else ("ActualRate", np.array([float(RATE)]))]
        for name, values in columns:
            group.create_dataset(name, data=values[:, None].T).attrs["MATLAB_class"] = np.bytes_("double")
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM")
    with h5py.File(path) as file:
        return (file["run"] if i > 2 else file)[names[1]][0], time


def hdf5(path, i, units, time, force, acceleration):
    with h5py.File(path, "w") as file:
        file.attrs.update({"sample_rate": float(RATE)} if i != 4 else {})
        for name, values, unit in [("force", force, units[0]), ("acceleration", acceleration, units[1])]:
            packed = i in (1, 2)
            kind = [np.float64, np.int32, np.int16, np.float32, np.float64][i]
            factor = np.abs(values).max() / 30000 if packed else 1.0
            data = np.round(values / factor).astype(kind) if packed else values.astype(kind)
            set = file.create_dataset(name, data=data, compression="gzip" if i == 3 else None)
            set.attrs["Units" if i == 3 else "units"] = unit
            if packed:
                set.attrs["scale_factor"] = factor
                set.attrs["add_offset"] = 0.0
            for extra in range(9 if i == 4 else 0):
                set.attrs[f"note {extra}"] = "of h5py"
        if i == 4:
            file.create_dataset("time", data=time * 1e3).attrs["units"] = "ms"
    with h5py.File(path) as file:
        set = file["acceleration"]
        return set[:] * set.attrs.get("scale_factor", 1.0), time


def netcdf(path, i, units, time, force, acceleration):
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("time", len(time))
        axis = file.createVariable("time", "f8", ("time",))
        axis.units = "seconds since 2024-01-10 00:00:00" if i == 1 else "s"
        axis[:] = time
        for name, values, unit in [("force", force, units[0]), ("acceleration", acceleration, units[1])]:
            variable = file.createVariable(name, "i2" if i in (2, 3) else "f8", ("time",), zlib=i == 4, fill_value=-32768 if i == 3 else None)
            variable.units = unit
            if i in (2, 3):
                variable.scale_factor = np.abs(values).max() / 30000
                variable.add_offset = 0.0
            variable[:] = values
    with netCDF4.Dataset(path) as file:
        return np.asarray(file["acceleration"][:]), time


def npy(path, i, units, time, force, acceleration):
    names = ["time [s]", f"force [{units[0]}]", f"acceleration [{units[1]}]"]
    kinds = [["<f8", "<f4", ">f8", "<f8", "<f8"][i]] * 3
    if i == 3:
        kinds[0] = "<M8[us]"
        names[0] = "time"
    data = np.zeros(len(time), np.dtype(list(zip(names, kinds)), align=i == 4))
    data[names[0]] = np.datetime64("2024-01-10T10:00:00") + (time * 1e6).astype("m8[us]") if i == 3 else time
    data[names[1]], data[names[2]] = force, acceleration
    np.save(path, data)
    return np.load(path)[names[2]].astype(float), time


def npz(path, i, units, time, force, acceleration):
    names = [f"force ({units[0]})", f"acceleration ({units[1]})"]
    times = [{"time (s)": time}, {"fs": RATE}, {"dt": 1 / RATE}, {"time_ms": time * 1e3}, {"t [us]": time * 1e6}][i]
    (np.savez if i % 2 else np.savez_compressed)(path, **{names[0]: force, names[1]: acceleration}, **times)
    return np.load(path)[names[1]], time


def wav(path, i, units, time, force, acceleration):
    full = [float(np.abs(x).max() * 1.01) for x in (force, acceleration)]
    kind = ["PCM_16", "PCM_24", "PCM_32", "FLOAT", "DOUBLE"][i]
    soundfile.write(path, np.column_stack([force / full[0], acceleration / full[1]]), RATE, subtype=kind, format=["WAV", "WAV", "RF64", "WAV", "WAV"][i])
    read, _ = soundfile.read(path, always_2d=True)
    return read[:, 1] * full[1], time, ["--units", f"1={full[0]!r} {units[0]},2={full[1]!r} {units[1]}"]


def csv(path, i, units, time, force, acceleration):
    forms = ["{} [{}]", "{} ({}) Run #1", "{} / {}", "{}, {}", "{} in {}"]
    names = [forms[i].format(*pair) for pair in [("Time", "s"), ("Force", units[0]), ("Acceleration", units[1])]]
    table = pandas.DataFrame(dict(zip(names, [time, force, acceleration])))
    if i == 3:
        table[names[0]] = pandas.Timestamp("2024-01-10 23:59:59") + pandas.to_timedelta(time, unit="s")
    options = {"sep": ";", "decimal": ","} if i in (1, 2) else {}
    table.to_csv(path, index=False, **options)
    return pandas.read_csv(path, **options)[names[2]].to_numpy(), time


def lvm(path, i, units, time, force, acceleration):
    columns = ["No", "One", "Multi", "One", "No"][i]
    sign = "," if i == 3 else "."
    lines = ["LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab", f"Decimal_Separator\t{sign}", "Multi_Headings\tNo", f"X_Columns\t{columns}"]
    lines += ["Time_Pref\tRelative", "***End_of_Header***\t", "\t", "Channels\t2", f"Samples\t{len(time)}\t{len(time)}", f"Y_Unit_Label\t{units[0]}\t{units[1]}"]
    lines += ["X_Dimension\tTime\tTime", "X0\t0\t0", f"Delta_X\t{1 / RATE}\t{1 / RATE}".replace(".", sign), "***End_of_Header***\t\t"]
    second = "\tX_Value" if columns == "Multi" else ""
    lines += [f"X_Value\tforce{second}\tacceleration\tComment"]
    for t, f, a in zip(time, force, acceleration):
        x = "" if columns == "No" else f"{t:.6f}"
        middle = f"\t{x}" if columns == "Multi" else ""
        lines += [f"{x}\t{f:.9e}{middle}\t{a:.9e}".replace(".", sign)]
    pathlib.Path(path).write_text("\n".join(lines) + "\n")
    if i in (2, 3):
        # lvm_read loses the last channel of several columns of times, and refuses decimal commas.
        return acceleration, time
    data = lvm_read.read(path, read_from_pickle=False, dump_file=False)[0]["data"]
    return data[:, -1], time


KINDS = {
    "58.uff": lambda *a: uff(*a, binary=0), "58b.uff": lambda *a: uff(*a, binary=1), "tdms": tdms, "5.mat": mat, "73.mat": mat73, "h5": hdf5, "nc": netcdf,
    "npy": npy, "npz": npz, "wav": wav, "csv": csv, "lvm": lvm,
}


def compare(program, folder, kind, i):
    """The differences, in words."""
    path = folder / f"record_{i}.{kind}"
    units = list(FORCES)[i], list(ACCELERATIONS)[i]
    time, force, acceleration = record(i)
    factor = ACCELERATIONS[units[1]]
    values, times, *options = KINDS[kind](str(path), i, units, time, force / FORCES[units[0]], acceleration / factor)
    model, run = path.with_name(path.name + ".yaml"), path.with_name(path.name + ".run")
    for command in [["init", path, "--out", model, *(options[0] if options else [])], ["fit", model, "--out", run, "--no-report"]]:
        done = subprocess.run([program, *command], capture_output=True, text=True)
        if done.returncode:
            return [done.stdout + done.stderr]
    document = json.loads((run / "result.json").read_text())
    mass = document["estimates"]["mass"]["value"]
    found = [] if abs(mass / MASS - 1) < 0.01 else [f"mass {mass} for {MASS} (units {units})"]
    table = pandas.read_csv(next((run / "channels").glob("*.csv")))
    own = table.iloc[:, 1].to_numpy()
    shown = document["experiments"][0]["channels"][0]["unit"]
    expected = np.asarray(values, float)
    if len(own) != len(expected):
        return [*found, f"{len(own)} samples for {len(expected)} ({shown})"]
    scale = np.dot(own, expected) / np.dot(expected, expected)
    if np.abs(own - scale * expected).max() > 1e-6 * np.abs(own).max():
        found.append(f"other samples: {own[:3]} for {expected[:3]}")
    if not min(abs(scale / x - 1) for x in (1.0, factor)) < 1e-6:
        found.append(f"a factor of {scale} ({shown})")
    if np.abs(np.diff(table.iloc[:, 0]) * RATE - 1).max() > 1e-3:
        found.append("other times")
    return found


def main():
    program, bad, count = str(pathlib.Path(sys.argv[1]).resolve()), 0, 0
    with tempfile.TemporaryDirectory() as folder:
        for kind in KINDS:
            for i in range(5):
                found = compare(program, pathlib.Path(folder), kind, i)
                count += 1
                bad += bool(found)
                for text in found:
                    print(f"{i}_{kind}: {text}")
    print(f"{count - bad} of {count} files right")
    sys.exit(bool(bad))


main()
