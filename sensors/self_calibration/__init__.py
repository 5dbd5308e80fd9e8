"""Sensor calibration from the recording itself, estimated before it is mapped.

All estimators share one `ScanTrack`: the laser tracked by its scans alone, compared with the wheels. This is
targetless extrinsic, temporal and intrinsic calibration from motion [Censi et al., "Simultaneous calibration
of odometry and sensor parameters for mobile robots", T-RO 2013], reduced to faults that would ruin the map.
Each is reported only where the evidence is overwhelming.
"""
