"""GeoTIFFs of a study in tiles, one for each tile, and a virtual raster over them."""

from collections.abc import Callable, Iterator
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

from umbra.folders.atomic import replace_file
from umbra.writers.city.sealed_files import SealedFiles
from umbra.writers.city.store_window import CityResult, StoredTile
from umbra.writers.vectors.gis_files import find_crs, write_geotiff

__all__ = ["write_rasters"]

_FOLDER, _VIRTUAL = "geotiff", "hours.vrt"
_BLOCK = 256


def write_rasters(
    result: CityResult, progress: Callable[[int, int], object] = lambda _done, _all: None
) -> list[Path]:
    """
    Write a cloud-optimised GeoTIFF with overviews for each tile that is done, and ``hours.vrt``.

    A file that is as it was written of the same results is left as it is.

    Parameters
    ----------
    result : CityResult
    progress : callable
        Called with the number of tiles done and of all that are to be written.

    Returns
    -------
    paths : list of Path
        The VRT first.
    """
    done = list(result.find_done())
    folder = result.folder / _FOLDER
    written = []
    with SealedFiles(folder) as sealed:
        for n, tile in enumerate(done):
            path, mark = folder / f"{tile.name}.tif", result.marks[tile.number]
            if not sealed.is_whole(path, mark):
                _write_tile(result, tile, path)
                sealed.add(path, mark)
            written.append(path)
            progress(n + 1, len(done))
    virtual = result.folder / _VIRTUAL
    with replace_file(virtual) as beside, beside.open("w", encoding="utf-8") as file:
        file.writelines(_describe(result, done))
    return [virtual, *written]


def _write_tile(result: CityResult, tile: StoredTile, path: Path) -> None:
    """Write one tile as a GeoTIFF."""
    bands = [(name, unit, result.read(name, tile)) for name, unit in result.bands.items()]
    with replace_file(path) as beside:
        write_geotiff(
            beside, result.x[tile.cols], result.y[tile.rows], bands,
            cell=result.cell, crs=result.facts.get("crs"), facts=result.facts,
        )  # fmt: skip


def _describe(result: CityResult, done: list[StoredTile]) -> Iterator[str]:
    """Write a virtual raster of the tiles, rows from the north."""
    (dx, dy), (west, _, _, north) = result.cell, result.extent
    rows, cols = len(result.y), len(result.x)
    yield f'<VRTDataset rasterXSize="{cols}" rasterYSize="{rows}">\n'
    system = find_crs(result.facts.get("crs"))
    if system is not None:
        yield f'<SRS dataAxisToSRSAxisMapping="1,2">{escape(system.to_wkt())}</SRS>\n'
    yield f"<GeoTransform>{west!r}, {dx!r}, 0.0, {north!r}, 0.0, {-dy!r}</GeoTransform>\n"
    for band, (name, unit) in enumerate(result.bands.items(), 1):
        yield (
            f'<VRTRasterBand dataType="Float32" band="{band}">\n'
            f"<Description>{escape(name)}</Description><UnitType>{escape(unit)}</UnitType>"
            "<NoDataValue>nan</NoDataValue>\n"
        )
        for tile in done:
            wide, high = tile.cols.stop - tile.cols.start, tile.rows.stop - tile.rows.start
            offset = f'xOff="{tile.cols.start}" yOff="{rows - tile.rows.stop}"'
            size = f'xSize="{wide}" ySize="{high}"'
            yield (
                '<SimpleSource><SourceFilename relativeToVRT="1">'
                f"{_FOLDER}/{tile.name}.tif</SourceFilename><SourceBand>{band}</SourceBand>"
                f'<SourceProperties RasterXSize="{wide}" RasterYSize="{high}" DataType="Float32" '
                f"BlockXSize={quoteattr(str(_BLOCK))} BlockYSize={quoteattr(str(_BLOCK))}/>"
                f'<SrcRect xOff="0" yOff="0" {size}/><DstRect {offset} {size}/></SimpleSource>\n'
            )
        yield "</VRTRasterBand>\n"
    yield "</VRTDataset>\n"
