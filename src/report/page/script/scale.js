// Conversion between values and positions, ticks, and number formats.

/** The value in the space in which an axis is even; NaN where it cannot be drawn. */
const even = (log, value) => {
  // Beyond this the difference of two values can overflow.
  if (value === null || !(1e300 >= Math.abs(value))) return NaN;
  if (!log) return value;
  return value > 0 ? Math.log10(value) : NaN;
};

const uneven = (log, place) => (log ? 10 ** place : place);

/** The smallest range that holds both; either may be missing. */
const union = (one, other) => {
  if (!one || !other) return one || other;
  return [Math.min(one[0], other[0]), Math.max(one[1], other[1])];
};

/** The smallest range that holds all drawable values. */
const extent = (log, values) => {
  let [low, high] = [Infinity, -Infinity];
  for (const value of values) {
    const place = even(log, value);
    if (place < low) low = place;
    if (place > high) high = place;
  }
  return low > high ? null : [low, high];
};

/** Some room around a range; a constant gets a range of its own size. */
const padded = ([low, high], share) => {
  const size = Math.max(Math.abs(low), Math.abs(high));
  if (high - low > 1e-9 * size) {
    const room = share * (high - low);
    return [low - room, high + room];
  }
  const room = size > 0 ? 0.1 * size : 1;
  return [low - room, high + room];
};

const superscript = (exponent) =>
  [...String(exponent)].map((c) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[c] ?? "⁻").join("");

/** A number with so many significant digits, a true minus, and a power of ten where it needs one. */
const number = (value, digits) => {
  if (value === null || !Number.isFinite(value)) return "–";
  const rounded = Number(value.toPrecision(digits));
  const size = Math.abs(rounded);
  if (size === 0) return "0";
  if (size >= 1e-3 && 1e6 > size) return String(rounded).replace("-", "−");
  const [mantissa, exponent] = rounded.toExponential().split("e");
  const power = `10${superscript(Number(exponent))}`;
  return `${mantissa}×${power}`.replace("-", "−");
};

const decade = (exponent) => `10${superscript(exponent)}`;

/** The next larger of 1, 2 and 5 times a power of ten. */
const roundStep = (step) => {
  const power = 10 ** Math.floor(Math.log10(step));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= 0.999999 * step);
};

const linearTicks = ([low, high], most) => {
  const step = roundStep((high - low) / most);
  const largest = Math.max(Math.abs(low), Math.abs(high));
  const places = Math.max(0, Math.min(15, -Math.floor(Math.log10(step) + 1e-9)));
  const plain = 1e5 > largest && largest >= 1e-3;
  const digits = Math.max(1, Math.ceil(Math.log10(largest / step) + 1e-9) + 1);
  const ticks = [];
  const first = Math.ceil(low / step - 1e-6);
  for (let i = 0; most + 2 >= i; i += 1) {
    const value = (first + i) * step;
    if (value > high + 1e-6 * step) break;
    const label = plain ? value.toFixed(places).replace("-", "−") : number(value, digits);
    ticks.push({ place: value, label: Number(value.toFixed(places)) === 0 && plain ? (0).toFixed(places) : label });
  }
  return ticks;
};

/** Ticks of a range in even space: at decades, or where few are in sight at round values. */
const ticksOf = (log, range, most) => {
  if (!log) {
    const ticks = linearTicks(range, most);
    // One value alone gives no scale.
    return ticks.length > 1 ? ticks : linearTicks(range, 2 * most);
  }
  const [first, last] = [Math.ceil(range[0] - 1e-9), Math.floor(range[1] + 1e-9)];
  if (1 > last - first) {
    const values = linearTicks([10 ** range[0], 10 ** range[1]], most);
    return values.filter((t) => t.place > 0).map((t) => ({ ...t, place: Math.log10(t.place) }));
  }
  // A range of few decades has ticks at round values between them.
  const between = 2 >= last - first ? [1, 2, 5] : [1];
  const stride = Math.floor((last - first) / most) + 1;
  const ticks = [];
  for (let exponent = first; last >= exponent; exponent += 1) {
    if (exponent % stride !== 0) continue;
    for (const factor of between) {
      const value = factor * 10 ** exponent;
      ticks.push({ place: Math.log10(value), label: between.length > 1 ? number(value, 1) : decade(exponent) });
    }
  }
  return ticks.filter(({ place }) => range[1] + 1e-9 >= place);
};

/** The last index whose x is at most a value, in rising x; -1 where all are beyond. */
const indexBefore = (xs, value) => {
  let [low, high] = [0, xs.length];
  while (high > low) {
    const middle = (low + high) >> 1;
    if (value >= xs[middle]) low = middle + 1;
    else high = middle;
  }
  return low - 1;
};
