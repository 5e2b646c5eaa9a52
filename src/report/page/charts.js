// Reads values in the drawings of a page and zooms them. A panel of a drawing states its frame in pixels and its axes; its curves are
// paths, whose points are values.

/** An axis of a panel: ends in the coordinate in which it is uniform, label and unit. */
const axisOf = (data, name) => {
  const [low, high, log] = data[name].split(" ");
  return { low: Number(low), high: Number(high), log: log === "true", label: data[`${name}label`], unit: data[`${name}unit`] };
};

const valueAt = (axis, share) => {
  const place = axis.low + share * (axis.high - axis.low);
  return axis.log ? 10 ** place : place;
};

const power = (exponent) => `10${[...String(exponent)].map((c) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[c] ?? "⁻").join("")}`;

/** A number with so many significant digits, a true minus, and a power of ten where it needs one. */
const number = (value, digits) => {
  const rounded = Number(value.toPrecision(Math.min(15, digits)));
  const size = Math.abs(rounded);
  if (size === 0 || (size >= 1e-3 && 1e6 > size)) return String(rounded).replace("-", "−");
  const [mantissa, exponent] = rounded.toExponential().split("e");
  return `${mantissa}×${power(Number(exponent))}`.replace("-", "−");
};

/** Ticks between two ends in uniform space: at decades, or at round values. */
const ticksOf = (log, low, high, most) => {
  const step = (room) => {
    const size = 10 ** Math.floor(Math.log10(room));
    return size * [1, 2, 5, 10].find((factor) => factor * size >= 0.999999 * room);
  };
  const round = (from, to) => {
    const each = step((to - from) / most);
    const digits = Math.ceil(Math.log10(Math.max(Math.abs(from), Math.abs(to)) / each) + 1e-9) + 1;
    const ticks = [];
    for (let i = Math.ceil(from / each - 1e-6); to / each + 1e-6 >= i; i += 1) ticks.push([i * each, number(i * each, Math.max(1, digits))]);
    return ticks;
  };
  if (!log) return round(low, high);
  if (1 > Math.floor(high) - Math.ceil(low)) return round(10 ** low, 10 ** high).filter(([x]) => x > 0).map(([x, label]) => [Math.log10(x), label]);
  const stride = Math.max(1, Math.ceil((high - low) / most));
  const ticks = [];
  for (let i = Math.ceil(low - 1e-9); high + 1e-9 >= i; i += 1) if (i % stride === 0) ticks.push([i, power(i)]);
  return ticks;
};

class Panel {
  constructor(box, chart) {
    const { data, inner } = { data: box.dataset, inner: box.querySelector("svg") };
    Object.assign(this, { box, chart, inner, x: axisOf(data, "x"), y: axisOf(data, "y") });
    [this.left, this.top, this.width, this.height] = data.frame.split(" ").map(Number);
    this.full = { from: 0, to: 1, low: 0, high: 1 };
    this.view = this.full;
    // Panels over the same time zoom and are read together.
    this.key = this.x.label.startsWith("time") ? [data.x, this.x.label].join(" ") : chart;
    this.curves = [...inner.querySelectorAll("[class]")].map((path) => ({ path, label: path.dataset.label, points: null }));
  }

  /** Shows a part of the panel: shares of the axes from the left and from the bottom. */
  show(view) {
    const { width, height } = this;
    const [across, up] = [view.to - view.from, view.high - view.low];
    this.view = view;
    this.inner.setAttribute("viewBox", [view.from * width, (1 - view.high) * height, across * width, up * height].join(" "));
    const bottom = this.top + height;
    let lines = "";
    const place = (group, axis, [first, last], most, at) => {
      const [low, span] = [axis.low, axis.high - axis.low];
      const old = [...group.children];
      const model = old[0];
      const ticks = ticksOf(axis.log, low + first * span, low + last * span, most);
      group.replaceChildren(...ticks.map(([value, label]) => {
        const share = ((value - low) / span - first) / (last - first);
        return at(share, label, model);
      }).filter(Boolean));
      if (!group.children.length && model) group.replaceChildren(model);
    };
    const text = (model, x, y, label) => {
      if (!model) return null;
      const made = model.cloneNode();
      made.setAttribute("x", x);
      made.setAttribute("y", y);
      made.textContent = label;
      return made;
    };
    place(this.box.querySelector(".x"), this.x, [view.from, view.to], Math.max(2, Math.min(8, Math.floor(width / 65))), (share, label, model) => {
      const x = this.left + share * width;
      lines += `M${x} ${bottom}V${this.top}`;
      return text(model, x, model?.getAttribute("y"), label);
    });
    place(this.box.querySelector(".y"), this.y, [view.low, view.high], Math.max(2, Math.floor(height / 33)), (share, label, model) => {
      const y = bottom - share * height;
      lines += `M${this.left} ${y}h${width}`;
      return text(model, model?.getAttribute("x"), y, label);
    });
    this.box.querySelector(".grid").setAttribute("d", lines);
  }

  /** The points of a curve in pixels, with the upper end for a band. */
  points(curve) {
    if (curve.points) return curve.points;
    const pair = (text) => text.split(/[ hV]/).slice(0, 2).map(Number);
    const all = (text) => text.split(/[MLZ]/).filter(Boolean).map(pair);
    const d = curve.path.getAttribute("d");
    const band = (run) => {
      const points = all(run);
      const count = points.length / 2;
      return points.slice(0, count).map(([x, y], i) => [x, y, points[2 * count - 1 - i][1]]);
    };
    curve.points = curve.path.classList.contains("band") ? d.split("Z").flatMap(band) : all(d);
    return curve.points;
  }

  /** Values of the curves nearest to a share of the axis. */
  values(share) {
    const [px, reach] = [share * this.width, 0.02 * this.width * (this.view.to - this.view.from) + 1];
    const valueOf = (y) => number(valueAt(this.y, 1 - y / this.height), 4 + Math.max(0, this.digits(this.y)));
    return this.curves.flatMap((curve) => {
      let [near, least] = [null, reach];
      for (const point of this.points(curve)) {
        const distance = Math.abs(point[0] - px);
        if (least > distance) [near, least] = [point, distance];
      }
      if (!near) return [];
      const numbers = near.slice(1).map(valueOf);
      return [`${curve.label ?? this.y.label} ${numbers.join(" to ")} ${this.y.unit}`.trim()];
    });
  }

  /** Digits that all values of an axis have in common. */
  digits({ low, high, log }) {
    return log ? 0 : Math.floor(Math.log10(Math.max(Math.abs(low), Math.abs(high)) / (high - low)));
  }

  /** The line at the place that is read. */
  cross(share) {
    this.inner.querySelector(".cross")?.remove();
    if (share === null) return;
    const line = document.createElementNS(this.inner.namespaceURI, "path");
    line.setAttribute("class", "cross");
    const x = share * this.width;
    line.setAttribute("d", `M${x} ${-9 * this.height}V${9 * this.height}`);
    this.inner.append(line);
  }
}

const charts = [...document.querySelectorAll("figure.chart .still")].map((still) => {
  const chart = { still, at: null };
  chart.panels = [...still.querySelectorAll(".panel")].map((box) => new Panel(box, chart));
  chart.cursor = document.createElement("p");
  chart.cursor.className = "cursor";
  still.after(chart.cursor);
  return chart;
});

const together = (panel) => charts.flatMap((chart) => chart.panels).filter((other) => other.key === panel.key);

const zoomTo = (panel, from, to) => {
  const room = Math.min(1, Math.max(0.005, to - from));
  const first = Math.min(Math.max(from, 0), 1 - room);
  for (const other of together(panel)) other.show({ ...other.view, from: first, to: first + room });
};

const reset = (chart) => chart.panels.forEach((panel) => together(panel).forEach((other) => other.show(other.full)));

/** Reads the values at a share of the horizontal axis; null ends the reading. */
const read = (panel, share) => {
  const { chart } = panel;
  const alike = chart.panels.filter((other) => other.key === panel.key);
  for (const other of together(panel)) other.cross(share);
  chart.at = share;
  if (share === null) {
    chart.cursor.textContent = "";
    return;
  }
  const x = `${panel.x.label || "x"} ${number(valueAt(panel.x, share), 5)} ${panel.x.unit}`.trim();
  chart.cursor.textContent = [x, ...alike.flatMap((other) => other.values(share))].join("; ");
};

/** The panel below a pointer, and the shares of its axes there. */
const below = (chart, event) => {
  const matrix = chart.still.querySelector("svg").getScreenCTM().inverse();
  const { x, y } = new DOMPoint(event.clientX, event.clientY).matrixTransform(matrix);
  const inside = (p) => x >= p.left && p.left + p.width >= x && y >= p.top && p.top + p.height >= y;
  const panel = chart.panels.find(inside);
  if (!panel) return null;
  const { from, to, low, high } = panel.view;
  const [across, up] = [(x - panel.left) / panel.width, 1 - (y - panel.top) / panel.height];
  return { panel, x: from + across * (to - from), y: low + up * (high - low), px: x, py: y };
};

const KEYS = {
  ArrowLeft: ({ panel, at, step }) => read(panel, Math.max(0, at - step)),
  ArrowRight: ({ panel, at, step }) => read(panel, Math.min(1, at + step)),
  "+": ({ panel, at, view }) => zoomTo(panel, at - 0.5 * (at - view.from), at + 0.5 * (view.to - at)),
  "-": ({ panel, at, view }) => zoomTo(panel, at - 2 * (at - view.from), at + 2 * (view.to - at)),
  Escape: ({ panel }) => reset(panel.chart),
};

for (const chart of charts.filter(({ panels }) => panels.length)) {
  const { still } = chart;
  still.setAttribute("role", "application");
  still.setAttribute("aria-label", still.parentElement.querySelector("strong").textContent);
  still.setAttribute("aria-describedby", "chart-keys");
  chart.cursor.setAttribute("aria-live", "polite");
  still.tabIndex = 0;
  let start = null;
  still.addEventListener("pointerdown", (event) => { start = event.pointerType === "mouse" ? below(chart, event) : null; });
  still.addEventListener("pointermove", (event) => {
    const here = below(chart, event);
    if (here) read(here.panel, here.x);
  });
  still.addEventListener("pointerup", (event) => {
    const [from, to] = [start, below(chart, event)];
    start = null;
    if (!from || !to || to.panel !== from.panel || 6 > Math.abs(to.px - from.px)) return;
    const { panel } = from;
    // A tall drag zooms both axes.
    if (Math.abs(to.py - from.py) > 24) panel.view = { ...panel.view, low: Math.min(from.y, to.y), high: Math.max(from.y, to.y) };
    zoomTo(panel, Math.min(from.x, to.x), Math.max(from.x, to.x));
  });
  still.addEventListener("pointerleave", () => { if (chart.panels.length) chart.panels.forEach((panel) => read(panel, null)); });
  still.addEventListener("dblclick", () => reset(chart));
  still.addEventListener("keydown", (event) => {
    const act = KEYS[event.key === "=" ? "+" : event.key];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    const [panel] = chart.panels;
    const { view } = panel;
    const at = Math.min(Math.max(chart.at ?? (view.from + view.to) / 2, view.from), view.to);
    act({ panel, view, at, step: (view.to - view.from) * (event.shiftKey ? 0.1 : 0.01) });
  });
}

// Paper shows what is folded.
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((part) => { part.open = true; }));
document.documentElement.classList.add("scripted");
