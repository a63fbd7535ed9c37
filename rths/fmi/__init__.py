"""FMI 3.0 both ways: an FMU as a rig or as a specimen, and an emulated laboratory as an FMU."""

from rths.fmi.rig import Rig, Specimen

__all__ = ["Rig", "Specimen"]
