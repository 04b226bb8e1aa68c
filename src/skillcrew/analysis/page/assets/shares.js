"use strict";
// Which share of the episodes has each agent follow each skill, over the time steps: one panel an agent.

const SHARE_STEPS = 1000;
const LEAST_RUNNING = 0.01;
const SHARES_MARGIN = { left: 38, right: 12, top: 20, bottom: 36 };
const SHARES_HEIGHT = 150;
const STRIP = 8;

function Shares() {
  let run = null;
  let arrays = null;
  let panels = [];

  async function show(newRun, seed) {
    run = newRun;
    const packed = run.shares[seed];
    const unpacked = await unpack(packed);
    // Another choice may have been made meanwhile.
    if (run !== newRun || packed !== run.shares[seed]) return;
    arrays = unpacked;
    const chooses = run.skills.length > 1;
    byId("choices-note").textContent = chooses
      ? `At each time step, the share of the episodes still running in which the champion's agent follows each skill, over ${run.scores.episodes} fresh episodes. Grey strip: how many still run.`
      : "This algorithm's teams choose nothing: they act without skills.";
    byId("shares-said").textContent = "";
    panels = chooses ? run.agents.map((_, agent) => make("canvas", { role: "img", "aria-label": `Skills of agent ${agent + 1}` })) : [];
    panels.forEach((canvas, agent) => {
      canvas.addEventListener("pointermove", (event) => point(agent, stepAt(canvas, event)));
      canvas.addEventListener("pointerleave", () => point(agent, null));
    });
    byId("shares").replaceChildren(...panels);
    draw(null);
  }

  const length = () => arrays.running.shape[0];

  function stepAt(canvas, event) {
    const box = canvas.getBoundingClientRect();
    const part = (event.clientX - box.left - SHARES_MARGIN.left) / (box.width - SHARES_MARGIN.left - SHARES_MARGIN.right);
    return part < 0 || part >= 1 ? null : Math.floor(part * length());
  }

  function point(agent, step) {
    draw(step);
    if (step === null) { byId("shares-said").textContent = ""; return; }
    const parts = run.skills
      .map((skill, index) => [skill.name, arrays.shares.at(agent, index, step) / SHARE_STEPS])
      .filter(([, share]) => share > 0.004)
      .sort((one, other) => other[1] - one[1])
      .map(([name, share]) => `${name} ${(share * 100).toFixed(0)} %`);
    const running = ((arrays.running.at(step) / SHARE_STEPS) * 100).toFixed(0);
    byId("shares-said").textContent = `Step ${step + 1}, agent ${agent + 1}: ${parts.join(", ")}. ${running} % of the episodes still run.`;
  }

  function draw(step) {
    if (arrays) panels.forEach((canvas, agent) => drawPanel(canvas, agent, step));
  }

  function drawPanel(canvas, agent, step) {
    const width = canvas.parentElement.clientWidth ? canvas.clientWidth || 300 : 300;
    const c = sharp(canvas, width, SHARES_HEIGHT);
    canvas.style.width = "";
    const floor = SHARES_HEIGHT - SHARES_MARGIN.bottom;
    const [w, h] = [width - SHARES_MARGIN.left - SHARES_MARGIN.right, floor - STRIP - 2 - SHARES_MARGIN.top];
    // On whole pixels, or lines of the ground would show between steps.
    const x = (t) => SHARES_MARGIN.left + Math.round((w * t) / length());
    for (let t = 0; t < length(); t += 1) {
      const running = arrays.running.at(t) / SHARE_STEPS;
      c.globalAlpha = running < LEAST_RUNNING ? 0.3 : 1;
      let below = 0;
      run.skills.forEach((skill, index) => {
        const share = arrays.shares.at(agent, index, t) / SHARE_STEPS;
        c.fillStyle = onGround(skill.colour);
        c.fillRect(x(t), SHARES_MARGIN.top + h * (1 - below - share), x(t + 1) - x(t), h * share);
        below += share;
      });
      c.globalAlpha = 1;
      c.fillStyle = cssColour("--soft");
      c.fillRect(x(t), floor - STRIP * running, x(t + 1) - x(t), STRIP * running);
    }
    drawShareAxes(c, agent, { x, w, h, floor, width });
    if (step !== null) {
      c.strokeStyle = cssColour("--text");
      c.strokeRect(x(step), SHARES_MARGIN.top, x(step + 1) - x(step), floor - SHARES_MARGIN.top);
    }
  }

  function drawShareAxes(c, agent, { x, w, h, floor }) {
    const of = run.agents[agent].type;
    c.fillStyle = cssColour("--text");
    c.font = canvasFont(12, "600");
    c.textAlign = "left";
    c.fillText(run.agents.length > 1 ? `Agent ${agent + 1}${of ? ` (${of})` : ""}` : "", SHARES_MARGIN.left, 13);
    c.font = canvasFont(11);
    c.fillStyle = cssColour("--soft");
    c.textAlign = "right";
    for (const tick of [0, 0.5, 1]) c.fillText(String(tick), SHARES_MARGIN.left - 5, SHARES_MARGIN.top + h * (1 - tick) + 4);
    c.textAlign = "center";
    for (const tick of roundTicks(0, length(), 5).filter(Number.isInteger)) c.fillText(String(tick), x(tick), floor + 13);
    c.fillText("time step", SHARES_MARGIN.left + w / 2, floor + 29);
    c.strokeStyle = cssColour("--line");
    c.strokeRect(SHARES_MARGIN.left, SHARES_MARGIN.top, w, h);
  }

  return { show, redraw: () => draw(null) };
}
