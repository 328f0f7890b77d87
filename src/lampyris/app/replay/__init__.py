"""Replays: one HTML file with a run in it, which is played by the modules of the app's page.

``bundle`` puts these modules into one script, ``streams`` puts runs into the frames that they read, ``page`` makes the file.
"""
