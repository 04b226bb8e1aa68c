"use strict";
// The studio: asks what runs there are, again and again, and for the curves of those that are ticked.

const EVERY = 1500;
const MOST_TICKED = 20;

function studio() {
  const curves = Curves();
  const table = Table((key, isTicked) => {
    follows = false;
    if (isTicked) ticked.add(key); else ticked.delete(key);
    look();
  });
  let ticked = new Set();
  // Until somebody ticks, what trains is shown, or what changed last.
  let follows = true;
  let runs = [];
  let drawn = null;
  let asks = 0;

  const found = () => {
    const words = byId("find").value.toLowerCase().split(/\s+/).filter(Boolean);
    const text = (run) => `${run.name} ${run.algorithm} ${run.environment} ${run.state}`.toLowerCase();
    return runs.filter((run) => words.every((word) => text(run).includes(word)));
  };
  const hasCurve = (run) => run.score !== "" && run.state !== "damaged";

  function follow() {
    const training = runs.filter((run) => run.state === "training" && hasCurve(run));
    const shown = training.length ? training : runs.filter(hasCurve).slice(0, 1);
    ticked = new Set(shown.slice(0, CHART_COLOURS).map((run) => run.key));
  }

  function showRuns(data) {
    runs = data.runs;
    if (follows) follow();
    const shown = found();
    table.show(shown, ticked);
    byId("root").textContent = data.root;
    document.title = `${data.root}: skillcrew studio`;
    const training = runs.filter((run) => run.state === "training").length;
    byId("count").textContent = `${plural(runs.length, "run")}${training ? `, ${training} training` : ""}${data.cut ? "; there are more, open a folder further down" : ""}`;
    byId("runs").hidden = !shown.length;
    byId("empty").hidden = Boolean(shown.length);
    byId("empty").textContent = runs.length ? "No run is called that." : "There is no run here yet; it shows up once one begins.";
  }

  /** Asks for curves where other runs are ticked than those drawn, or one of them has grown. */
  async function showCurves(mine) {
    const chosen = runs.filter((run) => ticked.has(run.key));
    const asked = chosen.slice(0, MOST_TICKED);
    byId("ticked").textContent = chosen.length > MOST_TICKED ? `${chosen.length} ticked; curves of the first ${MOST_TICKED} are drawn.` : follows ? "" : `${chosen.length} ticked.`;
    const wanted = JSON.stringify(asked.map((run) => [run.key, run.changed, run.trouble]));
    if (wanted === drawn) return;
    const data = await ask(`curves?${asked.map((run) => `run=${encodeURIComponent(run.key)}`).join("&")}`);
    if (mine !== asks) return;
    curves.show(data.panels);
    byId("missing").replaceChildren(...data.missing.map(([name, why]) => make("li", {}, `${name}: ${why}`)));
    drawn = wanted;
  }

  async function ask(address) {
    const answer = await fetch(address);
    if (!answer.ok) throw new Error(await answer.text());
    return answer.json();
  }

  async function look() {
    asks += 1;
    const mine = asks;
    try {
      const data = await ask("runs");
      // A later question has been answered, or will be.
      if (mine !== asks) return;
      showRuns(data);
      await showCurves(mine);
      byId("trouble").hidden = true;
      document.documentElement.dataset.ready = "yes";
    } catch (error) {
      byId("trouble").textContent = error instanceof TypeError ? "The studio has ended, or cannot be reached. This page goes on once it is back." : error.message;
      byId("trouble").hidden = false;
    }
  }

  async function goOn() {
    if (!document.hidden) await look();
    setTimeout(goOn, EVERY);
  }

  function tick(keys) {
    follows = false;
    ticked = new Set(keys);
    look();
  }

  followTheme(() => {});
  byId("find").addEventListener("input", () => table.show(found(), ticked));
  byId("tick-found").addEventListener("click", () => tick(found().filter(hasCurve).map((run) => run.key)));
  byId("tick-none").addEventListener("click", () => tick([]));
  byId("tick-training").addEventListener("click", () => { follows = true; look(); });
  document.addEventListener("visibilitychange", () => { if (!document.hidden) look(); });
  window.addEventListener("resize", curves.draw);
  goOn();
}

studio();
