// Marks: the shapes of start, goal, robot and obstacles, on the map and in its legend. Each has a shape of its own, so
// that none is known by its colour alone: square, flag, ringed disc with a light middle; plain disc, square, triangle,
// diamond; gates are diamonds without a letter, hollow but for those on the path.

/** @typedef {CanvasRenderingContext2D} Pen */

/** @param {Pen} pen @param {number} x @param {number} y @param {number} r @param {string} colour */
export function robotMark(pen, x, y, r, colour) {
  pen.fillStyle = colour;
  pen.strokeStyle = "#fff";
  pen.lineWidth = 2;
  pen.beginPath();
  pen.arc(x, y, r, 0, 2 * Math.PI);
  pen.fill();
  pen.stroke();
  pen.fillStyle = "#fff";
  pen.beginPath();
  pen.arc(x, y, r * 0.36, 0, 2 * Math.PI);
  pen.fill();
}

/** A square with an S. @param {Pen} pen @param {number} x @param {number} y @param {number} r @param {string} colour */
export function startMark(pen, x, y, r, colour) {
  pen.fillStyle = colour;
  pen.strokeStyle = "#fff";
  pen.lineWidth = 2;
  pen.beginPath();
  pen.rect(x - r * 0.85, y - r * 0.85, r * 1.7, r * 1.7);
  pen.fill();
  pen.stroke();
  pen.fillStyle = "#20242c";
  pen.font = `bold ${Math.round(r * 1.2)}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText("S", x, y + 0.5);
}

/** A flag that stands on the cell. @param {Pen} pen @param {number} x @param {number} y @param {number} r @param {string} colour */
export function goalMark(pen, x, y, r, colour) {
  pen.lineJoin = "round";
  for (const [edge, more] of /** @type {Array<[string, number]>} */ ([["#fff", 3.5], ["#20242c", 0]])) {
    pen.strokeStyle = pen.fillStyle = edge;
    pen.lineWidth = Math.max(1.8, r * 0.2) + more;
    pen.beginPath();
    pen.moveTo(x - r * 0.55, y + r);
    pen.lineTo(x - r * 0.55, y - r * 1.15);
    pen.stroke();
    pen.beginPath();
    pen.moveTo(x - r * 0.55, y - r * 1.15);
    pen.lineTo(x + r * 0.95, y - r * 0.5);
    pen.lineTo(x - r * 0.55, y + r * 0.2);
    pen.closePath();
    if (more) pen.stroke();
    pen.fillStyle = more ? edge : colour;
    pen.fill();
  }
}

/** The outline of a gate. @param {Pen} pen @param {number} x @param {number} y @param {number} r */
export function gateOutline(pen, x, y, r) {
  pen.moveTo(x, y - r);
  pen.lineTo(x + r, y);
  pen.lineTo(x, y + r);
  pen.lineTo(x - r, y);
  pen.closePath();
}

/**
 * Gates as in pictures: diamonds, full on the path, hollow elsewhere, crossed out in dead ends. All in one stroke:
 * scattered maps have tens of thousands.
 * @param {Pen} pen @param {Array<[number, number]>} at pixels @param {number} r @param {"path" | "gate" | "end"} look @param {string} colour
 */
export function gateMarks(pen, at, r, look, colour) {
  pen.beginPath();
  for (const [x, y] of at) {
    gateOutline(pen, x, y, r);
    if (look !== "end") continue;
    const c = r * 0.42;
    pen.moveTo(x - c, y - c);
    pen.lineTo(x + c, y + c);
    pen.moveTo(x + c, y - c);
    pen.lineTo(x - c, y + c);
  }
  const wide = Math.max(1.4, r * 0.26);
  pen.lineJoin = "miter";
  pen.strokeStyle = "#fff";
  pen.lineWidth = wide + 1.6;
  pen.stroke();
  pen.strokeStyle = pen.fillStyle = colour;
  pen.lineWidth = wide;
  if (look === "path") pen.fill();
  pen.stroke();
}

/** An obstacle of a kind, filling a square of that side from the origin. @param {Pen} pen @param {[string, string, string]} look shape, colour, letter @param {number} side @param {boolean} dark @param {number} [seen] side on the screen, if it is another */
export function kindMark(pen, [shape, colour, letter], side, dark, seen = side) {
  const mid = side / 2;
  const r = mid - Math.max(1, side * 0.05);
  pen.fillStyle = colour;
  // An outline that differs from that of walls; small ones have little of it, so that their colour is seen.
  pen.strokeStyle = dark ? "#f4f6fa" : "#20242c";
  pen.lineWidth = Math.max(0.8, side * 0.06);
  pen.beginPath();
  if (shape === "circle") pen.arc(mid, mid, r * 0.88, 0, 2 * Math.PI);
  else if (shape === "square") pen.rect(mid - r * 0.8, mid - r * 0.8, r * 1.6, r * 1.6);
  else polygon(pen, mid, shape === "triangle" ? mid + r * 0.22 : mid, r * (shape === "triangle" ? 1.16 : 1), shape === "triangle" ? 3 : 4);
  pen.fill();
  pen.stroke();
  if (seen < 15) return;
  pen.fillStyle = "#fff";
  pen.font = `bold ${Math.round(side * 0.45)}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(letter, mid, mid + (shape === "triangle" ? side * 0.1 : side * 0.03));
}

/** @param {Pen} pen @param {number} x @param {number} y @param {number} r @param {number} corners */
function polygon(pen, x, y, r, corners) {
  for (let k = 0; k < corners; k++) {
    const t = (2 * Math.PI * k) / corners - Math.PI / 2;
    if (k) pen.lineTo(x + r * Math.cos(t), y + r * Math.sin(t));
    else pen.moveTo(x + r * Math.cos(t), y + r * Math.sin(t));
  }
  pen.closePath();
}
