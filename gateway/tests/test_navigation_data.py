import numpy as np
import pytest

from detectors.navigation import DepthSample, DvlSample, ImuSample, NavigationState
from gateway.navigation_data import NavigationData, NavigationDataError, read_navigation_data

IMU = np.array([[0.0, 0.1, 0.2, -9.8, 0.01, 0.02, 0.03], [0.5, 0.1, 0.2, -9.8, 0.01, 0.02, 0.03]])
DVL = np.array([[0.5, 1.0, 0.1, -0.1], [1.5, 1.1, 0.1, -0.1]])
DEPTH = np.array([[0.25, 12.0], [0.5, 12.5]])
REFERENCE = np.array([[0.0, 0.6, 0.5, -11.5, 1.0, 2.0, 0.1, 0.01, 0.02, 1.5], [1.0, *[0.0] * 9]])


def save(folder, **arrays):
    path = folder / "dive.npz"
    np.savez_compressed(path, **arrays)
    return path


def test_a_recording_comes_back_in_double_precision(tmp_path):
    path = save(tmp_path, imu=IMU.astype(np.float32), dvl=DVL, depth=DEPTH, reference=REFERENCE)
    dive = read_navigation_data(path)
    assert dive.name == "dive"
    assert dive.imu.dtype == np.float64
    np.testing.assert_array_equal(dive.imu, IMU.astype(np.float32))
    for name, rows in (("dvl", DVL), ("depth", DEPTH), ("reference", REFERENCE)):
        np.testing.assert_array_equal(getattr(dive, name), rows)


def test_samples_are_in_the_order_of_time_and_the_imu_is_first_among_equals():
    dive = NavigationData("dive", IMU, DVL, DEPTH)
    assert list(dive.samples()) == [
        ImuSample(0.0, (0.1, 0.2, -9.8), (0.01, 0.02, 0.03)),
        DepthSample(0.25, 12.0),
        ImuSample(0.5, (0.1, 0.2, -9.8), (0.01, 0.02, 0.03)),
        DvlSample(0.5, (1.0, 0.1, -0.1)),
        DepthSample(0.5, 12.5),
        DvlSample(1.5, (1.1, 0.1, -0.1)),
    ]


def test_begins_where_the_reference_begins():
    dive = NavigationData("dive", IMU, DVL, DEPTH, REFERENCE)
    assert dive.initial == NavigationState(0.0, 0.6, 0.5, 11.5, (1.0, 2.0, 0.1), (0.01, 0.02, 1.5))
    with pytest.raises(ValueError, match=r"night dive: no reference, .* want it in the recording"):
        _ = NavigationData("night dive", IMU, DVL, DEPTH).initial


def test_depth_is_the_references_where_no_other_was_recorded(tmp_path):
    dive = read_navigation_data(save(tmp_path, imu=IMU, dvl=DVL, reference=REFERENCE))
    np.testing.assert_array_equal(dive.depth, [[0.0, 11.5], [1.0, 0.0]])


def changed(rows, row, column, value):
    rows = rows.copy()
    rows[row, column] = value
    return rows


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"imu": None}, r"imu: missing: want an array \(N, 7\)"),
        ({"dvl": None}, r"dvl: missing: want an array \(N, 4\)"),
        ({"depth": None, "reference": None}, r"depth: missing: want an array \(N, 2\)"),
        ({"imu": IMU[:, :6]}, r"imu: shape \(2, 6\): want \(N, 7\)"),
        ({"dvl": DVL[0]}, r"dvl: shape \(4,\): want \(N, 4\)"),
        ({"depth": DEPTH[:0]}, r"depth: shape \(0, 2\): want \(N, 2\), one row or more"),
        ({"depth": None, "reference": REFERENCE[:, :3]}, r"reference: shape \(2, 3\): want \(N, 10\)"),
        ({"dvl": changed(DVL, 1, 2, np.nan)}, r"dvl: row 1 = \[1.5, 1.1, nan, -0.1\]: want finite numbers"),
        ({"imu": changed(IMU, 1, 0, 0.0)}, r"imu: row 1: time 0.0 after 0.0: want times that rise"),
        ({"reference": changed(REFERENCE, 1, 0, -1.0)}, r"reference: row 1: time -1.0 after 0.0: want times"),
        ({"imu": np.array([["a"]])}, "imu is of type .*; want a NumPy archive"),
    ],
)
def test_what_is_wrong_is_named_with_file_array_and_row(tmp_path, arrays, message):
    arrays = {"imu": IMU, "dvl": DVL, "depth": DEPTH, "reference": REFERENCE} | arrays
    path = save(tmp_path, **{name: rows for name, rows in arrays.items() if rows is not None})
    with pytest.raises(NavigationDataError, match=f"dive.npz: {message}"):
        read_navigation_data(path)


@pytest.mark.parametrize("content", [b"", b"time,x,y\n", b"PK\x03\x04 cut off", b"\x93NUMPY"])
def test_a_file_of_another_kind_is_said_to_be_one(tmp_path, content):
    path = tmp_path / "dive.npz"
    path.write_bytes(content)
    with pytest.raises(NavigationDataError, match=r"dive\.npz: .*want a NumPy archive"):
        read_navigation_data(path)


def test_a_single_array_and_a_missing_file_are_no_recordings(tmp_path):
    np.save(tmp_path / "dive.npy", IMU)
    with pytest.raises(NavigationDataError, match="want a NumPy archive"):
        read_navigation_data(tmp_path / "dive.npy")
    with pytest.raises(NavigationDataError, match=r"gone\.npz.*No such file"):
        read_navigation_data(tmp_path / "gone.npz")
