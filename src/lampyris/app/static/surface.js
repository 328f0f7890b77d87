// Surface: triangles in WebGL 2, for the landscape in 3-D. A module of our own: three.js 0.187 is 2.1 MB as its package
// has it (no smaller form, and the page has no build step), for a mesh, a ribbon and a ball.

/** A mesh: places and normals of three numbers, colours of three bytes, for each corner; and triangles. @typedef {{places: Float32Array, normals: Float32Array, colours: Uint8Array, index: Uint32Array}} Mesh */

/** A mesh that is kept, and where it is drawn. @typedef {{kept: {array: WebGLVertexArrayObject | null, count: number}, at?: number[]}} Thing */

const VERTEX = `#version 300 es
in vec3 place; in vec3 normal; in vec3 colour;
uniform mat4 view; uniform vec3 offset;
out vec3 tone; out vec3 face;
void main() { tone = colour; face = normal; gl_Position = view * vec4(place + offset, 1.0); }`;
const FRAGMENT = `#version 300 es
precision mediump float;
in vec3 tone; in vec3 face; out vec4 paint;
void main() { float light = 0.62 + 0.38 * max(dot(normalize(face), normalize(vec3(-0.4, 0.85, -0.35))), 0.0); paint = vec4(tone * light, 1.0); }`;

export class Surface {
  /** @param {HTMLCanvasElement} canvas @throws {Error} the browser has no WebGL 2 */
  constructor(canvas) {
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, powerPreference: "low-power" });
    if (!gl) throw new Error("This browser does not offer WebGL 2, which the 3-D view needs.");
    this.gl = gl;
    this.program = linked(gl);
    this.view = gl.getUniformLocation(this.program, "view");
    this.offset = gl.getUniformLocation(this.program, "offset");
    gl.useProgram(this.program);
    /** What stands still, and all of it. @type {Array<WebGLFramebuffer | null> | null} */
    this._targets = null;
    /** @type {Array<WebGLRenderbuffer | null>} */
    this._held = [];
    this._size = "";
    /** What is drawn in the first of them. */
    this._known = "";
    gl.enable(gl.DEPTH_TEST);
  }

  /** A mesh in the memory of what draws. @param {Mesh} mesh */
  keep({ places, normals, colours, index }) {
    const { gl } = this;
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    for (const [name, data, kind, even] of /** @type {Array<[string, any, number, boolean]>} */ ([["place", places, gl.FLOAT, false], ["normal", normals, gl.FLOAT, false], ["colour", colours, gl.UNSIGNED_BYTE, true]])) {
      const at = gl.getAttribLocation(this.program, name);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, 3, kind, even, 0, 0);
    }
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, index, gl.STATIC_DRAW);
    return { array, count: index.length };
  }

  /**
   * What stands still is drawn once for a view and copied from then on, with its depths: only what moves is drawn in each frame.
   * @param {number[]} paper colour behind everything, 0 to 1 @param {Float32Array} view @param {Thing[]} still @param {Thing[]} moving
   */
  draw(paper, view, still, moving) {
    const { gl } = this;
    const { width, height } = gl.canvas;
    const known = [width, height, ...paper, ...view, ...still.map(({ kept }) => kept.count)].join();
    if (!this._targets || this._size !== `${width} ${height}`) this._resize(width, height);
    const [below, whole] = /** @type {WebGLFramebuffer[]} */ (this._targets);
    gl.viewport(0, 0, width, height);
    gl.uniformMatrix4fv(this.view, false, view);
    if (known !== this._known) {
      this._known = known;
      gl.bindFramebuffer(gl.FRAMEBUFFER, below);
      gl.clearColor(paper[0], paper[1], paper[2], 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      this._all(still);
    }
    this._copy(below, whole, gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.bindFramebuffer(gl.FRAMEBUFFER, whole);
    this._all(moving);
    this._copy(whole, null, gl.COLOR_BUFFER_BIT);
  }

  /** @param {Thing[]} what */
  _all(what) {
    const { gl } = this;
    for (const { kept, at } of what) {
      gl.uniform3fv(this.offset, at ?? [0, 0, 0]);
      gl.bindVertexArray(kept.array);
      gl.drawElements(gl.TRIANGLES, kept.count, gl.UNSIGNED_INT, 0);
    }
  }

  /** @param {WebGLFramebuffer | null} from @param {WebGLFramebuffer | null} to @param {number} what */
  _copy(from, to, what) {
    const { gl } = this;
    const { width, height } = gl.canvas;
    gl.bindFramebuffer(gl.READ_FRAMEBUFFER, from);
    gl.bindFramebuffer(gl.DRAW_FRAMEBUFFER, to);
    gl.blitFramebuffer(0, 0, width, height, 0, 0, width, height, what, gl.NEAREST);
  }

  /** Two pictures with depths, of the canvas's size. @param {number} width @param {number} height */
  _resize(width, height) {
    const { gl } = this;
    this._size = `${width} ${height}`;
    this._known = "";
    this._held.forEach((one) => gl.deleteRenderbuffer(one));
    this._held = [];
    this._targets ??= [gl.createFramebuffer(), gl.createFramebuffer()];
    for (const target of this._targets) {
      gl.bindFramebuffer(gl.FRAMEBUFFER, target);
      for (const [format, place] of [[gl.RGBA8, gl.COLOR_ATTACHMENT0], [gl.DEPTH_COMPONENT24, gl.DEPTH_ATTACHMENT]]) {
        const buffer = gl.createRenderbuffer();
        this._held.push(buffer);
        gl.bindRenderbuffer(gl.RENDERBUFFER, buffer);
        gl.renderbufferStorage(gl.RENDERBUFFER, format, width, height);
        gl.framebufferRenderbuffer(gl.FRAMEBUFFER, place, gl.RENDERBUFFER, buffer);
      }
    }
  }

  /** Let go of what is kept. */
  close() {
    this.gl.getExtension("WEBGL_lose_context")?.loseContext();
  }
}

/** @param {WebGL2RenderingContext} gl */
function linked(gl) {
  const program = /** @type {WebGLProgram} */ (gl.createProgram());
  for (const [kind, text] of /** @type {Array<[number, string]>} */ ([[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]])) {
    const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(`The 3-D view does not work here: ${gl.getProgramInfoLog(program)}`);
  return program;
}

/**
 * Seen from around a middle, as a matrix by columns: turned by an angle, from a height, at a distance.
 * @param {number[]} middle @param {number} turn @param {number} height radians @param {number} far @param {number} ratio width by height
 */
export function seenFrom(middle, turn, height, far, ratio) {
  const ahead = [-Math.sin(turn) * Math.cos(height), -Math.sin(height), -Math.cos(turn) * Math.cos(height)];
  const right = [Math.cos(turn), 0, -Math.sin(turn)];
  const up = [right[1] * ahead[2] - right[2] * ahead[1], right[2] * ahead[0] - right[0] * ahead[2], right[0] * ahead[1] - right[1] * ahead[0]];
  const eye = middle.map((v, k) => v - far * ahead[k]);
  const dot = (/** @type {number[]} */ a) => a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2];
  const [near, end] = [far / 50, far * 4];
  const [a, b] = [-(end + near) / (end - near), (-2 * end * near) / (end - near)];
  const [sx, sy] = lensOf(ratio);
  // Rows of the turned frame: right, up, backwards.
  const back = ahead.map((v) => -v);
  const rows = [[...right, -dot(right)], [...up, -dot(up)], [...back, -dot(back)]];
  const out = new Float32Array(16);
  for (let c = 0; c < 4; c++) {
    out[4 * c] = sx * rows[0][c];
    out[4 * c + 1] = sy * rows[1][c];
    out[4 * c + 2] = a * rows[2][c] + (c === 3 ? b : 0);
    out[4 * c + 3] = -rows[2][c];
  }
  return out;
}

/** How much a view of a width and height enlarges in each direction. @param {number} ratio @returns {[number, number]} */
function lensOf(ratio) {
  const lens = 2.2;
  return ratio >= 1 ? [lens / ratio, lens] : [lens, lens * ratio];
}

/**
 * From how far places are seen whole, and as large as they can be.
 * @param {ArrayLike<number>} places x, height, y one after another @param {number[]} middle @param {number} turn @param {number} height @param {number} ratio width to height
 */
export function distanceFor(places, middle, turn, height, ratio) {
  const [sx, sy] = lensOf(ratio);
  const [sin, cos, low, flat] = [Math.sin(turn), Math.cos(turn), Math.sin(height), Math.cos(height)];
  let far = 0;
  for (let k = 0; k < places.length; k += 3) {
    const [x, y, z] = [places[k] - middle[0], places[k + 1] - middle[1], places[k + 2] - middle[2]];
    const ahead = -sin * flat * x - low * y - cos * flat * z;
    const right = cos * x - sin * z;
    const up = -sin * low * x + flat * y - cos * low * z;
    far = Math.max(far, (Math.max(sx * Math.abs(right), sy * Math.abs(up)) / 0.94) - ahead);
  }
  return far;
}
