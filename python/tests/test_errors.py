"""Errors: types, sentences of the program, and what Python code raises on the way."""

import re
import sys

import numpy as np
import pytest

import lamp_slicer as lamp


def test_sentences_are_those_of_the_program(tmp_path, stack, program):
    cut = tmp_path / "cut.tif"
    cut.write_bytes(stack.path.read_bytes()[:-500])
    text = tmp_path / "text.tif"
    text.write_text("no stack")
    stl = tmp_path / "text.stl"
    stl.write_text("solid nothing\nendsolid nothing\n")
    out = tmp_path / "out.tif"
    cases = [
        (lambda: lamp.open(cut), ["lamp", "info", cut]),
        (lambda: list(lamp.fix(cut)), ["fix", cut, "-o", out]),
        (lambda: lamp.open(text), ["lamp", "info", text]),
        (lambda: lamp.open(tmp_path / "none.tif"), ["lamp", "info", tmp_path / "none.tif"]),
        (lambda: next(lamp.slice(stl)), ["slice", stl, "-o", out]),
        (lambda: next(lamp.slice(stack.path)), ["slice", stack.path, "-o", out]),
        (lambda: next(lamp.slice(tmp_path / "none.stl")), ["slice", tmp_path / "none.stl", "-o", out]),
        (lambda: next(lamp.slice(stl, gray=True, material="mud")),
         ["slice", stl, "--gray", "--material", "mud", "-o", out]),
        (lambda: lamp.check(cut), ["lamp", "check", cut]),
        (lambda: lamp.write(tmp_path / "no" / "x.tif", stack),
         ["fix", stack.path, "-o", tmp_path / "no" / "x.tif"]),
        (lambda: next(lamp.tile(stack, machine="mine.toml")),
         ["tile", stack.path, "--machine", "mine.toml", "-o", out]),
    ]
    for call, command in cases:
        with pytest.raises(lamp.LampError) as caught:
            call()
        answer = program(*command)
        assert answer.returncode != 0
        # The program may add a hint that names options.
        said = re.sub(r"^error: [a-z]+: ", "", answer.stderr.strip().splitlines()[-1])
        assert said.startswith(str(caught.value)), (said, str(caught.value))


def test_types_tell_whose_fault_it_is(tmp_path, stack):
    with pytest.raises(FileNotFoundError) as caught:
        lamp.open(tmp_path / "none.tif")
    assert isinstance(caught.value, lamp.LampFileError) and caught.value.errno == 2
    with pytest.raises(ValueError):
        lamp.slice("x.stl", dpi=-1)
    with pytest.raises(OSError):
        lamp.write(tmp_path / "no" / "x.tif", stack)
    with pytest.raises(lamp.LampSettingsError, match="end its name in .tif, .lamp or /"):
        lamp.write(tmp_path / "x.png", stack)
    with pytest.raises(TypeError):
        lamp.slice("x.stl", thick="1mm")
    with pytest.raises(lamp.LampSettingsError, match="has no layers: give a stack"):
        lamp.fix(3)


def test_what_python_code_raises_comes_back_as_it_is(tmp_path):
    class Mine(Exception):
        pass

    reason = Mine("of my own")

    def failing():
        yield np.zeros((4, 4), bool)
        raise reason

    path = tmp_path / "x.tif"
    for work in [
        lambda: list(lamp.fix(failing())),
        lambda: lamp.write(path, lamp.dither(failing())),
        lambda: lamp.check(failing()),
    ]:
        with pytest.raises(Mine) as caught:
            work()
        assert caught.value is reason
    # Neither the file nor a temporary one is left.
    assert list(tmp_path.iterdir()) == []


def test_a_folder_is_replaced_only_by_force(tmp_path, stack):
    folder = f"{tmp_path}/pages/"
    lamp.write(folder, stack)
    with pytest.raises(lamp.LampError, match="pages"):
        lamp.write(folder, stack)
    lamp.write(folder, stack[2:4], force=True)
    assert len(lamp.open(folder)) == 2


def test_a_stack_that_is_written_over_itself_is_whole(tmp_path, stack):
    path = tmp_path / "same.tif"
    path.write_bytes(stack.path.read_bytes())
    lamp.write(path, lamp.fix(path))
    assert list(lamp.open(path)) == list(stack)


def test_an_opened_stack_is_one_file(tmp_path, stack):
    path = tmp_path / "one.tif"
    path.write_bytes(stack.path.read_bytes())
    opened = lamp.open(path)
    # Another file takes its name: the opened one stays.
    other = tmp_path / "other.tif"
    lamp.write(other, np.zeros((3, 4, 5), bool))
    if sys.platform != "win32":
        other.replace(path)
        assert list(opened) == list(stack) and opened[2] == stack[2]
    # The file itself is written to.
    opened = lamp.open(path)
    path.write_bytes(stack.path.read_bytes())
    with pytest.raises(lamp.LampError, match="changed"):
        list(opened)


def test_damage_is_an_error_not_a_layer(tmp_path, stack):
    bytes_of = bytearray(stack.path.read_bytes())
    numbers = np.random.default_rng(7)
    path = tmp_path / "damaged.tif"
    for _ in range(40):
        damaged = bytes_of.copy()
        for at in numbers.integers(0, len(damaged), 3):
            damaged[at] ^= 1 << int(numbers.integers(8))
        path.write_bytes(damaged)
        try:
            layers = list(lamp.open(path))
        except lamp.LampError:
            continue
        assert all(np.array_equal(a.array(), b.array()) for a, b in zip(layers, stack))
