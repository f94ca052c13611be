"""Plans of exposures, from the doses of all layers together."""

from __future__ import annotations

from typing import Literal, Optional, Union

from lamp_slicer import _native
from lamp_slicer._native import Layers
from lamp_slicer._stages import LayersLike, Path


def plan_speed(
    layers: LayersLike,
    *,
    material: Path,
    lamp_intensity: Optional[str] = None,
    wanted: Optional[int] = None,
    margin: Union[float, str, None] = None,
    gap: Union[float, str, None] = None,
    at: Optional[Literal["top", "middle", "bottom"]] = None,
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
        "margin": margin,
        "gap": gap,
        "at": at,
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
    margin: Union[float, str, None] = None,
    gap: Union[float, str, None] = None,
    at: Optional[Literal["top", "middle", "bottom"]] = None,
    objective: Optional[Literal["wrong", "boundary"]] = None,
    min_level: Optional[int] = None,
    exposure: Optional[str] = None,
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
        "margin": margin,
        "gap": gap,
        "at": at,
        "objective": objective,
        "min_level": min_level,
        "exposure": exposure,
    }
    return _native.plan_voxels(layers, keywords, memory_bytes=memory_bytes)
