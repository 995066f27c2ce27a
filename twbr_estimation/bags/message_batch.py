"""Raw messages of one topic as they lie in a buffer, without a Python object each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from .unpacking import Allowance, DamagedError, unpacked_message

IntArray = NDArray[np.int64]

ZSTD_MAGIC = 0xFD2FB528


@dataclass(frozen=True, slots=True)
class MessageBatch:
    """Serialised messages inside one buffer."""

    data: NDArray[np.uint8]
    """The buffer, for example one decompressed chunk."""
    offsets: IntArray
    """Offset of each message in `data`, (n,)."""
    sizes: IntArray
    """Length of each message [bytes], (n,)."""
    bag_times: IntArray
    """When each message was recorded [ns], (n,)."""

    def at(self, indices: IntArray, dtype: DTypeLike) -> NDArray[Any]:
        """Return the numbers of type `dtype` that start at these bytes of `data`."""
        item = np.dtype(dtype)
        count = max(self.data.size - item.itemsize + 1, 0)
        every_byte = np.ndarray((count,), dtype=item, buffer=self.data, strides=(1,))
        return np.asarray(every_byte[indices])

    def message(self, index: int) -> bytes:
        """Return one message's bytes."""
        start = int(self.offsets[index])
        return self.data[start : start + int(self.sizes[index])].tobytes()

    def take(self, chosen: NDArray[np.bool_]) -> MessageBatch:
        """Return the chosen messages, in the same buffer."""
        return MessageBatch(
            self.data, self.offsets[chosen], self.sizes[chosen], self.bag_times[chosen]
        )

    def decompressed(self, allowance: Allowance) -> tuple[MessageBatch, int]:
        """Undo rosbag2's compression of single messages, recognised by zstd's magic number.

        Returns:
            The plain messages, and how many were left out as damaged.

        Raises:
            RecordingError: they unpack to more than the allowance.
        """
        packed = self.sizes >= 4
        packed[packed] = self.at(self.offsets[packed], "<u4") == ZSTD_MAGIC
        if 2 * np.count_nonzero(packed) <= packed.size:
            return self, 0
        plain: list[bytes] = []
        for index in np.flatnonzero(packed).tolist():
            try:
                plain.append(unpacked_message(self.message(index), allowance))
            except DamagedError:
                packed[index] = False
        return joined(plain, self.bag_times[packed]), packed.size - len(plain)


def joined(messages: Sequence[bytes], bag_times: IntArray) -> MessageBatch:
    """Return separate messages as one batch."""
    sizes = np.fromiter(map(len, messages), dtype=np.int64, count=len(messages))
    data = np.frombuffer(b"".join(messages), dtype=np.uint8)
    return MessageBatch(data, np.cumsum(sizes) - sizes, sizes, bag_times)
