"""The building of a client of OpenSees or OpenFresco in place of the plan's: elements, their laboratories, the pace."""
