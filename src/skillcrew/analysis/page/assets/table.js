"use strict";
// The table of runs: a row for each, kept while the run is there, so that nothing jumps under the pointer.

const STATES = { training: "training", stopped: "stopped", done: "done", damaged: "damaged", reading: "…" };

/** `onTick(key, ticked)` is called when somebody ticks a run. */
function Table(onTick) {
  const rows = new Map();

  function emptyRow(key) {
    const tick = make("input", { type: "checkbox", onchange: () => onTick(key, tick.checked) });
    const [name, what, why] = [make("b"), make("span", { class: "what" }), make("span", { class: "why" })];
    const [state, steps] = [make("span"), make("span")];
    const [score, rate, page] = ["score", "rate", "page"].map((name) => make("td", { class: name }));
    const bar = make("progress");
    const row = make("tr", {}, make("td", { class: "tick" }, tick), make("td", { class: "run" }, name, what, why), make("td", { class: "now" }, state),
      make("td", { class: "steps" }, steps, bar), score, rate, page);
    row.dataset.key = key;
    return { row, tick, name, what, why, state, steps, bar, score, rate, page, link: null };
  }

  function fill(one, run, ticked) {
    one.tick.checked = ticked;
    one.tick.disabled = run.state === "damaged" || run.state === "reading";
    one.tick.setAttribute("aria-label", `Curve of ${run.name}`);
    one.row.className = ticked ? "ticked" : "";
    said(one.name, run.name);
    said(one.what, run.algorithm === null ? "" : `${run.algorithm} on ${run.environment}, ${plural(run.seeds, "seed")}`);
    said(one.why, run.trouble ?? "");
    one.state.className = `state ${run.state}`;
    said(one.state, STATES[run.state]);
    said(one.steps, run.budget === null ? "" : `${readableSteps(run.steps)} of ${readableSteps(run.budget)}`);
    one.bar.hidden = run.budget === null;
    one.bar.setAttribute("aria-label", "Share of the budget of steps");
    one.bar.max = run.budget ?? 1;
    one.bar.value = run.steps;
    said(one.score, run.score ? `${run.word} ${run.score}` : "");
    said(one.rate, run.rate === null ? "" : readableSteps(run.rate));
    link(one, run.page, run.key);
  }

  function said(element, text) {
    if (element.textContent !== text) element.textContent = text;
  }

  function link(one, page, key) {
    if (one.link === page) return;
    one.link = page;
    const word = page === "written" ? "open" : "make";
    const title = page === "written" ? "Curves, replay, skills, configuration" : "Lets the champions play and makes the page; takes a minute or so";
    const address = `page?run=${encodeURIComponent(key)}`;
    one.page.replaceChildren(...(page ? [make("a", { href: address, target: "_blank", rel: "noopener", title }, word)] : []));
  }

  /** Shows these runs in this order. */
  function show(runs, ticked) {
    const keys = new Set(runs.map((run) => run.key));
    for (const [key, one] of rows) {
      if (!keys.has(key)) {
        one.row.remove();
        rows.delete(key);
      }
    }
    runs.forEach((run, place) => {
      if (!rows.has(run.key)) rows.set(run.key, emptyRow(run.key));
      const one = rows.get(run.key);
      fill(one, run, ticked.has(run.key));
      const there = byId("rows").children[place];
      if (there !== one.row) byId("rows").insertBefore(one.row, there ?? null);
    });
  }

  return { show };
}
