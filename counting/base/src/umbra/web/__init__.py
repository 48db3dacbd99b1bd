"""Live exact shadows in a browser: a scene as one packed block, and a WebGL2 renderer of it."""
