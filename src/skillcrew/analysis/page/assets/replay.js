"use strict";
// The player: which episode is open, at which moment it is, and everything that moves with it.

const SPEEDS = [1, 2, 5, 10, 20, 50];
const READINGS_HEIGHT = 84;

function Replay() {
  let run = null;
  let wanted = null;
  let episodes = null;
  let episode = null;
  let moment = 0;
  let isMoving = false;
  let before = 0;
  let pointed = null;
  let pinned = null;
  const picture = Picture(byId("picture"), byId("picture-box"));
  const timeline = Timeline(byId("timeline"), (step) => { pause(); go(step); }, (text) => { byId("timeline-said").textContent = text; });
  byId("speed").append(...SPEEDS.map((speed) => make("option", { value: speed, selected: speed === 5 }, `${plural(speed, "step")}/s`)));

  async function show(newRun, seed) {
    pause();
    const replay = newRun.replays[seed];
    wanted = replay;
    const unpacked = await Episodes(newRun, replay);
    // Another choice may have been made meanwhile.
    if (wanted !== replay) return;
    [run, episodes, pointed, pinned] = [newRun, unpacked, null, null];
    byId("played").textContent = `${episodes.all.length} of ${replay.played} fresh episodes${run.scenery ? ". A mark over the time line says that something changed its state." : "; this environment has no scene to draw: choices and sensors are shown."}`;
    byId("stage").classList.toggle("bare", !run.scenery);
    fillEpisodes();
    fillAgents();
    byId("skills").replaceChildren(...run.skills.map(skillEntry));
    open(jumpTargets()[0].all[0].index);
  }

  const skillEntry = (skill) => make("span", { title: skill.text || null }, chip(skill), skill.name);

  function chip(skill) {
    const box = make("i", { class: "chip", "aria-hidden": "true" });
    box.style.background = onGround(skill.colour);
    return box;
  }

  function fillEpisodes() {
    const option = (one) => make("option", { value: one.index }, `${one.number} · ${described(one)}`);
    const parts = jumpTargets().filter((target) => target.group);
    byId("episode").replaceChildren(...parts.map((target) => make("optgroup", { label: target.group }, ...target.all.map(option))));
    byId("jumps").replaceChildren(...jumpTargets().map((target) => make("button", { type: "button", onclick: () => jump(target) }, target.word)));
  }

  function described(one) {
    if (one.solved === null) return `return ${readableScore(one.total, run.score)}, ${plural(one.steps, "step")}`;
    return one.solved ? `solved in ${plural(one.steps, "step")}` : `failed, ${plural(one.steps, "step")}`;
  }

  /** Where the buttons lead: to the best there is, and through the solved and the failed episodes. */
  function jumpTargets() {
    const all = [...episodes.all];
    if (all[0].solved === null) {
      all.sort((one, other) => other.total - one.total);
      return [{ word: "Best", group: "Best first", all }, { word: "Worst", all: [...all].reverse().slice(0, 1) }];
    }
    const solved = all.filter((one) => one.solved).sort((one, other) => one.steps - other.steps);
    const failed = all.filter((one) => !one.solved);
    const targets = [{ word: "Fastest", all: solved.slice(0, 1) }, { word: "Next solved", group: "Solved, fastest first", all: solved }, { word: "Next failed", group: "Failed", all: failed }];
    return targets.filter((target) => target.all.length);
  }

  function jump(target) {
    const at = target.all.findIndex((one) => one.index === Number(byId("episode").value));
    open(target.all[(at + 1) % target.all.length].index);
  }

  function open(index) {
    const wasMoving = isMoving;
    episode = episodes.open(index);
    byId("episode").value = index;
    byId("scrub").max = episode.steps;
    byId("outcome").textContent = described(episode);
    picture.open(run, episode);
    timeline.open(run, episode);
    fillLegend();
    go(0);
    if (wasMoving) play();
  }

  function fillAgents() {
    byId("agents").replaceChildren(...run.agents.map((agent, index) => make("li", {}, make("button", {
      type: "button", "aria-pressed": "false", title: `${agent.type || "Agent"} ${index + 1}: its sensors`,
      onclick: () => pin(index),
      onpointerenter: () => { pointed = index; draw(); },
      onpointerleave: () => { pointed = null; draw(); },
    }, make("span", { class: "number" }, String(index + 1)), make("i", { class: "chip" }), make("span", { class: "word" })))));
  }

  function pin(index) {
    if (index >= run.agents.length) return;
    pinned = pinned === index ? null : index;
    draw();
  }

  /** One of each mark, in each of its states. */
  function fillLegend() {
    const things = episode.groups.filter((group) => group.part === "points" && group.name !== "agents");
    const rows = things.map((group, index) => legendRow(group, (c, colour, full) => drawThing(c, SHAPES[index % SHAPES.length], 10, 10, 6.5, colour, full)));
    const discs = episode.groups.filter((group) => group.part === "discs");
    rows.push(...discs.map((group) => legendRow(group, (c, colour, full) => drawDisc(c, 10, 10, 8, colour, group.states.length > 1 ? full : 0.3, full === 0 || group.name === "sensors"))));
    const agents = episode.groups.find((group) => group.part === "points" && group.name === "agents");
    if (agents && agents.states.length > 1 && run.agents.some((_, agent) => agents.state(agent, episode.steps) > 0)) rows.unshift(legendOut(agents.states.slice(1).join(", ")));
    byId("legend").replaceChildren(...(rows.length ? [make("h3", {}, "What is where"), ...rows] : []));
  }

  function legendEntry(word, mark) {
    const canvas = make("canvas", { "aria-hidden": "true" });
    mark(sharp(canvas, 20, 20));
    return make("span", { class: "item" }, canvas, word);
  }

  /** Agents in another state than the first. */
  function legendOut(word) {
    const look = { colour: cssColour("--line"), heading: null, number: "", out: true, pointed: false };
    return make("div", { class: "group" }, "agents:", legendEntry(word, (c) => drawAgent(c, 10, 10, 6.5, look)));
  }

  function legendRow(group, mark) {
    const entry = (word, colour, full) => legendEntry(word, (c) => mark(c, colour, full));
    const kinds = [...new Set(group.kinds)];
    const neutral = kinds.length ? cssColour("--soft") : colourOfThing(group, 0);
    const states = group.states.length > 1 ? group.states.map((state, index) => entry(state, neutral, fullness(group, index))) : [];
    const ofKinds = group.part === "points" ? kinds.map((kind) => entry(kind, onGround(group.ofKinds[kind]), 1)) : [];
    return states.length || ofKinds.length
      ? make("div", { class: "group" }, make("span", {}, `${group.name}:`), ...ofKinds, ...states)
      : make("div", { class: "group" }, entry(group.name === "sensors" ? "sensors, of the agent pointed at" : group.name, neutral, 1));
  }

  function go(to) {
    moment = Math.min(Math.max(to, 0), episode.steps);
    draw();
  }

  function draw() {
    if (!episode) return;
    const agent = pointed ?? pinned;
    picture.draw(moment, agent);
    timeline.draw(moment);
    byId("scrub").value = Math.floor(moment);
    byId("time").textContent = `step ${Math.floor(moment)} of ${episode.steps}`;
    [...byId("agents").children].forEach(({ firstChild: button }, index) => {
      const skill = run.skills[episode.choice(index, moment)];
      button.children[1].style.background = onGround(skill.colour);
      if (button.children[2].textContent !== skill.name) button.children[2].textContent = skill.name;
      button.setAttribute("aria-pressed", String(index === pinned));
    });
    drawReadings(agent);
  }

  function drawReadings(agent) {
    byId("sensors-title").textContent = agent === null ? "Sensors" : `Sensors of agent ${agent + 1}`;
    byId("sensors").classList.toggle("open", agent !== null);
    const bars = [];
    for (let sensor = 0; agent !== null && sensor < episode.sensors; sensor += 1) {
      const { share, value } = episode.reading(agent, sensor, moment);
      const bar = make("div", { class: `reading${share < 0 ? " negative" : ""}`, title: `number ${sensor + 1}: ${Number(value.toPrecision(2))}` });
      const tall = Math.max(Math.abs(share) * READINGS_HEIGHT * (episode.isSigned ? 0.5 : 1), 1);
      bar.style.height = `${tall}px`;
      // Up or down from the middle.
      if (episode.isSigned) bar.style.marginBottom = `${READINGS_HEIGHT / 2 - (share < 0 ? tall : 0)}px`;
      bars.push(bar);
    }
    byId("readings").classList.toggle("signed", episode.isSigned);
    byId("readings").replaceChildren(...bars);
  }

  function play() {
    if (moment >= episode.steps) go(0);
    isMoving = true;
    before = performance.now();
    mark();
    requestAnimationFrame(advance);
  }

  function pause() {
    isMoving = false;
    if (episode) go(Math.round(moment));
    mark();
  }

  function mark() {
    byId("play").classList.toggle("moving", isMoving);
    byId("play").setAttribute("aria-label", isMoving ? "Pause" : "Play");
  }

  const isSmooth = () => !window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  let exact = 0;

  function advance(now) {
    if (!isMoving) { exact = 0; return; }
    // Time that passes while the tab is hidden does not count.
    exact = (exact || moment) + Math.min(now - before, 250) * Number(byId("speed").value) / 1000;
    before = now;
    if (exact >= episode.steps) { moment = episode.steps; exact = 0; pause(); return; }
    go(isSmooth() ? exact : Math.floor(exact));
    requestAnimationFrame(advance);
  }

  function step(by) { pause(); go(Math.round(moment) + by); }
  function neighbour(by) {
    const options = [...byId("episode").options];
    open(Number(options[(byId("episode").selectedIndex + by + options.length) % options.length].value));
  }
  function speed(by) {
    const select = byId("speed");
    select.selectedIndex = Math.min(Math.max(select.selectedIndex + by, 0), SPEEDS.length - 1);
  }

  byId("play").addEventListener("click", () => (isMoving ? pause() : play()));
  byId("first").addEventListener("click", () => { pause(); go(0); });
  byId("back").addEventListener("click", () => step(-1));
  byId("forward").addEventListener("click", () => step(1));
  byId("scrub").addEventListener("input", (event) => { pause(); go(Number(event.target.value)); });
  byId("episode").addEventListener("change", (event) => open(Number(event.target.value)));
  byId("picture").addEventListener("pointermove", (event) => { pointed = picture.near(event)?.agent ?? null; draw(); });
  byId("picture").addEventListener("pointerleave", () => { picture.near(null); pointed = null; draw(); });
  byId("picture").addEventListener("click", (event) => { const found = picture.near(event); if (found && found.agent !== null) pin(found.agent); });

  const keys = {
    " ": () => (isMoving ? pause() : play()),
    ArrowLeft: () => step(-1), ArrowRight: () => step(1),
    Home: () => { pause(); go(0); }, End: () => { pause(); go(episode.steps); },
    "+": () => speed(1), "=": () => speed(1), "-": () => speed(-1), "−": () => speed(-1),
    n: () => neighbour(1), p: () => neighbour(-1), f: () => jump(jumpTargets()[0]),
  };
  for (let digit = 1; digit <= 9; digit += 1) keys[digit] = () => pin(digit - 1);

  function redraw() {
    if (!episode) return;
    fillLegend();
    byId("skills").replaceChildren(...run.skills.map(skillEntry));
    draw();
  }

  return { show, redraw, draw, keys };
}
