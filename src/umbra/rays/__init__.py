"""What lies on rays: what the eye sees, and what is between a place and the light."""
