"""Write results: pictures, NetCDF, and the folder that holds them. Import the module you need."""
