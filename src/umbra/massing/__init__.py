"""
How high one may build: the greatest heights over a plot that keep rules of sunlight.

    plot.py     cells of a plot, and the ground under them
    needs.py    what rules ask of each receiver: lit pieces of time, and how many must remain
    planes.py   the height up to which each piece stays clear of each cell
    bounds.py   upper bounds: of each cell alone, and of the whole volume by prices
    choice.py   which pieces to keep: exact where nothing is to be chosen, else a search
    filling.py  raising cells until each is capped or bound
    solid.py    the heights as one closed mesh
    verify.py   an exact study with that mesh in the scene
"""
