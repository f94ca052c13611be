"""Contours and layouts against gdstk, KLayout and ezdxf."""

import math

import ezdxf
import gdstk
import klayout.db as kdb
import numpy as np
import pytest

import lamp_slicer as lamp

# Masks are named in a note.
pytestmark = pytest.mark.filterwarnings("ignore:slice")


@pytest.fixture(scope="module")
def layout(tmp_path_factory):
    """Polygons that overlap, paths, and cells in arrays, mirrored, magnified and turned."""
    rng = np.random.default_rng(7)
    library = gdstk.Library("L", unit=1e-6, precision=1e-9)
    leaf = library.new_cell("LEAF")
    for _ in range(12):
        corners = rng.uniform(0, 20, (3, 2)).round(3)
        leaf.add(gdstk.Polygon(corners, layer=int(rng.integers(1, 3)), datatype=0))
    leaf.add(gdstk.ellipse((10, 10), 7, inner_radius=4, tolerance=1e-3, layer=3, datatype=1))
    ends = ["flush", "round", "extended", (2.5, 1.5)]
    for k, end in enumerate(ends):
        points = [(0, 30 + 12 * k), (25, 30 + 12 * k), (30, 37 + 12 * k), (48, 35 + 12 * k)]
        leaf.add(gdstk.FlexPath(points, 3, ends=end, simple_path=True, layer=4, datatype=0))
    top = library.new_cell("TOP")
    top.add(gdstk.Reference(leaf, (0, 0), columns=3, rows=2, spacing=(60, 90)))
    top.add(gdstk.Reference(leaf, (250, 40), math.radians(33), 1.7, True))
    grid = {"columns": 2, "rows": 3, "spacing": (40, 50)}
    top.add(gdstk.Reference(leaf, (-100, 20), math.pi / 2, 0.5, **grid))
    path = tmp_path_factory.mktemp("layout") / "layout.gds"
    library.write_gds(path)
    return path


def test_masks_have_the_area_that_klayout_finds(layout):
    database = kdb.Layout()
    database.read(str(layout))
    top = database.top_cell()
    infos = sorted(database.layer_infos(), key=lambda info: (info.layer, info.datatype))
    masks = list(lamp.slice(layout, dpi="0.3um"))
    assert len(masks) == len(infos) == 4
    for mask, info in zip(masks, infos):
        region = kdb.Region(top.begin_shapes_rec(database.layer(info)))
        region.merged_semantics = True
        merged = region.merged()
        area = merged.area() * database.dbu**2
        perimeter = merged.perimeter() * database.dbu
        assert abs(mask.exposed_px * 0.3**2 - area) < 0.02 * 0.3 * perimeter


def test_pixels_are_white_where_gdstk_has_their_center_inside(layout):
    top = gdstk.read_gds(layout).top_level()[0].flatten()
    polygons = [shape for shape in top.get_polygons() if shape.layer < 4]
    for mask, (layer, datatype) in zip(lamp.slice(layout, dpi="0.7um"), [(1, 0), (2, 0), (3, 1)]):
        x0, y1 = (1000 * mm for mm in mask.origin_mm)
        rows, columns = np.indices(mask.shape)
        centers = np.stack([x0 + (columns + 0.5) * 0.7, y1 - (rows + 0.5) * 0.7], axis=-1)
        own = [it for it in polygons if (it.layer, it.datatype) == (layer, datatype)]
        inside = gdstk.inside(centers.reshape(-1, 2), own)
        differing = np.asarray(inside).reshape(mask.shape) != mask.array().astype(bool)
        # gdstk rounds corners of magnified cells to no grid, and keeps points on edges inside.
        assert differing.sum() <= 2


def test_a_drawing_of_ezdxf(tmp_path):
    drawing = ezdxf.new("R2010", units=ezdxf.units.MM)
    block = drawing.blocks.new("PAD")
    block.add_circle((1, 1), 2)
    block.add_lwpolyline([(0, 0, 0.5), (2, 0, 0), (2, 2, -0.3), (0, 2, 0)], "xyb", close=True)
    space = drawing.modelspace()
    space.add_blockref("PAD", (5, 7), {"rotation": 30, "xscale": 2, "yscale": 2, "layer": "B"})
    space.add_ellipse((30, 10), (6, 2), 0.4, dxfattribs={"layer": "A"})
    space.add_line((40, 0), (50, 0), {"layer": "A"})
    space.add_arc((45, 0), 5, 0, 180, dxfattribs={"layer": "A"})
    path = tmp_path / "drawing.dxf"
    drawing.saveas(path)
    a, b = lamp.slice(path, dpi=1270)
    pixel = (25.4 / 1270) ** 2
    ellipse = math.pi * (36 + 4) * 0.4
    assert a.exposed_px * pixel == pytest.approx(ellipse + math.pi * 12.5, rel=2e-3)

    def segment(bulge, chord):
        angle = 4 * math.atan(bulge)
        radius = chord * (1 + bulge**2) / (4 * bulge)
        return radius**2 / 2 * (angle - math.sin(angle))

    # The polygon is within the circle, so it is a hole.
    polygon = 4 + segment(0.5, 2) - segment(0.3, 2)
    assert b.exposed_px * pixel == pytest.approx(4 * (4 * math.pi - polygon), rel=2e-3)
