"use strict";
// Who follows which skill when, as rows of colour under the picture, and what changes its state when.

const TIMELINE_MARGIN = { left: 30, right: 14, bottom: 34 };
const EVENTS_HEIGHT = 16;

function Timeline(canvas, choose, say) {
  let run = null;
  let episode = null;
  let moment = 0;
  let isHeld = false;

  const rowHeight = () => Math.max(5, Math.min(18, 260 / run.agents.length));
  const top = () => (episode.events.length ? EVENTS_HEIGHT : 4);
  const width = () => Math.max(canvas.parentElement.clientWidth, 200);
  const x = (step) => TIMELINE_MARGIN.left + ((width() - TIMELINE_MARGIN.left - TIMELINE_MARGIN.right) * step) / episode.steps;

  function draw(at) {
    moment = at;
    const rows = run.agents.length;
    const floor = top() + rows * rowHeight();
    const c = sharp(canvas, width(), floor + TIMELINE_MARGIN.bottom);
    for (let agent = 0; agent < rows; agent += 1) drawRow(c, agent, top() + agent * rowHeight());
    c.font = canvasFont(11);
    c.fillStyle = cssColour("--soft");
    c.textAlign = "center";
    for (const tick of roundTicks(0, episode.steps, width() < 500 ? 5 : 10).filter(Number.isInteger)) c.fillText(String(tick), x(tick), floor + 14);
    c.fillText("time step", (x(0) + x(episode.steps)) / 2, floor + 29);
    for (const { step, group, thing, state } of episode.events) {
      drawThing(c, "diamond", x(step), 7, 4, colourOfThing(group, thing), fullness(group, state));
    }
    c.fillStyle = cssColour("--text");
    c.fillRect(x(moment) - 1, top() - 3, 2, floor - top() + 6);
  }

  function drawRow(c, agent, y) {
    const height = rowHeight();
    for (let step = 0; step < episode.steps;) {
      const choice = episode.choice(agent, step);
      let end = step + 1;
      while (end < episode.steps && episode.choice(agent, end) === choice) end += 1;
      c.fillStyle = onGround(run.skills[choice].colour);
      c.fillRect(x(step), y, x(end) - x(step) - (end < episode.steps ? 1 : 0), height - (height > 6 ? 2 : 1));
      step = end;
    }
    if (height < 10 && agent % 5) return;
    c.font = canvasFont(11);
    c.fillStyle = cssColour("--soft");
    c.textAlign = "right";
    c.textBaseline = "middle";
    c.fillText(String(agent + 1), TIMELINE_MARGIN.left - 6, y + height / 2 - 1);
    c.textBaseline = "alphabetic";
  }

  function placeOf(event) {
    const box = canvas.getBoundingClientRect();
    const part = (event.clientX - box.left - TIMELINE_MARGIN.left) / (width() - TIMELINE_MARGIN.left - TIMELINE_MARGIN.right);
    return { step: Math.min(Math.max(part, 0), 1) * episode.steps, agent: Math.floor((event.clientY - box.top - top()) / rowHeight()) };
  }

  function describe({ step, agent }) {
    const at = Math.min(Math.floor(step), episode.steps - 1);
    const parts = [`Step ${at + 1}`];
    if (agent >= 0 && agent < run.agents.length) parts.push(`agent ${agent + 1}: ${run.skills[episode.choice(agent, at)].name}`);
    const reach = episode.steps / 100;
    for (const { step: when, group, thing, state } of episode.events) {
      if (Math.abs(when - step) < Math.max(reach, 0.5)) parts.push(`${nameOfThing(group, thing)}: ${group.states[state] ?? "gone"}`);
    }
    return parts.join(", ");
  }

  canvas.addEventListener("pointerdown", (event) => { isHeld = true; canvas.setPointerCapture(event.pointerId); choose(Math.round(placeOf(event).step)); say(describe(placeOf(event))); });
  canvas.addEventListener("pointermove", (event) => {
    if (!episode) return;
    if (isHeld) choose(Math.round(placeOf(event).step));
    say(describe(placeOf(event)));
  });
  canvas.addEventListener("pointerup", () => { isHeld = false; });
  canvas.addEventListener("pointercancel", () => { isHeld = false; });
  canvas.addEventListener("pointerleave", () => say(""));
  return { open: (newRun, newEpisode) => { run = newRun; episode = newEpisode; }, draw };
}
