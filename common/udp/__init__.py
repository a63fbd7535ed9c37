"""Rigs in other processes: one UDP packet each way per tick, their layout, and the statistics of the exchange."""
