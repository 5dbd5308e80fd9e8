"""Motion from wheels, gyroscope and scans, its faults and its noise."""
