"""Opens the mission records of scenecast."""

from .label_map import LabelMap
from .mission import Mission
from .record import DamagedRecord, Record

__all__ = ["DamagedRecord", "LabelMap", "Mission", "Record"]
__version__ = "0.1.0"
