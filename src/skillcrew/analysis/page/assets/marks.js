"use strict";
// Marks on a canvas. What differs differs in shape or filling too, not in colour alone.

const SHAPES = ["diamond", "square", "triangle", "hexagon"];

function outline(c, shape, x, y, r) {
  c.beginPath();
  if (shape === "circle") { c.arc(x, y, r, 0, 2 * Math.PI); return; }
  const [corners, turn] = { diamond: [4, 0], square: [4, 0.25], triangle: [3, 0.5], hexagon: [6, 0] }[shape];
  for (let i = 0; i < corners; i += 1) {
    const angle = ((i + turn) / corners) * 2 * Math.PI + (shape === "square" ? Math.PI / 4 - 0.125 * Math.PI : 0) - Math.PI / 2;
    c.lineTo(x + r * 1.15 * Math.cos(angle), y + r * 1.15 * Math.sin(angle));
  }
  c.closePath();
}

/** A thing: an outline that is full from below by a share of its height. */
function drawThing(c, shape, x, y, r, colour, full) {
  c.save();
  outline(c, shape, x, y, r);
  c.fillStyle = cssColour("--plot");
  c.fill();
  if (full > 0) {
    c.save();
    c.clip();
    c.fillStyle = colour;
    c.fillRect(x - 2 * r, y + r * (1 - 2 * full) - (full === 1 ? r : 0), 4 * r, 4 * r);
    c.restore();
  }
  outline(c, shape, x, y, r);
  c.lineWidth = 2;
  c.strokeStyle = colour;
  c.stroke();
  c.restore();
}

/** An agent: a disc in its skill's colour with its number, and a wedge towards where it heads. */
function drawAgent(c, x, y, r, look) {
  c.save();
  c.lineWidth = look.pointed ? 3 : 1.5;
  c.strokeStyle = look.pointed ? cssColour("--accent") : cssColour("--text");
  c.fillStyle = look.colour;
  c.globalAlpha = look.out ? 0.55 : 1;
  if (look.heading !== null) {
    c.beginPath();
    for (const [far, side] of [[1.95, 0], [0.85, 0.62], [0.85, -0.62]]) {
      const angle = -look.heading + side;
      c.lineTo(x + r * far * Math.cos(angle), y + r * far * Math.sin(angle));
    }
    c.closePath();
    c.fill();
    c.stroke();
  }
  c.beginPath();
  c.arc(x, y, r, 0, 2 * Math.PI);
  c.fill();
  c.stroke();
  if (r >= 7) {
    c.fillStyle = readableOn(look.colour);
    c.font = canvasFont(Math.round(r * 1.3), "600");
    c.textAlign = "center";
    c.textBaseline = "middle";
    c.fillText(look.number, x, y + 0.5);
  }
  if (look.out) {
    c.globalAlpha = 1;
    c.lineWidth = 2;
    c.beginPath();
    for (const [dx, dy] of [[1, 1], [1, -1]]) { c.moveTo(x - r * dx, y - r * dy); c.lineTo(x + r * dx, y + r * dy); }
    c.strokeStyle = cssColour("--text");
    c.stroke();
  }
  c.restore();
}

/** Black or white, whichever is read better on a colour `#rrggbb`. */
function readableOn(colour) {
  const [red, green, blue] = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16) / 255);
  return 0.299 * red + 0.587 * green + 0.114 * blue > 0.58 ? "#000000" : "#ffffff";
}

/** A word with a rim of the ground, so that it is read on anything. */
function drawWord(c, text, x, y, colour, size = 12, align = "center") {
  c.save();
  c.font = canvasFont(size, "600");
  c.textAlign = align;
  c.textBaseline = "middle";
  c.lineJoin = "round";
  c.lineWidth = 4;
  c.strokeStyle = cssColour("--plot");
  c.strokeText(text, x, y);
  c.fillStyle = colour;
  c.fillText(text, x, y);
  c.restore();
}

function drawDisc(c, x, y, r, colour, full, isDashed) {
  c.save();
  c.beginPath();
  c.arc(x, y, Math.max(r, 0.5), 0, 2 * Math.PI);
  c.globalAlpha = 0.06 + 0.14 * full;
  c.fillStyle = colour;
  c.fill();
  c.globalAlpha = 0.75;
  c.lineWidth = 1.3;
  c.strokeStyle = colour;
  if (isDashed) c.setLineDash([5, 4]);
  c.stroke();
  c.restore();
}
