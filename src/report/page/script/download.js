// Downloads of a chart: its drawing as SVG or PNG, its numbers as CSV.

/** Pixels of an image per pixel of the drawing: 180 mm at 300 dots per inch. */
const DENSITY = 3.13;

const save = (name, blob) => {
  const link = element("a", { download: name, href: URL.createObjectURL(blob) });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
};

const drawing = (figure) => new XMLSerializer().serializeToString(figure.querySelector(".still svg"));

const saveSvg = (figure, name) => save(`${name}.svg`, new Blob([drawing(figure)], { type: "image/svg+xml" }));

const savePng = (figure, name) => {
  const still = figure.querySelector(".still svg");
  // The drawing has ten units per pixel.
  const [width, height] = still.getAttribute("viewBox").split(" ").slice(2).map((side) => (DENSITY * Number(side)) / 10);
  const image = new Image();
  image.addEventListener("load", () => {
    const canvas = element("canvas", { width: Math.round(width), height: Math.round(height) });
    canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
    canvas.toBlob((blob) => save(`${name}.png`, blob));
  });
  image.src = `data:image/svg+xml,${encodeURIComponent(drawing(figure))}`;
};

const quoted = (text) => `"${text.replaceAll('"', '""')}"`;

/** One row for each point: panel, curve, abscissa, ordinate, and the upper end of a band. */
const table = (panels) => {
  const rows = ["panel,curve,abscissa,x,y,upper"];
  for (const panel of panels) {
    const names = [caption(panel.y), caption(panel.x)].map(quoted);
    for (const mark of panel.marks) {
      const count = Math.max(mark.x.length, mark.y.length);
      for (let i = 0; count > i; i += 1) {
        const numbers = [mark.x[i], mark.y[i], mark.high[i]].map((value) => value ?? "");
        rows.push([names[0], quoted(mark.label), names[1], ...numbers].join(","));
      }
    }
  }
  return `${rows.join("\r\n")}\r\n`;
};

const saveCsv = (panels, name) => save(`${name}.csv`, new Blob([table(panels)], { type: "text/csv" }));
