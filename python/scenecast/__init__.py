"""Opens the mission records of scenecast, and running surfaces."""

from .label_map import LabelMap
from .mission import Mission
from .record import DamagedRecord, Record
from .surface import Surface, SurfaceError, open_surface

__all__ = ["DamagedRecord", "LabelMap", "Mission", "Record", "Surface", "SurfaceError", "open_surface"]
__version__ = "0.1.0"
