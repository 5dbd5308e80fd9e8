"""Everything that touches the world: bags, simulator, reports, pictures, the command line."""
