"""Stacks as read-only stores of Zarr, with the metadata of OME-Zarr: for napari, dask and others."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any, Union

if TYPE_CHECKING:
    from zarr.abc.store import Store

    from lamp_slicer._native import Stack


def zarr(stack: Union[str, os.PathLike[str], Stack]) -> Store:
    """Returns a stack as a read-only store of Zarr 3 (the package zarr must be installed).

    The store has a group with the metadata of OME-Zarr 0.5, and in it the array "0" with the axes
    z, y and x. Each of its chunks is a layer, which is read when it is asked for:

        group = zarr.open_group(lamp_slicer.zarr("blade.tif"), mode="r")
        layers = dask.array.from_zarr(group["0"])

    Scales are in micrometers: of z it is the mean thickness of the layers. The attribute "lamp" of
    the array lists the height and thickness of each. y counts down from the top row.
    """
    import lamp_slicer
    from lamp_slicer._zarr_store import StackStore

    opened = stack if isinstance(stack, lamp_slicer.Stack) else lamp_slicer.open(stack)
    return StackStore(opened)


def group_metadata(stack: Stack) -> dict[str, Any]:
    """Returns the metadata of the group: the axes and scales of OME-Zarr 0.5."""
    first = stack.info(0)
    pages = [stack.info(page) for page in range(len(stack))]
    thicknesses = [page.get("thickness_um") for page in pages]
    known = [thickness for thickness in thicknesses if thickness is not None]
    dpi = stack.dpi
    x_dpi, y_dpi = dpi if isinstance(dpi, tuple) else (dpi, dpi)
    z_um = sum(known) / len(known) if len(known) == len(pages) else None
    axes = [{"name": name, "type": "space"} for name in "zyx"]
    scale = [1.0, 1.0, 1.0]
    if x_dpi is not None and y_dpi is not None and z_um is not None:
        scale = [z_um, 25_400 / y_dpi, 25_400 / x_dpi]
        for axis in axes:
            axis["unit"] = "micrometer"
    transformations = [{"type": "scale", "scale": scale}]
    dataset = {"path": "0", "coordinateTransformations": transformations}
    name = first.get("stack", {}).get("part", "")
    multiscales = [{"name": name, "axes": axes, "datasets": [dataset]}]
    return {
        "zarr_format": 3,
        "node_type": "group",
        "attributes": {"ome": {"version": "0.5", "multiscales": multiscales}},
    }


def array_metadata(stack: Stack) -> dict[str, Any]:
    """Returns the metadata of the array: a chunk for each layer, as raw bytes."""
    layers, rows, columns = stack.shape
    pages = [stack.info(page) for page in range(layers)]
    keys = "layer", "z_um", "thickness_um", "exposure_ms"
    of_pages = {key: [page.get(key) for page in pages] for key in keys}
    return {
        "zarr_format": 3,
        "node_type": "array",
        "shape": [layers, rows, columns],
        "data_type": "uint8" if stack.is_gray else "bool",
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": [1, rows, columns]}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": "/"}},
        "fill_value": 0 if stack.is_gray else False,
        "codecs": [{"name": "bytes"}],
        "attributes": {"lamp": of_pages},
        "dimension_names": ["z", "y", "x"],
    }
