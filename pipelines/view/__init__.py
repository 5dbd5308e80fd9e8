"""A run in the browser, and the recording that it is shown from."""
