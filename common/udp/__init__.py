"""Rigs in other processes: one UDP packet each way per tick, its layout, and what is measured of the exchange."""
