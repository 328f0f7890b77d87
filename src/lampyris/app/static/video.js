// Video: a film that the server has drawn, as a WebM or MP4 file. The browser's own encoder makes the pictures small; the
// two containers are written here, one track of pictures each.

/** A picture of a video as the encoder gives it; times in milliseconds. @typedef {{data: Uint8Array, at: number, long: number, key: boolean}} Piece */
/** What the encoder says of them. @typedef {{width: number, height: number, codec: string, description: Uint8Array | null}} About */

/** Codecs by container, the first that the browser has. @type {Record<string, string[]>} */
const CODECS = { webm: ["vp09.00.31.08", "vp8"], mp4: ["avc1.640028", "avc1.42e01f", "vp09.00.31.08"] };
/** Pictures from one that stands alone to the next. */
const APART = 60;
/** Pictures that may wait for the encoder. */
const QUEUE = 6;

/**
 * The film in another container. @param {Blob} film WebP or GIF @param {string} ending "webm" or "mp4" @param {AbortSignal} signal
 * @param {(said: {what: string, done: number, of: number}) => void} share @returns {Promise<Blob>} @throws {Error} the browser has no encoder
 */
export async function askVideo(film, ending, signal, share) {
  const { ImageDecoder, VideoEncoder, VideoFrame } = /** @type {any} */ (globalThis);
  if (!ImageDecoder || !VideoEncoder) throw new Error(`This browser cannot make ${ending.toUpperCase()} files: export the film as WebP.`);
  const decoder = new ImageDecoder({ data: await film.arrayBuffer(), type: film.type });
  await decoder.tracks.ready;
  await decoder.completed;
  const many = decoder.tracks.selectedTrack.frameCount;
  const first = (await decoder.decode({ frameIndex: 0 })).image;
  // Most codecs take even sizes alone.
  const [width, height] = [first.displayWidth + (first.displayWidth & 1), first.displayHeight + (first.displayHeight & 1)];
  const config = await configOf(VideoEncoder, CODECS[ending], width, height);
  if (!config) throw new Error(`This browser has no encoder for ${ending.toUpperCase()} files: export the film as WebP.`);
  /** @type {Piece[]} */
  const pieces = [];
  /** @type {Uint8Array | null} */
  let description = null;
  /** @type {unknown} */
  let fault = null;
  const encoder = new VideoEncoder({
    output: (/** @type {any} */ chunk, /** @type {any} */ more) => {
      const data = new Uint8Array(chunk.byteLength);
      chunk.copyTo(data);
      const said = more?.decoderConfig?.description;
      if (said) description = new Uint8Array(ArrayBuffer.isView(said) ? said.buffer.slice(said.byteOffset, said.byteOffset + said.byteLength) : said);
      pieces.push({ data, at: Math.round(chunk.timestamp / 1000), long: Math.round((chunk.duration ?? 0) / 1000), key: chunk.type === "key" });
    },
    error: (/** @type {unknown} */ error) => (fault = error),
  });
  encoder.configure(config);
  const canvas = document.createElement("canvas");
  canvas.width = width;
  canvas.height = height;
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d", { willReadFrequently: true }));
  let at = 0;
  try {
    for (let k = 0; k < many && !fault; k++) {
      signal.throwIfAborted();
      const { image } = k ? await decoder.decode({ frameIndex: k }) : { image: first };
      const long = image.duration || 40_000;
      pen.fillStyle = "#fff";
      pen.fillRect(0, 0, width, height);
      pen.drawImage(image, 0, 0);
      image.close();
      const frame = new VideoFrame(canvas, { timestamp: at, duration: long });
      encoder.encode(frame, { keyFrame: k % APART === 0 });
      frame.close();
      at += long;
      share({ what: "encoding", done: k + 1, of: many });
      while (encoder.encodeQueueSize > QUEUE && !fault) await new Promise((go) => setTimeout(go, 4));
    }
    await encoder.flush();
  } finally {
    if (encoder.state !== "closed") encoder.close();
    decoder.close();
  }
  if (fault) throw fault;
  const about = { width, height, codec: config.codec, description };
  return ending === "webm" ? webm(pieces, about, at / 1000) : mp4(pieces, about);
}

/** @param {any} encoder @param {string[]} codecs @param {number} width @param {number} height */
async function configOf(encoder, codecs, width, height) {
  for (const codec of codecs) {
    const config = { codec, width, height, bitrate: Math.max(1_500_000, 8 * width * height), latencyMode: "quality", ...(codec.startsWith("avc1") ? { avc: { format: "avc" } } : {}) };
    try {
      const { supported } = await encoder.isConfigSupported(config);
      if (supported) return config;
    } catch {
      // Of this codec nothing is known here.
    }
  }
  return null;
}

// ---- WebM: elements of an identifier, a size and their content ----

/** @param {Piece[]} pieces @param {About} about @param {number} long milliseconds */
function webm(pieces, { width, height, codec }, long) {
  const head = element(0x1a45dfa3, element(0x4286, [1]), element(0x42f7, [1]), element(0x42f2, [4]), element(0x42f3, [8]), element(0x4282, ascii("webm")), element(0x4287, [4]), element(0x4285, [2]));
  const length = new Uint8Array(8);
  new DataView(length.buffer).setFloat64(0, long);
  const info = element(0x1549a966, element(0x2ad7b1, whole(1_000_000, 3)), element(0x4489, length), element(0x4d80, ascii("lampyris")), element(0x5741, ascii("lampyris")));
  const tracks = element(0x1654ae6b, element(0xae, element(0xd7, [1]), element(0x73c5, [1]), element(0x83, [1]), element(0x86, ascii(codec.startsWith("vp09") ? "V_VP9" : "V_VP8")),
    element(0xe0, element(0xb0, whole(width, 2)), element(0xba, whole(height, 2)))));
  /** @type {Uint8Array[]} */
  const clusters = [];
  /** @type {Uint8Array[]} */
  const cues = [];
  let place = info.length + tracks.length;
  for (let from = 0; from < pieces.length;) {
    let to = from + 1;
    while (to < pieces.length && !pieces[to].key && pieces[to].at - pieces[from].at < 30_000) to++;
    const begin = pieces[from].at;
    const cluster = element(0x1f43b675, element(0xe7, whole(begin, 4)), ...pieces.slice(from, to).map(({ data, at, key }) => element(0xa3, [0x81], whole(at - begin, 2), [key ? 0x80 : 0], data)));
    cues.push(element(0xbb, element(0xb3, whole(begin, 4)), element(0xb7, element(0xf7, [1]), element(0xf1, whole(place, 4)))));
    clusters.push(cluster);
    place += cluster.length;
    from = to;
  }
  return new Blob([head, element(0x18538067, info, tracks, ...clusters, element(0x1c53bb6b, ...cues))], { type: "video/webm" });
}

/** @param {number} id @param {...(Uint8Array | number[])} parts */
function element(id, ...parts) {
  const name = whole(id, id > 0xffffff ? 4 : id > 0xffff ? 3 : id > 0xff ? 2 : 1);
  const size = parts.reduce((sum, part) => sum + part.length, 0);
  // The size takes eight bytes, whatever it is.
  const length = [1, ...whole(0, 3), ...whole(size, 4)];
  return joined(name, length, ...parts);
}

// ---- MP4: boxes of a size, a name and their content ----

/** @param {Piece[]} pieces @param {About} about */
function mp4(pieces, { width, height, codec, description }) {
  const long = pieces.reduce((sum, one) => sum + one.long, 0);
  const matrix = [0x10000, 0, 0, 0, 0x10000, 0, 0, 0, 0x40000000].flatMap((v) => whole(v, 4));
  const zeros = (/** @type {number} */ n) => Array(n).fill(0);
  const avc = codec.startsWith("avc1");
  const kind = box(avc ? "avc1" : "vp09", zeros(6), whole(1, 2), zeros(16), whole(width, 2), whole(height, 2), whole(0x480000, 4), whole(0x480000, 4), zeros(4), whole(1, 2), zeros(32), whole(24, 2), [0xff, 0xff],
    avc ? box("avcC", description ?? []) : box("vpcC", [1, 0, 0, 0, 0, 31, 0x82, 2, 2, 2, 0, 0]));
  /** Runs of pictures that last as long. @type {Array<[number, number]>} */
  const spans = [];
  for (const { long: one } of pieces) {
    const last = spans[spans.length - 1];
    if (last && last[1] === one) last[0] += 1;
    else spans.push([1, one]);
  }
  const keys = pieces.flatMap(({ key }, k) => (key ? [k + 1] : []));
  const table = (/** @type {number} */ offset) => box("stbl",
    box("stsd", zeros(4), whole(1, 4), kind),
    box("stts", zeros(4), whole(spans.length, 4), spans.flatMap(([n, one]) => [...whole(n, 4), ...whole(one, 4)])),
    box("stss", zeros(4), whole(keys.length, 4), keys.flatMap((k) => whole(k, 4))),
    box("stsc", zeros(4), whole(1, 4), whole(1, 4), whole(pieces.length, 4), whole(1, 4)),
    box("stsz", zeros(8), whole(pieces.length, 4), pieces.flatMap(({ data }) => whole(data.length, 4))),
    box("stco", zeros(4), whole(1, 4), whole(offset, 4)));
  const movie = (/** @type {number} */ offset) => box("moov",
    box("mvhd", zeros(12), whole(1000, 4), whole(long, 4), whole(0x10000, 4), whole(0x100, 2), zeros(10), matrix, zeros(24), whole(2, 4)),
    box("trak",
      box("tkhd", [0, 0, 0, 3], zeros(8), whole(1, 4), zeros(4), whole(long, 4), zeros(16), matrix, whole(width, 2), zeros(2), whole(height, 2), zeros(2)),
      box("mdia", box("mdhd", zeros(12), whole(1000, 4), whole(long, 4), whole(0x55c4, 2), zeros(2)), box("hdlr", zeros(8), ascii("vide"), zeros(12), ascii("lampyris\0")),
        box("minf", box("vmhd", [0, 0, 0, 1], zeros(8)), box("dinf", box("dref", zeros(4), whole(1, 4), box("url ", [0, 0, 0, 1]))), table(offset)))));
  const head = box("ftyp", ascii("isom"), whole(512, 4), ascii("isom"), ascii("iso2"), ...(avc ? [ascii("avc1")] : []), ascii("mp41"));
  const offset = head.length + movie(0).length + 8;
  return new Blob([head, movie(offset), box("mdat", ...pieces.map(({ data }) => data))], { type: "video/mp4" });
}

/** @param {string} name @param {...(Uint8Array | number[])} parts */
function box(name, ...parts) {
  const size = 8 + parts.reduce((sum, part) => sum + part.length, 0);
  return joined(whole(size, 4), ascii(name), ...parts);
}

// ---- bytes ----

/** A whole number, the highest byte first. @param {number} value @param {number} bytes */
function whole(value, bytes) {
  return Array.from({ length: bytes }, (_, k) => Math.floor(value / 2 ** (8 * (bytes - 1 - k))) & 0xff);
}

/** @param {string} text */
function ascii(text) {
  return Array.from(text, (letter) => letter.charCodeAt(0));
}

/** @param {...(Uint8Array | number[])} parts */
function joined(...parts) {
  const out = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    out.set(part, at);
    at += part.length;
  }
  return out;
}
