"""Sensor models: how well a scan fits what the map says from a pose."""
