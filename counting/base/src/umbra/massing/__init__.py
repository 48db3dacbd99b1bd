"""
How high one may build: the greatest heights over a plot that keep rules of sunlight.

    plot.py     cells of a plot, and the ground under them
    rule_asks.py  rules as asks: which receivers must keep which hours
    planes.py   what each receiver needs: pieces of lit time, and the height up to which each
                stays clear of each cell
    upper_bounds.py  upper bounds: of each cell alone, and of the whole volume by prices
    piece_choice.py  which pieces to keep: exact where nothing is to be chosen, else a search
    solid.py    the heights as one closed mesh
    search.py   all of it, verified by an exact study with that mesh in the scene
"""
