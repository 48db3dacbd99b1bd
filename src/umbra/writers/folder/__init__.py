"""What a study writes into its folder: the result, pictures, and further files."""
