"""The store itself, apart from `_zarr`, since it needs the package zarr."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator, Iterable
from typing import TYPE_CHECKING, Optional

from zarr.abc.store import (
    ByteRequest,
    OffsetByteRequest,
    RangeByteRequest,
    Store,
    SuffixByteRequest,
)
from zarr.core.buffer import Buffer, BufferPrototype, default_buffer_prototype

from lamp_slicer._zarr import array_metadata, group_metadata

if TYPE_CHECKING:
    from lamp_slicer._native import Stack


class StackStore(Store):
    """A stack as a store: `zarr.json` of a group, `0/zarr.json` of an array, and its chunks."""

    supports_writes = False
    supports_deletes = False
    supports_listing = True

    def __init__(self, stack: Stack) -> None:
        super().__init__(read_only=True)
        self.stack = stack
        self._layers = stack.shape[0]
        self._texts = {
            "zarr.json": json.dumps(group_metadata(stack)).encode(),
            "0/zarr.json": json.dumps(array_metadata(stack)).encode(),
        }

    def __eq__(self, other: object) -> bool:
        return isinstance(other, StackStore) and other.stack is self.stack

    def __repr__(self) -> str:
        return f"StackStore({str(self.stack.path)!r})"

    def _layer_of(self, key: str) -> Optional[int]:
        """Returns the layer of a chunk's key, such as `0/c/812/0/0`."""
        words = key.split("/")
        if len(words) != 5 or words[:2] != ["0", "c"] or words[3:] != ["0", "0"]:
            return None
        layer = int(words[2]) if words[2].isdecimal() else self._layers
        return layer if layer < self._layers and str(layer) == words[2] else None

    def _read(self, layer: int) -> bytes:
        image = self.stack.array(layer)
        if self.stack.is_gray and image.dtype == bool:
            # Layers of a gray stack may be black and white.
            image = image.astype("uint8") * 255
        return image.tobytes()

    async def get(
        self,
        key: str,
        prototype: Optional[BufferPrototype] = None,
        byte_range: Optional[ByteRequest] = None,
    ) -> Optional[Buffer]:
        content = self._texts.get(key)
        layer = self._layer_of(key)
        if layer is not None:
            # The lock of Python is free while a layer is read, so threads help.
            content = await asyncio.to_thread(self._read, layer)
        if content is None:
            return None
        match byte_range:
            case RangeByteRequest(start, end):
                content = content[start:end]
            case OffsetByteRequest(offset):
                content = content[offset:]
            case SuffixByteRequest(suffix):
                content = content[-suffix:] if suffix else b""
        return (prototype or default_buffer_prototype()).buffer.from_bytes(content)

    async def get_partial_values(
        self,
        prototype: BufferPrototype,
        key_ranges: Iterable[tuple[str, Optional[ByteRequest]]],
    ) -> list[Optional[Buffer]]:
        return [await self.get(key, prototype, byte_range) for key, byte_range in key_ranges]

    async def exists(self, key: str) -> bool:
        return key in self._texts or self._layer_of(key) is not None

    async def set(self, key: str, value: Buffer) -> None:
        self._check_writable()

    async def delete(self, key: str) -> None:
        self._check_writable()

    async def list(self) -> AsyncIterator[str]:
        for key in self._texts:
            yield key
        for layer in range(self._layers):
            yield f"0/c/{layer}/0/0"

    async def list_prefix(self, prefix: str) -> AsyncIterator[str]:
        async for key in self.list():
            if key.startswith(prefix):
                yield key

    async def list_dir(self, prefix: str) -> AsyncIterator[str]:
        folder = prefix.rstrip("/") + "/" if prefix else ""
        seen = set()
        async for key in self.list_prefix(folder):
            name = key[len(folder) :].split("/")[0]
            if name not in seen:
                seen.add(name)
                yield name
