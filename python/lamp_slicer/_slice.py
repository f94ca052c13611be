"""`slice`: parts into layers."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, Optional, Protocol, Union

from lamp_slicer import _native
from lamp_slicer._native import Layers

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    class Mesh(Protocol):
        """A mesh in memory, such as of trimesh."""

        @property
        def vertices(self) -> ArrayLike: ...
        @property
        def faces(self) -> ArrayLike: ...


Path = Union[str, "os.PathLike[str]"]
Axis = Literal["x", "y", "z"]


def slice(
    part: Union[Path, list[Path], Mesh, tuple[ArrayLike, ArrayLike]],
    *,
    dpi: Union[float, str, None] = None,
    thickness: Optional[str] = None,
    name: Optional[str] = None,
    machine: Optional[Path] = None,
    layers: Optional[range] = None,
    plane: Optional[Literal["top", "middle", "bottom"]] = None,
    plane_tolerance: Optional[str] = None,
    side: Optional[Literal["both", "inside", "outside"]] = None,
    units: Optional[Literal["mm", "cm", "m", "um", "inch", "ft"]] = None,
    fill: Optional[Literal["solid", "even-odd"]] = None,
    bodies: Optional[Literal["unite", "xor"]] = None,
    subtract: Union[Path, Sequence[Path], None] = None,
    intersect: Union[Path, Sequence[Path], None] = None,
    scale: Union[float, tuple[float, float, float], None] = None,
    mirror: Union[Axis, Sequence[Axis], None] = None,
    rotate: Union[str, Sequence[str], None] = None,
    translate: Optional[tuple[float, float, float]] = None,
    trust_extent: bool = False,
    margin: Optional[int] = None,
    origin: Optional[tuple[float, float]] = None,
    size: Optional[str] = None,
    adaptive: bool = False,
    min: Optional[str] = None,
    max: Optional[str] = None,
    step: Optional[str] = None,
    criterion: Optional[Literal["volume", "cusp", "ra", "area"]] = None,
    deviation: Union[float, str, None] = None,
    cusp: Optional[str] = None,
    ra: Optional[str] = None,
    ra_line: Optional[str] = None,
    layers_budget: Optional[int] = None,
    time_budget: Optional[str] = None,
    layer_overhead: Optional[str] = None,
    snap: bool = False,
    row_pitch: Optional[str] = None,
    material: Optional[Path] = None,
    overcure: Optional[float] = None,
    lamp_intensity: Optional[str] = None,
    exposure_table: Optional[Path] = None,
    gray: bool = False,
    print_through: bool = False,
    antialias: bool = False,
    tolerance: Optional[str] = None,
    kernel: Optional[Literal["lamp", "occt", "both"]] = None,
    no_polish: bool = False,
    fallback: Optional[Path] = None,
    memory_bytes: Optional[int] = None,
) -> Layers:
    """Slices a part into layers. A pixel is white exactly if its center is inside the section.

    `part` is the path of an STL, STEP, 3MF, OBJ, CLI, SVG, DXF, GDSII or Gerber file, a list of
    paths that share one coordinate system, `(vertices, faces)`, or an object that has both, such as
    a mesh of trimesh. Coordinates of a mesh are in `units` and are rounded to 32 bits, as in an STL.

    The keywords are the options of `lamp slice`, which `lamp slice --help` describes:

    dpi: resolution in dots per inch, or how far pixels are apart, "14x19um"; 1500, or the
        machine's.
    thickness: thickness of the layers; the machine's, or the file's for contours and masks, or
        else "100um".
    name: the part's name in its stack; its file's name.
    machine: "alpha", "beta" or a file: its limits and defaults hold.
    layers: only these layers, such as range(100, 200).
    plane, plane_tolerance: where in a layer the part is cut, and what counts as on the plane.
    side: whether layers lie inside the part, outside of it, or on both sides of its surface.
    units, fill, bodies, subtract, intersect, trust_extent: the solid.
    scale, mirror, rotate, translate: its place, in this order: rotate=["x:90", "z:-12.5"],
        translate=(0, 0, 5) in millimeters.
    margin, or origin (in millimeters) and size: the pixels of the images.
    adaptive, min, max, step, criterion, deviation, cusp, ra, ra_line, layers_budget, time_budget,
        layer_overhead, snap, row_pitch: layers as thick as the part's slopes allow. A bound may
        differ by height: deviation="2%@0mm..12mm,0.5%@12mm..".
    material, overcure, lamp_intensity, or exposure_table: exposure times of the layers.
    gray, print_through: gray layers, which cure down to where the part ends.
    antialias: gray edges, whose levels are the shares of pixels within the part.
    tolerance, kernel, no_polish, fallback: how STEP parts are read.
    memory_bytes: memory for the table of crossings; a quarter of what is free.
    """
    keywords: dict[str, Any] = {
        "dpi": dpi,
        "thickness": thickness,
        "plane": plane,
        "plane_tolerance": plane_tolerance,
        "side": side,
        "units": units,
        "fill": fill,
        "bodies": bodies,
        "subtract": subtract,
        "intersect": intersect,
        "scale": scale,
        "mirror": mirror,
        "rotate": rotate,
        "translate": translate,
        "trust_extent": trust_extent or None,
        "margin": margin,
        "origin": origin,
        "size": size,
        "adaptive": adaptive or None,
        "min": min,
        "max": max,
        "step": step,
        "criterion": criterion,
        "deviation": deviation,
        "cusp": cusp,
        "ra": ra,
        "ra_line": ra_line,
        "layers_budget": layers_budget,
        "time_budget": time_budget,
        "layer_overhead": layer_overhead,
        "snap": snap or None,
        "row_pitch": row_pitch,
        "material": material,
        "overcure": overcure,
        "lamp_intensity": lamp_intensity,
        "exposure_table": exposure_table,
        "gray": gray or None,
        "print_through": print_through or None,
        "antialias": antialias or None,
        "tolerance": tolerance,
        "kernel": kernel,
        "no_polish": no_polish or None,
    }
    return _native.slice(
        part,
        keywords,
        name=name,
        machine=machine,
        layers=layers,
        memory_bytes=memory_bytes,
        fallback=fallback,
    )
