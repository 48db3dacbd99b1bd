"""Writers of results: pictures, NetCDF, and their folder. Import the module you need."""
