"""Loop closure over submaps."""
