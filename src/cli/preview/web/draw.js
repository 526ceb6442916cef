"use strict";

// Numbers made visible: pixels, and the curve of errors.
const draw = (function () {
  // Values become display values by a table of the highest 18 bits of a float: nine of its mantissa.
  const SHIFT = 14;
  const table = new Uint8ClampedArray(1 << (32 - SHIFT));

  // As the program's own tone curves.
  const curves = {
    shoulder: (v) => (v > 0.8 ? 0.8 + 0.2 * (1 - Math.exp((0.8 - v) / 0.2)) : v),
    linear: (v) => Math.min(v, 1),
    filmic: (v) => {
      const x = Math.min(v, 1e4);
      return Math.min((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14), 1);
    },
  };

  function encode(v) {
    return v <= 0.0031308 ? 12.92 * v : 1.055 * Math.pow(v, 1 / 2.4) - 0.055;
  }

  function fill(stops, tonemap) {
    const word = new Uint32Array(1);
    const value = new Float32Array(word.buffer);
    const factor = Math.pow(2, stops);
    // Negative numbers and what is no number stay black.
    for (let i = 0; i < table.length / 2; i++) {
      word[0] = (i << SHIFT) | (1 << (SHIFT - 1));
      const v = value[0];
      table[i] = v === v ? 255 * encode(curves[tonemap](v * factor)) : 0;
    }
  }

  // Pixels of three floats, as they are shown.
  function picture(context, image, stops, tonemap) {
    fill(stops, tonemap);
    const { width, height } = image;
    const bits = new Uint32Array(image.pixels.buffer, image.pixels.byteOffset, 3 * width * height);
    const shown = context.createImageData(width, height);
    const out = shown.data;
    for (let i = 0, o = 0; i < bits.length; i += 3, o += 4) {
      out[o] = table[bits[i] >>> SHIFT];
      out[o + 1] = table[bits[i + 1] >>> SHIFT];
      out[o + 2] = table[bits[i + 2] >>> SHIFT];
      out[o + 3] = 255;
    }
    context.putImageData(shown, 0, 0);
  }

  const viridis = [VIRIDIS_RGB];
  const colours = new Uint8ClampedArray(3 * 256);
  for (let i = 0; i < 256; i++) {
    const place = (i / 255) * (viridis.length / 3 - 1);
    const index = Math.min(Math.floor(place), viridis.length / 3 - 2);
    for (let c = 0; c < 3; c++) {
      const [a, b] = [viridis[3 * index + c], viridis[3 * index + 3 + c]];
      colours[3 * i + c] = a + (b - a) * (place - index);
    }
  }

  // Standard error over value, as the program judges pictures: root mean square over channels.
  function relative(image, i) {
    let sum = 0;
    for (let c = 3 * i; c < 3 * i + 3; c++) {
      const [p, e] = [image.pixels[c], image.errors[c]];
      sum += (e * e) / (p * p + 0.01);
    }
    return Math.sqrt(sum / 3);
  }

  // From a thousandth to one.
  function errors(context, image) {
    const { width, height } = image;
    const shown = context.createImageData(width, height);
    const out = shown.data;
    for (let i = 0; i < width * height; i++) {
      const part = Math.log10(relative(image, i)) / 3 + 1;
      const colour = 3 * Math.round(255 * Math.min(Math.max(part, 0), 1));
      out[4 * i] = colours[colour];
      out[4 * i + 1] = colours[colour + 1];
      out[4 * i + 2] = colours[colour + 2];
      out[4 * i + 3] = 255;
    }
    context.putImageData(shown, 0, 0);
  }

  function ramp() {
    const stops = [];
    for (let i = 0; i < viridis.length; i += 3) {
      stops.push(`rgb(${viridis[i]} ${viridis[i + 1]} ${viridis[i + 2]})`);
    }
    return `linear-gradient(to right, ${stops.join(", ")})`;
  }

  // Stops that make white of the luminance that 99 % of the pixels are below.
  function automatic(image) {
    const values = [];
    const p = image.pixels;
    for (let i = 0; i < p.length; i += 3) {
      const v = 0.2126 * p[i] + 0.7152 * p[i + 1] + 0.0722 * p[i + 2];
      if (v > 0 && v < Infinity) {
        values.push(v);
      }
    }
    if (values.length === 0) {
      return 0;
    }
    const sorted = Float32Array.from(values).sort();
    return -Math.log2(sorted[Math.floor(((sorted.length - 1) * 99) / 100)]);
  }

  // Marks of a logarithmic axis: 1, 2 and 5 times powers of ten, or the powers alone.
  function marks(low, high) {
    const list = [];
    const few = Math.log10(high / low) < 2.2;
    for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); e++) {
      for (const digit of few ? [1, 2, 5] : [1]) {
        const v = digit * Math.pow(10, e);
        if (v >= low * 0.999 && v <= high * 1.001) {
          list.push(v);
        }
      }
    }
    return list;
  }

  const UNITS = [[1, "s"], [60, "min"], [3600, "h"], [86400, "d"]];

  function time(seconds) {
    const [unit, name] = UNITS.filter(([unit]) => seconds >= unit).pop() || UNITS[0];
    const value = seconds / unit;
    return `${Number(value.toPrecision(value < 10 ? 2 : 3))} ${name}`;
  }

  // Marks of an axis of times, whole numbers of some unit where that is possible.
  function times(low, high) {
    const list = marks(low, high).filter((t) => t < 60);
    for (const [unit, digits] of [[60, [1, 2, 5, 10, 20, 30]], [3600, [1, 2, 5, 10]]]) {
      list.push(...digits.map((digit) => digit * unit));
    }
    for (let days = 1; days * 86400 <= high; days *= 2) {
      list.push(days * 86400);
    }
    return list.filter((t) => t >= low && t <= high);
  }

  function percent(error) {
    return `${Number((100 * error).toPrecision(2))} %`;
  }

  // Errors against seconds, and what is ahead until `goal` (or nothing).
  function chart(svg, points, goal) {
    const box = svg.getBoundingClientRect();
    const [width, height] = [Math.max(box.width, 200), Math.max(box.height, 120)];
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    const known = points.filter(([t, e]) => t > 0 && e > 0);
    if (known.length === 0) {
      svg.innerHTML = "";
      return;
    }
    const last = known[known.length - 1];
    const reach = goal && goal.error < last[1] ? last[0] * (last[1] / goal.error) ** 2 : last[0];
    const [left, right, top, bottom] = [52, 14, 12, 24];
    const span = [known[0][0], Math.max(reach, known[0][0] * 2)];
    const all = known.map((p) => p[1]).concat(goal ? [goal.error] : []);
    const errors = [Math.min(...all) / 1.25, Math.max(...all) * 1.25];
    const along = (v, [low, high]) => Math.log(v / low) / Math.log(high / low);
    const x = (t) => left + along(t, span) * (width - left - right);
    const y = (e) => height - bottom - along(e, errors) * (height - top - bottom);
    const at = ([t, e]) => `${x(t).toFixed(1)},${y(e).toFixed(1)}`;
    const parts = [];
    const line = (kind, x1, y1, x2, y2) => {
      parts.push(`<line class="${kind}" x1="${x1}" y1="${y1}" x2="${x2}" y2="${y2}"/>`);
    };
    for (const e of marks(...errors)) {
      line("rule", left, y(e), width - right, y(e));
      parts.push(`<text x="${left - 6}" y="${y(e) + 4}" text-anchor="end">${percent(e)}</text>`);
    }
    let free = 0;
    for (const t of times(...span)) {
      line("rule", x(t), top, x(t), height - bottom);
      if (x(t) > free) {
        const end = x(t) > width - 40 ? "end" : "middle";
        parts.push(`<text x="${x(t)}" y="${height - 6}" text-anchor="${end}">${time(t)}</text>`);
        free = x(t) + 58;
      }
    }
    line("axis", left, height - bottom, width - right, height - bottom);
    line("axis", left, top, left, height - bottom);
    if (goal) {
      line("goal", left, y(goal.error), width - right, y(goal.error));
      const above = y(goal.error) - 5;
      parts.push(`<text class="goal-name" x="${left + 6}" y="${above}">${goal.name}</text>`);
    }
    parts.push(`<polyline class="curve" points="${known.map(at).join(" ")}"/>`);
    if (reach > last[0]) {
      const end = [reach, goal.error];
      parts.push(`<polyline class="ahead" points="${at(last)} ${at(end)}"/>`);
    }
    parts.push(`<circle class="dot" cx="${x(last[0])}" cy="${y(last[1])}" r="3.5"/>`);
    svg.innerHTML = parts.join("");
  }

  return { picture, errors, relative, ramp, automatic, chart, time, percent };
})();
