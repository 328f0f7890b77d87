// A run at any moment: the map, the trail, robot and obstacles on a canvas; a slider, a button that plays.

const SIDE = 480;
const COLOURS = { free: [255, 255, 255], wall: [60, 60, 60], unknown: [200, 200, 200] };

/** The map as a picture of one pixel a cell. */
function pictureOf(cells, width, height) {
  const sheet = document.createElement("canvas");
  sheet.width = width;
  sheet.height = height;
  const image = new ImageData(width, height);
  const kinds = [COLOURS.free, COLOURS.wall, COLOURS.unknown];
  for (let k = 0; k < width * height; k += 1) image.data.set([...kinds[cells.getUint8(k)], 255], 4 * k);
  sheet.getContext("2d").putImageData(image, 0, 0);
  return sheet;
}

function render({ model, el }) {
  const frames = model.get("frames");
  const [width, height] = model.get("shape");
  const raw = model.get("cells");
  const cells = raw instanceof DataView ? raw : new DataView(raw.buffer ?? raw);
  const last = frames.t.length - 1;
  const scale = SIDE / Math.max(width, height);
  const map = pictureOf(cells, width, height);

  const canvas = document.createElement("canvas");
  canvas.width = Math.round(width * scale);
  canvas.height = Math.round(height * scale);
  canvas.style.maxWidth = "100%";
  canvas.setAttribute("role", "img");
  const play = document.createElement("button");
  play.textContent = "Play";
  const slider = document.createElement("input");
  slider.type = "range";
  slider.min = "0";
  slider.max = String(last);
  slider.style.width = "60%";
  slider.setAttribute("aria-label", "moment");
  const label = document.createElement("div");
  label.setAttribute("aria-live", "polite");
  el.append(canvas, document.createElement("br"), play, slider, label);
  const pen = canvas.getContext("2d");

  const disc = (x, y, radius, colour) => {
    pen.fillStyle = colour;
    pen.beginPath();
    pen.arc((x + 0.5) * scale, (y + 0.5) * scale, Math.max(radius * scale, 3), 0, 2 * Math.PI);
    pen.fill();
  };

  const draw = () => {
    const now = Math.min(Math.max(model.get("frame"), 0), last);
    slider.value = String(now);
    pen.imageSmoothingEnabled = false;
    pen.drawImage(map, 0, 0, canvas.width, canvas.height);
    pen.strokeStyle = "#1f77b4";
    pen.lineWidth = 2;
    pen.beginPath();
    for (let k = 0; k <= now; k += 1) pen.lineTo((frames.x[k] + 0.5) * scale, (frames.y[k] + 0.5) * scale);
    pen.stroke();
    disc(...frames.goal, 0.4, "#2ca02c");
    for (const one of frames.obstacles) {
      if (one.x[now] !== null) disc(one.x[now], one.y[now], one.radius, "#d62728");
    }
    disc(frames.x[now], frames.y[now], frames.radius, "#1f77b4");
    const time = frames.unit === "tick" ? `tick ${frames.t[now]}` : `${frames.t[now].toFixed(2)} ${frames.unit}`;
    const end = now === last ? `; ${frames.outcome}` : "";
    label.textContent = `${time}: ${frames.speed[now].toFixed(2)} ${frames.speed_unit}, limited by ${frames.cause[now]}${end}`;
    canvas.setAttribute("aria-label", label.textContent);
  };

  const show = (frame) => {
    model.set("frame", frame);
    model.save_changes();
    draw();
  };

  let timer = null;
  const stop = () => {
    clearInterval(timer);
    timer = null;
    play.textContent = "Play";
  };
  play.addEventListener("click", () => {
    if (timer !== null) {
      stop();
      return;
    }
    if (model.get("frame") >= last) show(0);
    play.textContent = "Pause";
    const each = frames.unit === "tick" ? 120 : Math.max((1000 * frames.t[last]) / Math.max(last, 1), 20);
    timer = setInterval(() => {
      if (model.get("frame") >= last) stop();
      else show(model.get("frame") + 1);
    }, each);
  });
  slider.addEventListener("input", () => {
    stop();
    show(Number(slider.value));
  });
  model.on("change:frame", draw);
  draw();
  return () => {
    stop();
    model.off("change:frame", draw);
  };
}

export default { render };
