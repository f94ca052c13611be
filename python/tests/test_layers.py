"""Arrays, runs and files: what is written is what was given, as other readers see it."""

import numpy as np
import pytest
import tifffile
from conftest import noise
from PIL import Image, ImageSequence

import lamp_slicer as lamp

SHAPES = [(1, 1, 1), (3, 7, 64), (2, 40, 33), (2, 1, 65), (2, 65, 1)]


@pytest.mark.parametrize("gray", [False, True])
@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("ending", [".tif", ".lamp", "/"])
def test_arrays_come_back_from_files(tmp_path, shape, gray, ending):
    images = noise(*shape, gray=gray)
    path = f"{tmp_path}/stack{ending}"
    lamp.write(path, images, dpi=254, thickness="50um", name="noise")
    stack = lamp.open(path)
    assert stack.shape == shape and len(stack) == shape[0]
    assert (stack.dpi, stack.is_gray) == (254, gray)
    assert stack.info().stack.part == "noise"
    for number, (layer, image) in enumerate(zip(stack, images)):
        assert layer.array().dtype == image.dtype
        assert np.array_equal(layer.array(), image)
        assert np.array_equal(stack.array(number), image)
        assert np.array_equal(np.asarray(stack[number]), image)
        assert (layer.index, layer.z_um, layer.thickness_um) == (number, 50 * number, 50)
        assert layer.shape == image.shape and layer.exposed_px == np.count_nonzero(image)


def test_other_readers_see_the_same_pixels(tmp_path):
    for gray in [False, True]:
        images = noise(5, 50, 70, gray)
        path = tmp_path / f"stack{gray}.tif"
        lamp.write(path, images, dpi=254, thickness="50um")
        assert np.array_equal(tifffile.imread(path).astype(images.dtype), images)
        with Image.open(path) as pages:
            seen = [np.array(page) for page in ImageSequence.Iterator(pages)]
        assert np.array_equal(np.array(seen), images)


def test_stacks_of_other_writers_are_read(tmp_path):
    images = noise(4, 30, 41)
    pages = [Image.fromarray(image) for image in images]
    path = tmp_path / "pillow.tif"
    pages[0].save(path, save_all=True, append_images=pages[1:], compression="group4")
    assert all(np.array_equal(layer.array(), image) for layer, image in zip(lamp.open(path), images))
    images = noise(4, 30, 41, gray=True)
    path = tmp_path / "tifffile.tif"
    tifffile.imwrite(path, images, compression="zlib", photometric="minisblack")
    assert all(np.array_equal(layer.array(), image) for layer, image in zip(lamp.open(path), images))


@pytest.mark.parametrize("gray", [False, True])
def test_runs_are_the_pixels(gray):
    images = noise(3, 20, 30, gray)
    for layer, image in zip(lamp.layers(images), images):
        starts, columns, levels = layer.runs
        assert starts.dtype == columns.dtype == np.uint32
        assert len(starts) == 21 and starts[0] == 0 and starts[-1] == len(columns)
        # Differences along rows, from black before the first column.
        before = np.pad(image, ((0, 0), (1, 0)))[:, :-1]
        rows, changed = np.nonzero(image != before)
        assert np.array_equal(columns, changed)
        assert np.array_equal(np.diff(starts), np.bincount(rows, minlength=20))
        assert (levels is None) == (not gray)
        if gray:
            assert np.array_equal(levels, image[rows, changed])


def test_layers_of_python_code_go_through_stages(stack):
    taken = []

    def inverted(layers):
        for layer in layers:
            taken.append(layer.index)
            yield ~layer.array()

    upside = list(lamp.dither(inverted(stack)))
    assert taken == list(range(len(stack)))
    for before, after in zip(stack, upside):
        assert np.array_equal(~before.array(), after.array())


def test_a_stack_is_indexed_as_a_list(stack):
    all_layers = list(stack)
    assert stack[-1] == all_layers[-1] and stack[3] == all_layers[3]
    some = list(stack[5:8])
    # The record of the stack goes with the first layer.
    assert [layer.index for layer in some] == [5, 6, 7]
    assert all(np.array_equal(a.array(), b.array()) for a, b in zip(some, all_layers[5:8]))
    assert some[0].info.stack.part == "ring" and some[0].info.stack.layers == 3
    assert list(stack[8:5]) == []
    for index in [len(stack), -len(stack) - 1, 10**15]:
        with pytest.raises(IndexError):
            stack[index]
    with pytest.raises(lamp.LampSettingsError, match="leave out the step"):
        stack[::2]


def test_a_view_of_other_bytes_is_white_where_it_is_not_zero():
    odd = np.array([[0, 2, 3, 0, 255]], dtype=np.uint8)
    (layer,) = lamp.layers([odd.view(bool)])
    assert layer.array().tolist() == [[False, True, True, False, True]]


def test_views_of_arrays_are_taken_as_they_look():
    image = noise(1, 30, 40)[0]
    for view in [image.T, image[::-1, ::2], np.asfortranarray(image)]:
        (layer,) = lamp.layers([view])
        assert np.array_equal(layer.array(), view)


@pytest.mark.parametrize(
    ("given", "why"),
    [
        (np.zeros((2, 2)), "an array of float64 is no layer"),
        (np.zeros((2, 2, 2), bool), r"an array of shape \(2, 2, 2\) is no layer"),
        (np.zeros(5, np.uint8), "of two dimensions"),
        ("a text", "no layer"),
        (None, "no layer"),
    ],
)
def test_what_is_no_layer_is_refused(given, why):
    with pytest.raises(lamp.LampSettingsError, match=why):
        list(lamp.layers([given]))


def test_layers_are_taken_once(stack):
    layers = lamp.fix(stack)
    dots = lamp.dither(layers)
    with pytest.raises(lamp.LampSettingsError, match="another stage has taken"):
        next(layers)
    # Layers that have begun go on where they are.
    first = next(dots)
    rest = list(lamp.fix(dots))
    assert (first.index, len(rest)) == (0, len(stack) - 1)
    assert next(dots, None) is None


def test_layers_know_what_they_are(stack):
    assert repr(stack[3]) == "<layer 3 (z 0.60 mm): 191 x 192, black and white>"
    assert repr(lamp.fix(stack)).endswith("ring.tif | fix --method spline --min-confidence 0.35>")
    assert repr(stack).endswith(f"ring.tif, {len(stack)} layers>")
    with pytest.raises(ValueError, match="always new"):
        np.array(stack[0], copy=False)
    assert np.asarray(stack[3], dtype=np.float32).sum() == stack[3].exposed_px
