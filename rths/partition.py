"""How much delay the partition of a plan bears, for the rooms above the laboratories."""

from models.structures.partition import Partition, assess, critical_delay_of

__all__ = ["Partition", "assess", "critical_delay_of"]
