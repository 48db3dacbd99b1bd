"""
Cities in tiles: any number of files, counted tile by tile in bounded memory, into one store.

    city_catalogue.py files, read once             CityFile, Catalogue
    file_geometry.py  their meshes on disk         FileGeometry
    city_layout.py    frame, ground, lattice       decided once for the whole city
    neighbourhood.py  what a window needs          PartScene, find_reaching
    count.py          one tile                     count_tile(job, tile), in any process
    receive.py        casters for suns of each height
    city_areas.py     named areas, as tasks beside the tiles
    surface_results.py walls and roofs of a tile    PartResults
    surface_pieces.py those of all tiles           SurfacePieces
    store.py          the results                  CityStore
    run.py            all tiles                    run_job, with any engine

Everything is computed in one frame, on one lattice: the bytes of a result do not depend on the
tiles, nor on the processes that count them.
"""
