"""Result and settings files."""
