import io
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest

from racecar.maps.errors import UserError
from racecar.pipelines.files.session_file import SESSION_FILE, VERSION, load_arrays, load_session, save_arrays
from racecar.sensors.arrays import Arrays

ARRAYS: Arrays = {
    "poses": np.arange(6, dtype=np.float64).reshape(2, 3),
    "scans.counts": np.array([3, 4], dtype=np.int16),
    "names": np.array(["a", "bc"]),
    "none": np.zeros((0, 2), dtype=np.float32),
}


def test_arrays_read_back_as_they_were(tmp_path: Path) -> None:
    save_arrays(ARRAYS, tmp_path / "a.npz")
    read = load_arrays(tmp_path / "a.npz")
    assert read.keys() == ARRAYS.keys()
    for name, array in ARRAYS.items():
        assert read[name].dtype == array.dtype
        assert np.array_equal(read[name], array)


def test_same_arrays_same_bytes(tmp_path: Path) -> None:
    for name in ("a.npz", "b.npz"):
        save_arrays(ARRAYS, tmp_path / name)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_folder_without_a_session(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=rf"no {SESSION_FILE} in .*; name a folder"):
        load_session(tmp_path)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_cut_file(tmp_path: Path, share: float) -> None:
    whole = tmp_path / "whole.npz"
    save_arrays(ARRAYS, whole)
    contents = whole.read_bytes()
    (tmp_path / SESSION_FILE).write_bytes(contents[: int(share * len(contents))])
    with pytest.raises(UserError, match=f"{SESSION_FILE} is damaged"):
        load_session(tmp_path)


def test_flipped_bits_are_found(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    save_arrays(ARRAYS, path)
    contents = bytearray(path.read_bytes())
    place = contents.index(np.float64(5.0).tobytes())
    contents[place + 6] ^= 1
    path.write_bytes(contents)
    with pytest.raises(UserError, match="damaged"):
        load_arrays(path)


def test_other_files_of_numpy(tmp_path: Path) -> None:
    path = tmp_path / SESSION_FILE
    np.savez(path, poses=np.zeros(3))
    with pytest.raises(UserError, match=r"not a file of racecar"):
        load_session(tmp_path)
    with path.open("wb") as file:
        np.save(file, np.zeros(3))
    with pytest.raises(UserError, match=r"not a file of racecar"):
        load_session(tmp_path)


def test_pickles_are_not_opened(tmp_path: Path) -> None:
    path = tmp_path / SESSION_FILE
    np.savez(path, format=np.array({"a": 1}, dtype=object), version=np.array(VERSION))
    with pytest.raises(UserError, match="damaged"):
        load_session(tmp_path)


def header(shape: tuple[int, ...], dtype: str = "<f8") -> bytes:
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(stream, {"descr": dtype, "fortran_order": False, "shape": shape})
    return stream.getvalue()


@pytest.mark.parametrize("compression", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
@pytest.mark.parametrize(
    "contents", [header((10**15,)), header((10**15,), "<U0"), header((-1,)), b"\x93NUMPY\x01"]
)
def test_no_memory_is_taken_for_what_is_not_there(tmp_path: Path, contents: bytes, compression: int) -> None:
    with zipfile.ZipFile(tmp_path / SESSION_FILE, "w", compression) as archive:
        archive.writestr("format.npy", contents)
    with pytest.raises(UserError, match="damaged"):
        load_session(tmp_path)


def test_what_unpacks_to_more_than_the_file_is_refused(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / SESSION_FILE, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("poses.npy", header((10**7,), "|u1") + bytes(10**7))
    tracemalloc.start()
    with pytest.raises(UserError, match="damaged"):
        load_session(tmp_path)
    assert tracemalloc.get_traced_memory()[1] < 1e6
    tracemalloc.stop()


def test_what_is_no_session(tmp_path: Path) -> None:
    np.savez(tmp_path / SESSION_FILE, format=np.array("racecar checkpoint"), version=np.array(VERSION))
    with pytest.raises(UserError, match="is not a racecar session"):
        load_session(tmp_path)


def test_newer_version(tmp_path: Path) -> None:
    marks = {"format": np.array("racecar session"), "version": np.array(VERSION + 1)}
    np.savez(tmp_path / SESSION_FILE, **marks)
    with pytest.raises(UserError, match=f"version {VERSION + 1} .* knows version {VERSION}"):
        load_session(tmp_path)


def test_session_that_lacks_an_array(tmp_path: Path) -> None:
    save_arrays(ARRAYS, tmp_path / SESSION_FILE)
    with pytest.raises(UserError, match="damaged"):
        load_session(tmp_path)
