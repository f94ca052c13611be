"""CAD parts to the layer images of projection photopolymerization.

Stages take layers and give layers. A chain of stages runs natively, a layer at a time, when its
layers are written or iterated over:

    import lamp_slicer as lamp

    layers = lamp.slice("blade.stl", dpi=1500, thickness="100um")
    lamp.write("blade.tif", lamp.dither(lamp.fix(layers)))

    stack = lamp.open("blade.tif")
    image = stack[100].array()

Keywords are the options of the program with `_` for `-`. Lengths are texts with a unit, such as
"100um"; shares are numbers, such as 0.25; angles are in degrees.
"""

from lamp_slicer._errors import (
    LampError,
    LampFileError,
    LampFileNotFoundError,
    LampNote,
    LampSettingsError,
    LampWarning,
)
from lamp_slicer._native import VERSION as __version__
from lamp_slicer._native import Layer, Layers, Stack
from lamp_slicer._plan import plan_column_cure, plan_ecpl, plan_speed, plan_voxels
from lamp_slicer._records import Feature, Finding, Findings, Plan, Record, Runs
from lamp_slicer._slice import slice
from lamp_slicer._stages import check, compensate, dither, edit, fix, layers, open, tile, write
from lamp_slicer._zarr import zarr

__all__ = [
    "Feature",
    "Finding",
    "Findings",
    "LampError",
    "LampFileError",
    "LampFileNotFoundError",
    "LampNote",
    "LampSettingsError",
    "LampWarning",
    "Layer",
    "Layers",
    "Plan",
    "Record",
    "Runs",
    "Stack",
    "check",
    "compensate",
    "dither",
    "edit",
    "fix",
    "layers",
    "open",
    "plan_column_cure",
    "plan_ecpl",
    "plan_speed",
    "plan_voxels",
    "slice",
    "tile",
    "write",
    "zarr",
]
