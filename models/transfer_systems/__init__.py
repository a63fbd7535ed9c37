"""Models of what imposes the computed motion: dead time, hydraulic actuator, shaking table."""
