"""The kind `column`: a hydraulic actuator that deforms a specimen."""
