"""Private helpers that every package may use: cancellation, limits, locks, values and arrays, elementary functions."""
