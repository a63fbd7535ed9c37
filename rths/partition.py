"""What a plan's partition can bear, for whoever works above the laboratories."""

from models.structures.partition import Partition, assess, critical_delay_of

__all__ = ["Partition", "assess", "critical_delay_of"]
