"""Many bags mapped at once, and the page that shows what became of each."""
