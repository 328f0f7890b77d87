"""The execution of a study: workers, pools, clusters, and the check of each result."""
