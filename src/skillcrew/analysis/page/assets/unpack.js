"use strict";
// Numbers from the text that packing.py makes of them.

const NOWHERE = -32768;

async function inflated(text) {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Arrays by name: {shape, at(i, j, k)}, whole numbers; the last axis is time. */
async function unpack(packed) {
  const planes = await inflated(packed.data);
  const half = planes.length / 2;
  const arrays = {};
  let first = 0;
  for (const [name, shape] of packed.arrays) {
    const size = shape.reduce((product, length) => product * length, 1);
    const length = shape[shape.length - 1];
    const values = new Int16Array(size);
    let sum = 0;
    for (let i = 0; i < size; i += 1) {
      if (i % length === 0) sum = 0;
      sum = (sum + planes[first + i] + planes[half + first + i] * 256) & 0xffff;
      values[i] = sum;
    }
    arrays[name] = indexed(values, shape);
    first += size;
  }
  return arrays;
}

function indexed(values, shape) {
  const [, rows, columns] = shape.length === 3 ? shape : [0, 0, 0];
  const at = shape.length === 3 ? (i, j, k) => values[(i * rows + j) * columns + k] : (i) => values[i];
  return { shape, at };
}
