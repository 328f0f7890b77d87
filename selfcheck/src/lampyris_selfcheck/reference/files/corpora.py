"""Good files, small, for mutants to be made from, and the words of their formats."""

from __future__ import annotations

import base64

from lampyris_selfcheck.reference.files.map_files import adam7, bmp, chunk, npy, png, rows
from lampyris_selfcheck.reference.files.mutator import (
    Corpus,
    change_bmp,
    change_npy,
    change_png,
    change_rows,
    change_tree,
    repair_npy,
)

_PALETTE = chunk(b"PLTE", bytes([0] * 3 + [255] * 3 + [255, 0, 0]))
_TWO = bytes(4) + b"\xff" * 4
_EXIF = chunk(b"eXIf", b"II*\0\x08\0\0\0\1\0\x12\1\3\0\1\0\0\0\6\0\0\0")
_CHATTER = chunk(b"gAMA", bytes(4)) + chunk(b"zTXt", b"k\0\0x\x9c\3\0\0\0\0\1") + chunk(b"tIME", bytes(7))

_RLE4 = bytes([0, 3, 1, 0, 0, 0, 2, 17, 0, 2, 1, 0, 1, 16, 0, 1])

PNG = Corpus(
    (
        png(6, 5, 8, 0, rows(*[[0, 255, 0, 200, 100, 255]] * 5)),
        png(4, 2, 2, 3, b"\0\x14\0\x50", before=_PALETTE + chunk(b"tRNS", b"\xff\x00")),
        png(2, 2, 16, 6, b"\0" + bytes(16) + b"\0" + b"\xff" * 16, before=_EXIF),
        png(3, 2, 16, 4, b"\0" + bytes(12) + b"\1" + b"\xff" * 12),
        png(3, 2, 8, 2, rows([255] * 9, [0] * 6 + [255, 20, 147]), before=chunk(b"tRNS", bytes(6))),
        png(5, 2, 1, 0, b"\0\xf0\0\x0f", before=_CHATTER),
        png(9, 9, 8, 0, adam7([[0, 255, 255] * 3] * 9), interlace=1),
        png(2, 1, 8, 0, rows([0, 255]), before=chunk(b"acTL", b"\0\0\0\1\0\0\0\0")),
    ),
    text=False,
    change=change_png,
)
BMP = Corpus(
    (
        bmp(3, 3, 24, bytes([255] * 12 + [0] * 24)),
        bmp(3, -2, 32, b"\xff\xff\xff\0" * 6),
        bmp(5, 2, 4, bytes([0x01, 0x10, 0, 0] * 2), palette=_TWO, used=2),
        bmp(9, 2, 1, bytes([0x55, 0x80, 0, 0] * 2), palette=_TWO, used=2),
        bmp(4, 2, 8, bytes([3, 1, 1, 0, 0, 0, 0, 3, 1, 0, 1, 0, 0, 1]), palette=_TWO, used=2, packing=1),
        bmp(4, 2, 4, _RLE4, palette=_TWO, used=2, packing=2),
        bmp(2, 1, 32, b"\xff" * 8, masks=b"\0\0\xff\0\0\xff\0\0\xff\0\0\0\0\0\0\xff", header=56, packing=3),
    ),
    text=False,
    change=change_bmp,
)
PGM = Corpus(
    (
        b"P5\n# made by hand\n4 3\n255\n" + bytes(range(12)),
        b"P5 2 2 65535\n" + bytes([0, 0, 255, 255, 1, 2, 3, 4]),
        b"P2\n3 2\n255\n0 255 128\n1 2 3\n",
        b"P1\n3 2\n0 1 0\n101\n",
        b"P4 9 2\n\x80\x80\x7f\x00",
        b"P6 2 1 255\n" + bytes(6),
        b"P3 2 1 255\n0 0 0 255 255 255\n",
    ),
    (b"P1", b"P2", b"P3", b"P4", b"P5", b"P6"),
)
NPY = Corpus(
    (
        npy("{'descr': '|i1', 'fortran_order': False, 'shape': (3, 4), }", b"\0\1\xff" * 4),
        npy("{'descr': '|b1', 'fortran_order': True, 'shape': (2, 3), }", b"\0\1\0\1\1\0"),
        npy("{'descr': '|b1', 'fortran_order': False, 'shape': (20, 30), }", b"\0\1\1" * 200),
        npy("{'descr': '<i8', 'fortran_order': False, 'shape': (1, 2), }", bytes(15) + b"\1"),
        npy("{'descr': '>u2', 'fortran_order': False, 'shape': (2, 2), }", b"\0\0\0\1" * 2, version=2),
    ),
    (b"descr", b"'<i4'", b"'|O'", b"shape", b"fortran_order", b"True", b"()"),
    change=change_npy,
    repair=repair_npy,
)
MAP = Corpus(
    (
        b"type octile\nheight 3\nwidth 4\nmap\n.@T.\nGS..\n.WO.\n",
        b"type octile\nheight 12\nwidth 16\nmap\n" + b"....@@TTOOWWSSGG\n" * 12,
        b"type octile\r\nheight 2\r\nwidth 2\r\nmap\r\n..\r\n@.\r\n\r\n",
    ),
    (b"type", b"octile", b"tile", b"height", b"width", b"map", b".G@OTSW"),
    change=change_rows,
)
TEXT = Corpus((b"#..#\n#S?#\n#oG#\n", b"\xef\xbb\xbf....\n.##.\n\n", b"#"), (b"#.?SGo",), change=change_rows)
CSV = Corpus(
    (
        b"0,1,0\n1,0,-1\n",
        b"\xef\xbb\xbf0;1\r\n1;0\r\n",
        b"0\t0\t1\n 0 \t1\t0\n\n",
        b"# lampyris costmap\n0,63,252\n253,254,-1\n",
    ),
    (b"# lampyris costmap\n",),
)
SCEN_MAP = b"type octile\nheight 4\nwidth 5\nmap\n.....\n.@.WW\n.S.WW\n....T\n"
SCEN = Corpus(
    (
        b"version 1\n0\tmaps/a.map\t5\t4\t0\t0\t2\t3\t3.82842712\n0\ta.map\t5\t4\t0\t0\t0\t0\t0\n",
        b"version 1.0\r\n0 a.map 5 4 0 0 4 0 4\r\n\r\n1 a.map 5 4 3 1 4 2 1.41421356\r\n",
        b"1 a.map 5 4 0 3 3 3 3.0\n",
    ),
    (b"version", b"a.map", b"b.map", b"../a.map", b"m.scen", b"/dev/zero", b"\\\\host\\a.map"),
)
ROS_YAML = (
    b"image: m.pgm\nmode: trinary\nresolution: 0.050\norigin: [0.000, 0.000, 0]\nnegate: 0\n"
    b"occupied_thresh: 0.65\nfree_thresh: 0.196\n"
)
_ROS_FLOW = (
    b"\xef\xbb\xbf{image: m.pgm, resolution: 5e-2, origin: [1, 2, 0.5], negate: no,\n"
    b" 'occupied_thresh': 0.6, \"free_thresh\": 2e-1, mode: Scale}\r\n"
)
_ROS_BLOCK = (
    b"%YAML 1.2\n---\nimage: >-\n  m.pgm\nresolution: 1\norigin:\n- 0\n- -1\n- .5\nnegate: false\n"
    b"occupied_thresh: 0.65 # a comment\nfree_thresh: 0.196\nmode: raw\n...\n"
)
YAML_WORDS = (
    *b"&a |*a |!!int |!!python/object/apply:os.system |! |<<: |--- |...\n|? |- |: |>-\n|~|true".split(b"|"),
    *b"null yes No .nan m.pgm ../ /etc/passwd ~/ http://127.0.0.1/ file:///etc/passwd C:/ ./ sub/../".split(),
    *rb"""/dev/zero /proc/self/mem m.yaml \\host\share '' "\U00110000" "\ud800" "\x1b[31m" 'a''' """.split(),
    *(b"|2\n", b"|cat", b"%TAG ! x:\n", b"%YAML 9.1\n"),
)
ROS = Corpus(
    (ROS_YAML, _ROS_FLOW, _ROS_BLOCK),
    (
        *YAML_WORDS,
        *b"image resolution origin negate occupied_thresh free_thresh mode trinary scale raw".split(),
    ),
    change=change_tree,
)
ROS_PICTURE = b"P5 3 2 255\n" + bytes([0, 205, 254, 100, 255, 90])
ROS_PICTURES = Corpus((*PGM.seeds, *PNG.seeds, *BMP.seeds), text=False, change=change_png)

# Tiny pictures made by Pillow: 5 x 4 grey, the same turned by its EXIF orientation, 9 x 7 progressive colour.
_GREY_JPEG = base64.b64decode(
    "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAA0JCgsKCA0LCgsODg0PEyAVExISEyccHhcgLikxMC4pLSwzOko+MzZGNywtQFdBRkxO"
    "UlNSMj5aYVpQYEpRUk//wAALCAAEAAUBAREA/8QAFAABAAAAAAAAAAAAAAAAAAAABf/EABoQAAAHAAAAAAAAAAAAAAAAAAACBAY2"
    "g7P/2gAIAQEAAD8AaY0RQ2aGH//Z"
)
_TURNED_JPEG = base64.b64decode(
    "/9j/4AAQSkZJRgABAQAAAQABAAD/4QAiRXhpZgAATU0AKgAAAAgAAQESAAMAAAABAAYAAAAAAAD/2wBDAA0JCgsKCA0LCgsODg0P"
    "EyAVExISEyccHhcgLikxMC4pLSwzOko+MzZGNywtQFdBRkxOUlNSMj5aYVpQYEpRUk//wAALCAAEAAUBAREA/8QAFAABAAAAAAAA"
    "AAAAAAAAAAAABf/EABoQAAAHAAAAAAAAAAAAAAAAAAACBAY2g7P/2gAIAQEAAD8AaY0RQ2aGH//Z"
)
_COLOUR_JPEG = base64.b64decode(
    "/9j/4AAQSkZJRgABAQAAAQABAAD/2wBDAA0JCgsKCA0LCgsODg0PEyAVExISEyccHhcgLikxMC4pLSwzOko+MzZGNywtQFdBRkxO"
    "UlNSMj5aYVpQYEpRUk//2wBDAQ4ODhMREyYVFSZPNS01T09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09PT09P"
    "T09PT09PT0//wgARCAAHAAkDASIAAhEBAxEB/8QAFgABAQEAAAAAAAAAAAAAAAAAAAQG/8QAFAEBAAAAAAAAAAAAAAAAAAAAAP/a"
    "AAwDAQACEAMQAAABm0wf/8QAFRABAQAAAAAAAAAAAAAAAAAABBD/2gAIAQEAAQUCDP/EABQRAQAAAAAAAAAAAAAAAAAAAAD/2gAI"
    "AQMBAT8Bf//EABQRAQAAAAAAAAAAAAAAAAAAAAD/2gAIAQIBAT8Bf//EABUQAQEAAAAAAAAAAAAAAAAAAAEQ/9oACAEBAAY/Aif/"
    "xAAUEAEAAAAAAAAAAAAAAAAAAAAQ/9oACAEBAAE/IQ//2gAMAwEAAgADAAAAEHP/xAAUEQEAAAAAAAAAAAAAAAAAAAAA/9oACAED"
    "AQE/EH//xAAUEQEAAAAAAAAAAAAAAAAAAAAA/9oACAECAQE/EH//xAAVEAEBAAAAAAAAAAAAAAAAAAAQwf/aAAgBAQABPxCR/9k="
)
PHOTO = Corpus((_GREY_JPEG, _TURNED_JPEG, _COLOUR_JPEG, PNG.seeds[0]), text=False)
_MANY_STYLES = rb"""a: {b: [1, 2.5, true, null, 'x', "y\u00e9\n"], c: ~}
d: |
  text
  more
e: >-
  folded
f: 0x1F
"""
YAML = Corpus(
    (*ROS.seeds, _MANY_STYLES, rb'{"a": [1, -2e3, {"b": []}], "c": "\ud83d\ude00", "d": {}}'),
    ROS.words,
    change=change_tree,
)
TRACK = Corpus(
    (
        b"x,y\n1,2\n2,2\n2,3\n",
        b"\xef\xbb\xbftick,x,y\r\n0,1,1\r\n3,2,1\r\n",
        b'"x","y"\n"3","4"\n',
        b"tick,t,x_m,x,y\n0,0.0,.5,0,0\n1,.5,1.5,1,0\n",
    ),
    (b"x", b"y", b"t", b"tick"),
)
WAY = Corpus(
    (
        b"x_m,y_m,yaw\n0.5,0.5,0\n1.5,.5,1\n",
        b"\xef\xbb\xbf# x y\r\n1 2\r\n1e0 -2.5\r\n",
        b"x;y\n1;2\n\n3;4\n# end\n",
        b'"x","y"\n"3","4"\n',
        b"1,2\n3,4\n",
    ),
    (b"x_m", b"y_m", b"x", b"y", b"nan", b"1e9", b"1_0", b"#"),
)
_POSE = b'{"header": {"frame_id": "map"}, "pose": {"position": {"x": 1.5, "y": 2, "z": 0}}}'
_A_MAP = b'{"name": "m", "width": 7, "height": 6, "resolution": 1.0, "origin": [0.0, 0.0, 0.0]}'
WAY_JSON = Corpus(
    (
        b'{"header": {"frame_id": "odom"}, "poses": [' + _POSE + b", " + _POSE + b"]}",
        b'{"op": "publish", "msg": {"poses": [{"position": {"x": 0, "y": -1e2}}]}}',
        b'{"planner": "astar", "cells": [[0, 0], [1, 1]], "map": ' + _A_MAP + b"}",
    ),
    (b"poses", b"pose", b"position", b"msg", b"cells", b"planner", b"map", b"NaN", b"null", b"frame_id"),
    change=change_tree,
)
WAY_YAML = Corpus(
    (
        b"header:\n  frame_id: map\nposes:\n- pose:\n    position:\n      x: 1.0\n      y: 2.0\n---\n",
        b"poses: [{position: {x: 1, y: .5}}, {pose: {position: {x: 2, y: 3}}}]\n",
    ),
    (*YAML_WORDS, b"poses", b"pose", b"position", b"x", b"y", b"---\n"),
    change=change_tree,
)
MOVERS = Corpus(
    (
        b"x_m,y_m,radius,top_speed\n1,2,0.3,1\n",
        b"id;x_m;y_m;radius;top_speed;vx;vy\r\n1;1;2;0;1.5;1;-1\r\n",
        b"x_m,y_m,radius,top_speed\n",
    ),
    (b"x_m", b"radius", b"top_speed", b"vx", b"vy", b"-1", b"1e9"),
)
ZONES = Corpus(
    (
        b"1,1,0.5\n,inf,2\n",
        b"\xef\xbb\xbf# m/s\r\n1;1;1\r\n;;3e-1\r\n",
        b"1\t1\t1\n1\t1\t1",
    ),
    (b"inf", b"0", b"nan", b"-1", b"1e10"),
)
ZONES_NPY = Corpus(
    (
        npy("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }", b"\0\0\0\0\0\0\xf0\x3f" * 6),
        npy("{'descr': '<f4', 'fortran_order': True, 'shape': (2, 3), }", b"\0\0\x80\x7f" * 6),
    ),
    (b"descr", b"'<f4'", b"'<i4'", b"'|O'", b"shape", b"fortran_order", b"True", b"(2, 3)"),
    change=change_npy,
    repair=repair_npy,
)
_DOB = b"""NumberOfDynamicObstacles: 1
DynamicObstacleID: 0
ObstacleRadius: 0.25
NumberOfTrajectories: 1
TrajectoryID: 0
TrajectoryProbability: 1.0
NumberOfPoints: 2
0.5 0.5 0.0 0
1.5 0.5 2 0.1
ObstacleExistsAfterTrajectory: 0
"""
DOB = Corpus(
    (_DOB,), (b"NumberOfPoints:", b"ObstacleRadius:", b"DynamicObstacleID:", b"NumberOfTrajectories:")
)
_MPRIM = b"""resolution_m: 0.1
numberofangles: 4
totalnumberofprimitives: 3
primID: 0
startangle_c: 0
endpose_c: 3 0 0
additionalactioncostmult: 1
intermediateposes: 3
0.0000 0.0000 0.0000
0.1500 0.0000 0.0000
0.3000 0.0000 0.0000
primID: 1
startangle_c: 0
endpose_c: 0 0 -1
additionalactioncostmult: 5
intermediateposes: 3
0 0 0
0 0 -0.7854
0 0 -1.5708
primID: 0
startangle_c: 1
endpose_c: 0 -1 1
additionalactioncostmult: 2
intermediateposes: 2
0.0 0.0 1.5708
0.0 -0.1 1.5708
"""
_ANGLES = b"""resolution_m: 0.025
min_turning_radius_m: 1.0
numberofangles: 2
angle:0 0.0
angle:1 0.46364761
totalnumberofprimitives: 1
primID: 7
startangle_c: 1
endpose_c: 2 1 1
additionalactioncostmult: 1
turning_radius: 0.0000
intermediateposes: 2
0.0 0.0 0.4636
0.05 0.025 0.4636
"""
MPRIM = Corpus(
    (_MPRIM, _ANGLES),
    (
        b"primID:",
        b"startangle_c:",
        b"endpose_c:",
        b"intermediateposes:",
        b"angle:1",
        b"numberofangles:",
        b"turning_radius:",
    ),
)
_AHEAD = b"""{"trajectory_id": 0, "start_angle_index": 0, "end_angle_index": 0, "left_turn": true, "trajectory_radius": 0.0,
 "trajectory_length": 0.2, "arc_length": 0.0, "straight_length": 0.2, "poses": [[0.1, 0, 0], [0.2, 0.0, 0.0]]}"""
_IN_PLACE = b"""{"trajectory_id": 1, "start_angle_index": 1, "end_angle_index": 0,
 "poses": [[0, 0, 1.570796], [0, 0, 1e0], [0, 0, 0.5], [0, 0, 0.0]]}"""
PRIMITIVES_JSON = Corpus(
    (
        b'{"version": 1.0, "lattice_metadata": {"motion_model": "diff", "turning_radius": 0.5, "grid_resolution": 0.05,'
        b' "num_of_headings": 2, "heading_angles": [0.0, 1.5707963267948966], "number_of_trajectories": 2},\n'
        b'"primitives": [' + _AHEAD + b",\n" + _IN_PLACE + b"]}",
        b'{"lattice_metadata": {"grid_resolution": 0.1, "heading_angles": [0]}, "primitives": ['
        + _AHEAD
        + b"]}",
    ),
    (
        b"poses",
        b"grid_resolution",
        b"heading_angles",
        b"primitives",
        b"trajectory_length",
        b"start_angle_index",
        b"NaN",
    ),
    change=change_tree,
)
ROBOT = Corpus(
    (
        b"rectangle: [1.2, 0.6]\ndrive: ackermann\nturn_radius: 1.5\nv_max: 0.8\n",
        b"footprint: [[1, 0.3], [-0.3, 0.3], [-0.3, -0.3], [1, -0.3]]\na_max: 1\nd_max: 2.0\njerk_max: null\n",
        b"radius: 0.25\na_lat_max: 1e0\n",
    ),
    (
        b"footprint",
        b"rectangle",
        b"radius",
        b"drive",
        b"turn_radius",
        b"differential",
        b"omnidirectional",
        *YAML_WORDS,
    ),
    change=change_tree,
)
SCENARIO_WORDS = (
    *b"version name map map_hash start goal robot preset moves planner law seed obstacles".split(),
    *b"simulate bundled file recipe rows resolution values colour size settings origin radius".split(),
    *b"v_max a_max d_max kind count rate waypoints track id tick_s ticks patience m random-walk".split(),
    *b"patrol crossing recorded octile guide dissertation ad-gso astar physical costmap random".split(),
    *b"m.map t.csv t.dob z.csv zones drive a_lat_max turn_radius jerk_max period obstacle_info velocities".split(),
    *b"tracking perfect velocity time_limit creep blind.reach moving.reaction optimum rpp".split(),
    *YAML_WORDS,
)
_ALL_OF_IT = b"""version: 1
name: all of it
map: {file: m.map, resolution: 0.5}
start: [0, 0]
goal: {m: [1.2, 0.3]}
robot: {radius: 0.1, v_max: 1.5, a_max: 0.5, d_max: 1.0}
moves: octile
planner: {name: ad-gso, settings: {rho: 0.5}}
law: physical
seed: 7
obstacles:
- {kind: random-walk, count: 1, rate: 0.5}
- {kind: patrol, waypoints: [[0, 1], [2, 2]]}
- {kind: crossing, count: 2, radius: 0.1}
- kind: recorded
  track: [[0, 2], [1, 2]]
- {kind: recorded, file: t.csv}
- {kind: recorded, file: t.dob, id: 0, tick_s: 0.5}
edits:
- {tick: 1, blocked: [[2, 0]]}
- {tick: 3, freed: [[2, 0]]}
simulate: {ticks: 5, patience: 2}
"""
_DRIVEN = b"""version: 1
map: {file: m.map, resolution: 0.5}
start: [0, 0]
goal: [3, 2]
robot: {v_max: 1.5, a_lat_max: 0.5, turn_radius: 0.0, jerk_max: null}
law: {name: physical, settings: {creep: 0.2, moving.reaction: 0.2}}
zones: z.csv
obstacles: [{kind: crossing, count: 1}]
drive: {period: 0.2, time_limit: 9, obstacle_info: velocities, tracking: perfect, delay: 0}
"""
_RECIPE = b"""version: 1
map: {recipe: random, size: [20, 10], seed: 3, settings: {density: 0.2}}
start: [0, 0]
goal: [19, 9]
preset: dissertation
"""
_ROWS = b"""version: 1
map:
  rows: ['S..', '.#.', '..G']
  name: drawn
  origin: [0, 0, 0.5]
simulate: {}
"""
SCENARIO_YAML = Corpus(
    (
        b"version: 1\nmap: guide\n",
        b"version: 1\nmap: {file: r.yaml}\nstart: [1, 1]\ngoal: [2, 0]\n",
        _ALL_OF_IT,
        _DRIVEN,
        _RECIPE,
        _ROWS,
    ),
    SCENARIO_WORDS,
    change=change_tree,
)
_JSON = rb"""{"$schema": "x", "version": 1, "name": "caf\u00e9", "map": {"rows":
 ["S.......", "..#.....", "........", "....##..", ".......G"]},
 "robot": {"radius": 0.1, "v_max": 1e0}, "planner": {"name": "astar"}, "law": null,
 "obstacles": [{"kind": "recorded", "track": [[2, 0], [3, 0]]}, {"kind": "crossing", "count": 1}],
 "simulate": {"ticks": 5}}
"""
SCENARIO_JSON = Corpus(
    (b'{"version": 1, "map": "guide", "start": [0, 9], "goal": [7, 0], "seed": 3}', _JSON),
    (*SCENARIO_WORDS, b"NaN", b"Infinity", rb'"\ud800"', b"/* */", b"// x\n"),
    change=change_tree,
)
JSON = Corpus(
    (
        *SCENARIO_JSON.seeds,
        rb'{"a": [1, -2.5e3, {"b": []}, "\"\/\\\ud83d\ude00"], "c": true, "d": {"e": null}}',
    ),
    SCENARIO_JSON.words,
    change=change_tree,
)
SCENARIO_BESIDE = {
    "m.map": b"type octile\nheight 3\nwidth 4\nmap\n....\n.@..\n....\n",
    "r.yaml": ROS_YAML,
    "m.pgm": ROS_PICTURE,
    "t.csv": b"x,y\n1,2\n2,2\n",
    "t.dob": _DOB,
    "z.csv": b"1,1,0.5,inf\n1,,1,1\n1,1,1,1\n",
}
STUDY_WORDS = (
    *SCENARIO_WORDS,
    *b"maps queries stored limit start goal least scen planners settings grid label all except laws".split(),
    *b"traffic none tracks replayed live seeds budget expansions seconds kind plan drive memory".split(),
    *b"about guide env-1 dijkstra jps ad-gso constant three-speed a.scen mixed b.map".split(),
)
_STUDY = b"""{"version": 1, "name": "small", "about": "what it asks", "maps": [
 {"rows": ["S.......", "..#.....", "....##..", ".......G"], "name": "drawn"},
 {"file": "m.map", "queries": [{"start": [0, 0], "goal": [3, 2]}], "limit": 1}],
 "planners": ["astar", {"name": "ad-gso", "grid": {"rho": [0.1, 0.6]}, "label": "glowworms"}],
 "laws": ["physical", {"name": "constant", "settings": {"creep": 0.1}}],
 "traffic": ["none", {"kind": "crossing", "grid": {"count": [1, 2], "rate": [null]}}],
 "seeds": [0, 4], "seed": 7, "ticks": 20, "patience": 3, "robot": {"radius": 0.1, "v_max": 2}}
"""
_STUDY_PLAN = b"""{"version": 1, "preset": "dissertation", "moves": null, "seeds": 2,
 "maps": [{"scen": "a.scen", "limit": 2}, {"bundled": "guide", "queries": {"random": 3, "least": 2}},
  {"recipe": "random", "size": [20, 10], "seed": 3, "settings": {"density": 0.2}, "queries": {"random": 2}}],
 "planners": {"all": {"except": ["dijkstra"]}}, "budget": {"expansions": 1000, "seconds": null}}
"""
_STUDY_DRIVE = b"""{"$schema": "x", "version": 1, "kind": "drive", "maps": ["guide"], "planners": ["sipp"],
 "drive": {"period": 0.2, "time_limit": 9}, "memory": false, "budget": null,
 "traffic": [{"kind": "random-walk", "count": 2, "radius": 0.1, "tracks": "live"}]}
"""
_STUDY_YAML = b"""version: 1
about: >
  What does it ask?
maps:
  - guide
  - {rows: ['S..', '.#.', '..G'], name: drawn, origin: [0, 0, 0.5]}
  - file: r.yaml
    queries: [{start: [1, 1], goal: {m: [0.12, 0.07]}}]
planners: all
laws: [constant]
seeds: 3
"""
STUDY_JSON = Corpus((_STUDY, _STUDY_PLAN, _STUDY_DRIVE), (*STUDY_WORDS, b"NaN"), change=change_tree)
STUDY_YAML = Corpus((_STUDY_YAML, _STUDY, _STUDY_PLAN), STUDY_WORDS, change=change_tree)
STUDY_BESIDE = {**SCENARIO_BESIDE, "a.map": SCEN_MAP, "a.scen": SCEN.seeds[2] + b"1 a.map 5 4 0 0 4 0 4\n"}
