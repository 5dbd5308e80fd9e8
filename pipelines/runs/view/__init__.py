"""What a run recorded, and what there is to see of it."""
