"""The threads of a node: what waits for them, what is due, and the memory they leave."""
