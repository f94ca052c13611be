"""Slices against trimesh, and meshes in memory against files."""

import math
import warnings

import numpy as np
import pytest

import lamp_slicer as lamp


@pytest.mark.parametrize("z", [0.5, 2.0, 3.3, 4.9])
def test_white_has_the_area_of_the_section(mesh, z):
    dpi, thickness_um = 1200, 100
    layer = round(1000 * z / thickness_um) - 1
    (sliced,) = lamp.slice(mesh, dpi=dpi, thickness="100um", layers=range(layer, layer + 1))
    section = mesh.section(plane_origin=[0, 0, z], plane_normal=[0, 0, 1])
    flat, _ = section.to_2D()
    pitch = 25.4 / dpi
    # By pixel centers, the error of a curve is of the order of a pixel along its length, and far
    # below it on average.
    error = abs(sliced.exposed_px * pitch**2 - flat.area)
    assert error < 0.02 * pitch * flat.length


def test_each_pixel_is_white_where_its_center_is_inside(mesh):
    (sliced,) = lamp.slice(mesh, dpi=150, thickness="1mm", plane="middle", layers=range(2, 3))
    x0, y1 = sliced.origin_mm
    pitch = 25.4 / 150
    rows, columns = np.indices(sliced.shape)
    centers = np.stack([x0 + (columns + 0.5) * pitch, y1 - (rows + 0.5) * pitch], axis=-1)
    heights = np.full(sliced.shape, 2.5)
    points = np.dstack([centers, heights]).reshape(-1, 3)
    inside = mesh.contains(points).reshape(sliced.shape)
    assert np.array_equal(sliced.array(), inside)


def test_a_mesh_in_memory_is_its_stl(mesh, stl):
    settings = {"dpi": 200, "thickness": "250um", "rotate": "x:90", "name": "ring"}
    of_file = list(lamp.slice(stl, **settings))
    for given in [mesh, (mesh.vertices, mesh.faces), str(stl), [stl]]:
        made = list(lamp.slice(given, **settings))
        assert len(made) == len(of_file) == 64
        assert all(np.array_equal(a.array(), b.array()) for a, b in zip(made, of_file))


def test_the_program_writes_the_same_bytes(tmp_path, stl, program):
    ours, theirs = tmp_path / "ours.tif", tmp_path / "theirs.tif"
    lamp.write(ours, lamp.dither(lamp.fix(lamp.slice(stl, dpi=300))))
    sliced = ["slice", stl, "--dpi", "300", "-q", "-o", tmp_path / "a.tif"]
    program(*sliced, check=True)
    program("fix", tmp_path / "a.tif", "-q", "-o", tmp_path / "b.tif", check=True)
    program("dither", tmp_path / "b.tif", "-q", "-o", theirs, check=True)
    assert ours.read_bytes() == theirs.read_bytes()


@pytest.mark.filterwarnings("ignore:slice")
def test_keywords_are_the_options_of_the_program(tmp_path, stl, program):
    """Keywords in each of their forms, against the program with the same options."""
    cases = [
        ({"thickness": "0.5mm", "margin": 3, "plane": "bottom"},
         ["--thickness", "0.5mm", "--margin", "3", "--plane", "bottom"]),
        ({"scale": 1.5, "mirror": ("x", "y"), "rotate": ["x:90", "z:-12.5"], "translate": (1, 2, 3)},
         ["--scale", "1.5", "--mirror", "x,y", "--rotate", "x:90,z:-12.5", "--translate", "1,2,3"]),
        ({"scale": (1, 1.1, 0.9), "units": "inch", "fill": "even-odd", "subtract": stl},
         ["--scale", "1,1.1,0.9", "--units", "inch", "--fill", "even-odd", "--subtract", stl]),
        ({"origin": (-9, 9.5), "size": "20x20mm"}, ["--origin=-9,9.5", "--size", "20x20mm"]),
        ({"adaptive": True, "deviation": 0.05, "max": "300um", "snap": True},
         ["--adaptive", "--deviation", "0.05", "--max", "300um", "--snap"]),
        ({"adaptive": True, "ra": "6um", "ra_line": "0.2,1um"},
         ["--adaptive", "--ra", "6um", "--ra-line", "0.2,1um"]),
        ({"side": "outside", "thickness": "0.5mm"}, ["--side", "outside", "--thickness", "0.5mm"]),
        ({"adaptive": True, "deviation": "5%@..2mm,1%@2mm.."},
         ["--adaptive", "--deviation", "5%@..2mm,1%@2mm.."]),
        ({"material": "lamp-suspension", "overcure": 1.5, "gray": True},
         ["--material", "lamp-suspension", "--overcure", "1.5", "--gray"]),
        ({"machine": "beta", "layers": range(4, 9), "name": "a part"},
         ["--machine", "beta", "--layers", "4..9", "--name", "a part"]),
    ]
    for keywords, options in cases:
        dpi = {} if "machine" in keywords else {"dpi": 100}
        words = [] if "machine" in keywords else ["--dpi", "100"]
        ours, theirs = tmp_path / "ours.tif", tmp_path / "theirs.tif"
        lamp.write(ours, lamp.slice(stl, **dpi, **keywords))
        program("slice", stl, *words, *options, "-q", "-o", theirs, check=True)
        assert ours.read_bytes() == theirs.read_bytes(), keywords


@pytest.mark.parametrize(
    ("keywords", "why"),
    [
        ({"dpi": 0}, "dpi: `0` is not a resolution"),
        ({"dpi": math.nan}, "dpi: `nan` is not a resolution"),
        ({"thickness": "thick"}, "thickness: `thick` is not a length"),
        ({"thickness": "100"}, "thickness: `100` has no known unit"),
        ({"thickness": "0um"}, "thickness: the length must be above zero"),
        ({"thickness": "-5um"}, "thickness: -5um is below zero"),
        ({"origin": (1, 2)}, "origin: it has no effect"),
        ({"origin": "here", "size": "1x1mm"}, "origin: `here` is not 2 numbers"),
        ({"gray": True}, "gray layers need a material"),
        ({"overcure": 2}, "overcure: it has no effect"),
        ({"material": "lamp-suspension", "overcure": 0}, "overcure: `0` is not a depth"),
        ({"min": "5um"}, "min: it has no effect"),
        ({"plane": "side"}, "plane: `side` is none of top, middle, bottom"),
        ({"margin": -1}, "margin: `-1` is not a number of pixels"),
        ({"scale": 0}, "scale: `0` would leave nothing"),
        ({"rotate": "q:9"}, "rotate: `q:9` is not a rotation"),
        ({"translate": (0, 0)}, "translate: `0,0` is not 3 numbers"),
        ({"adaptive": True, "thickness": "50um"}, "thickness: it has no effect"),
        ({"layers": range(9, 9)}, "is no range of layers"),
        ({"layers": range(0, 9, 2)}, "is no range of layers"),
        ({"layers": "1..2"}, "is no range of layers"),
        ({"bodies": "xor"}, "is for --fill even-odd"),
    ],
)
def test_wrong_keywords_are_named(stl, keywords, why):
    with pytest.raises(lamp.LampSettingsError, match=why):
        next(lamp.slice(stl, **keywords))


@pytest.mark.parametrize(
    ("vertices", "faces", "why"),
    [
        ([[0, 0, 0]], [[0, 0, 1]], "face 0 names vertex 1, but there are 1 vertices"),
        ([[0, 0, 0]], [[0, 0, -1]], "face 0 names vertex -1"),
        ([[0, 0]], [[0, 0, 0]], "give an array of n x 3 numbers"),
        ([[0, 0, 0]], [[0, 0, 0, 0]], "give an array of n x 3 numbers"),
        ([[0, 0, 0]], np.zeros((0, 3), int), "mesh: the file holds no facets"),
        ([[0, 0, math.nan], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], "mesh: .*facet 0"),
    ],
)
def test_wrong_meshes_are_refused(vertices, faces, why):
    with pytest.raises(lamp.LampError, match=why):
        next(lamp.slice((vertices, faces)))


@pytest.mark.parametrize("part", [3, None, (1, 2, 3), b"x", [], "-"])
def test_what_is_no_part_is_refused(part):
    with pytest.raises((lamp.LampSettingsError, FileNotFoundError)):
        next(lamp.slice(part))


def test_remarks_are_warnings(mesh):
    tiny = (mesh.vertices / 1000, mesh.faces)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        list(lamp.slice(tiny))
    assert [str(warning.message).split(":")[0] for warning in caught] == ["slice"] * 2
    assert "smaller than any casting" in str(caught[0].message)
    assert {warning.category for warning in caught} == {lamp.LampWarning}
    assert {warning.filename for warning in caught} == {__file__}
    # Through a function of the package, too.
    with pytest.warns(lamp.LampWarning) as caught:
        lamp.check(lamp.slice(tiny))
    assert {warning.filename for warning in caught} == {__file__}
