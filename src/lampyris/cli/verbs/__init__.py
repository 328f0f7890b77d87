"""One module a verb: its options, what it does, and the text it prints."""
