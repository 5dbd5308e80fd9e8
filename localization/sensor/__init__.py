"""Sensor models: how well a scan at a pose fits the map."""
