"""AD-GSO, the planner of the dissertation: settings, session, walk, layers of other costs."""
