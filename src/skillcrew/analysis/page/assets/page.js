"use strict";
// The page as a whole: its data, its theme, which run and seed it shows, and the keyboard.

function main() {
  const data = JSON.parse(byId("data").textContent);
  const curves = Curves();
  const replay = Replay();
  const shares = Shares();

  const otherTheme = followTheme(() => {
    shares.redraw();
    replay.redraw();
  });

  async function show() {
    const run = data.runs[byId("run").selectedIndex];
    const seed = byId("seed").selectedIndex;
    await Promise.all([replay.show(run, seed), shares.show(run, seed)]);
    document.documentElement.dataset.shown = `${byId("run").selectedIndex}/${seed}`;
  }

  function chooseRun() {
    const run = data.runs[byId("run").selectedIndex];
    byId("seed").replaceChildren(...run.replays.map((one) => make("option", {}, String(one.seed))));
    const files = run.about.map(([name, text]) => make("details", { open: ["beginning", "environment.txt"].includes(name) }, make("summary", {}, name), make("pre", { tabindex: 0 }, text)));
    byId("about-files").replaceChildren(...files);
    return show();
  }

  function nextSeed() {
    const select = byId("seed");
    select.selectedIndex = (select.selectedIndex + 1) % select.options.length;
    show();
  }

  function onKey(event) {
    const { target } = event;
    if (event.ctrlKey || event.metaKey || event.altKey || target.tagName === "SELECT") return;
    // What has the focus keeps the keys that it knows itself.
    if (event.key === " " && ["BUTTON", "SUMMARY"].includes(target.tagName)) return;
    if (event.key === " " && target.type === "checkbox") return;
    const action = { ...replay.keys, t: otherTheme, s: nextSeed }[event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  byId("run").append(...data.runs.map((run) => make("option", {}, data.runs.length > 1 ? `${run.name}, ${run.environment}` : run.name)));
  byId("run-label").hidden = data.runs.length < 2;
  byId("run").addEventListener("change", chooseRun);
  byId("seed").addEventListener("change", show);
  document.addEventListener("keydown", onKey);
  drawScores(data);
  curves.show(data.panels);
  let width = window.innerWidth;
  window.addEventListener("resize", () => {
    replay.draw();
    shares.redraw();
    // Telephones change the height alone when their bars come and go.
    if (window.innerWidth !== width) curves.draw();
    width = window.innerWidth;
  });
  return chooseRun();
}

main().then(() => { document.documentElement.dataset.ready = "yes"; }).catch((error) => {
  // Browsers from before 2023 cannot inflate.
  byId("played").textContent = `This browser cannot show it: ${error.message}`;
  throw error;
});
