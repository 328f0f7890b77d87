"""Continuous swarm optimisers with an ask/tell interface; they know nothing of maps.

``settings.start(box, rng)`` makes a swarm; ``swarm.ask()`` says where it wants the function's values, and
``swarm.tell(values)`` moves it on. **The greater a value, the better.** Anyone who looks for a least value
calls :func:`lampyris.planning.swarm.optimisers.loop.minimise`, which turns the sign, once.
"""
