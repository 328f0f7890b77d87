"""The app: a page in the browser, a small server on this machine, and engines that do the work.

The server knows no algorithm. It checks the client, hands the question to an engine (a process of its own, with
limits) and streams what comes back. The page draws the same nouns that the reports draw.
"""
