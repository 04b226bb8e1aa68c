"use strict";
// Elements, words and numbers. Text from a run folder becomes text nodes, never markup.

const SVG = "http://www.w3.org/2000/svg";
const byId = (id) => document.getElementById(id);

/** An element with attributes and children; strings become text. */
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  return filled(element, attributes, children);
}

function makeSvg(tag, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, tag), attributes, children);
}

function filled(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== null && value !== false) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children);
  return element;
}

/** 0.5 M, 200 k. */
function readableSteps(steps) {
  for (const [scale, suffix] of [[1e9, " G"], [1e6, " M"], [1e3, " k"]]) {
    if (steps >= scale) return `${Number((steps / scale).toPrecision(3))}${suffix}`;
  }
  return String(Number(steps.toPrecision(3)));
}

function readableScore(value, score) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  return score.decimals === null ? String(Number(value.toPrecision(4))) : value.toFixed(score.decimals);
}

const plural = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;

/** Round values that make about `count` ticks from low to high. */
function roundTicks(low, high, count) {
  const span = high - low || 1;
  const rough = span / count;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 2.5, 5, 10].map((digit) => digit * power).find((size) => size >= rough);
  const ticks = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; i += 1) ticks.push(Number((i * step).toPrecision(12)));
  return ticks;
}

/** Powers of ten between low and high, with what lies between them where there are few. */
function logarithmicTicks(low, high, room) {
  const decades = Math.log10(high / low);
  const leading = decades < 1.5 && room > 360 ? [1, 2, 5] : decades < 3 ? [1, 3] : [1];
  const ticks = [];
  for (let power = Math.floor(Math.log10(low)); power <= Math.log10(high); power += 1) {
    for (const digit of leading) {
      const tick = digit * 10 ** power;
      if (tick >= low && tick <= high) ticks.push(tick);
    }
  }
  return ticks;
}

const isDark = () => document.documentElement.dataset.theme === "dark";
const onGround = (pair) => pair[isDark() ? 1 : 0];
const cssColour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

/** A canvas made as sharp as the screen; returns its context, scaled to CSS pixels. */
function sharp(canvas, width, height) {
  const ratio = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * ratio);
  canvas.height = Math.round(height * ratio);
  canvas.style.width = `${width}px`;
  canvas.style.height = `${height}px`;
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  return context;
}

const canvasFont = (size, weight = "") => `${weight} ${size}px system-ui, "DejaVu Sans", sans-serif`.trim();
