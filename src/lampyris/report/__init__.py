"""Pictures, films and tables of any plan or trace, from any source. Imports only the nouns."""
