"""Models of transfer systems, which impose the computed motion: dead time, hydraulic actuators."""
