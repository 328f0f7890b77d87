"""``lampyris swarm``: robots that look for sources together."""
