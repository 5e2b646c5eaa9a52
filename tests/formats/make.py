#!/usr/bin/env python3
"""Writes the files of this folder: one record in each format, and files that are refused. Files with a shorter record are
written into tests/fuzz/corpus/channels.

Needs numpy, scipy, pyuff, soundfile, npTDMS, pandas and h5py. Versions of the last run: numpy 2.4.6, scipy 1.17.1,
pyuff 2.5.8, soundfile 0.14.0, npTDMS 1.13.0, pandas 3.1.1, h5py 3.16.0.

The record is held exactly by every format: 64 samples per second, and values k/1024 with integers k of 16 bits, which
have at most 12 significant digits. It is the displacement of an oscillator with m = 2 kg, c = 1.6 N s/m and k = 90 N/m under a
force of two sines.
"""
import pathlib
import zipfile

import h5py
import numpy
import pandas
import pyuff
import scipy.integrate
import scipy.io
import soundfile
from nptdms import ChannelObject, GroupObject, RootObject, TdmsWriter

HERE = pathlib.Path(__file__).resolve().parent
FOLDERS = {HERE: 193, HERE.parent / "fuzz" / "corpus" / "channels": 6}
RATE, SCALE = 64, 1024


def force_at(t):
    return 12.0 * numpy.sin(5.0 * t) + 6.0 * numpy.sin(9.0 * t + 1.0)


def make(folder, count):
    """Sets the folder and the record."""
    global FOLDER, COUNT, t, counts, displacement, force
    FOLDER, COUNT = folder, count
    t = numpy.arange(COUNT) / RATE
    motion = scipy.integrate.solve_ivp(
        lambda t, s: [s[1], (force_at(t) - 1.6 * s[1] - 90.0 * s[0]) / 2.0],
        [0.0, t[-1]], [0.0, 0.0], t_eval=t, rtol=1e-10, atol=1e-12,
    )
    counts = {
        "displacement": numpy.round(SCALE * motion.y[0]).astype(numpy.int16),
        "force": numpy.round(SCALE * force_at(t)).astype(numpy.int16),
    }
    displacement, force = (counts[name] / SCALE for name in counts)


def text():
    rows = [f"{float(a)!r},{float(b)!r},{float(c)!r}" for a, b, c in zip(t, displacement, force)]
    (FOLDER / "record.csv").write_text("time,displacement,force\n" + "\n".join(rows) + "\n")


def of_numpy():
    frame = pandas.DataFrame({"time": t, "displacement": displacement, "force": force})
    numpy.save(FOLDER / "record.npy", frame.to_records(index=False))
    arrays = {"time": t, "displacement": displacement, "force": force}
    numpy.savez_compressed(FOLDER / "record.npz", **arrays, rate=64.0, note="free text")
    numpy.savez(FOLDER / "stored.npz", record=numpy.stack([t, displacement, force]).astype(">f8"))
    objects = numpy.array([{"a": 1}, None], dtype=object)
    numpy.save(FOLDER / "objects.npy", objects, allow_pickle=True)


def of_spreadsheets():
    with zipfile.ZipFile(FOLDER / "book.xlsx", "w") as file:
        file.writestr("xl/workbook.xml", "<workbook/>")


def of_matlab():
    test = {"time": t, "displacement": displacement, "force": force, "operator": "N. N."}
    # Version 5 and, with compression, version 7; a struct within a cell within a struct.
    scipy.io.savemat(FOLDER / "v5.mat", {"test": test, "fs": 64.0}, oned_as="column")
    cell = numpy.empty(2, dtype=object)
    cell[0], cell[1] = "first run", test
    parts = {"bench": {"runs": cell, "spectrum": numpy.array([1 + 2j, 3 - 1j])}}
    scipy.io.savemat(FOLDER / "v7.mat", parts, do_compression=True, oned_as="row")
    of_matlab_73()


def of_matlab_73():
    """As MATLAB writes version 7.3: HDF5 after a block with the text of the header, arrays with their dimensions reversed, in chunks
    with deflate where they are long, cells as references to `#refs#`."""
    path = FOLDER / "v73.mat"
    with h5py.File(path, "w", userblock_size=512, libver="earliest") as file:
        def array(name, values, matlab, **options):
            data = file.create_dataset(name, data=numpy.asarray(values), **options)
            data.attrs["MATLAB_class"] = numpy.bytes_(matlab)
            return data

        def text(name, content):
            array(name, [[ord(c)] for c in content], "char", dtype="u2").attrs["MATLAB_int_decode"] = numpy.int32(2)

        file.create_group("bench").attrs["MATLAB_class"] = numpy.bytes_("struct")
        file.create_group("#refs#/test").attrs["MATLAB_class"] = numpy.bytes_("struct")
        long = {"chunks": (1, 50 if COUNT > 50 else 3), "compression": 3}
        array("#refs#/test/time", t[None, :], "double", **long)
        array("#refs#/test/displacement", displacement[None, :], "double", shuffle=True, **long)
        array("#refs#/test/force", force[None, :].astype("f4"), "single", chunks=(1, COUNT // 2), fletcher32=True)
        text("#refs#/test/operator", "N. N.")
        text("#refs#/a", "first run")
        references = [[file["#refs#/a"].ref], [file["#refs#/test"].ref]]
        array("bench/runs", references, "cell", dtype=h5py.ref_dtype)
        spectrum = numpy.array([[(1.0, 2.0), (3.0, -1.0)]], dtype=[("real", "f8"), ("imag", "f8")])
        array("bench/spectrum", spectrum, "double")
        array("fs", [[64.0]], "double")
        array("empty", numpy.array([0, 0], dtype="u8"), "double").attrs["MATLAB_empty"] = numpy.uint8(1)
        array("log", [[0xDD000000, 2, 1, 1, 1, 1]], "table", dtype="u4").attrs["MATLAB_object_decode"] = numpy.int32(3)
    header = b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Thu Nov 26 12:00:00 2026 HDF5 schema 1.00 ."
    content = bytearray(path.read_bytes())
    content[:128] = header.ljust(116) + bytes(8) + b"\x00\x02IM"
    path.write_bytes(content)


def of_hdf5():
    # Superblock 0 with symbol tables, numbers of the other byte order and in two dimensions; superblock 2 with links in the headers.
    with h5py.File(FOLDER / "record.h5", "w", libver="earliest") as file:
        test = file.create_group("test")
        test.create_dataset("time", data=t.astype(">f8"))
        table = numpy.stack([displacement, force], axis=1).astype("f4")
        test.create_dataset("record", data=table, chunks=(COUNT // 3, 2), shuffle=True, compression="gzip")
        test["record"].attrs["units"] = numpy.bytes_("m")
        test.create_dataset("note", data="free text")
        test.create_dataset("lzf", data=displacement, chunks=(COUNT,), compression="lzf")
        test.create_dataset("never", shape=(COUNT,), dtype="f8")
        test.create_dataset("cube", data=numpy.zeros((2, 2, 2)))
        test["again"] = h5py.SoftLink("/test/time")
    with h5py.File(FOLDER / "circle.h5", "w", libver="earliest") as file:
        file["a/b"] = file.require_group("a")
    with h5py.File(FOLDER / "latest.h5", "w", libver="latest") as file:
        file["test/time"], file["test/displacement"] = t, displacement
        file["test/force"] = counts["force"].astype(">i2")
        file["test/force"].attrs["unit"] = numpy.bytes_("N")
        file.create_dataset("test/chunks", data=force, chunks=(COUNT // 3,))
        for i in range(10):
            file[f"dense/{i}"] = i


def of_sound():
    # Full scale: 32768/1024 = 32.
    both = numpy.stack(list(counts.values()), axis=1)
    soundfile.write(FOLDER / "record.wav", both, RATE, subtype="PCM_16")


def of_labview():
    def channel(name, values, **properties):
        waveform = {"wf_increment": 1 / RATE, "wf_start_offset": 0.0}
        return ChannelObject("Test 1", name, values, properties={**waveform, **properties})

    with TdmsWriter(FOLDER / "record.tdms") as file:
        half = COUNT // 2
        scale = {
            "NI_Number_Of_Scales": 1, "NI_Scaling_Status": "unscaled", "NI_Scale[0]_Scale_Type": "Linear",
            "NI_Scale[0]_Linear_Slope": 1 / SCALE, "NI_Scale[0]_Linear_Y_Intercept": 0.0,
        }
        root = RootObject(properties={"author": "N. N."})
        for part in (slice(0, half), slice(half, COUNT)):
            file.write_segment([
                root,
                GroupObject("Test 1"),
                channel("displacement", displacement[part], unit_string="m"),
                channel("force", counts["force"][part], unit_string="N", **scale),
                ChannelObject("Notes", "remarks", ["released", "by hand"]),
            ])


def of_universal():
    def function(values, kind, node, unit, **other):
        return {
            "type": 58, "func_type": 1, "ver_num": 0, "load_case_id": 0, "rsp_ent_name": "beam", "rsp_node": node,
            "rsp_dir": 3, "ref_ent_name": "beam", "ref_node": node, "ref_dir": 3, "ord_data_type": 4,
            "num_pts": len(values), "abscissa_spacing": 1, "abscissa_min": 0.0, "abscissa_inc": 1 / RATE,
            "z_axis_value": 0.0, "abscissa_spec_data_type": 17, "abscissa_axis_lab": "Time",
            "abscissa_axis_units_lab": "s", "ordinate_spec_data_type": kind, "ordinate_axis_units_lab": unit,
            "orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0, "id1": "a record", "data": values,
            "x": t[: len(values)], **other,
        }

    units = {
        "type": 164, "units_code": 1, "units_description": "SI units", "temp_mode": 1, "length": 1.0, "force": 1.0,
        "temp": 1.0, "temp_offset": 273.15,
    }
    response = {"func_type": 4, "ord_data_type": 5, "abscissa_spec_data_type": 18, "binary": 0}
    spectrum = (numpy.fft.rfft(displacement) / numpy.fft.rfft(force))[:8]
    frf = function(spectrum.astype(numpy.complex64), 8, 12, "m", **response)
    for name, binary in [("record.uff", 0), ("binary.uff", 1)]:
        path = FOLDER / name
        path.unlink(missing_ok=True)
        sets = [
            units,
            function(displacement, 8, 12, "m", binary=binary),
            function(force, 13, 7, "NONE", binary=binary),
        ]
        pyuff.UFF(str(path)).write_sets(sets + ([frf] if binary == 0 else []), mode="overwrite")
    path = FOLDER / "frf.unv"
    path.unlink(missing_ok=True)
    pyuff.UFF(str(path)).write_sets([units, frf], mode="overwrite")


if __name__ == "__main__":
    for folder, count in FOLDERS.items():
        folder.mkdir(exist_ok=True)
        make(folder, count)
        for part in (*([text] if folder == HERE else []), of_numpy, of_spreadsheets, of_matlab, of_hdf5, of_sound, of_labview, of_universal):
            part()
