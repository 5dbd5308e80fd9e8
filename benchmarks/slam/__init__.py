"""The mapper on the logs of the SLAM benchmark, and on a long drive."""
