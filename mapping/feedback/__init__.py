"""What the verdict on a finished map finds is acted on before the map is given out."""
