"""Align the estimate with walls, and learn where their surface is."""
