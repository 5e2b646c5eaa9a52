"""Scaling figures of the race as SVG, by the standard library alone."""
import math

INK, QUIET, GRID, PAPER = "#1c1f24", "#5b626c", "#dfe3e8", "#ffffff"
# Told apart by hue, lightness and mark, also by the colour-blind.
COLOURS = ["#0a63b0", "#d1600a", "#1d8454", "#8a4fa8"]
WIDTH, HEIGHT = 760, 460
LEFT, RIGHT, TOP, BOTTOM = 84, 24, 56, 64


def escape(text):
    return text.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def number(value):
    """A tick in words that people read: 1000, 100,000, 10⁶, 0.01."""
    exponent = math.floor(math.log10(value) + 1e-9)
    if exponent >= 6 or exponent <= -4:
        mantissa = round(value / 10.0**exponent)
        power = "10" + "".join("⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".index(c)] for c in str(exponent))
        return power if mantissa == 1 else f"{mantissa}·{power}"
    return f"{value:,g}"


class Figure:
    """Axes with logarithmic scales; series of marks joined by lines, and level lines with a name."""

    def __init__(self, title, x_label, y_label, x_ticks=None):
        self.title, self.x_label, self.y_label, self.x_ticks = title, x_label, y_label, x_ticks
        self.series, self.levels = [], []

    def add(self, name, points, dashed=False, line=True):
        points = [(x, y) for x, y in points if y is not None and y > 0]
        if points:
            self.series.append((name, points, dashed, line))

    def level(self, name, y):
        if y is not None and y > 0:
            self.levels.append((name, y))

    def write(self, path):
        if self.series:
            with open(path, "w", encoding="utf-8") as file:
                file.write(self.svg())

    def ranges(self):
        xs = [x for _, points, *_ in self.series for x, _ in points] + list(self.x_ticks or [])
        ys = [y for _, points, *_ in self.series for _, y in points] + [y for _, y in self.levels]
        low, high = math.log10(min(ys)), math.log10(max(ys))
        room = max(0.08 * (high - low), 0.08)
        x_low, x_high = math.log10(min(xs)), math.log10(max(xs))
        side = 0.04 * max(x_high - x_low, 0.1)
        return x_low - side, x_high + side, low - room, high + 2 * room

    def svg(self):
        x_low, x_high, y_low, y_high = self.ranges()

        def px(x):
            return LEFT + (math.log10(x) - x_low) / (x_high - x_low) * (WIDTH - LEFT - RIGHT)

        def py(y):
            return HEIGHT - BOTTOM - (math.log10(y) - y_low) / (y_high - y_low) * (HEIGHT - TOP - BOTTOM)

        out = [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" '
            f'height="{HEIGHT}" role="img" font-family="DejaVu Sans, Verdana, sans-serif" font-size="13">',
            f"<title>{escape(self.title)}</title>",
            f'<rect width="{WIDTH}" height="{HEIGHT}" fill="{PAPER}"/>',
            f'<text x="{LEFT}" y="28" font-size="16" font-weight="bold" fill="{INK}">{escape(self.title)}</text>',
        ]
        bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
        for x in self.x_ticks or ticks(x_low, x_high):
            out.append(f'<path d="M{px(x):.1f} {TOP}V{bottom}" stroke="{GRID}"/>')
            out.append(f'<text x="{px(x):.1f}" y="{bottom + 20}" text-anchor="middle" fill="{QUIET}">{number(x)}</text>')
        for y in ticks(y_low, y_high):
            out.append(f'<path d="M{LEFT} {py(y):.1f}H{right}" stroke="{GRID}"/>')
            out.append(f'<text x="{LEFT - 8}" y="{py(y) + 4.5:.1f}" text-anchor="end" fill="{QUIET}">{number(y)}</text>')
        out.append(f'<path d="M{LEFT} {TOP}V{bottom}H{right}" fill="none" stroke="{QUIET}"/>')
        out.append(f'<text x="{(LEFT + right) / 2:.0f}" y="{HEIGHT - 18}" text-anchor="middle" fill="{INK}">{escape(self.x_label)}</text>')
        middle = (TOP + bottom) / 2
        out.append(
            f'<text transform="translate(20 {middle:.0f}) rotate(-90)" text-anchor="middle" fill="{INK}">{escape(self.y_label)}</text>'
        )
        labels = []
        for name, y in self.levels:
            out.append(f'<path d="M{LEFT} {py(y):.1f}H{right}" stroke="{QUIET}" stroke-width="1.5" stroke-dasharray="6 4"/>')
            labels.append((right - 4, py(y) - 6, "end", QUIET, name))
        solid = 0
        for name, points, dashed, line in self.series:
            colour = QUIET if dashed else COLOURS[solid % len(COLOURS)]
            places = [(px(x), py(y)) for x, y in sorted(points)]
            if line:
                path = "L".join(f"{x:.1f} {y:.1f}" for x, y in places)
                dash = ' stroke-width="1.5" stroke-dasharray="2 4"' if dashed else ' stroke-width="2.2"'
                out.append(f'<path d="M{path}" fill="none" stroke="{colour}" stroke-linejoin="round"{dash}/>')
            if not dashed:
                out += [mark(solid, x, y, colour) for x, y in places]
                x, y = places[-1] if line else places[0]
                # Above the last point of a line, towards the middle; above a point that stands alone.
                anchor, shift = ("end", -2) if x > WIDTH / 2 else ("start", 10)
                if not line:
                    anchor, shift = "middle", 0
                labels.append((x + shift, y - 12, anchor, colour, name))
                solid += 1
        out += placed(labels)
        out.append("</svg>\n")
        return "\n".join(out)


def placed(labels):
    """Labels moved up until none stands on another."""
    out, taken = [], []
    for x, y, anchor, colour, name in sorted(labels, key=lambda label: -label[1]):
        width = 7.6 * len(name)
        left = x - {"end": 1.0, "middle": 0.5, "start": 0.0}[anchor] * width
        while any(abs(y - other) < 16 and left < end and begin < left + width for other, begin, end in taken):
            y -= 2
        taken.append((y, left, left + width))
        out.append(
            f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="{colour}" stroke="{PAPER}" '
            f'stroke-width="4" paint-order="stroke" stroke-linejoin="round">{escape(name)}</text>'
        )
    return out


def mark(kind, x, y, colour):
    if kind % 3 == 0:
        return f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="{colour}"/>'
    if kind % 3 == 1:
        return f'<rect x="{x - 4:.1f}" y="{y - 4:.1f}" width="8" height="8" fill="{colour}"/>'
    return f'<path d="M{x:.1f} {y - 5:.1f}l5 9h-10z" fill="{colour}"/>'


def ticks(low, high):
    """Ticks of a logarithmic axis: decades, and within few decades 2 and 5 (or every digit) as well."""
    for factors in ([1], [1, 2, 5], [1, 1.5, 2, 3, 4, 5, 6, 8]):
        found = [
            f * 10.0**e
            for e in range(math.floor(low) - 1, math.ceil(high) + 1)
            for f in factors
            if low <= math.log10(f * 10.0**e) <= high
        ]
        if len(found) >= 4:
            break
    return found
