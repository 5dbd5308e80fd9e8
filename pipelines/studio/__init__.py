"""The studio: a page in the browser of this machine to look at runs and to drive a simulated car."""
