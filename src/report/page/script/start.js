// Replaces the drawing of every figure by a chart.

/** Equally spaced values are written by their ends. */
const spread = (xs) => (Array.isArray(xs) ? xs : Array.from({ length: xs.count }, (_, i) => xs.from + i * xs.step));

const begin = () => {
  const charts = [...document.querySelectorAll("figure.chart")].map((figure, index) => {
    const data = JSON.parse(figure.querySelector("script").textContent);
    for (const mark of data.panels.flatMap((panel) => panel.marks)) mark.x = spread(mark.x);
    const chart = new Chart(figure, data, index);
    figure.classList.add("ready");
    return chart;
  });
  const motion = document.getElementById("animation");
  if (motion) new Motion(motion, charts);
  for (const axis of axes.values()) {
    const full = axis.full ?? [0, 1];
    axis.full = full[1] > full[0] ? full : padded(full, 0);
    axis.range = axis.full;
    refresh(axis);
  }
  const observer = new ResizeObserver(() => axes.forEach(refresh));
  for (const chart of charts) observer.observe(chart.live);
};

begin();
// Paper shows what is folded.
addEventListener("beforeprint", () => document.querySelectorAll("details").forEach((part) => { part.open = true; }));
document.documentElement.classList.add("scripted");
