// Animation of the fitted system: wall, spring, damper and mass at the modelled displacement, the measured one as a dashed outline.

/** Pixels: width, height, the mass at rest, its half-width, and the largest travel. */
const SCENE = { width: 640, height: 150, rest: 400, half: 45, travel: 120 };

const pointsOf = (start, end, count, height, middle) => {
  const lead = 18;
  const step = (end - start - 2 * lead) / count;
  let path = `M${fixed(start)} ${middle}H${fixed(start + lead)}`;
  for (let i = 0; count > i; i += 1) {
    path += `L${fixed(start + lead + (i + 0.5) * step)} ${middle + (i % 2 ? height : -height)}`;
  }
  return `${path}L${fixed(end - lead)} ${middle}H${fixed(end)}`;
};

/** Value of a mark at a time, linear between points; null outside. */
const atTime = (mark, time) => {
  if (!mark || !mark.x.length) return null;
  const i = Math.min(indexBefore(mark.x, time), mark.x.length - 1);
  if (0 > i) return null;
  const [here, next] = [mark.y[i], mark.y[i + 1]];
  if (here === null || next === undefined || next === null) return here;
  const share = (time - mark.x[i]) / (mark.x[i + 1] - mark.x[i]);
  return here + (share > 0 ? share : 0) * (next - here);
};

class Motion {
  constructor(details, charts) {
    const contents = JSON.parse(details.querySelector(".contents").textContent);
    const own = details.querySelector(".response");
    const chart = charts.find(({ figure }) => figure.id === contents.chart);
    const panel = own ? JSON.parse(own.textContent).panels[0] : chart?.panels[0];
    if (!panel) { details.remove(); return; }
    if (own) for (const mark of panel.marks) mark.x = spread(mark.x);
    const labelled = (label) => panel.marks.find((mark) => mark.label === label);
    [this.model, this.samples, this.y] = [labelled("model"), labelled("samples"), panel.y];
    const { x } = this.model;
    [this.from, this.to] = [x[0], x[x.length - 1]];
    const all = [this.model, this.samples].flatMap((mark) => mark?.y ?? []);
    this.largest = all.reduce((most, y) => Math.max(most, Math.abs(y ?? 0)), 0) || 1;
    const functions = charts.find(({ figure }) => figure.id === "figure-functions");
    this.coefficients = contents.coefficients.map((coefficient) => {
      const of = functions?.panels.find((p) => p.y.label === coefficient.label);
      return { ...coefficient, mark: of?.marks.find((mark) => mark.label === "estimate") };
    });
    Object.assign(this, { time: this.from, playing: false, before: null });
    this.build(details);
    details.addEventListener("toggle", () => { if (!details.open) this.pause(); });
    this.draw();
  }

  build(details) {
    const space = document.querySelector(".still svg").namespaceURI;
    const { width, height } = SCENE;
    const name = this.samples
      ? "Moving mass with spring and damper: solid as modelled, dashed outline as measured"
      : "Moving mass with spring and damper, as modelled";
    const svg = shape(space, "svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": name, class: "scene" }, details);
    const line = (attributes) => shape(space, "path", { class: "curve black", "stroke-width": 1.5, ...attributes }, svg);
    line({ d: `M20 10V${height - 20}H${width - 20}` });
    this.spring = line({});
    this.damper = line({});
    this.block = shape(space, "rect", { class: "mass", y: 30, width: 2 * SCENE.half, height: 90 }, svg);
    this.ghost = line({ class: "curve vermillion", "stroke-dasharray": "5 4" });
    const bar = element("div", { class: "bar" }, details);
    this.button = element("button", { type: "button" }, bar);
    this.button.addEventListener("click", () => (this.playing ? this.pause() : this.play()));
    const speed = element("label", {}, bar);
    speed.append("Speed ");
    this.speed = element("select", {}, speed);
    // The first speed shows the record in 20 s.
    const slow = 10 ** Math.round(Math.log10((this.to - this.from) / 20));
    for (const factor of [1, 0.1, 0.01, 10]) {
      element("option", { value: slow * factor }, this.speed).textContent = `${number(slow * factor, 3)} ×`;
    }
    const time = element("label", { class: "time" }, bar);
    time.append("Time ");
    this.slider = element("input", { type: "range", min: 0, max: 1000, value: 0, step: 1 }, time);
    this.slider.addEventListener("input", () => {
      this.pause();
      this.time = this.from + (Number(this.slider.value) / 1000) * (this.to - this.from);
      this.draw();
      this.tell();
    });
    // Readers who stand on the slider would hear every step.
    this.slider.addEventListener("focus", () => this.pause());
    this.values = element("dl", { class: "pairs" }, details);
    const row = (label) => {
      element("dt", {}, this.values).textContent = label;
      return element("dd", {}, this.values);
    };
    this.clock = row("time");
    this.place = row(`${this.y.label}, model`);
    this.measured = this.samples ? row(`${this.y.label}, measured`) : null;
    for (const coefficient of this.coefficients) {
      const cell = row(coefficient.label);
      coefficient.text = element("span", {}, cell);
      const gauge = shape(space, "svg", { viewBox: "0 0 100 8", class: "gauge", "aria-hidden": "true" }, cell);
      shape(space, "rect", { class: "stretch", width: 100, height: 8 }, gauge);
      coefficient.gauge = shape(space, "rect", { class: "level", height: 8 }, gauge);
    }
    this.label();
    this.tell();
  }

  label() {
    this.button.textContent = this.playing ? "Pause" : "Play";
  }

  /** The time for readers, where it does not run. */
  tell() {
    this.slider.setAttribute("aria-valuetext", `${number(this.time, 4)} s`);
  }

  play() {
    if (this.time >= this.to) this.time = this.from;
    Object.assign(this, { playing: true, before: null });
    this.label();
    requestAnimationFrame((now) => this.frame(now));
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.label();
    this.tell();
  }

  frame(now) {
    if (!this.playing) return;
    // A pause of the browser adds no time.
    const passed = Math.min(now - (this.before ?? now), 100) / 1000;
    this.before = now;
    this.time = Math.min(this.time + passed * Number(this.speed.value), this.to);
    this.draw();
    if (this.time >= this.to) this.pause();
    else requestAnimationFrame((next) => this.frame(next));
  }

  draw() {
    const { rest, half, travel } = SCENE;
    const at = (y) => rest + (travel * (y ?? 0)) / this.largest;
    const y = atTime(this.model, this.time);
    const left = at(y) - half;
    this.spring.setAttribute("d", pointsOf(20, left, 12, 10, 50));
    const middle = 20 + 0.5 * (rest - half - 20);
    this.damper.setAttribute("d", `M20 100H${fixed(middle - 30)}M${fixed(middle + 30)} 88H${fixed(middle - 30)}V112H${fixed(middle + 30)}`
      + `M${fixed(middle + (left - rest + half) / 4)} 91V109M${fixed(middle + (left - rest + half) / 4)} 100H${fixed(left)}`);
    this.block.setAttribute("x", fixed(left));
    const samples = atTime(this.samples, this.time);
    const ghost = at(samples) - half;
    this.ghost.setAttribute("d", samples === null ? "" : `M${fixed(ghost)} 26h${2 * half}v98h${-2 * half}Z`);
    this.slider.value = (1000 * (this.time - this.from)) / (this.to - this.from);
    this.clock.textContent = `${number(this.time, 4)} s`;
    this.place.textContent = `${number(y, 3)} ${this.y.unit}`;
    if (this.measured) this.measured.textContent = `${number(samples, 3)} ${this.y.unit}`;
    for (const coefficient of this.coefficients) {
      const value = coefficient.mark ? atTime(coefficient.mark, this.time) : coefficient.max;
      coefficient.text.textContent = `${number(value, 4)} ${coefficient.unit} `;
      const share = coefficient.max > 0 ? value / coefficient.max : 0;
      coefficient.gauge.setAttribute("width", fixed(100 * Math.min(Math.max(share, 0), 1)));
    }
  }
}
