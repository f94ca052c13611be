"""The native half. `lamp_slicer` has its functions with their keywords."""

import builtins
import os
from collections.abc import Iterator
from typing import Any, Optional, Union, overload

import numpy as np
from numpy.typing import DTypeLike, NDArray

from lamp_slicer._records import Plan, Record, Runs

VERSION: str

class Layer:
    """One layer: its image and the metadata of its page. It is not changed once made."""

    @property
    def index(self) -> int:
        """The layer's index, 0 at the bottom."""
    @property
    def z_um(self) -> Optional[float]:
        """The height of the layer's bottom in micrometers, if it is known."""
    @property
    def thickness_um(self) -> Optional[float]:
        """The layer's thickness in micrometers, if it is known."""
    @property
    def exposure_ms(self) -> Optional[float]:
        """The layer's exposure time in milliseconds, if it is known."""
    @property
    def origin_mm(self) -> Optional[tuple[float, float]]:
        """x and y of the image's top left corner in part coordinates in millimeters, if known."""
    @property
    def dpi(self) -> Union[float, tuple[float, float], None]:
        """The resolution in dots per inch, if it is known; along x and y if they differ."""
    @property
    def shape(self) -> tuple[int, int]:
        """The numbers of rows and columns, as of the array."""
    @property
    def is_gray(self) -> bool:
        """Whether the image is gray; otherwise it is black and white."""
    @property
    def info(self) -> Record:
        """The metadata of the page."""
    @property
    def runs(self) -> Runs:
        """The image as runs."""
    @property
    def exposed_px(self) -> int:
        """The number of pixels that are not black."""
    def array(self) -> NDArray[Union[np.bool_, np.uint8]]:
        """The image as a new array: bool if it is black and white, uint8 if it is gray."""
    def __array__(
        self, dtype: Optional[DTypeLike] = None, copy: Optional[bool] = None
    ) -> NDArray[Any]: ...

class Layers(Iterator[Layer]):
    """An iterator over layers, bottom first. Work begins with the first layer that is asked for."""

    def __iter__(self) -> Layers: ...
    def __next__(self) -> Layer: ...
    @property
    def reports(self) -> Optional[list[Record]]:
        """The reports of the stages, once the last layer is through."""

class Stack:
    """A stack of layers, bottom first. Images are read when they are asked for."""

    def __len__(self) -> int: ...
    @overload
    def __getitem__(self, index: int) -> Layer: ...
    @overload
    def __getitem__(self, index: builtins.slice) -> Layers: ...
    def __iter__(self) -> Layers: ...
    def array(self, index: int) -> NDArray[Union[np.bool_, np.uint8]]:
        """The image of a layer as a new array: bool if black and white, uint8 if it is gray."""
    def runs(self, index: int) -> Runs:
        """The image of a layer as runs."""
    def info(self, index: int = 0) -> Record:
        """The metadata of a layer's page. Its image is not read."""
    @property
    def dpi(self) -> Union[float, tuple[float, float], None]:
        """The resolution of the first layer in dots per inch, if it is known; along x and y if they
        differ."""
    @property
    def shape(self) -> tuple[int, int, int]:
        """The numbers of layers, rows and columns. Raises an error if images differ in size."""
    @property
    def is_gray(self) -> bool:
        """Whether any image is gray; otherwise all are black and white."""
    @property
    def path(self) -> os.PathLike[str]:
        """The path that was opened."""

Path = Union[str, os.PathLike[str]]

def run_program(program: str, words: list[str], stage: Optional[str]) -> int: ...
def open(path: Path) -> Stack: ...
def layers(
    arrays: Any, *, dpi: Union[float, str, None], thickness: Optional[str], name: Optional[str]
) -> Layers: ...
def slice(
    part: Any,
    keywords: dict[str, Any],
    *,
    name: Optional[str],
    machine: Optional[Path],
    layers: Optional[range],
    memory_bytes: Optional[int],
    fallback: Optional[Path],
) -> Layers: ...
def fix(layers: Any, keywords: dict[str, Any]) -> Layers: ...
def dither(layers: Any, keywords: dict[str, Any]) -> Layers: ...
def compensate(layers: Any, keywords: dict[str, Any]) -> Layers: ...
def edit(layers: Any, edits: Path) -> Layers: ...
def tile(parts: Any, keywords: dict[str, Any]) -> Layers: ...
def plan_speed(
    layers: Any, keywords: dict[str, Any], *, memory_bytes: Optional[int]
) -> Layers: ...
def plan_voxels(
    layers: Any, keywords: dict[str, Any], *, memory_bytes: Optional[int]
) -> Layers: ...
def plan_column_cure(keywords: dict[str, Any]) -> Plan: ...
def plan_ecpl(keywords: dict[str, Any]) -> Plan: ...
def check(layers: Any, keywords: dict[str, Any]) -> Record: ...
def write(
    path: Path,
    layers: Any,
    *,
    dpi: Union[float, str, None],
    thickness: Optional[str],
    name: Optional[str],
    classic: bool,
    force: bool,
) -> list[Record]: ...
