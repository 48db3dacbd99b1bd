"""What a run made and the next one can use: scenes that take long to read."""

from umbra.cache.folder import LIMIT, find_folder, measure
from umbra.cache.scenes import Beside, keep_scene, load_scene

__all__ = ["LIMIT", "Beside", "find_folder", "keep_scene", "load_scene", "measure"]
