"use strict";
// One seed's recorded episodes, and what there is in one of them at a moment, also between two steps.

const STEPS_ACROSS = 4000;
const STEPS_AROUND = 256;
const STEPS_OF_SENSORS = 100;

async function Episodes(run, replay) {
  const arrays = await unpack(replay);
  const extent = run.scenery ? Math.max(...[0, 1].map((axis) => run.scenery.high[axis] - run.scenery.low[axis])) : 1;
  return {
    all: replay.episodes.map(([number, solved, total, steps], index) => ({ index, number, solved, total, steps })),
    open: (index) => Episode(run, replay, arrays, index, extent),
  };
}

function Episode(run, replay, arrays, index, extent) {
  const [number, solved, total, steps] = replay.episodes[index];
  const groups = (run.scenery ? run.scenery.groups : []).map((group) => ({ ...group, ...reader(group, arrays, index) }));

  function reader(group) {
    const of = (axis) => arrays[`${group.arrays}.${axis}`];
    const first = of("x") || of("x0");
    const along = (axis, thing, moment) => between(of(axis), thing, moment);
    const place = (axis, column) => (thing, moment) => run.scenery.low[column] + (along(axis, thing, moment) / STEPS_ACROSS) * extent;
    return {
      count: first.shape[1],
      x: place(of("x") ? "x" : "x0", 0),
      y: place(of("y") ? "y" : "y0", 1),
      toX: of("x1") && place("x1", 0),
      toY: of("y1") && place("y1", 1),
      radius: of("radius") && ((thing, moment) => (along("radius", thing, moment) / STEPS_ACROSS) * extent),
      heading: of("heading") && ((thing, moment) => turned(of("heading"), thing, moment)),
      state: of("state") ? (thing, moment) => of("state").at(index, thing, Math.floor(moment)) : () => null,
    };
  }

  /** Between two steps things are on the straight line from where they were to where they are. */
  function between(array, thing, moment) {
    const before = Math.floor(moment);
    const from = array.at(index, thing, before);
    if (moment === before) return from === NOWHERE ? NaN : from;
    const to = array.at(index, thing, before + 1);
    return from === NOWHERE || to === NOWHERE ? NaN : from + (to - from) * (moment - before);
  }

  function turned(array, thing, moment) {
    const before = Math.floor(moment);
    const from = array.at(index, thing, before);
    const on = moment === before ? 0 : ((array.at(index, thing, before + 1) - from + STEPS_AROUND * 1.5) % STEPS_AROUND) - STEPS_AROUND / 2;
    return ((from + on * (moment - before)) / STEPS_AROUND) * 2 * Math.PI;
  }

  /** The skill that an agent follows from a moment on; at the end, the one that it followed last. */
  const choice = (agent, moment) => arrays.choice.at(index, agent, Math.min(Math.floor(moment), steps - 1));

  function reading(agent, sensor, moment) {
    const at = Math.min(Math.floor(moment), steps - 1);
    const share = arrays.seen.at(index, agent * replay.sensors + sensor, at) / STEPS_OF_SENSORS;
    return { share, value: Math.sign(share) * Math.expm1(Math.abs(share) * Math.log1p(replay.greatest)) };
  }

  /** What changes its state when: {step, group, thing, state}. */
  function events() {
    const found = [];
    for (const group of groups.filter((one) => one.part === "points" && one.name !== "agents" && one.states.length)) {
      for (let thing = 0; thing < group.count; thing += 1) {
        for (let step = 1; step <= steps; step += 1) {
          const state = group.state(thing, step);
          if (state !== group.state(thing, step - 1)) found.push({ step, group, thing, state });
        }
      }
    }
    return found;
  }

  /** Whether any sensor reads less than 0 in this episode. */
  function isSigned() {
    for (let row = 0; row < run.agents.length * replay.sensors; row += 1) {
      for (let step = 0; step < steps; step += 1) if (arrays.seen.at(index, row, step) < 0) return true;
    }
    return false;
  }

  return { number, solved, total, steps, groups, choice, reading, sensors: replay.sensors, isSigned: isSigned(), events: events() };
}

const kindOf = (group, thing) => (group.kinds && group.kinds[thing]) || "";
const colourOfThing = (group, thing) => {
  const own = (group.ofKinds && group.ofKinds[kindOf(group, thing)]) || group.colour;
  return own ? onGround(own) : cssColour("--soft");
};
const nameOfThing = (group, thing) => [group.name, kindOf(group, thing)].filter(Boolean).join(" ");
/** How full a mark is: empty in the first state, full in the last. */
const fullness = (group, state) => (state === null || group.states.length < 2 ? 1 : Math.min(state / (group.states.length - 1), 1));
