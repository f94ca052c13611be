"""Stacks as stores of Zarr, as zarr and dask read them."""

import dask.array
import numpy as np
import pytest
import zarr
from conftest import noise
from PIL import Image

import lamp_slicer as lamp


def test_zarr_and_dask_see_the_layers(stack):
    expected = np.array([layer.array() for layer in stack])
    group = zarr.open_group(lamp.zarr(stack), mode="r")
    array = group["0"]
    assert (array.shape, array.dtype) == (stack.shape, bool)
    assert array.chunks == (1, *stack.shape[1:])
    assert np.array_equal(array[:], expected)
    assert np.array_equal(array[3:6, 40:50, 30:90:2], expected[3:6, 40:50, 30:90:2])
    lazily = dask.array.from_zarr(array)
    assert lazily.chunks[0] == (1,) * len(stack)
    sums = lazily.sum(axis=(1, 2)).compute()
    assert sums.tolist() == [layer.exposed_px for layer in stack]


def test_the_metadata_is_of_ome_zarr(stack):
    group = zarr.open_group(lamp.zarr(stack.path), mode="r")
    ome = group.attrs["ome"]
    assert ome["version"] == "0.5"
    (multiscale,) = ome["multiscales"]
    assert multiscale["name"] == "ring"
    assert [axis["name"] for axis in multiscale["axes"]] == ["z", "y", "x"]
    assert {axis["unit"] for axis in multiscale["axes"]} == {"micrometer"}
    (dataset,) = multiscale["datasets"]
    (transformation,) = dataset["coordinateTransformations"]
    # 25400 um are 300 pixels.
    assert transformation["scale"] == pytest.approx([200, 25_400 / 300, 25_400 / 300])
    of_pages = group[dataset["path"]].attrs["lamp"]
    assert of_pages["z_um"] == [200 * number for number in range(len(stack))]
    assert sorted(key for key, _ in group.members()) == ["0"]


def test_gray_stacks_may_have_masks(tmp_path):
    gray, mask = noise(2, 20, 30, gray=True), noise(2, 20, 30)
    path = tmp_path / "both.tif"
    lamp.write(path, [*gray, *mask])
    group = zarr.open_group(lamp.zarr(path), mode="r")
    expected = np.concatenate([gray, mask.astype(np.uint8) * 255])
    assert group["0"].dtype == np.uint8 and np.array_equal(group["0"][:], expected)
    # Nothing is known of its size.
    (multiscale,) = group.attrs["ome"]["multiscales"]
    assert multiscale["datasets"][0]["coordinateTransformations"][0]["scale"] == [1, 1, 1]


def test_a_store_is_read_only_and_has_one_size(tmp_path, stack):
    store = lamp.zarr(stack)
    with pytest.raises(Exception, match="read-only|read only"):
        zarr.open_group(store, mode="a").create_array("1", shape=(1,), dtype="u1")
    path = tmp_path / "sizes.tif"
    # Such stacks are only of other writers.
    pages = [Image.fromarray(np.zeros(shape, bool)) for shape in [(3, 4), (4, 4)]]
    pages[0].save(path, save_all=True, append_images=pages[1:], compression="group4")
    with pytest.raises(lamp.LampError, match="layer 1 has 4 x 4 pixels"):
        lamp.zarr(path)
