"""Laboratory A: integrates the building and drives the actuator that deforms the column."""
