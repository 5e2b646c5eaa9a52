// One pair of axes in a chart.

const MARGIN = { left: 62, right: 20, top: 8, bottom: 26 };

class Panel {
  constructor(chart, data, name, parent, count) {
    Object.assign(this, { chart, name, title: data.title, x: data.x, y: data.y, yRange: null });
    this.marks = data.marks.map((mark) => this.prepared(mark));
    const own = data.x.limits ? data.x.limits.map((v) => even(data.x.log, v)) : this.xExtent();
    // Charts over the same time axis zoom together.
    const span = (own ?? []).map((end) => end.toPrecision(4)).join(" ");
    const owner = data.x.label.startsWith("time") ? span : name.split("-")[0];
    this.axis = axisOf([caption(data.x), data.x.log, owner].join("|"), data.x.log);
    this.axis.panels.push(this);
    this.axis.full = union(this.axis.full, own);
    this.height = count === 1 ? 330 : 210;
    this.build(parent);
  }

  prepared(mark) {
    const rising = mark.x.every((value, i) => i === 0 || value >= mark.x[i - 1]);
    return { ...mark, rising };
  }

  xExtent() {
    return this.marks.reduce((range, mark) => union(range, extent(this.x.log, mark.x)), null);
  }

  build(parent) {
    const { chart } = this;
    this.box = element("div", { class: "panel" }, parent);
    const head = element("div", { class: "head" }, this.box);
    if (this.title) element("div", { class: "name" }, head).textContent = this.title;
    element("div", { class: "ylabel" }, head).textContent = caption(this.y);
    const name = [chart.title, this.title, caption(this.y), `against ${caption(this.x)}`].filter(Boolean).join(", ");
    this.plot = element("div", {
      class: "plot", tabindex: "0", role: "application", "aria-roledescription": "chart",
      "aria-label": name, "aria-describedby": "chart-keys",
    }, this.box);
    this.svg = shape(chart.space, "svg", { role: "img", "aria-label": name }, this.plot);
    element("div", { class: "xlabel" }, this.box).textContent = caption(this.x);
    this.cursor = element("div", { class: "cursor" }, this.box);
    this.cross = null;
    listen(this);
  }

  isShown(mark) {
    return !this.chart.hidden.has(mark.key);
  }

  /** What the vertical axis shows unless it is zoomed. */
  fullY() {
    const { log, limits } = this.y;
    if (limits) return limits.map((value) => even(log, value));
    const shown = this.marks.filter((mark) => this.isShown(mark));
    const lists = shown.flatMap((mark) => [mark.y, mark.high]);
    const range = lists.reduce((all, values) => union(all, extent(log, values)), null);
    return padded(range ?? [0, 1], 0.05);
  }

  /** Places in pixels for what is in sight. */
  view() {
    const width = Math.max(200, Math.floor(this.plot.clientWidth));
    const frame = { left: MARGIN.left, top: MARGIN.top, width: width - MARGIN.left - MARGIN.right, height: this.height - MARGIN.top - MARGIN.bottom };
    const [x, y] = [this.axis.range, this.yRange ?? this.fullY()];
    const bottom = frame.top + frame.height;
    const xAt = (place) => frame.left + ((place - x[0]) / (x[1] - x[0])) * frame.width;
    const yAt = (place) => bottom - ((place - y[0]) / (y[1] - y[0])) * frame.height;
    return {
      ...frame, bottom, outer: width, xAt, yAt,
      x: { log: this.x.log, range: x }, y: { log: this.y.log, range: y },
      xTicks: ticksOf(this.x.log, x, Math.max(2, Math.min(8, Math.floor(frame.width / 65)))),
      yTicks: ticksOf(this.y.log, y, Math.max(2, Math.floor(frame.height / 40))),
      px: (value) => xAt(even(this.x.log, value)),
      py: (value) => yAt(even(this.y.log, value)),
      // Points far outside the frame are moved closer to it.
      near: (pixel) => Math.min(Math.max(pixel, -5000), 5000),
      placeAt: (pixel) => x[0] + ((pixel - frame.left) / frame.width) * (x[1] - x[0]),
      heightAt: (pixel) => y[0] + ((bottom - pixel) / frame.height) * (y[1] - y[0]),
    };
  }

  draw() {
    if (!this.plot.clientWidth) return;
    const { space } = this.chart;
    const view = this.view();
    const { svg } = this;
    svg.replaceChildren();
    svg.setAttribute("viewBox", `0 0 ${view.outer} ${this.height}`);
    svg.setAttribute("height", this.height);
    svg.dataset.x = this.axis.range.join(" ");
    svg.dataset.y = view.y.range.join(" ");
    const clip = `clip-${this.name}`;
    const frame = { x: view.left, y: view.top, width: view.width, height: view.height };
    shape(space, "rect", frame, shape(space, "clipPath", { id: clip }, shape(space, "defs", {}, svg)));
    const back = shape(space, "g", { "clip-path": `url(#${clip})` }, svg);
    drawAxes(space, view, svg);
    const front = shape(space, "g", { class: "marks", "clip-path": `url(#${clip})` }, svg);
    for (const mark of this.marks) {
      if (this.isShown(mark)) drawMark(space, mark, view, mark.kind === "span" ? back : front);
    }
    shape(space, "rect", { class: "frame", ...frame }, svg);
    this.read(view);
  }

  /** The line at the place that is read, and the values there. */
  read(view) {
    const place = this.axis.at;
    this.cursor.replaceChildren();
    if (place === null) return;
    const x = uneven(this.x.log, place);
    const pixel = view.xAt(place);
    const inside = pixel >= view.left - 0.5 && view.left + view.width + 0.5 >= pixel;
    if (inside) shape(this.chart.space, "path", { class: "cross", d: `M${fixed(pixel)} ${view.top}V${view.bottom}` }, this.svg);
    const digits = this.digits(view);
    const parts = [`${this.x.label || "x"} ${number(x, digits)} ${this.x.unit}`.trim()];
    for (const { mark, text, y } of this.values(view, x)) {
      parts.push(`${mark.label || this.y.label} ${text}`);
      const height = view.py(y);
      if (inside && height >= view.top && view.bottom >= height) {
        shape(this.chart.space, "circle", { class: `at ${mark.colour}`, cx: fixed(pixel), cy: fixed(height), r: 3.5 }, this.svg);
      }
    }
    for (const part of parts) element("span", {}, this.cursor).textContent = part;
  }

  /** Digits that tell neighbouring pixels apart. */
  digits(view) {
    const [low, high] = view.x.range.map((place) => uneven(this.x.log, place));
    const ratio = Math.max(Math.abs(low), Math.abs(high)) / Math.abs(high - low);
    return Math.min(12, 4 + Math.ceil(Math.log10(Math.max(1, ratio))));
  }

  values(view, x) {
    const found = [];
    const curves = new Set(this.marks.filter((mark) => mark.kind === "line" && mark.label).map((mark) => mark.key));
    const isRepeated = (mark) => mark.kind === "points" && curves.has(mark.key);
    for (const mark of this.marks.filter((mark) => mark.x.length && mark.y.length && this.isShown(mark) && !isRepeated(mark))) {
      if (mark.kind === "band") {
        const [low, high] = [mark.y, mark.high].map((ys) => valueAt(mark, ys, view, x));
        if (low && high) found.push({ mark, y: NaN, text: `${number(low.y, 5)} to ${number(high.y, 5)} ${this.y.unit}`.trim() });
      } else {
        const value = valueAt(mark, mark.y, view, x);
        if (value && value.y !== null) found.push({ mark, y: value.y, text: `${number(value.y, 5)} ${this.y.unit}`.trim() });
      }
    }
    return found;
  }

  /** Says the values to those who listen. */
  say() {
    const words = [...this.cursor.children].map((part) => part.textContent);
    document.getElementById("chart-cursor").textContent = words.join("; ");
  }
}
