"""Arrays that are computed when they are read, as variables of a dataset."""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing

from umbra.receivers.on_demand import OnDemand

__all__ = ["wrap_lazily"]


class _Reader(BackendArray):
    """Reads parts of an array for xarray, as a file's reader does."""

    def __init__(self, array: Any) -> None:
        self.array, self.shape, self.dtype = array, array.shape, array.dtype

    def __getitem__(self, key: indexing.ExplicitIndexer) -> Any:
        basic = indexing.IndexingSupport.BASIC
        return indexing.explicit_indexing_adapter(key, self.shape, basic, self._read)

    def _read(self, key: Any) -> NDArray:
        values: NDArray = self.array[key]
        return values

    def __reduce__(self) -> tuple[Any, ...]:
        return _Reader, (np.asarray(self.array),)


def wrap_lazily(array: OnDemand) -> Any:
    """Return an array that a dataset computes when it is first read, and then keeps."""
    return indexing.MemoryCachedArray(indexing.LazilyIndexedArray(_Reader(array)))
