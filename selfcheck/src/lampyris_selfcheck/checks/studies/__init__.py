"""Checks of studies and their stores: damage, kills, failing disks."""
