"""Layers that make no stack are refused by `write`, in the sentences of reading."""

import numpy as np
import pytest

import lamp_slicer as lamp

KEYWORDS = {"dpi": 300, "thickness": "100um"}
ENDINGS = pytest.mark.parametrize("ending", [".tif", ".lamp", "/"])


def ones(*shape):
    return np.ones(shape, bool)


@pytest.fixture
def layer():
    return next(lamp.layers([ones(3, 3)], **KEYWORDS))


@ENDINGS
@pytest.mark.parametrize(
    ("given", "why"),
    [
        ([ones(3, 3), ones(4, 5)], "layer 1 .* has 5 x 4 pixels, and the first layer has 3 x 3"),
        ([ones(3, 3), ones(3, 3), ones(3, 0)], "page 2: it claims a side of 0 pixels"),
        ([ones(0, 3)], "page 0: it claims a side of 0 pixels"),
        ([ones(3, 0).astype(np.uint8)], "page 0: it claims a side of 0 pixels"),
    ],
)
def test_arrays_that_make_no_stack_are_refused(tmp_path, ending, given, why):
    for call in [
        lambda: lamp.write(f"{tmp_path}/stack{ending}", given, **KEYWORDS),
        lambda: lamp.write(f"{tmp_path}/stack{ending}", lamp.fix(lamp.layers(given, **KEYWORDS))),
        lambda: list(lamp.layers(given, **KEYWORDS)),
    ]:
        with pytest.raises(lamp.LampError, match=why):
            call()
    # Neither the stack nor a temporary file is left.
    assert list(tmp_path.iterdir()) == []


@ENDINGS
def test_layers_go_up(tmp_path, ending, layer, stack):
    for given, why in [
        ([layer, layer], "layer 0 comes after layer 0: a stack's layers must go up"),
        ([stack[3], stack[2]], "layer 2 comes after layer 3"),
    ]:
        with pytest.raises(lamp.LampError, match=why):
            lamp.write(f"{tmp_path}/stack{ending}", given)
    assert list(tmp_path.iterdir()) == []


def test_a_refused_stack_leaves_the_file_before_it(tmp_path):
    path = tmp_path / "stack.tif"
    lamp.write(path, [ones(3, 3)], **KEYWORDS)
    before = path.read_bytes()
    with pytest.raises(lamp.LampError, match="5 x 4"):
        lamp.write(path, [ones(3, 3), ones(4, 5)], **KEYWORDS)
    assert path.read_bytes() == before and list(tmp_path.iterdir()) == [path]


def test_a_folder_has_each_layer_and_a_record(tmp_path, stack):
    folder = f"{tmp_path}/pages/"
    with pytest.raises(lamp.LampError, match="lacks a page: layer 4 does not follow"):
        lamp.write(folder, [stack[2], stack[4]])
    assert list(tmp_path.iterdir()) == []
    # Without a name, and from the middle of a stack.
    for given, keywords in [([ones(3, 3)] * 2, KEYWORDS), ([stack[2], stack[3]], {})]:
        lamp.write(folder, given, force=True, **keywords)
        assert len(list(lamp.open(folder))) == 2


def test_a_path_is_no_array(tmp_path, stack):
    out = tmp_path / "o.tif"
    for path in [str(stack.path), stack.path]:
        with pytest.raises(lamp.LampSettingsError, match="open it with lamp_slicer.open"):
            lamp.write(out, path, **KEYWORDS)
        with pytest.raises(lamp.LampSettingsError, match="open it with lamp_slicer.open"):
            lamp.layers(path)
    assert not out.exists()
    lamp.write(out, str(stack.path))
    assert list(lamp.open(out)) == list(stack)


@pytest.mark.parametrize("copies", [-1, 2.5, 10**12, "two"])
def test_copies_are_a_count(stack, copies):
    for call in [lambda: lamp.tile([(stack, copies)]), lambda: lamp.tile(stack, copies=copies)]:
        with pytest.raises(lamp.LampSettingsError, match=f"{copies} is no number of copies"):
            call()
    with pytest.raises(lamp.LampSettingsError, match="is no part: give layers"):
        lamp.tile([(stack,)])
