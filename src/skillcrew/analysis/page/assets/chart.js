"use strict";
// One panel of learning curves, as SVG: axes, bands, means, single seeds, and a cross that follows the pointer.

const MARGIN = { right: 14, top: 10, bottom: 42 };
const LETTER = 7.2;
const DASHES = [null, "8 4", "2 3"];
const CHART_COLOURS = 7;

const colourOf = (index) => `var(--s${index % CHART_COLOURS})`;
const dashOf = (index) => DASHES[Math.floor(index / CHART_COLOURS) % DASHES.length];

/** The value of a curve at some steps, linear between its points; null outside of them. */
function valueAt(steps, values, at) {
  if (!steps.length || at < steps[0] || at > steps[steps.length - 1]) return null;
  let low = 0;
  let high = steps.length - 1;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (steps[middle] <= at) low = middle; else high = middle;
  }
  if (steps[high] === steps[low] || values[low] === null || values[high] === null) return values[low];
  return values[low] + ((values[high] - values[low]) * (at - steps[low])) / (steps[high] - steps[low]);
}

/** Where steps and values are on a chart of some width and height. */
function scalesOf(panel, curves, options, width, height) {
  const bands = curves.map((curve) => curve[options.logarithmic ? "logarithmic" : "band"]);
  const all = curves.flatMap((curve) => curve.seeds);
  const last = Math.max(...all.map((seed) => seed.steps[seed.steps.length - 1]), 1);
  const starts = [...bands.map((band) => band.steps[0]), ...curves.map((curve) => curve.pretrained).filter(Boolean)];
  const first = options.logarithmic ? Math.max(Math.min(...starts, last / 10), 1) : 0;
  const ends = panel.score.ends || endsOf(all.flatMap((seed) => seed.values), bands);
  const room = 0.03 * (ends[1] - ends[0] || 1);
  const [bottom, top] = [ends[0] - room, ends[1] + room];
  // As wide as what stands on the axis, and its name.
  const ticks = roundTicks(ends[0], ends[1], 5);
  const left = 34 + LETTER * Math.max(...ticks.map((tick) => String(tick).length), 3);
  const [w, h] = [width - left - MARGIN.right, height - MARGIN.top - MARGIN.bottom];
  const share = options.logarithmic
    ? (steps) => Math.log(Math.max(steps, first) / first) / Math.log(last / first)
    : (steps) => steps / last;
  return {
    first, last, bottom, top, width, height, ticks, left,
    x: (steps) => left + w * share(steps),
    y: (value) => MARGIN.top + h * (1 - (value - bottom) / (top - bottom)),
    steps: (x) => {
      const part = Math.min(Math.max((x - left) / w, 0), 1);
      return options.logarithmic ? first * (last / first) ** part : part * last;
    },
  };
}

function endsOf(values, bands) {
  const numbers = [...values, ...bands.flatMap((band) => [...band.low, ...band.high])].filter((value) => value !== null);
  return numbers.length ? [Math.min(...numbers), Math.max(...numbers)] : [0, 1];
}

const pathOf = (steps, values, scale) => steps
  .map((at, i) => (values[i] === null ? "" : `${i && values[i - 1] !== null ? "L" : "M"}${scale.x(at).toFixed(1)} ${scale.y(values[i]).toFixed(1)}`))
  .join("");

function bandPath(band, scale) {
  const known = band.steps.map((_, i) => i).filter((i) => band.low[i] !== null && band.high[i] !== null);
  if (known.length < 2) return "";
  const point = (i, side) => `${scale.x(band.steps[i]).toFixed(1)} ${scale.y(band[side][i]).toFixed(1)}`;
  return `M${known.map((i) => point(i, "high")).join("L")}L${known.reverse().map((i) => point(i, "low")).join("L")}Z`;
}

function axesOf(panel, scale, options) {
  const right = scale.width - MARGIN.right;
  const floor = scale.height - MARGIN.bottom;
  const parts = [];
  for (const tick of scale.ticks) {
    const y = scale.y(tick);
    parts.push(makeSvg("line", { class: "grid", x1: scale.left, x2: right, y1: y, y2: y }));
    parts.push(makeSvg("text", { x: scale.left - 7, y: y + 4, "text-anchor": "end" }, String(tick)));
  }
  const ticks = options.logarithmic
    ? logarithmicTicks(scale.first, scale.last, scale.width)
    : roundTicks(0, scale.last, scale.width < 420 ? 4 : 6);
  for (const tick of ticks) {
    const x = scale.x(tick);
    parts.push(makeSvg("line", { class: "frame", x1: x, x2: x, y1: floor, y2: floor + 4 }));
    parts.push(makeSvg("text", { x, y: floor + 17, "text-anchor": "middle" }, tick ? readableSteps(tick) : "0"));
  }
  parts.push(makeSvg("line", { class: "frame", x1: scale.left, x2: right, y1: floor, y2: floor }));
  const middle = (MARGIN.top + floor) / 2;
  const said = `environment steps${options.logarithmic ? " (logarithmic)" : ""}`;
  parts.push(makeSvg("text", { class: "axis-label", x: (scale.left + right) / 2, y: scale.height - 6, "text-anchor": "middle" }, said));
  parts.push(makeSvg("text", { class: "axis-label", x: 0, y: 0, "text-anchor": "middle", transform: `translate(13 ${middle}) rotate(-90)` }, panel.score.label));
  return parts;
}

function drawnCurve(curve, index, scale, options) {
  const band = curve[options.logarithmic ? "logarithmic" : "band"];
  const colour = colourOf(index);
  const parts = [];
  const shade = bandPath(band, scale);
  if (shade) parts.push(makeSvg("path", { class: "band", d: shade, fill: colour }));
  if (options.singleSeeds) {
    for (const seed of curve.seeds) parts.push(makeSvg("path", { class: "seed", d: pathOf(seed.steps, seed.values, scale), stroke: colour }));
  }
  if (curve.pretrained) {
    const x = scale.x(curve.pretrained);
    parts.push(makeSvg("line", { class: "pretrained", x1: x, x2: x, y1: MARGIN.top, y2: scale.height - MARGIN.bottom, stroke: colour }));
  }
  parts.push(makeSvg("path", { class: "mean", d: pathOf(band.steps, band.mean, scale), stroke: colour, "stroke-dasharray": dashOf(index) }));
  if (band.steps.length === 1) parts.push(makeSvg("circle", { cx: scale.x(band.steps[0]), cy: scale.y(band.mean[0]), r: 3.5, fill: colour }));
  return parts;
}
