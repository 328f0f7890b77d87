"""The analysis of a study: summaries, intervals, comparisons, exports."""
