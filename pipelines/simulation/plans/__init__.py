"""Floor plans, drawn by the project itself."""
