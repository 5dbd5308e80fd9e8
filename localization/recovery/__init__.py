"""Recovery: detect that the car is lost, search for other places, and choose between hypotheses."""
