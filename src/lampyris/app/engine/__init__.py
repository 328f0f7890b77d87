"""The engines of the app: processes that plan, simulate and draw."""
