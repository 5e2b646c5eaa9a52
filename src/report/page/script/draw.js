// Marks as SVG paths, in the pixels of a panel.

/** Makes an element of the drawing; the name space is that of the drawing in the page. */
const shape = (space, name, attributes, parent) => {
  const element = document.createElementNS(space, name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  if (parent) parent.append(element);
  return element;
};

const element = (name, attributes, parent) => {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  if (parent) parent.append(made);
  return made;
};

const fixed = (value) => String(Math.round(value * 10) / 10);

/** The indices to draw: those in sight and a neighbour on either side. */
const inSight = (mark, view) => {
  if (!mark.rising) return [0, mark.x.length];
  const [low, high] = view.x.range.map((place) => uneven(view.x.log, place));
  return [Math.max(0, indexBefore(mark.x, low) - 1), Math.min(mark.x.length, indexBefore(mark.x, high) + 3)];
};

/** Calls `each` with the pixels of every drawable point in sight, and `gap` where one is missing. */
const walk = (mark, ys, view, each, gap) => {
  const [from, to] = inSight(mark, view);
  for (let i = from; to > i; i += 1) {
    const [px, py] = [view.px(mark.x[i]), view.py(ys[i])];
    if (Number.isFinite(px) && Number.isFinite(py)) each(px, py);
    else gap();
  }
};

const linePath = (mark, ys, view) => {
  let [path, pen, alone] = ["", "M", ""];
  const end = () => {
    // A sample between two gaps has no line segment and is drawn as a dot.
    path += alone;
    [pen, alone] = ["M", ""];
  };
  walk(mark, ys, view, (px, py) => {
    alone = pen === "M" ? "h0" : "";
    path += `${pen}${fixed(px)} ${fixed(py)}`;
    pen = "L";
  }, end);
  end();
  return path;
};

const dotPath = (mark, view) => {
  let path = "";
  walk(mark, mark.y, view, (px, py) => { path += `M${fixed(px)} ${fixed(py)}h0`; }, () => {});
  return path;
};

/** Lines from zero to the points. */
const stemPath = (mark, view) => {
  let path = "";
  const foot = fixed(view.near(view.py(0)));
  walk(mark, mark.y, view, (px, py) => { path += `M${fixed(px)} ${foot}V${fixed(view.near(py))}`; }, () => {});
  return path;
};

/** The areas between two curves, one for each stretch without a gap. */
const bandPath = (mark, view) => {
  let [path, low, high] = ["", [], []];
  const end = () => {
    if (low.length > 1) path += `M${low.join("L")}L${high.reverse().join("L")}Z`;
    [low, high] = [[], []];
  };
  const [from, to] = inSight(mark, view);
  for (let i = from; to > i; i += 1) {
    const [px, bottom, top] = [view.px(mark.x[i]), view.py(mark.y[i]), view.py(mark.high[i])];
    if (Number.isFinite(px + bottom + top)) {
      low.push(`${fixed(px)} ${fixed(view.near(bottom))}`);
      high.push(`${fixed(px)} ${fixed(view.near(top))}`);
    } else end();
  }
  end();
  return path;
};

const pathOf = (mark, view) => {
  const { left, top, width, height } = view;
  switch (mark.kind) {
    case "line": return linePath(mark, mark.y, view);
    case "points": return dotPath(mark, view);
    case "stems": return stemPath(mark, view);
    case "band": return bandPath(mark, view);
    case "across": return `M${left} ${fixed(view.near(view.py(mark.y[0])))}h${width}`;
    case "upright": return `M${fixed(view.px(mark.x[0]))} ${top}v${height}`;
    default: {
      const [from, to] = mark.x.map(view.px);
      return `M${fixed(from)} ${top}H${fixed(to)}v${height}H${fixed(from)}Z`;
    }
  }
};

const looks = (mark) => {
  switch (mark.kind) {
    case "band": return { class: `area ${mark.colour}${mark.dash ? " edged" : ""}` };
    case "span": return { class: "stretch" };
    case "points": return { class: `dots ${mark.colour}`, "stroke-width": mark.width };
    default: {
      const dash = mark.dash ? { "stroke-dasharray": mark.dash } : {};
      return { class: `curve ${mark.colour}`, "stroke-width": mark.width, ...dash };
    }
  }
};

const drawMark = (space, mark, view, parent) => {
  const path = pathOf(mark, view);
  if (!path || path.includes("NaN")) return;
  shape(space, "path", { ...looks(mark), d: path }, parent);
  if (mark.kind !== "band" || !mark.dash) return;
  // The dashes are those of both edges, not of the ends.
  const edges = [mark.y, mark.high].map((ys) => linePath(mark, ys, view)).join("");
  shape(space, "path", { ...looks({ ...mark, kind: "line", width: 1.2 }), d: edges }, parent);
};

const drawAxes = (space, view, parent) => {
  const { left, top, width, height } = view;
  const [right, bottom] = [left + width, top + height];
  for (const tick of view.xTicks) {
    const at = fixed(view.xAt(tick.place));
    shape(space, "path", { class: "grid", d: `M${at} ${top}V${bottom}` }, parent);
    // A long label at the right end stays within the drawing.
    const middle = fixed(Math.min(view.xAt(tick.place), view.outer - 3.5 * tick.label.length));
    const text = shape(space, "text", { x: middle, y: bottom + 16, "text-anchor": "middle" }, parent);
    text.textContent = tick.label;
  }
  for (const tick of view.yTicks) {
    const at = fixed(view.yAt(tick.place));
    shape(space, "path", { class: "grid", d: `M${left} ${at}H${right}` }, parent);
    // A label of many digits is narrowed to the margin.
    const narrow = tick.label.length > 8 ? { textLength: left - 8, lengthAdjust: "spacingAndGlyphs" } : {};
    const text = shape(space, "text", { x: left - 6, y: at, "text-anchor": "end", dy: "0.35em", ...narrow }, parent);
    text.textContent = tick.label;
  }
};

/** The value of a mark at an x, between two points by a straight line; null where there is none. */
const valueAt = (mark, ys, view, x) => {
  if (!mark.rising || !mark.x.length) return null;
  const i = indexBefore(mark.x, x);
  const next = mark.x[i + 1];
  if (mark.kind === "points" || mark.kind === "stems") {
    const near = next !== undefined && (0 > i || next - x <= x - mark.x[i]) ? i + 1 : i;
    return { x: mark.x[near], y: ys[near] };
  }
  if (0 > i) return null;
  if (mark.x[i] === x) return { x, y: ys[i] };
  if (next === undefined || ys[i] === null || ys[i + 1] === null) return null;
  const [a, b, c] = [mark.x[i], next, x].map((value) => even(view.x.log, value));
  const share = (c - a) / (b - a);
  const [from, to] = [even(view.y.log, ys[i]), even(view.y.log, ys[i + 1])];
  return { x, y: uneven(view.y.log, from + share * (to - from)) };
};
