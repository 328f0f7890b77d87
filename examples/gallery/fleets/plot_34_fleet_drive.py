"""
A fleet that is late and does not collide
=========================================

The plan is driven with random delays; the order of visits is kept, so delays cost time only.
"""

import matplotlib.pyplot as plt

import lampyris

fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), 10, seed=1)
figure, ax = plt.subplots(figsize=(8, 4), constrained_layout=True)
for chance in (0.0, 0.1, 0.3):
    trace = lampyris.simulate_fleet(fleet, delays=lampyris.Delays(chance, duration=3.0), seed=1)
    ax.plot(
        sorted(trace.arrivals), range(1, 11), "o-", label=f"{chance:.0%} delayed, {trace.contacts} contacts"
    )
ax.set(xlabel="time (s)", ylabel="robots arrived")
ax.legend()
plt.show()
