"""FlatCityBuf: features of CityJSON with an index, of which only those in the region are read."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from umbra.errors import InputError
from umbra.packages import need
from umbra.readers.budget import Budget
from umbra.readers.checks import Losses, find_reason, list_counts
from umbra.readers.cityjson import Templates, make_parts
from umbra.readers.content import FileContent
from umbra.readers.georeference import name_crs
from umbra.readers.model import FileModel, ReadChoices, turn_up
from umbra.readers.region import Region

__all__ = ["read_flatcitybuf"]

_CORNER = 40  # memory of a vertex in lists [byte]


def read_flatcitybuf(_: FileContent, path: Path, choices: ReadChoices) -> FileModel:
    """Read FlatCityBuf; with a region by its index, else one feature after another."""
    fcb = need("flatcitybuf", "city", "FlatCityBuf")
    counts = Losses()
    try:
        reader = fcb.FcbReader.open_file(path)
        head = fcb.to_cityjson_metadata(reader.header)
        crs = name_crs(head.get("metadata", {}).get("referenceSystem"))
        hits = _find_features(fcb, reader, choices.region, crs)
        features = _list_documents(fcb, reader, head, hits, choices.budget)
        parts = make_parts(
            features, Templates(None, choices.budget), counts, lambda n: f"feature {n - 1}: "
        )
    except fcb.FcbError as error:
        reason = find_reason(error, 160)
        msg = f"is damaged FlatCityBuf ({reason}); fetch or export it again"
        raise InputError(msg) from error
    outside = 0
    if choices.region is not None and reader.header.info.index_node_size:
        outside = max(reader.header.info.features_count - len(hits), 0)
    version = reader.header.info.cityjson_version
    return FileModel(
        f"FlatCityBuf {version}".strip(), turn_up(parts, choices.up), crs, list_counts(counts),
        outside=outside,
    )  # fmt: skip


def _find_features(fcb: Any, reader: Any, region: Region | None, crs: str | None) -> Any:
    """Return features, or their places in the file if an index finds those in a region."""
    info = reader.header.info
    if region is None or not info.index_node_size:
        return reader.select_all()
    layout = reader.header.layout
    box = region.settle(crs).find_box(crs)
    return fcb.search_rtree(
        reader.range_reader, layout.rtree_begin, info.features_count, info.index_node_size, box
    )


def _list_documents(
    fcb: Any, reader: Any, head: dict[str, Any], hits: Any, budget: Budget
) -> Iterator[dict[str, Any]]:
    """Return the header and then features as in a CityJSON sequence."""
    yield head
    for hit in hits:
        feature = hit if isinstance(hit, fcb.Feature) else reader.feature_at(hit)
        document = fcb.to_cityjson_feature(feature, reader.header)
        budget.spend(_CORNER * len(document.get("vertices", ())), "coordinates")
        yield document
