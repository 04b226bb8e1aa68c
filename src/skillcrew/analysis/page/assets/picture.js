"use strict";
// The world at a moment: whatever the scene's groups hold, drawn in the same way for all environments.

const TRAIL = 25;
const PICTURE_PAD = { left: 30, right: 10, top: 10, bottom: 22 };

function Picture(canvas, box) {
  let run = null;
  let episode = null;
  let view = null;
  let last = 0;
  let shown = { moment: 0, agent: null, near: null };

  const agentsOf = () => episode && episode.groups.find((group) => group.part === "points" && group.name === "agents");
  const skillOf = (agent, moment) => run.skills[episode.choice(agent, moment)] || run.skills[0];

  function open(newRun, newEpisode) {
    run = newRun;
    episode = newEpisode;
    box.hidden = !run.scenery;
    if (run.scenery) view = bounds();
  }

  /** What the scene says is to be shown, and a quarter of it on each side where agents or discs are there. */
  function bounds() {
    const { low, high } = run.scenery;
    const [from, to] = [[...low], [...high]];
    const include = (place, radius) => place.forEach((at, axis) => {
      const room = (high[axis] - low[axis]) / 4;
      if (at - radius < from[axis]) from[axis] = Math.max(at - radius, low[axis] - room);
      if (at + radius > to[axis]) to[axis] = Math.min(at + radius, high[axis] + room);
    });
    const each = (group, moment) => {
      for (let thing = 0; thing < group.count; thing += 1) {
        include([group.x(thing, moment), group.y(thing, moment)], group.radius ? group.radius(thing, moment) : 0);
      }
    };
    const agents = agentsOf();
    for (let moment = 0; agents && moment <= episode.steps; moment += 1) each(agents, moment);
    episode.groups.filter((group) => group.part === "discs" && group.name !== "sensors").forEach((group) => each(group, 0));
    const rim = 0.015 * Math.max(to[0] - from[0], to[1] - from[1]);
    return { low: from.map((at) => at - rim), high: to.map((at) => at + rim) };
  }

  function placed(width, height) {
    const spans = [0, 1].map((axis) => view.high[axis] - view.low[axis]);
    const room = [width - PICTURE_PAD.left - PICTURE_PAD.right, height - PICTURE_PAD.top - PICTURE_PAD.bottom];
    const scale = Math.min(room[0] / spans[0], room[1] / spans[1]);
    return {
      scale,
      x: (at) => PICTURE_PAD.left + (at - view.low[0]) * scale,
      y: (at) => PICTURE_PAD.top + (view.high[1] - at) * scale,
    };
  }

  function draw(moment, agent) {
    if (!run || !run.scenery) return;
    shown = { ...shown, moment, agent };
    const spans = [0, 1].map((axis) => view.high[axis] - view.low[axis]);
    const most = Math.min(Math.max(window.innerHeight * 0.72, 300), 640);
    const inner = Math.min(box.clientWidth - PICTURE_PAD.left - PICTURE_PAD.right, (most * spans[0]) / spans[1]);
    const width = Math.round(inner + PICTURE_PAD.left + PICTURE_PAD.right);
    const height = Math.round((inner * spans[1]) / spans[0] + PICTURE_PAD.top + PICTURE_PAD.bottom);
    const c = sharp(canvas, width, height);
    const at = placed(width, height);
    // Large enough for their numbers, unless they are so many that they would hide each other.
    const least = run.agents.length > 16 ? 3.5 : 7.5;
    last = { at, size: Math.max(least, Math.min(9, inner / 55)) };
    drawGround(c, at, width, height);
    c.save();
    c.beginPath();
    c.rect(at.x(view.low[0]), at.y(view.high[1]), spans[0] * at.scale, spans[1] * at.scale);
    c.clip();
    for (const part of ["discs", "lines"]) episode.groups.filter((group) => group.part === part).forEach((group) => drawGroup(c, at, group));
    drawTrails(c, at);
    const things = episode.groups.filter((group) => group.part === "points" && group.name !== "agents");
    things.forEach((group, index) => drawThings(c, at, group, SHAPES[index % SHAPES.length]));
    episode.groups.filter((group) => group.part === "labels").forEach((group) => drawLabels(c, at, group));
    c.restore();
    drawAgents(c, at);
    if (shown.near && shown.near.text) drawWord(c, shown.near.text, ...inside(shown.near, width), cssColour("--text"), 13, shown.near.x > width / 2 ? "right" : "left");
  }

  const inside = (near, width) => [near.x + (near.x > width / 2 ? -14 : 14), Math.max(near.y - 12, 14)];

  function drawGround(c, at, width, height) {
    c.font = canvasFont(11);
    c.lineWidth = 1;
    const ticks = [0, 1].map((axis) => roundTicks(view.low[axis], view.high[axis], 5));
    c.strokeStyle = cssColour("--faint");
    c.fillStyle = cssColour("--soft");
    c.textAlign = "center";
    const [left, floor] = [at.x(view.low[0]), at.y(view.low[1])];
    for (const tick of ticks[0]) {
      c.strokeRect(at.x(tick), at.y(view.high[1]), 0, floor - at.y(view.high[1]));
      c.fillText(String(tick), at.x(tick), floor + 15);
    }
    c.textAlign = "right";
    for (const tick of ticks[1]) {
      c.strokeRect(left, at.y(tick), at.x(view.high[0]) - left, 0);
      c.fillText(String(tick), left - 5, at.y(tick) + 4);
    }
    const { low, high } = run.scenery;
    c.strokeStyle = cssColour("--line");
    c.lineWidth = 1.5;
    c.strokeRect(at.x(low[0]), at.y(high[1]), (high[0] - low[0]) * at.scale, (high[1] - low[1]) * at.scale);
  }

  function drawGroup(c, at, group) {
    for (let thing = 0; thing < group.count; thing += 1) {
      const state = group.state(thing, shown.moment);
      const colour = colourOfThing(group, thing);
      const [x, y] = [at.x(group.x(thing, shown.moment)), at.y(group.y(thing, shown.moment))];
      if (state !== null && state < 0) continue;
      if (group.part === "lines") {
        c.strokeStyle = colour;
        c.lineWidth = 2.5;
        c.beginPath();
        c.moveTo(x, y);
        c.lineTo(at.x(group.toX(thing, shown.moment)), at.y(group.toY(thing, shown.moment)));
        c.stroke();
      } else if (group.name !== "sensors" || thing === shown.agent) {
        const full = fullness(group, state);
        drawDisc(c, x, y, group.radius(thing, shown.moment) * at.scale, colour, group.states.length > 1 ? full : 0.3, full === 0 || group.name === "sensors");
      }
    }
  }

  /** Where each agent has come from, in the colours of the skills that it followed there. */
  function drawTrails(c, at) {
    const agents = agentsOf();
    if (!agents) return;
    const start = Math.max(0, Math.ceil(shown.moment) - TRAIL);
    c.lineCap = "round";
    for (let agent = 0; agent < agents.count; agent += 1) {
      for (let step = start; step < shown.moment; step += 1) {
        const end = Math.min(step + 1, shown.moment);
        c.globalAlpha = 0.15 + 0.65 * (1 - (shown.moment - end) / TRAIL);
        c.strokeStyle = onGround(skillOf(agent, step).colour);
        c.lineWidth = 3;
        c.beginPath();
        c.moveTo(at.x(agents.x(agent, step)), at.y(agents.y(agent, step)));
        c.lineTo(at.x(agents.x(agent, end)), at.y(agents.y(agent, end)));
        c.stroke();
      }
    }
    c.globalAlpha = 1;
  }

  function drawThings(c, at, group, shape) {
    for (let thing = 0; thing < group.count; thing += 1) {
      const state = group.state(thing, shown.moment);
      if (state !== null && state < 0) continue;
      const [x, y] = [at.x(group.x(thing, shown.moment)), at.y(group.y(thing, shown.moment))];
      drawThing(c, shape, x, y, last.size * 0.95, colourOfThing(group, thing), fullness(group, state));
    }
  }

  function drawLabels(c, at, group) {
    group.texts.forEach((text, index) => {
      const [x, y] = [at.x(group.x(index, shown.moment)), at.y(group.y(index, shown.moment))];
      drawWord(c, text, x, y - last.size - 9, cssColour("--text"));
    });
  }

  function drawAgents(c, at) {
    const agents = agentsOf();
    if (!agents) return;
    // The one pointed at last, on top of the others.
    const order = [...Array(agents.count).keys()].sort((one, other) => (one === shown.agent) - (other === shown.agent));
    for (const agent of order) {
      const state = agents.state(agent, shown.moment);
      const [x, y] = placeOfAgent(at, agents, agent);
      if (Number.isNaN(x) || Number.isNaN(y) || (state !== null && state < 0)) continue;
      drawAgent(c, x, y, last.size, {
        colour: onGround(skillOf(agent, shown.moment).colour),
        heading: agents.heading ? agents.heading(agent, shown.moment) : null,
        number: String(agent + 1),
        out: state > 0,
        pointed: agent === shown.agent,
      });
    }
  }

  /** Who has gone out of sight stands at the border. */
  function placeOfAgent(at, agents, agent) {
    const within = (value, axis) => Math.min(Math.max(value, view.low[axis]), view.high[axis]);
    return [at.x(within(agents.x(agent, shown.moment), 0)), at.y(within(agents.y(agent, shown.moment), 1))];
  }

  /** What is next to the pointer: an agent, or another thing; null if nothing is. */
  function near(event) {
    if (!episode || !run.scenery || !last) return null;
    const frame = canvas.getBoundingClientRect();
    const [px, py] = [event.clientX - frame.left, event.clientY - frame.top];
    let best = null;
    for (const group of episode.groups.filter((one) => one.part === "points")) {
      for (let thing = 0; thing < group.count; thing += 1) {
        const isAgent = group.name === "agents";
        const [x, y] = isAgent ? placeOfAgent(last.at, group, thing) : [last.at.x(group.x(thing, shown.moment)), last.at.y(group.y(thing, shown.moment))];
        const state = group.state(thing, shown.moment);
        // Agents first: they stand on what they visit.
        const away = Math.hypot(x - px, y - py) - (isAgent ? 6 : 0);
        if (away < 16 && (state === null || state >= 0) && (!best || away < best.away)) {
          const said = state === null ? "" : `: ${group.states[state] ?? state}`;
          best = { away, x, y, agent: isAgent ? thing : null, text: isAgent ? `agent ${thing + 1}${state > 0 ? said : ""}: ${skillOf(thing, shown.moment).name}` : nameOfThing(group, thing) + said };
        }
      }
    }
    return best;
  }

  return { open, draw, near: (event) => { shown.near = event && near(event); return shown.near; } };
}
