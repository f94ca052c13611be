"""Stages from layers to layers, checks, and stacks as files."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Literal, Optional, Union

from lamp_slicer import _native
from lamp_slicer._native import Layer, Layers, Stack
from lamp_slicer._records import Findings, Record

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Image = Union[Layer, NDArray[np.bool_], NDArray[np.uint8]]

Path = Union[str, "os.PathLike[str]"]
# Layers as stages take them: of a stage, a stack or its path, or of any iterable of layers or of
# arrays of two dimensions, bool for black and white and uint8 for gray.
LayersLike = Union[Layers, Stack, Path, "Iterable[Image]"]


def open(path: Path) -> Stack:
    """Opens a stack: a TIFF, a packed stack, a picture, or a folder of pages.

    The text of all pages is read, and their images only when they are asked for. Several threads
    may read one stack at a time.
    """
    return _native.open(path)


def layers(
    arrays: Iterable[Image],
    *,
    dpi: Union[float, str, None] = None,
    thickness: Optional[str] = None,
    name: Optional[str] = None,
) -> Layers:
    """Returns layers of arrays, bottom first: bool for black and white, uint8 for gray.

    dpi: resolution in dots per inch, or how far pixels are apart: "14x19um".
    thickness: thickness of the layers, such as "100um".
    name: name of the part.
    """
    return _native.layers(arrays, dpi=dpi, thickness=thickness, name=name)


def fix(
    layers: LayersLike,
    *,
    method: Optional[Literal["nearest", "spline"]] = None,
    max_width: Optional[int] = None,
    min_confidence: Optional[float] = None,
    use_neighbors: bool = False,
) -> Layers:
    """Corrects stray rows, which gaps in a mesh leave white or black across the image.

    The keywords are the options of `fix`, which `fix --help` describes. The report of the layers
    lists the bands of rows.
    """
    keywords = {
        "method": method,
        "max_width": max_width,
        "min_confidence": min_confidence,
        "use_neighbors": use_neighbors or None,
    }
    return _native.fix(layers, keywords)


def dither(
    layers: LayersLike,
    *,
    method: Optional[
        Literal["blue-noise", "ordered", "floyd-steinberg", "sierra-lite", "threshold"]
    ] = None,
    cell: Optional[str] = None,
    cell_clearance: Optional[str] = None,
    cell_level: Optional[float] = None,
) -> Layers:
    """Turns gray layers into dots; others pass unchanged.

    cell: side of the square cells that screen the inside of parts, such as "85um".
    cell_clearance: least distance between cells and surfaces, such as "1mm".
    cell_level: share of cells that are white, from 0 to 1; a half.
    """
    keywords = {
        "method": method,
        "cell": cell,
        "cell_clearance": cell_clearance,
        "cell_level": cell_level,
    }
    return _native.dither(layers, keywords)


def compensate(
    layers: LayersLike,
    *,
    uniform: Optional[str] = None,
    material: Optional[Path] = None,
    dose: Optional[str] = None,
    lamp_intensity: Optional[str] = None,
    min_feature: Optional[str] = None,
    shrinkage: Optional[str] = None,
    one_bit: bool = False,
) -> Layers:
    """Moves edges in by the excess cure width, and enlarges images for shrinkage in firing.

    uniform: how far edges move in, such as "25um" or "25x40um"; outwards if it is negative.
    material: a built-in material or a file, whose cure width edges move by.
    dose: the dose of full white, such as "300mJ/cm2".
    lamp_intensity: the lamp as it is now, such as "75%".
    min_feature: walls stay at least this wide; two pixels.
    shrinkage: such as "2.1%" or "x:2.1%,y:1.8%".
    one_bit: rounds edges to whole pixels.

    The report of the layers lists walls that were narrowed less than asked, or lost.
    """
    keywords = {
        "uniform": uniform,
        "material": material,
        "dose": dose,
        "lamp_intensity": lamp_intensity,
        "min_feature": min_feature,
        "shrinkage": shrinkage,
        "one_bit": one_bit or None,
    }
    return _native.compensate(layers, keywords)


def edit(layers: LayersLike, edits: Path) -> Layers:
    """Changes layers by a list of edits, the TOML file that `lamp edit --edits` takes."""
    return _native.edit(layers, edits)


def tile(
    parts: Union[LayersLike, list[Union[LayersLike, tuple[LayersLike, int]]]],
    *,
    machine: Optional[Path] = None,
    area: Optional[str] = None,
    copies: Optional[int] = None,
    shares: bool = False,
    gap: Optional[str] = None,
    edge_gap: Optional[str] = None,
    fit: bool = False,
    pack: Optional[Literal["box", "outline"]] = None,
    turns: Optional[Literal["none", "half", "quarters"]] = None,
    layout: Optional[Path] = None,
    settle: bool = False,
    resample: bool = False,
    mesh: Union[Literal["hexagon", "square", "none"], Path, None] = None,
    cell: Optional[str] = None,
    wall: Optional[str] = None,
    clearance: Optional[str] = None,
    moat: Optional[Literal["rising", "layer", "outline"]] = None,
    least_piece: Optional[str] = None,
    break_width: Optional[str] = None,
    break_pitch: Optional[str] = None,
    base_layers: Optional[int] = None,
) -> Layers:
    """Lays out copies of parts on a build area, in a mesh of thin walls.

    `parts` are the layers of one part, or a list of parts, each alone or as `(layers, copies)`.
    Lists of arrays are one part: give them to `layers` first.

    The keywords are the options of `tile`, which `tile --help` describes:

    machine, area: "alpha", "beta" or a file; such as "4x4.5in".
    copies: copies of a single part; as many as fit.
    shares, gap, edge_gap, fit, pack, turns, layout: where copies lie.
    settle, resample: how the layers of several parts match.
    mesh, cell, wall, clearance, moat, least_piece, break_width, break_pitch, base_layers: the mesh;
        none with mesh="none".

    The report of the layers has the layout, as `tile --layout-out` writes it.
    """
    keywords = {
        "machine": machine,
        "area": area,
        "copies": copies,
        "shares": shares or None,
        "gap": gap,
        "edge_gap": edge_gap,
        "fit": fit or None,
        "pack": pack,
        "turns": turns,
        "layout": layout,
        "settle": settle or None,
        "resample": resample or None,
        "mesh": mesh,
        "cell": cell,
        "wall": wall,
        "clearance": clearance,
        "moat": moat,
        "least_piece": least_piece,
        "break_width": break_width,
        "break_pitch": break_pitch,
        "base_layers": base_layers,
    }
    return _native.tile(parts, keywords)


def check(
    layers: LayersLike,
    *,
    only: Union[str, Sequence[str], None] = None,
    speck: Optional[str] = None,
    speck_layers: Optional[int] = None,
    least_support: Optional[float] = None,
    max_overhang: Optional[str] = None,
    drain: Optional[str] = None,
    threshold: Optional[int] = None,
    machine: Optional[Path] = None,
    rules: Optional[Path] = None,
) -> Findings:
    """Finds features that would be swept away, trap resin or bend as layers are built.

    The keywords are the options of `lamp check`, which `lamp check --help` describes. `only` names
    groups: islands, joints, pockets, overhangs, rules, balance and layers.
    """
    keywords = {
        "only": only,
        "speck": speck,
        "speck_layers": speck_layers,
        "least_support": least_support,
        "max_overhang": max_overhang,
        "drain": drain,
        "threshold": threshold,
        "machine": machine,
        "rules": rules,
    }
    answer = _native.check(layers, keywords)
    return Findings(answer["found"], answer["reports"])


def write(
    path: Path,
    layers: LayersLike,
    *,
    dpi: Union[float, str, None] = None,
    thickness: Optional[str] = None,
    name: Optional[str] = None,
    classic: bool = False,
    force: bool = False,
) -> list[Record]:
    """Writes layers as a stack, and returns what the stages report.

    `path` ends in .tif, or in .lamp for a packed stack, or in / for a folder of pages. It gets its
    name when all layers are written.

    dpi, thickness, name: what pages state of arrays; layers have their own.
    classic: writes a classic TIFF of at most 4 GiB instead of a BigTIFF.
    force: replaces a folder that an earlier run wrote.
    """
    return _native.write(
        path, layers, dpi=dpi, thickness=thickness, name=name, classic=classic, force=force
    )
