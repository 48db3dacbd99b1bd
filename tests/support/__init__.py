"""What several tests share: shapes, places that are seen, and a ray caster to judge by."""
