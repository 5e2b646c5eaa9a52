// Pointer, wheel and keys on a panel.

const WHEEL = 1.2;
/** A drag shorter than this many pixels is a click. */
const DRAG = 6;

const placeOf = (panel, event) => {
  const box = panel.svg.getBoundingClientRect();
  const view = panel.view();
  const scale = view.outer / box.width;
  const [px, py] = [(event.clientX - box.left) * scale, (event.clientY - box.top) * scale];
  const clamped = Math.min(Math.max(px, view.left), view.left + view.width);
  return { px: clamped, py: Math.min(Math.max(py, view.top), view.bottom), view, place: view.placeAt(clamped) };
};

const readAt = (panel, place) => {
  panel.axis.at = place;
  refresh(panel.axis);
};

/** The wheel scrolls the page until a chart has the focus. */
const onWheel = (panel, event) => {
  if (!event.ctrlKey && document.activeElement !== panel.plot) return;
  // At the full range the wheel scrolls the page.
  if (event.deltaY > 0 && !event.shiftKey && !isZoomed(panel.axis)) return;
  event.preventDefault();
  const { place, py, view } = placeOf(panel, event);
  const factor = event.deltaY > 0 ? WHEEL : 1 / WHEEL;
  if (event.shiftKey) {
    const at = view.heightAt(py);
    const [low, high] = view.y.range;
    panel.yRange = [at - factor * (at - low), at + factor * (high - at)];
    refresh(panel.axis);
  } else zoom(panel.axis, factor, place);
};

/** Marks the rectangle that a drag would show. */
const showDrag = (panel, from, to) => {
  const { view } = to;
  const [left, right] = [from.px, to.px].sort((a, b) => a - b);
  const tall = Math.abs(to.py - from.py) > 4 * DRAG;
  const [top, bottom] = tall ? [from.py, to.py].sort((a, b) => a - b) : [view.top, view.bottom];
  panel.svg.querySelector(".drag")?.remove();
  shape(panel.chart.space, "rect", { class: "drag", x: left, y: top, width: right - left, height: bottom - top }, panel.svg);
  return { tall, top, bottom };
};

const endDrag = (panel, from, to) => {
  if (DRAG > Math.abs(to.px - from.px)) return;
  const { tall, top, bottom } = showDrag(panel, from, to);
  if (tall) panel.yRange = [to.view.heightAt(bottom), to.view.heightAt(top)];
  const [low, high] = [from.place, to.place].sort((a, b) => a - b);
  setRange(panel.axis, low, high);
};

/** Two fingers: what is under each stays under it. */
const pinch = (panel, fingers, before) => {
  const spread = (points) => Math.max(20, Math.abs(points[0].clientX - points[1].clientX));
  const middle = (points) => ({ clientX: (points[0].clientX + points[1].clientX) / 2, clientY: points[0].clientY });
  const [was, is] = [placeOf(panel, middle(before)), placeOf(panel, middle(fingers))];
  zoom(panel.axis, spread(before) / spread(fingers), is.place);
  const shift = was.place - is.place;
  setRange(panel.axis, panel.axis.range[0] + shift, panel.axis.range[1] + shift);
};

const onPointers = (panel) => {
  const fingers = new Map();
  let from = null;
  const { plot } = panel;
  plot.addEventListener("pointerdown", (event) => {
    fingers.set(event.pointerId, event);
    const start = placeOf(panel, event);
    if (event.pointerType === "mouse" && event.button === 0) {
      from = start;
      plot.setPointerCapture(event.pointerId);
    } else readAt(panel, start.place);
  });
  plot.addEventListener("pointermove", (event) => {
    const before = [...fingers.values()];
    if (fingers.has(event.pointerId)) fingers.set(event.pointerId, event);
    if (fingers.size === 2) return pinch(panel, [...fingers.values()], before);
    const to = placeOf(panel, event);
    if (from && Math.abs(to.px - from.px) >= DRAG) return void showDrag(panel, from, to);
    return readAt(panel, to.place);
  });
  const up = (event) => {
    fingers.delete(event.pointerId);
    if (from && event.type === "pointerup") endDrag(panel, from, placeOf(panel, event));
    from = null;
    panel.svg.querySelector(".drag")?.remove();
  };
  plot.addEventListener("pointerup", up);
  plot.addEventListener("pointercancel", up);
  plot.addEventListener("pointerleave", (event) => {
    if (event.pointerType === "mouse" && document.activeElement !== plot) readAt(panel, null);
  });
};

/** Moves the place that is read; what leaves the sight takes the sight with it. */
const step = (panel, place) => {
  const { axis } = panel;
  const [least, most] = axis.full;
  const at = Math.min(Math.max(place, least), most);
  const [low, high] = axis.range;
  if (low > at) setRange(axis, at, at + high - low);
  if (at > high) setRange(axis, at - (high - low), at);
  axis.at = at;
};

const KEYS = {
  ArrowLeft: (panel, at, part) => step(panel, at - part),
  ArrowRight: (panel, at, part) => step(panel, at + part),
  Home: (panel) => step(panel, panel.axis.range[0]),
  End: (panel) => step(panel, panel.axis.range[1]),
  "+": (panel, at) => zoom(panel.axis, 0.5, at),
  "=": (panel, at) => zoom(panel.axis, 0.5, at),
  "-": (panel, at) => zoom(panel.axis, 2, at),
  Escape: (panel) => panel.chart.reset(),
};

const onKey = (panel, event) => {
  const act = KEYS[event.key];
  if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  const { axis } = panel;
  const [low, high] = axis.range;
  const at = axis.at === null || low > axis.at || axis.at > high ? (low + high) / 2 : axis.at;
  act(panel, at, (high - low) * (event.shiftKey ? 0.1 : 0.01));
  refresh(axis);
  requestAnimationFrame(() => panel.say());
};

const listen = (panel) => {
  const { plot } = panel;
  plot.addEventListener("wheel", (event) => onWheel(panel, event), { passive: false });
  plot.addEventListener("dblclick", () => panel.chart.reset());
  plot.addEventListener("keydown", (event) => onKey(panel, event));
  plot.addEventListener("blur", () => readAt(panel, null));
  onPointers(panel);
};
