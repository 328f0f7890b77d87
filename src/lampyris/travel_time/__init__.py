"""Travel time: the path that is driven in the least time under the static caps of a speed law."""
