"""Files of loggers: each trap of a library that the design of `read_record` avoids, on a file written by that library or a stand-in."""

import sys
import types

import numpy as np
import pytest

import kmcfit as km

from conftest import oscillator

RATE = 512.0
TIME = np.arange(2048) / RATE


def force(time):
    return 20.0 * np.sin(2 * np.pi * (3.0 * time + time**2))


@pytest.fixture(scope="module")
def motion():
    """Force in N and acceleration in g of m = 2 kg, c = 6 N s/m, k = 5000 N/m, with a little noise."""
    _, acceleration = oscillator(2.0, 6.0, 5000.0, TIME, force)
    noise = 0.01 * np.random.default_rng(3).standard_normal(len(TIME))
    return force(TIME), (acceleration + noise) / 9.80665


def mass(experiment):
    fit = km.Model().fit(experiment)
    assert fit.verdict.level != "inadequate"
    return fit.estimates["mass"].value


def mdf_file(path, *groups):
    """A file with a group for each list of (name, unit, times, values)."""
    asammdf = pytest.importorskip("asammdf")
    with asammdf.MDF() as file:
        for group in groups:
            file.append([asammdf.Signal(samples=v, timestamps=t, name=n, unit=u) for n, u, t, v in group])
        file.save(path, overwrite=True)
    return path


def test_groups_with_rounded_clocks_are_one_record(tmp_path, motion):
    f, a = motion
    path = mdf_file(tmp_path / "groups.mf4", [("shaker", "N", TIME, f)], [("head", "g", TIME * (1.0 + 1e-15) + 1e-9, a)])
    experiment = km.read_record(path)
    assert len(experiment) == len(TIME) and experiment._spec["columns"]["force"] == "force"
    assert experiment._spec["units"]["acceleration"] == "g"
    assert mass(experiment) == pytest.approx(2.0, abs=0.005)


def test_groups_of_other_rates_keep_their_clocks(tmp_path, motion):
    _, a = motion
    clock = np.arange(1000) / 256.0 + 0.0012
    path = mdf_file(tmp_path / "rates.mf4", [("shaker", "N", clock, force(clock))], [("head", "g", TIME, a)])
    with pytest.warns(UserWarning, match="outside the times of the inputs"):
        experiment = km.read_record(path)
    assert experiment._columns["time force"].shape == (1000,)
    assert mass(experiment) == pytest.approx(2.0, abs=0.01)


def test_invalid_samples_are_missing_and_the_others_stay(tmp_path):
    asammdf = pytest.importorskip("asammdf")
    invalid = np.zeros(len(TIME), dtype=bool)
    invalid[100:110] = True
    values = np.sin(50 * TIME)
    signal = asammdf.Signal(samples=values, timestamps=TIME, name="a", unit="m/s²", invalidation_bits=asammdf.InvalidationArray(invalid, (0, 0)))
    with asammdf.MDF() as file:
        file.append([signal])
        file.save(tmp_path / "invalid.mf4")
    read = km.read_record(tmp_path / "invalid.mf4")._columns
    assert np.isnan(read["acceleration"][100:110]).all()
    np.testing.assert_array_equal(read["acceleration"][110:], values[110:])
    assert len(read["time"]) == len(TIME)


def test_one_name_in_several_groups_and_integers(tmp_path):
    steps = (np.arange(2048) % 7).astype(np.int16)
    late = TIME[:500] - 0.25
    path = mdf_file(tmp_path / "names.mf4", [("x", "mm", TIME, steps)], [("x", "mm", late, np.sin(9 * late))])
    with pytest.raises(km.InputError, match="several channels of displacement"):
        km.read_record(path)
    np.testing.assert_array_equal(km.read_record(path, displacement="x (group 0)")._columns["displacement"], steps)
    # Negative times are times.
    np.testing.assert_allclose(km.read_record(path, displacement="x (group 1)")._columns["time"], late - late[0])


def edf_file(path, rate, samples, unit, values, seconds=1.0):
    pyedflib = pytest.importorskip("pyedflib")
    with pyedflib.EdfWriter(str(path), 1, file_type=pyedflib.FILETYPE_EDFPLUS) as file:
        file.setDatarecordDuration(seconds)
        head = {"label": "head", "dimension": unit, "sample_frequency": rate, "physical_min": -1.0, "physical_max": 1.0}
        file.setSignalHeaders([{**head, "digital_min": -32768, "digital_max": 32767, "transducer": "", "prefilter": ""}])
        file.writeSamples([values])
    return path


def test_padding_of_the_last_data_record_is_left_out(tmp_path):
    values = 0.5 * np.sin(50 * np.arange(2248) / 512.0) + 0.1
    path = edf_file(tmp_path / "padded.edf", 512, 2248, "g", values)
    with pytest.warns(UserWarning, match="312 samples of `head` are zeros that fill the last data record"):
        experiment = km.read_record(path)
    assert len(experiment) == 2248
    np.testing.assert_allclose(experiment._columns["acceleration"], values, atol=1 / 32767)


def test_clipped_samples_are_named(tmp_path):
    path = edf_file(tmp_path / "clipped.edf", 512, 1024, "g", 1.2 * np.sin(50 * np.arange(1024) / 512.0))
    with pytest.warns(UserWarning, match="repeat a limit of the file"):
        km.read_record(path)


def test_slips_of_data_records_add_up(tmp_path):
    """80 data records of 0.9995 s whose headers state 100 Hz: the clock of the logger is 0.05 % fast."""
    obspy = pytest.importorskip("obspy")
    rate, step, count = 100.0, 0.9995 / 100.0, 100
    with open(tmp_path / "slips.mseed", "wb") as file:
        for i in range(80):
            samples = np.round(1e6 * np.sin(2 * np.pi * 5.0 * step * (np.arange(count) + count * i))).astype(np.int32)
            header = {"network": "XX", "station": "A", "channel": "HNZ", "sampling_rate": rate, "starttime": obspy.UTCDateTime(0) + step * count * i}
            obspy.Trace(samples, header).write(file, format="MSEED", reclen=4096)
    with pytest.warns(UserWarning, match="no unit is stated"):
        time = km.read_record(tmp_path / "slips.mseed", acceleration="XX.A..HNZ")._columns["time"]
    np.testing.assert_allclose(time, step * np.arange(8000), atol=1e-4)
    joined = obspy.read(tmp_path / "slips.mseed")
    assert len(joined) == 1 and joined[0].stats.sampling_rate == rate


def test_gaps_between_data_records_stay(tmp_path):
    obspy = pytest.importorskip("obspy")
    parts = [obspy.Trace(np.sin(np.arange(500.0)), {"sampling_rate": 100.0, "starttime": obspy.UTCDateTime(0) + at}) for at in (0, 20)]
    obspy.Stream(parts).write(str(tmp_path / "gap.mseed"), format="MSEED")
    time = km.read_record(tmp_path / "gap.mseed", displacement="...", units={"displacement": "mm"})._columns["time"]
    assert len(time) == 1000 and time[500] - time[499] > 14


def test_the_factor_of_a_sac_file_and_its_rate_are_applied(tmp_path):
    obspy = pytest.importorskip("obspy")
    step = 0.0040012
    trace = obspy.Trace(np.arange(50, dtype=np.float32), {"delta": step, "calib": 0.25, "network": "XX", "station": "A", "channel": "HNZ"})
    trace.write(str(tmp_path / "a.sac"), format="SAC")
    columns = km.read_record(tmp_path / "a.sac", acceleration="XX.A..HNZ", units={"acceleration": "cm/s²"})._columns
    np.testing.assert_allclose(columns["time"], step * np.arange(50), rtol=1e-6)
    np.testing.assert_array_equal(columns["acceleration"], 0.25 * np.arange(50))


def stand_in(monkeypatch, name, **content):
    """A module of this name: the library has no writer, and no file of its devices is free to copy."""
    module = types.ModuleType(name)
    vars(module).update(content)
    monkeypatch.setitem(sys.modules, name, module)
    if "." in name:
        monkeypatch.setitem(sys.modules, name.split(".")[0], types.ModuleType(name.split(".")[0]))


def test_times_of_an_ide_file_are_those_of_its_samples(tmp_path, monkeypatch, motion):
    _, a = motion
    # The stated rate is 1 % off, the first time is not 0.
    events = types.SimpleNamespace(arraySlice=lambda: np.array([1e6 * (TIME + 0.3), a]), getSampleRate=lambda: 1.01 * RATE)

    class Events:
        __len__ = lambda self: len(TIME)
        arraySlice = staticmethod(events.arraySlice)
        getSampleRate = staticmethod(events.getSampleRate)

    part = types.SimpleNamespace(getSession=Events, displayName="X (40g)", name="X", units=("Acceleration", "g"))
    channel = types.SimpleNamespace(name="40g DC Acceleration", subchannels=[part])
    stand_in(monkeypatch, "idelib", importFile=lambda path, quiet: types.SimpleNamespace(channels={80: channel}))
    (tmp_path / "a.ide").write_bytes(b"")
    columns = km.read_record(tmp_path / "a.ide")._columns
    np.testing.assert_allclose(columns["time"], TIME, atol=1e-12)
    np.testing.assert_array_equal(columns["acceleration"], a)


def test_times_of_a_cwa_file_are_those_of_its_samples(tmp_path, monkeypatch):
    time = 1.7e9 + np.arange(1000) / 98.5
    values = np.random.default_rng(1).standard_normal((1000, 3))
    reader = types.SimpleNamespace(predict=lambda file: {"accel": values, "time": time, "fs": 100.0})
    stand_in(monkeypatch, "skdh.io", ReadCwa=lambda ext_error: reader)
    (tmp_path / "a.cwa").write_bytes(b"")
    with pytest.raises(km.InputError, match="several channels of acceleration"):
        km.read_record(tmp_path / "a.cwa")
    columns = km.read_record(tmp_path / "a.cwa", acceleration="acceleration y")._columns
    np.testing.assert_allclose(np.diff(columns["time"]), 1 / 98.5, atol=1e-6)


def test_asynchronous_channels_of_dewesoft_keep_their_times(tmp_path, monkeypatch):
    slow = np.array([0.0, 0.31, 0.5, 1.2])
    channels = {
        "a": types.SimpleNamespace(name="a", unit="m/s2", array_size=1, scaled=lambda: (TIME, np.sin(TIME))),
        "x": types.SimpleNamespace(name="x", unit="mm", array_size=1, scaled=lambda: (slow, slow)),
        "bus": types.SimpleNamespace(name="bus", unit="", array_size=1, scaled=lambda: 1 / 0),
    }

    class File(dict):
        __enter__ = lambda self: self
        __exit__ = lambda self, *error: None

    stand_in(monkeypatch, "dwdatareader", open_file=lambda path: File(channels))
    (tmp_path / "a.dxd").write_bytes(b"")
    with pytest.warns(UserWarning, match="not read: `bus`"):
        columns = km.read_record(tmp_path / "a.dxd")._columns
    np.testing.assert_array_equal(columns["time"], slow)
    np.testing.assert_array_equal(columns["time acceleration"], TIME)


TDM = """<?xml version="1.0" encoding="UTF-8"?>
<usi:tdm xmlns:usi="http://www.ni.com/Schemas/USI/1_0" version="1.0">
<usi:include><file byteOrder="littleEndian" url="a.tdx">
<block byteOffset="0" id="inc0" length="2" valueType="eFloat64Usi"/>
<block byteOffset="16" id="inc1" length="{n}" valueType="eFloat64Usi"/>
</file></usi:include>
<usi:data>
<tdm_root id="usi1"><channelgroups>#xpointer(id("usi2"))</channelgroups></tdm_root>
<tdm_channelgroup id="usi2"><name>run</name><channels>#xpointer(id("usi3") id("usi4"))</channels></tdm_channelgroup>
<tdm_channel id="usi3"><name>clock</name><unit_string>s</unit_string><local_columns>#xpointer(id("usi5"))</local_columns></tdm_channel>
<tdm_channel id="usi4"><name>head</name><unit_string>"g"</unit_string><local_columns>#xpointer(id("usi6"))</local_columns></tdm_channel>
<localcolumn id="usi5"><global_flag>15</global_flag><sequence_representation>implicit_linear</sequence_representation>
<submatrix>#xpointer(id("usi7"))</submatrix><values>#xpointer(id("usi8"))</values></localcolumn>
<localcolumn id="usi6"><global_flag>15</global_flag><sequence_representation>explicit</sequence_representation>
<submatrix>#xpointer(id("usi7"))</submatrix><values>#xpointer(id("usi9"))</values></localcolumn>
<submatrix id="usi7"><number_of_rows>{n}</number_of_rows></submatrix>
<double_sequence id="usi8"><values external="inc0"/></double_sequence>
<double_sequence id="usi9"><values external="inc1"/></double_sequence>
</usi:data></usi:tdm>
"""


def test_quoted_units_and_implicit_times_of_a_tdm_file(tmp_path, motion):
    pytest.importorskip("tdm_loader")
    _, a = motion
    (tmp_path / "a.tdm").write_text(TDM.format(n=len(a)))
    (tmp_path / "a.tdx").write_bytes(np.array([0.5, 1 / RATE]).tobytes() + a.tobytes())
    experiment = km.read_record(tmp_path / "a.tdm")
    assert experiment.channels == ["acceleration"] and experiment._spec["units"]["acceleration"] == "g"
    np.testing.assert_allclose(experiment._columns["time"], TIME, atol=1e-12)


def test_refusals_name_the_cure(tmp_path, monkeypatch):
    with pytest.raises(km.InputError, match="not a format of a logger's library"):
        km.read_record(tmp_path / "a.csv")
    monkeypatch.setitem(sys.modules, "idelib", None)
    with pytest.raises(km.InputError, match="pip install idelib"):
        km.read_record(tmp_path / "a.ide")
    stand_in(monkeypatch, "idelib", importFile=lambda path, quiet: 1 / 0)
    with pytest.raises(km.InputError, match="no such file"):
        km.read_record(tmp_path / "a.ide")
    (tmp_path / "a.ide").write_bytes(b"")
    with pytest.raises(km.InputError, match="the file cannot be read"):
        km.read_record(tmp_path / "a.ide")
