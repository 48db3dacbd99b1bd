"""Arrays of results that are computed when they are read, and take no memory until then."""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

__all__ = ["OnDemand"]


class OnDemand:
    """
    An array that is computed whenever it is read.

    Parameters
    ----------
    shape : tuple of int
    dtype : dtype
    make : callable
        Returns the whole array, which the reader may write to.
    """

    def __init__(
        self, shape: tuple[int, ...], dtype: DTypeLike, make: Callable[[], NDArray]
    ) -> None:
        self.shape, self.dtype, self._make = shape, np.dtype(dtype), make

    @property
    def ndim(self) -> int:
        """Number of axes."""
        return len(self.shape)

    @property
    def size(self) -> int:
        """Number of values."""
        return int(np.prod(self.shape))

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, key: Any) -> NDArray:
        return self._make()[key]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray:
        values = self._make()
        return values if dtype is None else values.astype(dtype, copy=False)
