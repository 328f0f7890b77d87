// What can be measured of how the page looks, as one function: texts too pale, controls too small, what sticks out.
() => {
  const light = (v) => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);
  const luminance = ([r, g, b]) => 0.2126 * light(r) + 0.7152 * light(g) + 0.0722 * light(b);
  const pen = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
  const known = new Map();
  const colour = (text) => {
    if (!known.has(text)) {
      pen.clearRect(0, 0, 1, 1);
      pen.fillStyle = text;
      pen.fillRect(0, 0, 1, 1);
      const [r, g, b, a] = pen.getImageData(0, 0, 1, 1).data;
      known.set(text, [r, g, b, a / 255]);
    }
    return known.get(text);
  };
  const over = (top, low) => [0, 1, 2].map((i) => top[i] * top[3] + low[i] * (1 - top[3])).concat([1]);
  const ground = (element) => {
    const sheets = [];
    for (let at = element; at; at = at.parentElement) {
      sheets.push(colour(getComputedStyle(at).backgroundColor));
      if (sheets.at(-1)[3] === 1) break;
    }
    return sheets.reverse().reduce((low, top) => over(top, low), [255, 255, 255, 1]);
  };
  const contrast = (a, b) => {
    const [high, low] = [luminance(a), luminance(b)].sort((x, y) => y - x);
    return (high + 0.05) / (low + 0.05);
  };
  const seen = (element) => element.checkVisibility({ visibilityProperty: true, opacityProperty: true });
  const name = (element) => (element.getAttribute("aria-label") || element.textContent || element.id).trim().slice(0, 30);

  const pale = [];
  let texts = 0;
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    const element = walk.currentNode.parentElement;
    if (!walk.currentNode.data.trim() || element.closest(".unseen, .skip, noscript, option, :disabled") || !seen(element)) continue;
    texts += 1;
    const style = getComputedStyle(element);
    const behind = ground(element);
    const ink = [...colour(element instanceof SVGElement ? style.fill : style.color)];
    for (let at = element; at; at = at.parentElement) ink[3] *= Number(getComputedStyle(at).opacity);
    const size = parseFloat(style.fontSize);
    const large = size >= 24 || (size >= 18.66 && Number(style.fontWeight) >= 700);
    const ratio = contrast(over(ink, behind), behind);
    if (ratio < (large ? 3 : 4.5)) pale.push(`${element.tagName} ${ratio.toFixed(2)}: ${walk.currentNode.data.trim().slice(0, 30)}`);
  }
  for (const field of document.querySelectorAll("input, select")) {
    // What is typed into, and what stands there before.
    if (!seen(field) || field.matches(":disabled, [type=range], [type=checkbox], [type=radio]")) continue;
    const style = getComputedStyle(field);
    const behind = ground(field);
    const edge = contrast(over(colour(style.borderTopColor), behind), behind);
    if (edge < 3) pale.push(`edge of ${field.tagName} ${edge.toFixed(2)}: ${name(field) || field.id}`);
    if (!field.placeholder) continue;
    const hint = contrast(over(colour(getComputedStyle(field, "::placeholder").color), behind), behind);
    if (hint < 4.5) pale.push(`placeholder ${hint.toFixed(2)}: ${field.placeholder}`);
  }

  const least = innerWidth < 821 ? 40 : 24;
  const small = [];
  let targets = 0;
  for (const element of document.querySelectorAll("button, input, select, textarea, summary, a[href], [role=slider]")) {
    // A link in a sentence is as high as its line (WCAG 2.5.8 leaves those out).
    if (!seen(element.labels?.[0] ?? element) || element.closest(".unseen, .skip") || element.matches("p a")) continue;
    // A label is pressed for what it names.
    const boxes = [element, ...(element.labels ?? [])].map((one) => one.getBoundingClientRect());
    const wide = Math.max(...boxes.map((box) => box.right)) - Math.min(...boxes.map((box) => box.left));
    const high = Math.max(...boxes.map((box) => box.bottom)) - Math.min(...boxes.map((box) => box.top));
    if (!wide || !high) continue;
    targets += 1;
    if (wide < least - 0.5 || high < least - 0.5) small.push(`${element.tagName} ${Math.round(wide)} x ${Math.round(high)}: ${name(element)}`);
  }

  const out = [];
  for (const element of document.querySelectorAll("body *")) {
    // Some boxes scroll by themselves; nothing else may stick out of the window.
    if (element.closest(".wide, .maps, .unseen, .skip, .mosaic, dialog:not([open])") || !seen(element)) continue;
    const box = element.getBoundingClientRect();
    if (box.width && (box.right > innerWidth + 1 || box.left < -1)) out.push(`${element.tagName}.${element.className} ${Math.round(box.left)} to ${Math.round(box.right)}`);
  }
  for (const pane of document.querySelectorAll(".pane, #stage, #below, #top, html")) {
    if (seen(pane) && pane.scrollWidth > pane.clientWidth + 1) out.push(`${pane.id || pane.tagName} scrolls sideways: ${pane.scrollWidth} in ${pane.clientWidth}`);
  }
  return { pale, small, out, texts, targets };
}
