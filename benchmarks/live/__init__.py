"""How well the nodes keep up while a bag is played."""
