"""What imposes the computed motion on a specimen: dead time, hydraulic actuator, shaking table."""
