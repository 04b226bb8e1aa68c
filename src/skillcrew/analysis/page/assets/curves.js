"use strict";
// All panels of learning curves: what is shown, and the steps that the pointer is at in all of them.

function Curves() {
  const options = { logarithmic: false, singleSeeds: null, pooled: false };
  const hidden = new Set();
  let panels = [];
  let pointed = null;
  // One name has one colour in all panels.
  const places = new Map();
  const placeOf = (label) => {
    if (!places.has(label)) {
      const taken = new Set(places.values());
      places.set(label, [...Array(taken.size + 1).keys()].find((place) => !taken.has(place)));
    }
    return places.get(label);
  };

  /** Draws these panels, in the place of those that are there. */
  function show(shown) {
    panels = shown.map((panel) => Object.assign(panels.find((one) => sameAxes(one.panel, panel)) ?? emptyPanel(panel), { panel }));
    const boxes = panels.map((one) => one.box);
    if (boxes.length !== byId("panels").children.length || boxes.some((box, i) => box !== byId("panels").children[i])) {
      byId("panels").replaceChildren(...boxes);
    }
    const labels = new Set(shown.flatMap((panel) => [...panel.curves, ...panel.pooled].map((curve) => curve.label)));
    for (const label of places.keys()) if (!labels.has(label)) places.delete(label);
    // With many curves, single seeds hide the means.
    byId("single-seeds").checked = options.singleSeeds ?? shown.every((panel) => panel.curves.length < 3);
    byId("pool-label").hidden = !shown.some((panel) => panel.pooled.length);
    draw();
  }

  const sameAxes = (one, other) => one.environment === other.environment && one.score.label === other.score.label;

  function emptyPanel(panel) {
    const chart = makeSvg("svg", { class: "chart", role: "img", "aria-label": `Learning curves in ${panel.environment}` });
    const entries = make("div", { class: "entries" });
    const box = make("div", { class: "panel" }, make("h3", {}, panel.environment), chart, entries);
    const one = { panel, box, chart, entries, scale: null, marks: null };
    chart.addEventListener("pointermove", (event) => {
      const place = chart.getBoundingClientRect();
      say(one.scale.steps(((event.clientX - place.left) / place.width) * one.scale.width));
    });
    chart.addEventListener("pointerleave", () => say(null));
    return one;
  }

  const curvesOf = (panel) => (options.pooled && panel.pooled.length ? withPooled(panel) : panel.curves);

  function withPooled(panel) {
    const together = new Set(panel.pooled.flatMap((curve) => curve.runs));
    return [...panel.pooled, ...panel.curves.filter((curve) => !together.has(curve.run))];
  }

  function draw() {
    for (const one of panels) drawPanel(one);
    say(pointed);
  }

  function drawPanel(one) {
    const width = Math.max(one.chart.parentElement.clientWidth, 240);
    const height = Math.round(Math.min(Math.max(width * 0.55, 220), 340));
    const curves = curvesOf(one.panel);
    const seen = curves.filter((curve) => !hidden.has(curve.label));
    one.scale = scalesOf(one.panel, seen.length ? seen : curves, options, width, height);
    one.chart.setAttribute("viewBox", `0 0 ${width} ${height}`);
    one.chart.setAttribute("height", height);
    one.marks = makeSvg("g");
    const drawn = seen.flatMap((curve) => drawnCurve(curve, placeOf(curve.label), one.scale, { ...options, singleSeeds: byId("single-seeds").checked }));
    one.chart.replaceChildren(...axesOf(one.panel, one.scale, options), ...drawn, one.marks);
    const focused = one.entries.contains(document.activeElement) ? document.activeElement.dataset.label : null;
    one.entries.replaceChildren(...curves.map(entryOf));
    [...one.entries.children].find((entry) => entry.dataset.label === focused)?.focus();
  }

  function entryOf(curve) {
    const index = placeOf(curve.label);
    const line = makeSvg("svg", { viewBox: "0 0 26 10", "aria-hidden": "true" },
      makeSvg("rect", { x: 0, y: 0, width: 26, height: 10, fill: colourOf(index), opacity: 0.2 }),
      makeSvg("line", { x1: 0, x2: 26, y1: 5, y2: 5, stroke: colourOf(index), "stroke-width": 2.2, "stroke-dasharray": dashOf(index) }));
    const isOff = hidden.has(curve.label);
    const seeds = ` (${plural(curve.seeds.length, "seed")})`;
    const entry = make("button", { type: "button", class: `entry${isOff ? " off" : ""}`, "aria-pressed": String(!isOff), title: "Show or hide" },
      line, make("span", {}, curve.label + seeds), make("b"));
    entry.dataset.label = curve.label;
    entry.addEventListener("click", () => {
      if (!hidden.delete(curve.label)) hidden.add(curve.label);
      draw();
    });
    return entry;
  }

  /** Reads all curves off at some steps; null: at the end of each. */
  function say(steps) {
    pointed = steps;
    for (const one of panels) {
      one.marks.replaceChildren();
      const { scale, panel } = one;
      const inside = steps !== null && steps >= scale.first && steps <= scale.last;
      if (inside) {
        const x = scale.x(steps);
        const flipped = x > scale.width * 0.7;
        one.marks.append(
          makeSvg("line", { class: "cross", x1: x, x2: x, y1: MARGIN.top, y2: scale.height - MARGIN.bottom }),
          makeSvg("text", { x: x + (flipped ? -5 : 5), y: MARGIN.top + 11, "text-anchor": flipped ? "end" : "start" }, readableSteps(steps)));
      }
      const curves = curvesOf(panel);
      [...one.entries.children].forEach((entry, index) => {
        const curve = curves[index];
        const band = curve[options.logarithmic ? "logarithmic" : "band"];
        const at = steps === null ? band.steps[band.steps.length - 1] : steps;
        const [mean, low, high] = ["mean", "low", "high"].map((side) => valueAt(band.steps, band[side], at));
        const spread = low === null || high === null ? "" : ` [${readableScore(low, panel.score)}, ${readableScore(high, panel.score)}]`;
        entry.lastChild.textContent = `${readableScore(mean, panel.score)}${mean === null ? "" : spread}`;
        if (inside && mean !== null && !hidden.has(curve.label)) {
          one.marks.append(makeSvg("circle", { cx: scale.x(steps), cy: scale.y(mean), r: 4, fill: colourOf(placeOf(curve.label)) }));
        }
      });
    }
  }

  for (const [id, name] of [["logarithmic", "logarithmic"], ["single-seeds", "singleSeeds"], ["pool", "pooled"]]) {
    byId(id).addEventListener("change", (event) => { options[name] = event.target.checked; draw(); });
  }
  return { show, draw };
}

/** The champions' scores, a row for each run. */
function drawScores(data) {
  const seeds = [...new Set(data.runs.flatMap((run) => run.scores.rows.map((row) => row.seed)))].sort((one, other) => (one ?? -1) - (other ?? -1));
  const words = seeds.map((seed) => (seed === null ? "all seeds" : `seed ${seed}`));
  const head = make("tr", {}, ...["Run", "Environment", "Score", ...words].map((word) => make("th", { scope: "col" }, word)));
  const rows = data.runs.map((run) => {
    const cells = seeds.map((seed) => make("td", {}, run.scores.rows.find((row) => row.seed === seed)?.text ?? ""));
    const what = `${run.score.label}, ${plural(run.scores.episodes, "episode")}`;
    return make("tr", {}, make("td", {}, run.name), make("td", {}, run.environment), make("td", {}, what), ...cells);
  });
  byId("scores").replaceChildren(make("table", {}, make("thead", {}, head), make("tbody", {}, ...rows)));
}
