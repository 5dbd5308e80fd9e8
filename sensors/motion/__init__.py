"""Motion from wheels, gyroscope and scans, with its systematic errors and noise."""
