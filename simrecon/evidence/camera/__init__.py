"""What is known of the camera: files of calibrations, a field of view, or a usual lens."""
