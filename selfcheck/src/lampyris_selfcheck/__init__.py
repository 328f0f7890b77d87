"""Checks of lampyris, each a command: ``lampyris selfcheck NAME``.

Each check asks many seeded questions, judges every answer by a stranger to the code that gave it (a slow reference
of :mod:`lampyris_selfcheck.reference`, the referee, a published length) and says how many cases it tried and how
many failed. Three sizes: ``commit`` is part of ``make test``, ``nightly`` of ``make check-nightly``,
``release`` takes hours.
"""
