"""Rules for plans of certain kinds: any-angle lines, schedules, via points."""
