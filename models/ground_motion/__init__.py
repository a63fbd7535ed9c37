"""Ground motions: records that ship or that the user brings, their readers, and the motion of the table."""

from models.ground_motion.at2 import read_at2
from models.ground_motion.csv import read_csv
from models.ground_motion.knet import read_knet
from models.ground_motion.motions import MOTIONS, load
from models.ground_motion.record import GAL, STANDARD_GRAVITY, GroundMotion
from models.ground_motion.resample import ground, ground_displacement, resample

__all__ = [
    "GAL",
    "MOTIONS",
    "STANDARD_GRAVITY",
    "GroundMotion",
    "ground",
    "ground_displacement",
    "load",
    "read_at2",
    "read_csv",
    "read_knet",
    "resample",
]
