"""What a recording itself proves about its sensors, learned before it is mapped.

All estimators work on one `ScanTrack`: the laser followed by its scans alone, with the wheels beside it. This
is targetless extrinsic, temporal and intrinsic calibration from motion [Censi et al., "Simultaneous
calibration of odometry and sensor parameters for mobile robots", T-RO 2013], reduced to the questions that
decide whether a map can become right, and each answered only where the evidence is overwhelming.
"""
