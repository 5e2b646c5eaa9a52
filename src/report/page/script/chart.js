// A chart: panels over shared horizontal axes, a legend that toggles curves, buttons, and the values at the pointer.

/** Horizontal axes by what they show: charts of the same time zoom and read together. */
const axes = new Map();

const axisOf = (key, log) => {
  if (!axes.has(key)) axes.set(key, { log, full: null, range: null, at: null, panels: [] });
  return axes.get(key);
};

/** Draws all panels of an axis again, once before the next picture. */
const refresh = (axis) => {
  if (axis.waiting) return;
  axis.waiting = true;
  requestAnimationFrame(() => {
    axis.waiting = false;
    for (const panel of axis.panels) panel.draw();
    for (const chart of new Set(axis.panels.map((panel) => panel.chart))) chart.buttons();
  });
};

const setRange = (axis, low, high) => {
  const [least, most] = axis.full;
  const room = most - least;
  // Least range: a billionth of the full range, or the rounding error.
  const closest = Math.max(1e-9 * room, 1e-12 * Math.max(Math.abs(least), Math.abs(most)));
  const span = Math.min(room, Math.max(high - low, closest));
  const first = Math.min(Math.max(low, least), most - span);
  axis.range = [first, first + span];
  refresh(axis);
};

/** Shows `factor` of the range in sight, with the place `at` where it is. */
const zoom = (axis, factor, at) => {
  const [low, high] = axis.range;
  setRange(axis, at - factor * (at - low), at + factor * (high - at));
};

const isZoomed = (axis) => axis.range[0] > axis.full[0] || axis.full[1] > axis.range[1];

const caption = ({ label, unit }) => (unit ? (label ? `${label} (${unit})` : unit) : label);

class Chart {
  constructor(figure, data, index) {
    this.figure = figure;
    this.space = figure.querySelector(".still svg").namespaceURI;
    this.title = figure.querySelector("figcaption strong").textContent;
    this.hidden = new Set();
    this.live = element("div", { class: "live" });
    this.bar();
    const grid = element("div", { class: data.columns > 1 ? "panels beside" : "panels" }, this.live);
    this.panels = data.panels.map((panel, i) => new Panel(this, panel, `${index}-${i}`, grid, data.panels.length));
    this.panels.forEach((panel, i) => panel.box.classList.toggle("shares", this.panels[i + 1]?.axis === panel.axis));
    this.legend(data.off);
    figure.querySelector(".still").after(this.live);
  }

  bar() {
    const bar = element("div", { class: "bar" }, this.live);
    this.keys = element("div", { class: "keys", role: "group", "aria-label": `Curves of ${this.title}` }, bar);
    const tools = element("div", { class: "tools", role: "group", "aria-label": `Zoom of ${this.title}` }, bar);
    const files = element("div", { class: "tools", role: "group", "aria-label": `Downloads of ${this.title}` }, bar);
    const button = (text, name, act, group = tools) => {
      const made = element("button", { type: "button", "aria-label": name, title: name }, group);
      made.textContent = text;
      made.addEventListener("click", act);
      return made;
    };
    const each = (factor) => () => this.xAxes().forEach((axis) => {
      const middle = axis.at === null ? (axis.range[0] + axis.range[1]) / 2 : axis.at;
      zoom(axis, factor, Math.min(Math.max(middle, axis.range[0]), axis.range[1]));
    });
    button("+", "Zoom in", each(0.5));
    button("−", "Zoom out", each(2));
    this.whole = button("Reset", "Reset: show everything again", () => this.reset());
    const file = this.figure.id.replace("figure-", "");
    button("SVG", "SVG: download the drawing", () => saveSvg(this.figure, file), files);
    button("PNG", "PNG: download the drawing", () => savePng(this.figure, file), files);
    button("CSV", "CSV: download the numbers", () => saveCsv(this.panels, file), files);
  }

  xAxes() {
    return [...new Set(this.panels.map((panel) => panel.axis))];
  }

  /** One key for each label of one colour, with the look of its curve if it has one. */
  legend(off) {
    const seen = new Map();
    for (const mark of this.panels.flatMap((panel) => panel.marks)) {
      mark.key = [mark.label, mark.colour].join("|");
      const first = seen.get(mark.key);
      if (mark.label && (!first || (first.kind !== "line" && mark.kind === "line"))) seen.set(mark.key, mark);
    }
    for (const [key, mark] of seen) {
      const shown = !off.includes(mark.label);
      if (!shown) this.hidden.add(key);
      const button = element("button", { type: "button", class: "key", "aria-pressed": String(shown) }, this.keys);
      const sample = shape(this.space, "svg", { viewBox: "0 0 28 12", "aria-hidden": "true" }, button);
      const paths = { points: "M5 6h0M14 6h0M23 6h0", band: "M0 1H28V11H0Z", span: "M0 1H28V11H0Z" };
      shape(this.space, "path", { ...looks(mark), d: paths[mark.kind] ?? "M0 6H28" }, sample);
      if (mark.kind === "band" && mark.dash) shape(this.space, "path", { ...looks({ ...mark, kind: "line", width: 1.2 }), d: "M0 1H28M0 11H28" }, sample);
      element("span", {}, button).textContent = mark.label;
      button.addEventListener("click", () => this.toggle(key, button));
    }
  }

  toggle(key, button) {
    const shown = this.hidden.delete(key);
    if (!shown) this.hidden.add(key);
    button.setAttribute("aria-pressed", String(shown));
    for (const panel of this.panels) panel.draw();
  }

  reset() {
    for (const panel of this.panels) panel.yRange = null;
    for (const axis of this.xAxes()) setRange(axis, ...axis.full);
  }

  buttons() {
    const zoomed = this.panels.some((panel) => panel.yRange) || this.xAxes().some(isZoomed);
    this.whole.disabled = !zoomed;
  }
}
