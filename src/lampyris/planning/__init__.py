"""Planners: from a :class:`~lampyris.model.scene.Scene` to a :class:`~lampyris.model.plan.Plan`."""
