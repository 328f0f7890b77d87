"""Settings of planners, tuned on the queries of a study by Optuna (the extra ``tune``)."""
