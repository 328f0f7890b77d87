"""Where the planners of this package are: a planner is one module and one row here.

Planners of other packages are found by entry points. Reading those means reading the metadata of all installed packages, which
takes 15 ms, a tenth of a short call; so it is done only for names that are not in these tables. What another package registers
under one of these names is not used.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

CELLS: Mapping[str, str] = MappingProxyType(
    {
        "ad-gso": "lampyris.planning.adgso.ad_gso:AdGso",
        "ant-system": "lampyris.planning.swarm.ant_system:AntSystem",
        "apso": "lampyris.planning.swarm.pso:APso",
        "astar": "lampyris.planning.graph.astar:AStar",
        "bidirectional-astar": "lampyris.planning.graph.bidirectional_astar:BidirectionalAStar",
        "bit-star": "lampyris.planning.sampling.rrt_star:BitStar",
        "dijkstra": "lampyris.planning.graph.dijkstra:Dijkstra",
        "diversity-pso": "lampyris.planning.swarm.pso:DiversityPso",
        "dstar": "lampyris.planning.incremental.dstar:DStar",
        "dstar-lite": "lampyris.planning.incremental.dstar_lite:DStarLite",
        "dstar-lpso": "lampyris.planning.swarm.dstar_lpso:DstarLpso",
        "dstar16-lpso": "lampyris.planning.swarm.dstar_lpso:Dstar16Lpso",
        "fastest": "lampyris.planning.graph.fastest:Fastest",
        "fastest-time": "lampyris.travel_time.fastest_time:FastestTime",
        "focussed-dstar": "lampyris.planning.incremental.focussed_dstar:FocussedDStar",
        "gso": "lampyris.planning.swarm.gso:Gso",
        "igso": "lampyris.planning.swarm.gso:Igso",
        "informed-rrt-star": "lampyris.planning.sampling.rrt_star:InformedRrtStar",
        "ipso": "lampyris.planning.swarm.pso:IPso",
        "jps": "lampyris.planning.graph.jps:JumpPointSearch",
        "lazy-theta-star": "lampyris.planning.graph.theta_star:LazyThetaStar",
        "lpa-star": "lampyris.planning.incremental.lpa_star:LpaStar",
        "lpso": "lampyris.planning.swarm.pso:LPso",
        "mmas-dstar": "lampyris.planning.swarm.mmas_dstar:MmasDstar",
        "polyanya": "lampyris.planning.map_models.polyanya:Polyanya",
        "pso": "lampyris.planning.swarm.pso:Pso",
        "pso-apf": "lampyris.planning.swarm.pso:PsoApf",
        "quadtree": "lampyris.planning.map_models.quadtree:Quadtree",
        "rrt": "lampyris.planning.sampling.rrt:Rrt",
        "rrt-connect": "lampyris.planning.sampling.rrt:RrtConnect",
        "rrt-star": "lampyris.planning.sampling.rrt_star:RrtStar",
        "sipp": "lampyris.planning.spacetime.sipp:Sipp",
        "space-time-astar": "lampyris.planning.spacetime.space_time_astar:SpaceTimeAStar",
        "theta-star": "lampyris.planning.graph.theta_star:ThetaStar",
        "visibility-graph": "lampyris.planning.map_models.visibility_graph:VisibilityGraph",
        "voronoi": "lampyris.planning.map_models.voronoi:Voronoi",
    }
)
"""Module and class of each planner on cells, by name."""
POSES: Mapping[str, str] = MappingProxyType(
    {
        "hybrid-astar": "lampyris.planning.hybrid.hybrid_planner:HybridAStar",
        "lattice": "lampyris.planning.lattice.lattice_planner:LatticePlanner",
        "lattice-sipp": "lampyris.planning.lattice.timed.timed_planner:LatticeSipp",
        "pad": "lampyris.planning.lattice.pad.pad_planner:PadPlanner",
        "pad-sipp": "lampyris.planning.lattice.pad.timed_pad_planner:PadSipp",
        "pose-rrt-connect": "lampyris.planning.sampling.pose_rrt:PoseRrtConnect",
        "pose-rrt-star": "lampyris.planning.sampling.pose_star:PoseRrtStar",
    }
)
"""The same of planners of poses."""
FLEETS: Mapping[str, str] = MappingProxyType(
    {
        "cbs": "lampyris.planning.fleet.cbs:Cbs",
        "eecbs": "lampyris.planning.fleet.eecbs:Eecbs",
        "lacam": "lampyris.planning.fleet.lacam:Lacam",
        "lns": "lampyris.planning.fleet.lns:Lns",
        "pibt": "lampyris.planning.fleet.pibt:Pibt",
        "prioritised-sipp": "lampyris.planning.fleet.prioritised:PrioritisedSipp",
    }
)
"""The same of planners of fleets."""
