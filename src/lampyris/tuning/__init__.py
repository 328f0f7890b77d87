"""Settings of planners and speed laws, tuned on the queries of a study by Optuna (the extra ``tune``)."""
