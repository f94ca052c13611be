"""Plans of exposures: of layers, from the doses of all together, and of bitmaps on a fixed glass."""

from __future__ import annotations

from typing import Literal, Optional, Union

from lamp_slicer import _native
from lamp_slicer._native import Layers
from lamp_slicer._records import Plan
from lamp_slicer._stages import LayersLike, Path


def plan_speed(
    layers: LayersLike,
    *,
    material: Path,
    lamp_intensity: Optional[str] = None,
    wanted: Optional[int] = None,
    dose_margin: Union[float, str, None] = None,
    search_gap: Union[float, str, None] = None,
    dose_at: Optional[Literal["top", "middle", "bottom"]] = None,
    speed: Optional[str] = None,
    max_change: Union[float, str, None] = None,
    memory_bytes: Optional[int] = None,
) -> Layers:
    """Chooses the time of each layer that cures the fewest voxels wrongly. Images do not change.

    The keywords are the options of `lamp plan speed`, which `lamp plan speed --help` describes.
    The report has the times as `times_ms`, bottom first, and the bound on the best plan.
    """
    keywords = {
        "material": material,
        "lamp_intensity": lamp_intensity,
        "wanted": wanted,
        "dose_margin": dose_margin,
        "search_gap": search_gap,
        "dose_at": dose_at,
        "speed": speed,
        "max_change": max_change,
    }
    return _native.plan_speed(layers, keywords, memory_bytes=memory_bytes)


def plan_voxels(
    layers: LayersLike,
    *,
    material: Path,
    lamp_intensity: Optional[str] = None,
    wanted: Optional[int] = None,
    dose_margin: Union[float, str, None] = None,
    search_gap: Union[float, str, None] = None,
    dose_at: Optional[Literal["top", "middle", "bottom"]] = None,
    objective: Optional[Literal["wrong", "boundary"]] = None,
    min_level: Optional[int] = None,
    expose: Optional[str] = None,
    memory_bytes: Optional[int] = None,
) -> Layers:
    """Chooses the gray level of each pixel, so that as few voxels as possible are cured wrongly.

    The keywords are options of `lamp plan voxels`, which `lamp plan voxels --help` describes. The
    report has the voxels that are cured wrongly before and after, and the bound on the best plan.
    """
    keywords = {
        "material": material,
        "lamp_intensity": lamp_intensity,
        "wanted": wanted,
        "dose_margin": dose_margin,
        "search_gap": search_gap,
        "dose_at": dose_at,
        "objective": objective,
        "min_level": min_level,
        "expose": expose,
    }
    return _native.plan_voxels(layers, keywords, memory_bytes=memory_bytes)


def plan_column_cure(
    target: Path,
    *,
    projector: Path,
    material: Path,
    pixel: Optional[str] = None,
    full: Optional[str] = None,
    units: Optional[Literal["mm", "cm", "m", "um", "inch", "ft"]] = None,
    bitmaps: Optional[int] = None,
    gray: bool = False,
    optimize: Optional[Literal["dose", "height"]] = None,
    max_time: Optional[str] = None,
    dose_error: Union[float, str, None] = None,
    robust: Optional[str] = None,
    rays: Optional[str] = None,
    flat_field: Optional[Path] = None,
    voxel: Optional[str] = None,
    search_gap: Union[float, str, None] = None,
) -> Plan:
    """Chooses bitmaps and times that cure a part through glass, without layers.

    The keywords are the options of `lamp plan column-cure`, which `lamp plan column-cure --help`
    describes. `plan.bitmaps.measures` has the errors of heights and doses, `plan.best` those of the
    best times and the bound on them.
    """
    keywords = {
        "target": target,
        "projector": projector,
        "material": material,
        "pixel": pixel,
        "full": full,
        "units": units,
        "bitmaps": bitmaps,
        "gray": gray,
        "optimize": optimize,
        "max_time": max_time,
        "dose_error": dose_error,
        "robust": robust,
        "rays": rays,
        "flat_field": flat_field,
        "voxel": voxel,
        "search_gap": search_gap,
    }
    return _native.plan_column_cure(keywords)


def plan_ecpl(
    target: Path,
    *,
    projector: Path,
    material: Path,
    pixel: Optional[str] = None,
    full: Optional[str] = None,
    units: Optional[Literal["mm", "cm", "m", "um", "inch", "ft"]] = None,
    method: Optional[Literal["joint", "seed"]] = None,
) -> Plan:
    """Chooses bitmaps and times that cure an axisymmetric part, by the kinetics of resin and oxygen.

    The keywords are the options of `lamp plan ecpl`, which `lamp plan ecpl --help` describes.
    `plan.measures` has the errors of heights, `plan.profile` the heights over the distance from the
    axis.
    """
    keywords = {
        "target": target,
        "projector": projector,
        "material": material,
        "pixel": pixel,
        "full": full,
        "units": units,
        "method": method,
    }
    return _native.plan_ecpl(keywords)
