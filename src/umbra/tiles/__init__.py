"""
Cities in tiles: any number of files, counted tile by tile in bounded memory, into one store.

    catalogue.py      files, read once             CityFile, Catalogue
    geometry.py       their meshes on disk         FileGeometry
    layout.py         frame, ground, lattice       decided once for the whole city
    reach.py          which boxes can cast onto which
    neighbourhood.py  what a window needs          PartScene
    count.py          one tile                     count_tile(job, tile), in any process
    sun_groups.py     casters for suns of each height
    surfaces.py       walls and roofs of a tile    PartResults
    pieces.py         those of all tiles           SurfacePieces
    store.py          the results                  CityStore
    run.py            all tiles                    run_job, with any engine

Everything is computed in one frame, on one lattice: the bytes of a result do not depend on the
tiles, nor on the processes that count them.
"""
