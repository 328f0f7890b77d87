// In the page: what bench_app measures there. The page knows nothing of this; its modules are asked for again, and
// every module is there only once.

async () => {
  const { sourceOf } = await import("/static/layers.js");
  const page = sourceOf(/** @type {any} */ (null)).page;
  const { map } = page;
  const bench = (window.bench = { page, times: [], costs: [], echoes: [], wrong: 0, moves: [], follows: [], seconds: [] });

  // Frames: when each was drawn, and how long its drawing took.
  map.onFrame = (ms) => {
    bench.times.push(performance.now());
    bench.costs.push(ms);
    follow();
  };
  bench.take = () => {
    const taken = { times: bench.times, costs: bench.costs };
    bench.times = [];
    bench.costs = [];
    return taken;
  };

  // Something to do in each frame.
  let turn = 0;
  bench.each = (act) => {
    cancelAnimationFrame(turn);
    let k = 0;
    const again = (now) => {
      act(k++, now);
      turn = requestAnimationFrame(again);
    };
    if (act) turn = requestAnimationFrame(again);
  };
  const other = (k) => {
    const { width, height } = page.ground;
    const values = new Uint8Array(width * height);
    for (let c = 0; c < values.length; c++) values[c] = 1 + ((7 * c + 31 * k + 3 * Math.floor(c / width)) % 255);
    return { name: "cost", width, height, low: 0, high: 1, values };
  };
  bench.heat = () => {
    const layers = Array.from({ length: 8 }, (_, k) => other(k));
    bench.each((k) => map.setLayer(layers[k % 8]));
  };
  bench.wheel = (x, y) => {
    // In for two seconds, and out again.
    bench.each((_, now) => {
      const deltaY = now % 4000 < 2000 ? -30 : 30;
      map.canvas.dispatchEvent(new WheelEvent("wheel", { deltaY, clientX: x, clientY: y, cancelable: true, bubbles: true }));
    });
  };
  bench.pan = () =>
    bench.each((k) => {
      map.view.pan(k % 120 < 60 ? 3 : -3, k % 80 < 40 ? 2 : -2, page.ground.width, page.ground.height);
      map.refresh();
    });
  bench.still = () => {
    bench.each(null);
    map.setLayer(null);
    map.fit();
  };

  // Painting: from when the browser got an event until its cells can be read back from the screen's canvas.
  const repaint = map.repaint.bind(map);
  let since = 0;
  for (const kind of ["pointerdown", "pointermove", "pointerrawupdate"]) {
    map.canvas.addEventListener(kind, (event) => (since = event.timeStamp), true);
  }
  map.repaint = (cells) => {
    repaint(cells);
    if (!bench.painting) return;
    const all = [...cells];
    const [cx, cy] = all[all.length - 1];
    const began = since;
    const look = () => {
      const [x, y] = map.view.pixel(cx, cy);
      const [red] = map.pen.getImageData(Math.round(x * devicePixelRatio), Math.round(y * devicePixelRatio), 1, 1).data;
      return red < 128;
    };
    if (look()) bench.echoes.push(performance.now() - began);
    else {
      // Not at once: with the next frame.
      requestAnimationFrame(() => requestAnimationFrame(() => {
        if (look()) bench.echoes.push(performance.now() - began);
        else bench.wrong++;
      }));
    }
  };

  // Dragging: from a move until a way is on the canvas that leads to where that move, or a later one, had put the goal.
  let ends = "";
  page.store.listen((changed) => {
    if (changed.has("goal")) bench.moves.push({ at: since, goal: String(page.store.scenario.goal), done: 0 });
  });
  page.on("plan", (plan) => {
    const cells = plan?.cells ?? [];
    ends = cells.length ? `${cells[cells.length - 2]},${cells[cells.length - 1]}` : "";
    if (ends) bench.seconds.push(plan.seconds);
  });
  const follow = () => {
    if (!ends) return;
    const now = performance.now();
    const newest = bench.moves.findLastIndex((move) => move.goal === ends);
    for (let k = 0; k <= newest; k++) {
      if (bench.moves[k].done) continue;
      bench.moves[k].done = now;
      bench.follows.push(now - bench.moves[k].at);
    }
    ends = "";
  };
}
