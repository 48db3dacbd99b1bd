"""Shadow volumes of any triangle soup: adjacency, silhouettes, sides, caps and culling."""
