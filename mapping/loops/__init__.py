"""Loop closure: recognize earlier places, match and verify them."""
