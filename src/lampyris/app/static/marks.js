// Marks: the shapes of start, goal, robot and obstacles, on the map and in its legend. Each has a shape of its own, so
// that none is known by its colour alone: square, star, ringed disc with a light middle; plain disc, square, triangle,
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

/** @param {Pen} pen @param {number} x @param {number} y @param {number} r @param {string} colour */
export function startMark(pen, x, y, r, colour) {
  end(pen, x, y, r, colour, "S");
}

/** @param {Pen} pen @param {number} x @param {number} y @param {number} r @param {string} colour */
export function goalMark(pen, x, y, r, colour) {
  end(pen, x, y, r, colour, "G");
}

/** @param {Pen} pen @param {number} x @param {number} y @param {number} r @param {string} colour @param {string} letter */
function end(pen, x, y, r, colour, letter) {
  pen.fillStyle = colour;
  pen.strokeStyle = "#fff";
  pen.lineWidth = 2;
  pen.beginPath();
  if (letter === "S") pen.rect(x - r * 0.85, y - r * 0.85, r * 1.7, r * 1.7);
  else star(pen, x, y, r * 1.25);
  pen.fill();
  pen.stroke();
  pen.fillStyle = letter === "S" ? "#fff" : "#20242c";
  pen.font = `bold ${Math.round(r * 1.05)}px system-ui, sans-serif`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(letter, x, y + 0.5);
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

/** @param {Pen} pen @param {number} x @param {number} y @param {number} r */
function star(pen, x, y, r) {
  for (let k = 0; k < 10; k++) {
    const t = (Math.PI * k) / 5 - Math.PI / 2;
    const far = k % 2 ? r * 0.5 : r;
    if (k) pen.lineTo(x + far * Math.cos(t), y + far * Math.sin(t));
    else pen.moveTo(x + far * Math.cos(t), y + far * Math.sin(t));
  }
  pen.closePath();
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
