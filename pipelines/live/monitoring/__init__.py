"""How a node is: what is wrong, how well it keeps up, and what it reports of both."""
