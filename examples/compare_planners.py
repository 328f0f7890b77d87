"""The same query by every planner that is installed: exact cost, gap and work done."""

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-1"), start=(37, 8), goal=(5, 38))
for name in lampyris.list_planners():
    plan = lampyris.plan(scene, planner=name, seed=1)
    print(
        f"{name:19} {plan.status:8} cost {plan.cost:7.3f}, gap {plan.gap:6.2%}, expansions {plan.expansions}"
    )
greedy = lampyris.plan(scene, choice="greedy")
exact = lampyris.plan(scene, choice="exact")
print(f"ad-gso: greedy {greedy.cost:.3f}, exact choice {exact.cost:.3f}")
