/* jspsych-socialai, MIT licence, contributors to socialai-dsl. It contains nothing of others. */
"use strict";
var __defProp = Object.defineProperty;
var __getOwnPropDesc = Object.getOwnPropertyDescriptor;
var __getOwnPropNames = Object.getOwnPropertyNames;
var __hasOwnProp = Object.prototype.hasOwnProperty;
var __export = (target, all) => {
  for (var name in all)
    __defProp(target, name, { get: all[name], enumerable: true });
};
var __copyProps = (to, from, except, desc) => {
  if (from && typeof from === "object" || typeof from === "function") {
    for (let key of __getOwnPropNames(from))
      if (!__hasOwnProp.call(to, key) && key !== except)
        __defProp(to, key, { get: () => from[key], enumerable: !(desc = __getOwnPropDesc(from, key)) || desc.enumerable });
  }
  return to;
};
var __toCommonJS = (mod) => __copyProps(__defProp({}, "__esModule", { value: true }), mod);

// web/jspsych-socialai/src/index.js
var index_exports = {};
__export(index_exports, {
  default: () => JsPsychSocialai
});
module.exports = __toCommonJS(index_exports);
var import_jspsych = require("jspsych");

// web/jspsych-socialai/package.json
var version = "0.1.0";

// socialai_dsl/study/static/connection.js
var TRY_EVERY = 1e3;
var BEAT_EVERY = 2e3;
var CLOSED = { 4404: "unknown", 4409: "elsewhere", 4429: "fast" };
var Connection = class {
  /** @param {string} address @param {(said: Reply) => void} hear
   * @param {(why: string | undefined) => void} lost told that it was lost; with a word for why if it is not opened again
   * @param {() => Reply} [greeting] what is sent first, each time */
  constructor(address, hear, lost, greeting) {
    this.address = address;
    this.hear = hear;
    this.lost = lost;
    this.greeting = greeting;
    this.beating = setInterval(() => this.send({ do: "beat" }), BEAT_EVERY);
    this.open();
  }
  open() {
    const socket = this.socket = new WebSocket(this.address);
    socket.onopen = () => this.greeting && this.send(this.greeting());
    socket.onmessage = (event) => this.hear(JSON.parse(event.data));
    socket.onclose = ({ code }) => {
      if (CLOSED[code]) this.close();
      else this.trying = setTimeout(() => this.open(), TRY_EVERY);
      this.lost(CLOSED[code]);
    };
  }
  /** @param {Reply} what */
  send(what) {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(what));
  }
  /** Let it go for good. */
  close() {
    clearInterval(this.beating);
    clearTimeout(this.trying);
    if (!this.socket) return;
    this.socket.onmessage = this.socket.onclose = null;
    this.socket.close();
  }
};

// socialai_dsl/traces/static/dom.js
function make(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  setAttributes(made, attributes);
  made.append(...children.filter((child) => child !== null));
  return made;
}
function setAttributes(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(name.slice(2), value);
    else if (value !== null && value !== false) element.setAttribute(name, value === true ? "" : String(value));
  }
}
function panel(title, name, ...children) {
  const heading = make("h2", { id: `${name}-title` }, title);
  return make("section", { class: `panel ${name}`, "aria-labelledby": `${name}-title` }, heading, ...children);
}

// socialai_dsl/traces/static/tiles.js
var INK = [38, 40, 46];
var PAPER = [243, 241, 235];
var WHITE = [255, 255, 255];
var LINE = [221, 218, 209];
var LAVA = [240, 118, 34];
var STONE = [92, 97, 107];
var SEEN_TINT = [255, 226, 138];
var SKIN = [252, 206, 160];
var GOLD = [250, 214, 90];
var BROWN = [104, 70, 40];
var SEEN_LINE = "rgb(214 150 20)";
var PALETTE = [[214, 64, 58], [62, 160, 82], [58, 110, 205], [142, 84, 178], [232, 182, 44], [136, 140, 148]];
var UNLETTERED = [0, 1, 2, 3, 9];
var FORWARD = [[1, 0], [0, 1], [-1, 0], [0, -1]];
function mix(a, b, share) {
  const part = (k) => Math.round(a[k] + (b[k] - a[k]) * share);
  return [part(0), part(1), part(2)];
}
var dark = (colour) => mix(colour, INK, 0.45);
var light = (colour) => mix(colour, WHITE, 0.55);
var css = (colour) => `rgb(${colour.join(" ")})`;
function turn(points, direction) {
  const [cos, sin] = FORWARD[direction % 4];
  return points.map(([x, y]) => [0.5 + (x - 0.5) * cos - (y - 0.5) * sin, 0.5 + (x - 0.5) * sin + (y - 0.5) * cos]);
}
var Pen = class _Pen {
  /** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {number} size */
  constructor(context, x, y, size) {
    this.c = context;
    this.x = x;
    this.y = y;
    this.size = size;
  }
  /** A square of this one: its upper left corner and its side. @param {number} x @param {number} y @param {number} size */
  part(x, y, size) {
    return new _Pen(this.c, this.x + x * this.size, this.y + y * this.size, size * this.size);
  }
  /** @param {Rgb} colour */
  fill(colour) {
    this.c.fillStyle = css(colour);
    this.c.fillRect(this.x, this.y, this.size, this.size);
  }
  /** A path in the colour of the outline, and within it one in that of the inside.
   * @param {(inset: number) => void} path @param {Rgb | null} fill @param {Rgb | null} outline @param {number} width */
  paint(path, fill, outline, width) {
    this.c.beginPath();
    path(0);
    if (outline) {
      if (!fill) path(width);
      this.c.fillStyle = css(outline);
      this.c.fill("evenodd");
      if (!fill) return;
      this.c.beginPath();
      path(width);
    }
    if (fill) {
      this.c.fillStyle = css(fill);
      this.c.fill();
    }
  }
  /** @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1
   * @param {{fill?: Rgb, outline?: Rgb, width?: number, radius?: number}} look */
  rectangle(x0, y0, x1, y1, { fill, outline, width = 0.05, radius = 0 }) {
    const s = this.size, last = s - 0.25;
    const snap = (part) => Math.floor(part * last * 4) / 4;
    const left = snap(x0), top = snap(y0), w = snap(x1) + 0.25 - left, h = snap(y1) + 0.25 - top;
    this.paint((inset) => {
      const r = Math.max(0, radius * s - inset);
      this.c.roundRect(this.x + left + inset, this.y + top + inset, w - 2 * inset, h - 2 * inset, r);
    }, fill ?? null, outline ?? null, Math.max(1, Math.round(width * s * 4)) / 4);
  }
  /** @param {number} x @param {number} y @param {number} radius @param {{fill?: Rgb, outline?: Rgb, width?: number}} look */
  circle(x, y, radius, look) {
    this.ellipse(x - radius, y - radius, x + radius, y + radius, look);
  }
  /** @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1
   * @param {{fill?: Rgb, outline?: Rgb, width?: number}} look */
  ellipse(x0, y0, x1, y1, { fill, outline, width = 0.05 }) {
    const s = this.size, x = this.x + (x0 + x1) / 2 * s, y = this.y + (y0 + y1) / 2 * s;
    this.paint((inset) => {
      const rx = Math.max(0, (x1 - x0) / 2 * s - inset), ry = Math.max(0, (y1 - y0) / 2 * s - inset);
      this.c.moveTo(x + rx, y);
      this.c.ellipse(x, y, rx, ry, 0, 0, 2 * Math.PI);
    }, fill ?? null, outline ?? null, width * s);
  }
  /** A slice between two angles in degrees, clockwise from the right.
   * @param {number} x @param {number} y @param {number} radius @param {number} start @param {number} end @param {Rgb} fill */
  pie(x, y, radius, start, end, fill) {
    const s = this.size, cx = this.x + x * s, cy = this.y + y * s;
    this.c.beginPath();
    this.c.moveTo(cx, cy);
    this.c.arc(cx, cy, radius * s, start * Math.PI / 180, end * Math.PI / 180);
    this.c.fillStyle = css(fill);
    this.c.fill();
  }
  /** @param {Point[]} points */
  trail(points) {
    this.c.beginPath();
    for (const [x, y] of points) this.c.lineTo(this.x + x * this.size, this.y + y * this.size);
  }
  /** @param {Point[]} points @param {Rgb} fill */
  polygon(points, fill) {
    this.trail(points);
    this.c.fillStyle = css(fill);
    this.c.fill();
  }
  /** A line with round ends. @param {Point[]} points @param {Rgb} colour @param {number} width */
  line(points, colour, width) {
    this.trail(points);
    this.c.lineCap = this.c.lineJoin = "round";
    this.c.lineWidth = width * this.size;
    this.c.strokeStyle = css(colour);
    this.c.stroke();
  }
  /** Part of a circle whose outer radius is given; angles as for a pie.
   * @param {number} x @param {number} y @param {number} radius @param {number} start @param {number} end
   * @param {Rgb} colour @param {number} width */
  arc(x, y, radius, start, end, colour, width) {
    const s = this.size;
    this.c.beginPath();
    this.c.arc(this.x + x * s, this.y + y * s, (radius - width / 2) * s, start * Math.PI / 180, end * Math.PI / 180);
    this.c.lineCap = "butt";
    this.c.lineWidth = width * s;
    this.c.strokeStyle = css(colour);
    this.c.stroke();
  }
};
function drawTile(context, x, y, size, look, more = {}) {
  context.save();
  context.beginPath();
  context.rect(x, y, size, size);
  context.clip();
  const pen = new Pen(context, x, y, size);
  pen.fill(more.seen ? mix(PAPER, SEEN_TINT, 0.55) : PAPER);
  pen.rectangle(0, 0, 1, 1, { outline: more.seen ? mix(LINE, SEEN_TINT, 0.5) : LINE, width: 0.03 });
  const marks = more.marks ?? [], isAgents = more.agent !== void 0;
  if (more.below) drawThing(pen, more.below, []);
  drawThing(pen, look, isAgents ? [] : marks);
  const colour = PALETTE[look[1] % 6];
  if (more.gesture) drawGesture(pen, colour, look[3], more.gesture);
  if (more.agent !== void 0) drawAgent(pen, more.agent);
  if (!isAgents) drawMarks(pen, marks);
  if (more.held) drawHeld(pen, more.held, isAgents ? marks : []);
  drawRays(pen, more.rays ?? []);
  if (more.letter && !UNLETTERED.includes(look[0])) drawLetter(pen, look[1]);
  context.restore();
}
function drawThing(pen, [type, colour, status, orientation], marks) {
  const side = marks.reduce((part2, [, word]) => part2 * (SIZES[word] ?? 1), 1);
  const part = pen.part((1 - side) / 2, (1 - side) / 2, side);
  (DRAWERS[type] ?? drawUnknown)(part, PALETTE[colour % 6], status, orientation);
  const patterns = marks.map(([, word]) => PATTERNS[word]).filter((draw) => draw);
  for (const draw of patterns) draw(part);
  if (patterns.length && DRAWERS[type] === drawBall && status) {
    part.polygon(star(0.34), WHITE);
    part.polygon(star(0.25), INK);
  }
}
function drawHeld(pen, held, marks) {
  pen.circle(0.2, 0.8, 0.19, { fill: WHITE, outline: INK, width: 0.03 });
  const part = pen.part(0.05, 0.65, 0.3);
  drawThing(part, held, marks);
  drawMarks(part, marks);
}
var SIZES = { tiny: 0.4, small: 0.55, medium: 0.75, large: 0.95 };
var PATTERNS = {
  plain: (pen) => pen.arc(0.5, 0.5, 0.2, 190, 290, WHITE, 0.06),
  striped: (pen) => {
    for (const y of [0.38, 0.52, 0.66]) {
      pen.line([[0.3, y], [0.7, y]], INK, 0.1);
      pen.line([[0.3, y], [0.7, y]], WHITE, 0.06);
    }
  },
  spotted: (pen) => {
    for (const [x, y] of [[0.38, 0.4], [0.62, 0.4], [0.5, 0.53], [0.38, 0.66], [0.62, 0.66]]) {
      pen.circle(x, y, 0.07, { fill: WHITE, outline: INK, width: 0.02 });
    }
  },
  checked: (pen) => {
    pen.rectangle(0.32, 0.36, 0.68, 0.72, { fill: INK });
    pen.rectangle(0.34, 0.38, 0.5, 0.54, { fill: WHITE });
    pen.rectangle(0.5, 0.54, 0.66, 0.7, { fill: WHITE });
  }
};
var FACES = {
  calm: [255, 236, 160],
  cheerful: [255, 214, 60],
  laughing: [255, 170, 40],
  sad: [150, 190, 240],
  angry: [240, 90, 70],
  afraid: [200, 170, 230],
  surprised: [170, 230, 170]
};
function drawMarks(pen, marks) {
  for (const [, word, place, row] of marks) {
    if (FACES[word]) drawFace(pen, word);
    else if (!SIZES[word] && !PATTERNS[word]) drawTag(pen, place, row);
  }
}
function drawFace(pen, word) {
  const x = 0.8, y = 0.2;
  pen.circle(x, y, 0.19, { fill: FACES[word], outline: INK, width: 0.03 });
  for (const side of [-1, 1]) {
    pen.circle(x + side * 0.07, y - 0.04, ["afraid", "surprised"].includes(word) ? 0.045 : 0.03, { fill: INK });
    if (word === "angry") pen.line([[x + side * 0.12, y - 0.13], [x + side * 0.03, y - 0.08]], INK, 0.03);
  }
  if (word === "calm") pen.line([[x - 0.07, y + 0.08], [x + 0.07, y + 0.08]], INK, 0.03);
  else if (word === "cheerful") pen.arc(x, y, 0.125, 20, 160, INK, 0.03);
  else if (word === "laughing") pen.pie(x, y + 0.02, 0.11, 0, 180, INK);
  else if (word === "sad" || word === "angry") pen.arc(x, y + 0.17, 0.12, 215, 325, INK, 0.03);
  else pen.circle(x, y + 0.09, word === "surprised" ? 0.05 : 0.03, { fill: INK });
}
function drawTag(pen, place, row) {
  const y = 0.94 - 0.09 * row, left = 0.5 - 0.035 * place;
  pen.rectangle(left - 0.05, y - 0.045, left + 0.07 * place + 0.05, y + 0.045, { fill: WHITE, outline: INK, width: 0.015 });
  for (let dot = 0; dot <= place; dot++) pen.circle(left + 0.07 * dot, y, 0.025, { fill: INK });
}
function drawLetter(pen, colour) {
  pen.circle(0.84, 0.84, 0.15, { fill: WHITE, outline: INK, width: 0.025 });
  pen.c.font = `bold ${Math.round(pen.size * 0.24)}px system-ui, sans-serif`;
  pen.c.textAlign = "center";
  pen.c.textBaseline = "middle";
  pen.c.fillStyle = css(INK);
  pen.c.fillText("RGBPYE"[colour % 6], pen.x + 0.84 * pen.size, pen.y + 0.85 * pen.size);
}
function drawUnknown(pen, colour, status) {
  pen.rectangle(0.2, 0.2, 0.8, 0.8, { outline: colour, width: 0.06 });
  pen.line([[0.2, 0.2], [0.8, 0.8]], colour, 0.06);
  for (let tick = 0; tick < Math.min(status, 8); tick++) pen.circle(0.12 + 0.11 * tick, 0.91, 0.04, { fill: INK });
}
function drawWall(pen, colour) {
  const stone = colour === PALETTE[5] ? STONE : mix(STONE, colour, 0.6);
  pen.fill(mix(stone, INK, 0.35));
  for (let row = 0; row < 3; row++) {
    const edges = row % 2 ? [-0.25, 0.25, 0.75, 1.25] : [0, 0.5, 1];
    for (let k = 0; k + 1 < edges.length; k++) {
      pen.rectangle(edges[k] + 0.015, row / 3 + 0.015, edges[k + 1] - 0.015, (row + 1) / 3 - 0.015, { fill: stone });
    }
  }
}
function drawDoor(pen, colour, status) {
  pen.rectangle(0, 0, 1, 1, { outline: dark(colour), width: 0.11 });
  if (status === 0) {
    pen.rectangle(0.03, 0.03, 0.23, 0.97, { fill: colour, outline: dark(colour), width: 0.04 });
    return;
  }
  pen.rectangle(0.11, 0.11, 0.89, 0.89, { fill: colour });
  for (const [y0, y1] of [[0.18, 0.46], [0.54, 0.82]]) {
    pen.rectangle(0.2, y0, 0.66, y1, { outline: mix(colour, INK, 0.25), width: 0.04 });
  }
  if (status === 2) drawPadlock(pen);
  else pen.circle(0.77, 0.5, 0.065, { fill: WHITE, outline: INK, width: 0.03 });
}
function drawPadlock(pen) {
  pen.arc(0.5, 0.42, 0.15, 180, 360, INK, 0.06);
  pen.line([[0.38, 0.42], [0.38, 0.5]], INK, 0.06);
  pen.line([[0.62, 0.42], [0.62, 0.5]], INK, 0.06);
  pen.rectangle(0.28, 0.47, 0.72, 0.79, { fill: GOLD, outline: INK, width: 0.04, radius: 0.05 });
  pen.circle(0.5, 0.6, 0.05, { fill: INK });
  pen.line([[0.5, 0.6], [0.5, 0.69]], INK, 0.04);
}
function drawRemoteDoor(pen, colour, status) {
  pen.rectangle(0, 0, 1, 1, { outline: dark(colour), width: 0.11 });
  const bottom = status === 0 ? 0.24 : 0.9;
  for (const x of [0.28, 0.5, 0.72]) pen.line([[x, 0.1], [x, bottom]], colour, 0.07);
  for (const y of [0.34, 0.66]) if (y < bottom) pen.line([[0.14, y], [0.86, y]], colour, 0.06);
}
function drawBall(pen, colour, status) {
  pen.circle(0.5, 0.5, 0.32, { fill: dark(colour) });
  pen.circle(0.5, 0.5, 0.275, { fill: colour });
  if (!status) {
    pen.circle(0.41, 0.4, 0.07, { fill: light(colour) });
    return;
  }
  pen.polygon(star(0.22), INK);
}
function star(radius) {
  return Array.from({ length: 10 }, (_, corner) => {
    const reach = corner % 2 ? radius * 0.42 : radius, angle = Math.PI * (corner / 5 - 0.5);
    return [0.5 + reach * Math.cos(angle), 0.5 + reach * Math.sin(angle)];
  });
}
function drawBox(pen, colour, status) {
  pen.rectangle(0.18, 0.36, 0.82, 0.84, { fill: colour, outline: dark(colour), width: 0.05 });
  if (status === 1) {
    pen.polygon([[0.18, 0.36], [0.05, 0.16], [0.6, 0.1], [0.82, 0.36]], dark(colour));
    pen.polygon([[0.23, 0.34], [0.13, 0.2], [0.57, 0.15], [0.74, 0.34]], light(colour));
  } else {
    pen.rectangle(0.14, 0.24, 0.86, 0.42, { fill: light(colour), outline: dark(colour), width: 0.05 });
  }
  if (status === 2) drawPadlock(pen);
}
function drawLava(pen, colour) {
  pen.fill(colour === PALETTE[0] ? LAVA : mix(LAVA, colour, 0.6));
  for (const y of [0.22, 0.5, 0.78]) {
    const wave = [];
    for (let k = 0; k <= 20; k++) wave.push([k / 20, y + 0.06 * Math.sin(k / 20 * 4 * Math.PI)]);
    pen.line(wave, [140, 38, 18], 0.06);
  }
}
function drawSwitch(pen, colour, status) {
  pen.rectangle(0.2, 0.08, 0.8, 0.92, { fill: WHITE, outline: dark(colour), width: 0.05, radius: 0.1 });
  const [top, bottom] = status ? [0.16, 0.5] : [0.5, 0.84];
  pen.rectangle(0.3, 0.16, 0.7, 0.84, { fill: mix(colour, WHITE, 0.7), radius: 0.06 });
  pen.rectangle(0.3, top, 0.7, bottom, { fill: colour, outline: dark(colour), width: 0.03, radius: 0.06 });
  for (let angle = 0; status && angle < 360; angle += 45) {
    const dx = Math.cos(angle * Math.PI / 180), dy = Math.sin(angle * Math.PI / 180);
    pen.line([[0.5 + 0.055 * dx, 0.33 + 0.055 * dy], [0.5 + 0.115 * dx, 0.33 + 0.115 * dy]], WHITE, 0.035);
  }
}
function drawApple(pen, colour, status) {
  if (status) {
    pen.ellipse(0.34, 0.28, 0.66, 0.46, { fill: colour });
    pen.ellipse(0.36, 0.7, 0.64, 0.86, { fill: colour });
    pen.line([[0.5, 0.3], [0.5, 0.8]], [244, 232, 196], 0.13);
    pen.circle(0.5, 0.55, 0.035, { fill: BROWN });
  } else {
    pen.circle(0.38, 0.56, 0.24, { fill: colour });
    pen.circle(0.62, 0.56, 0.24, { fill: colour });
    pen.circle(0.5, 0.66, 0.22, { fill: colour });
    pen.circle(0.33, 0.47, 0.06, { fill: light(colour) });
  }
  pen.line([[0.5, 0.38], [0.55, 0.18]], BROWN, 0.05);
  pen.polygon([[0.56, 0.24], [0.8, 0.12], [0.72, 0.3]], [70, 150, 70]);
}
function drawLever(pen, colour, status) {
  if (status < 2) {
    const tip = status ? [0.76, 0.24] : [0.24, 0.24];
    pen.line([[0.5, 0.7], tip], INK, 0.08);
    pen.circle(...tip, 0.12, { fill: colour, outline: dark(colour), width: 0.04 });
  } else {
    pen.line([[0.5, 0.7], [0.56, 0.54]], INK, 0.08);
    pen.line([[0.14, 0.93], [0.6, 0.93]], INK, 0.06);
    pen.circle(0.72, 0.9, 0.09, { fill: colour, outline: dark(colour), width: 0.04 });
  }
  pen.rectangle(0.18, 0.66, 0.82, 0.86, { fill: STONE, outline: INK, width: 0.03, radius: 0.05 });
}
function drawGenerator(pen, colour, status) {
  pen.rectangle(0.12, 0.16, 0.88, 0.84, { fill: colour, outline: dark(colour), width: 0.06, radius: 0.1 });
  pen.polygon(
    [[0.56, 0.22], [0.32, 0.54], [0.48, 0.54], [0.42, 0.78], [0.68, 0.44], [0.52, 0.44]],
    status ? [255, 238, 130] : dark(colour)
  );
}
function drawMarble(pen, colour, status, orientation) {
  pen.circle(0.5, 0.5, 0.24, { fill: dark(colour) });
  pen.circle(0.5, 0.5, 0.2, { fill: colour });
  pen.arc(0.44, 0.5, 0.14, 270, 80, WHITE, 0.06);
  pen.circle(0.42, 0.42, 0.045, { fill: light(colour) });
  if (status) {
    for (const y of [0.4, 0.6]) pen.line(turn([[0.06, y], [0.2, y]], orientation), dark(colour), 0.05);
  }
}
function drawPlatform(pen, colour, status) {
  pen.rectangle(0.1, 0.1, 0.9, 0.9, { fill: status ? colour : mix(PAPER, colour, 0.5), outline: dark(colour), width: 0.05 });
  pen.rectangle(0.24, 0.24, 0.76, 0.76, { outline: dark(colour), width: 0.04 });
  pen.line([[0.24, 0.24], [0.76, 0.76]], dark(colour), 0.04);
  pen.line([[0.76, 0.24], [0.24, 0.76]], dark(colour), 0.04);
}
function drawFence(pen, colour) {
  const wood = mix(colour, [150, 110, 70], 0.5);
  for (const y of [0.42, 0.68]) pen.rectangle(0, y, 1, y + 0.09, { fill: dark(wood) });
  for (const x of [0.08, 0.41, 0.74]) {
    pen.polygon([[x, 0.9], [x, 0.26], [x + 0.09, 0.12], [x + 0.18, 0.26], [x + 0.18, 0.9]], wood);
  }
}
function drawAgent(pen, direction) {
  pen.polygon(turn([[0.97, 0.5], [0.1, 0.93], [0.25, 0.5], [0.1, 0.07]], direction), WHITE);
  pen.polygon(turn([[0.9, 0.5], [0.16, 0.86], [0.3, 0.5], [0.16, 0.14]], direction), [120, 18, 24]);
  pen.polygon(turn([[0.8, 0.5], [0.26, 0.76], [0.37, 0.5], [0.26, 0.24]], direction), [232, 48, 52]);
}
function drawNpc(pen, colour, status, orientation) {
  pen.circle(0.5, 0.565, 0.36, { fill: dark(colour) });
  pen.circle(0.5, 0.565, 0.315, { fill: colour });
  const [dx, dy] = FORWARD[orientation % 4];
  for (const side of [-1, 1]) {
    const x = 0.5 + side * 0.13 + dx * 0.07, y = 0.585 + dy * 0.07;
    pen.circle(x, y, 0.105, { fill: WHITE });
    pen.circle(x + dx * 0.045, y + dy * 0.045, 0.058, { fill: INK });
  }
  HATS[status % HATS.length](pen);
  for (let dot = 0; dot < Math.min(Math.floor(status / HATS.length), 5); dot++) {
    pen.circle(0.22 + dot * 0.14, 0.9, 0.055, { fill: WHITE, outline: INK, width: 0.02 });
  }
  drawGaze(pen, orientation);
}
function drawGaze(pen, orientation) {
  pen.polygon(turn([[1, 0.5], [0.8, 0.3], [0.8, 0.7]], orientation), WHITE);
  pen.polygon(turn([[0.97, 0.5], [0.83, 0.36], [0.83, 0.64]], orientation), INK);
}
var ARMS = [
  [[0.46, 0.85], [0.74, 0.85], [0.93, 0.85]],
  [[0.85, 0.42], [0.85, 0.74], [0.85, 0.93]],
  [[0.54, 0.85], [0.26, 0.85], [0.07, 0.85]],
  [[0.85, 0.62], [0.85, 0.26], [0.85, 0.07]]
];
var RING = 0.42;
function drawGesture(pen, colour, orientation, gesture) {
  if (gesture.pointing >= 0) {
    const [shoulder, hand, tip] = ARMS[gesture.pointing];
    pen.line([shoulder, hand], WHITE, 0.22);
    pen.line([hand, tip], INK, 0.13);
    pen.line([shoulder, hand], mix(colour, INK, 0.6), 0.15);
    pen.circle(...hand, 0.11, { fill: SKIN, outline: INK, width: 0.035 });
    pen.line([hand, tip], SKIN, 0.07);
    drawGaze(pen, orientation);
  }
  const sign = SIGNS[gesture.act];
  if (!sign) return;
  pen.circle(0.2, 0.2, 0.19, { fill: sign.fill, outline: WHITE, width: 0.035 });
  sign.draw(pen);
}
function drawRays(pen, rays) {
  for (const [[x, y], [toX, toY], direction, number] of rays) {
    const finger = ARMS[direction][2], dark2 = mix(PALETTE[number % 6], INK, 0.3);
    const start = [x + finger[0], y + finger[1]];
    const goal = [toX + 0.5, toY + 0.5];
    const share = Math.max(0, 1 - RING / Math.hypot(goal[0] - start[0], goal[1] - start[1]));
    const end = [start[0] + (goal[0] - start[0]) * share, start[1] + (goal[1] - start[1]) * share];
    pen.circle(...goal, RING + 0.02, { outline: WHITE, width: 0.11 });
    pen.line([start, end], WHITE, 0.11);
    pen.line([start, end], dark2, 0.06);
    pen.circle(...goal, RING, { outline: dark2, width: 0.06 });
  }
}
var turnSign = (side) => (pen) => {
  pen.line([[0.2 - side * 0.07, 0.3], [0.2 - side * 0.07, 0.17], [0.2 + side * 0.03, 0.17]], WHITE, 0.05);
  pen.polygon([[0.2 + side * 0.14, 0.17], [0.2 + side * 0.02, 0.08], [0.2 + side * 0.02, 0.26]], WHITE);
};
var SIGNS = {
  forward: {
    fill: [34, 122, 62],
    draw: (pen) => {
      pen.polygon([[0.2, 0.07], [0.31, 0.2], [0.09, 0.2]], WHITE);
      pen.rectangle(0.155, 0.18, 0.245, 0.32, { fill: WHITE });
    }
  },
  left: { fill: [44, 82, 178], draw: turnSign(-1) },
  right: { fill: [44, 82, 178], draw: turnSign(1) },
  toggle: {
    fill: [255, 166, 40],
    draw: (pen) => {
      for (const [dx, dy] of [[0.12, 0], [0.06, 0.104], [0.06, -0.104]]) {
        pen.line([[0.2 - dx, 0.2 - dy], [0.2 + dx, 0.2 + dy]], INK, 0.045);
      }
    }
  },
  point: {
    fill: [252, 220, 90],
    draw: (pen) => {
      pen.rectangle(0.165, 0.08, 0.235, 0.24, { fill: INK });
      pen.circle(0.2, 0.3, 0.04, { fill: INK });
    }
  },
  stop: {
    fill: [150, 40, 44],
    draw: (pen) => {
      for (const side of [-1, 1]) pen.line([[0.12, 0.2 - side * 0.08], [0.28, 0.2 + side * 0.08]], WHITE, 0.055);
    }
  }
};
var HATS = [
  (pen) => {
    pen.polygon([[0.5, 0], [0.74, 0.33], [0.26, 0.33]], [58, 48, 120]);
    pen.rectangle(0.14, 0.31, 0.86, 0.39, { fill: [58, 48, 120], radius: 0.03 });
    pen.circle(0.51, 0.22, 0.05, { fill: GOLD });
  },
  (pen) => {
    pen.rectangle(0.23, 0.14, 0.77, 0.36, { fill: [52, 112, 100], radius: 0.1 });
    pen.rectangle(0.23, 0.31, 0.95, 0.39, { fill: [30, 66, 60], radius: 0.03 });
  },
  (pen) => {
    const outer = [[0.23, 0.38], [0.2, 0.1], [0.37, 0.23], [0.5, 0.03], [0.63, 0.23], [0.8, 0.1], [0.77, 0.38]];
    const inner = [[0.27, 0.34], [0.26, 0.19], [0.38, 0.29], [0.5, 0.12], [0.62, 0.29], [0.74, 0.19], [0.73, 0.34]];
    pen.polygon(
      /** @type {Point[]} */
      outer,
      [140, 96, 8]
    );
    pen.polygon(
      /** @type {Point[]} */
      inner,
      [250, 206, 62]
    );
  },
  (pen) => {
    pen.rectangle(0.31, 0.02, 0.69, 0.34, { fill: INK, radius: 0.02 });
    pen.rectangle(0.31, 0.22, 0.69, 0.29, { fill: [200, 56, 56] });
    pen.rectangle(0.15, 0.31, 0.85, 0.38, { fill: INK, radius: 0.03 });
  },
  (pen) => {
    pen.polygon([[0.5, 0.22], [0.2, 0.05], [0.2, 0.39]], [230, 76, 146]);
    pen.polygon([[0.5, 0.22], [0.8, 0.05], [0.8, 0.39]], [230, 76, 146]);
    pen.circle(0.5, 0.22, 0.08, { fill: [150, 30, 86] });
  },
  (pen) => {
    pen.polygon([[0.62, 0.33], [0.64, 0], [0.8, 0.1], [0.74, 0.3]], [226, 110, 36]);
    pen.line([[0.66, 0.32], [0.72, 0.08]], [126, 52, 12], 0.03);
    pen.rectangle(0.17, 0.29, 0.83, 0.39, { fill: WHITE, outline: INK, width: 0.025, radius: 0.02 });
  },
  (pen) => {
    for (const [x, y] of [[0.33, 0.17], [0.67, 0.17], [0.5, 0.14]]) {
      pen.circle(x, y, 0.14, { fill: WHITE, outline: INK, width: 0.025 });
    }
    pen.rectangle(0.3, 0.15, 0.7, 0.3, { fill: WHITE });
    pen.rectangle(0.28, 0.27, 0.72, 0.39, { fill: WHITE, outline: INK, width: 0.025 });
  },
  (pen) => {
    pen.rectangle(0.3, 0.22, 0.7, 0.38, { fill: INK, radius: 0.03 });
    pen.polygon([[0.5, 0.04], [0.94, 0.18], [0.5, 0.31], [0.06, 0.18]], INK);
    pen.line([[0.5, 0.18], [0.84, 0.22], [0.84, 0.4]], [250, 206, 62], 0.035);
    pen.circle(0.84, 0.41, 0.05, { fill: [250, 206, 62] });
  },
  (pen) => {
    pen.ellipse(0.22, 0.03, 0.78, 0.24, { outline: [150, 104, 8], width: 0.085 });
    pen.ellipse(0.24, 0.045, 0.76, 0.225, { outline: [255, 214, 64], width: 0.05 });
  },
  (pen) => {
    pen.ellipse(0.27, 0.06, 0.73, 0.48, { fill: [190, 142, 78] });
    pen.rectangle(0.27, 0.24, 0.73, 0.32, { fill: [110, 66, 28] });
    pen.ellipse(0.03, 0.29, 0.97, 0.41, { fill: [190, 142, 78], outline: [110, 66, 28], width: 0.025 });
  },
  (pen) => {
    const horns = [[0.16, 0.26], [0.2, 0.4], [0.43, 0.33], [0.46, 0], [0.33, 0.19]];
    const bone = [[0.19, 0.29], [0.22, 0.36], [0.39, 0.3], [0.43, 0.08], [0.34, 0.23]];
    for (const side of [-1, 1]) {
      pen.polygon(horns.map(([x, y]) => [0.5 + side * x, y]), INK);
      pen.polygon(bone.map(([x, y]) => [0.5 + side * x, y]), [246, 236, 210]);
    }
    pen.pie(0.5, 0.38, 0.28, 180, 360, [150, 156, 166]);
    pen.rectangle(0.21, 0.33, 0.79, 0.4, { fill: INK, radius: 0.02 });
  },
  (pen) => {
    pen.pie(0.5, 0.39, 0.25, 180, 360, [66, 190, 200]);
    pen.pie(0.5, 0.39, 0.25, 240, 300, [240, 120, 60]);
    pen.line([[0.5, 0.15], [0.5, 0.07]], INK, 0.04);
    pen.ellipse(0.2, 0.02, 0.5, 0.11, { fill: [220, 60, 60], outline: INK, width: 0.02 });
    pen.ellipse(0.5, 0.02, 0.8, 0.11, { fill: [220, 60, 60], outline: INK, width: 0.02 });
  }
];
var DRAWERS = {
  0: (pen) => pen.fill(mix(STONE, INK, 0.7)),
  // not seen
  1: () => {
  },
  2: drawWall,
  3: (pen, colour) => pen.rectangle(0.08, 0.08, 0.92, 0.92, { fill: mix(PAPER, colour, 0.35), radius: 0.06 }),
  4: drawDoor,
  6: drawBall,
  7: drawBox,
  9: drawLava,
  11: drawNpc,
  12: drawSwitch,
  13: drawApple,
  14: drawLever,
  15: drawGenerator,
  16: drawMarble,
  17: drawPlatform,
  18: drawFence,
  19: drawRemoteDoor
};

// socialai_dsl/traces/static/trace.js
var VIEW = 7;
function inView([ax, ay, direction], x, y) {
  const [aheadX, aheadY] = [[1, 0], [0, 1], [-1, 0], [0, -1]][direction];
  const dx = x - ax, dy = y - ay;
  const ahead = dx * aheadX + dy * aheadY, aside = -dx * aheadY + dy * aheadX;
  return ahead >= 0 && ahead < VIEW && Math.abs(aside) <= (VIEW - 1) / 2;
}

// socialai_dsl/traces/static/room.js
function drawPicture(canvas, picture, { tile, letters = false }) {
  const { width, height, cells, agent, below, gestures, held, marks, tinted, seen: marked } = picture;
  canvas.width = width * tile;
  canvas.height = height * tile;
  const context = (
    /** @type {CanvasRenderingContext2D} */
    canvas.getContext("2d")
  );
  const seen = (x, y) => tinted && x >= 0 && y >= 0 && x < width && y < height && (marked ? marked.has(y * width + x) : inView(agent, x, y));
  cells.forEach((look, cell) => {
    const x = cell % width, y = Math.floor(cell / width);
    drawTile(context, x * tile, y * tile, tile, look, {
      agent: agent[0] === x && agent[1] === y ? agent[2] : void 0,
      seen: seen(x, y),
      below: below.get(cell),
      gesture: gestures.get(cell),
      held: held.get(cell),
      marks: marks.get(cell),
      rays: raysAt(picture, x, y),
      letter: letters
    });
  });
  context.fillStyle = SEEN_LINE;
  const line = Math.max(1, Math.floor(tile / 16));
  cells.forEach((_, cell) => {
    const x = cell % width, y = Math.floor(cell / width), left = x * tile, top = y * tile;
    if (!seen(x, y)) return;
    if (!seen(x - 1, y)) context.fillRect(left, top, line, tile);
    if (!seen(x + 1, y)) context.fillRect(left + tile - line, top, line, tile);
    if (!seen(x, y - 1)) context.fillRect(left, top, tile, line);
    if (!seen(x, y + 1)) context.fillRect(left, top + tile - line, tile, line);
  });
}
function raysAt({ width, cells, gestures }, x, y) {
  return [...gestures].flatMap(([cell, { pointing, at }]) => {
    if (!at?.length) return [];
    const left = cell % width - x, up = Math.floor(cell / width) - y, right = left + at[0], down = up + at[1];
    return left * right <= 0 && up * down <= 0 ? [[[left, up], [right, down], pointing, cells[cell][1]]] : [];
  });
}

// socialai_dsl/traces/static/seat.js
var VIEW2 = 7;
var UP = 3;
var MOVES = {
  ArrowLeft: "left",
  a: "left",
  ArrowRight: "right",
  d: "right",
  ArrowUp: "forward",
  w: "forward",
  t: "toggle",
  p: "pickup",
  o: "drop",
  x: "done",
  ".": "none",
  " ": "none"
};
function pictureOf({ cells, gestures, held, marks }) {
  const shown = gestures.map(([cell, pointing, act, ...at]) => [cell, { pointing, act, at }]);
  return { width: VIEW2, height: VIEW2, cells, agent: [(VIEW2 - 1) / 2, VIEW2 - 1, UP], below: /* @__PURE__ */ new Map(), gestures: new Map(shown), held: new Map(held), marks: new Map(marks), tinted: false };
}

// socialai_dsl/study/static/screen.js
var TILE = 64;
var MOST_IN_A_LIST = 120;
var Screen = class {
  /** @param {Record<string, string>} words the texts of the page @param {(what: Reply) => void} send tells the server
   * @param {Pages} pages what is shown besides rooms, by what the server calls it
   * @param {() => void} [onward] goes on from an episode that has ended */
  constructor(words, send, pages, onward) {
    this.words = words;
    this.send = send;
    this.onward = onward ?? (() => this.go());
    this.pages = { room: (now) => this.room(now), ...pages };
    this.now = {};
    this.actions = [];
    this.phrases = [];
    this.shown = 0;
    this.offline = false;
    this.title = make("h1", { tabindex: -1 }, words.title);
    this.state = make("output", { class: "quiet", "aria-live": "polite" });
    this.message = make("p", { class: "message", role: "status" });
    this.body = make("main");
    this.root = make("div", { class: "study" }, make("header", {}, this.title, this.state), this.message, this.body);
    this.canvas = make("canvas", { role: "img", "aria-label": words.sees });
    this.seen = make("pre", { class: "seen", "aria-live": "polite" });
    this.heard = make("ol", { class: "lines", tabindex: 0, "aria-live": "polite", "aria-label": words.heard });
    this.listed = [];
    this.told = make("p", { class: "quiet" });
    this.moves = make("div", { class: "moves", role: "group", "aria-label": words.movements });
    this.speech = make("form", { class: "say", onsubmit: (event) => this.speak(event) });
    this.buttons = make("div", { class: "buttons" });
    this.keys = make("p", { class: "quiet" }, words.keys);
    addEventListener("keydown", (event) => this.key(event));
  }
  /** A text of the page with its values. @param {string} name @param {Reply} values */
  say(name, values = {}) {
    return this.words[name].replace(/\{(\w+)\}/g, (_, key) => String(values[key]));
  }
  /** @param {string} text @param {string} kind */
  tell(text, kind = "") {
    this.message.textContent = text;
    this.message.className = `message ${kind}`;
  }
  /** Say that the connection was lost, and take nothing until the server shows something again. @param {string} [why] */
  lose(why) {
    this.offline = true;
    this.root.classList.add("offline");
    this.tell(this.words[why ?? "offline"]);
  }
  /** Show nothing until the server shows something. */
  clear() {
    this.now = {};
    clearInterval(this.counting);
    this.body.replaceChildren();
    this.tell("");
  }
  /** @param {Reply} now what the server says that is to be seen */
  show(now) {
    const before = this.now;
    this.now = now;
    this.offline = false;
    this.root.classList.remove("offline");
    if (now.actions) [this.actions, this.phrases] = [now.actions, now.phrases];
    this.tell(now.notice ? this.words[now.notice] : "");
    const same = before.do === now.do && (now.do === "play" || before.on === now.on);
    if (now.do === "play") this.play(now, same);
    else if (!same || now.do === "room" || now.do === "consent") this.page(now);
    if (!same) this.title.focus();
  }
  /** @param {Reply} now */
  page(now) {
    clearInterval(this.counting);
    this.title.textContent = this.words.title;
    this.state.textContent = "";
    this.body.setAttribute("aria-live", "polite");
    this.body.replaceChildren(...this.pages[now.do](now));
  }
  /** @param {Reply} now */
  room(now) {
    const until = performance.now() + now.seconds * 1e3, left = make("output");
    const count = () => {
      left.textContent = this.say("room_left", { number: Math.max(0, Math.ceil((until - performance.now()) / 1e3)) });
    };
    count();
    this.counting = setInterval(count, 1e3);
    return [make("p", { class: "text" }, this.words.room), left];
  }
  go() {
    this.send({ do: "go", on: this.now.on });
  }
  // -- rooms ------------------------------------------------------------------------------------------------
  /** @param {Reply} now @param {boolean} same */
  play(now, same) {
    const numbers = { number: now.episode, of: now.episodes };
    this.title.textContent = this.say(now.practice ? "practice" : "episode", numbers);
    this.state.textContent = this.say("step", { number: now.t });
    this.told.textContent = now.told;
    if (!same || now.actions) {
      this.body.setAttribute("aria-live", "off");
      this.body.replaceChildren(this.told, this.canvas, this.moves, this.speech, this.buttons, panel(this.words.heard, "transcript", this.heard), this.seen, this.keys);
      this.choices();
    }
    this.canvas.hidden = !now.view;
    this.seen.hidden = !now.seen;
    if (now.view) drawPicture(this.canvas, pictureOf(now.view), { tile: TILE });
    this.seen.textContent = now.seen ?? "";
    this.hear(now);
    this.moves.hidden = this.speech.hidden = Boolean(now.ended);
    this.buttons.replaceChildren();
    if (now.ended) this.ended(now);
    else if (now.waiting) this.tell(this.words.waiting);
    for (const one of this.body.querySelectorAll(".moves button, .say button")) one.disabled = Boolean(now.waiting);
    requestAnimationFrame(() => {
      this.shown = performance.now();
    });
  }
  /** List what was heard. What is listed already stays, so that a screen reader reads new lines alone. @param {Reply} now */
  hear(now) {
    const lines = now.heard.length ? now.heard : [["", this.words.nothing_heard]], keys = lines.map(String);
    while (this.listed.some((key, place) => key !== keys[place])) {
      this.heard.firstChild?.remove();
      this.listed.shift();
    }
    this.heard.append(...lines.slice(this.listed.length).map(([, line]) => make("li", {}, line)));
    this.listed = keys;
    for (const [place, item] of [...this.heard.children].entries()) item.className = !now.heard.length ? "quiet" : lines[place][0] === now.t ? "now" : "";
    this.heard.scrollTop = this.heard.scrollHeight;
  }
  /** @param {Reply} now */
  ended(now) {
    this.tell(now.success === null ? this.words.over : now.success ? this.words.success : this.words.failure, now.success === null ? "" : now.success ? "good" : "bad");
    if (now.waiting) this.buttons.replaceChildren(make("p", {}, this.words.ready));
    else {
      const button = make("button", { class: "main", onclick: () => this.onward() }, this.words.next);
      this.buttons.replaceChildren(button);
      button.focus();
    }
  }
  /** The buttons for movements, and what can be said. */
  choices() {
    const moves = [...this.actions, "none"];
    this.moves.replaceChildren(...moves.map((word) => make("button", { type: "button", "data-move": word, onclick: () => this.act(word) }, this.words[word] ?? word)));
    const first = make("option", { value: "" }, this.words.say_first);
    this.phrase = this.phrases.length <= MOST_IN_A_LIST ? make("select", { "aria-label": this.words.say_what }, first, ...this.phrases.map((said) => make("option", { value: said }, said))) : make("input", { type: "text", list: "phrases", "aria-label": this.words.say_what });
    this.together = make("input", { type: "checkbox" });
    const list = this.phrase.tagName === "INPUT" ? [make("datalist", { id: "phrases" }, ...this.phrases.map((said) => make("option", { value: said })))] : [];
    this.speech.replaceChildren(...this.phrases.length ? [this.phrase, ...list, make("button", {}, this.words.say), make("label", {}, this.together, this.words.with)] : []);
  }
  /** Move, and say what is chosen if it is to be said with a movement. @param {string} move */
  act(move) {
    const said = this.together?.checked ? this.phrase?.value || null : null;
    this.choose(move === "none" ? null : move, said);
  }
  /** @param {Event} event */
  speak(event) {
    event.preventDefault();
    if (this.phrase?.value) this.choose(null, this.phrase.value);
  }
  /** @param {string | null} movement @param {string | null} said */
  choose(movement, said) {
    if (this.now.do !== "play" || this.now.ended || this.now.waiting || this.offline) return;
    this.send({ do: "act", on: this.now.on, movement, said, shown: this.shown, acted: performance.now() });
    if (said && this.together) {
      this.together.checked = false;
      if (this.phrase) this.phrase.value = "";
    }
  }
  /** @param {KeyboardEvent} event */
  key(event) {
    const { key } = event, target = event.composedPath()[0];
    if (!this.root.isConnected || this.now.do !== "play" || event.ctrlKey || event.metaKey || event.altKey || !(target instanceof HTMLElement)) return;
    if (target.matches("select, input")) {
      if (key === "Escape") target.blur();
      return;
    }
    if (target.matches("button, a") && [" ", "Enter"].includes(key)) return;
    const move = MOVES[key.length === 1 ? key.toLowerCase() : key];
    if (key === "/") {
      event.preventDefault();
      this.phrase?.focus();
    } else if (move && (move === "none" || this.actions.includes(move))) {
      event.preventDefault();
      this.act(move);
    }
  }
};

// socialai_dsl/traces/static/pages.css
var pages_default = '/* The look of all pages: calm, light or dark as the system is. */\n:root {\n  color-scheme: light dark;\n  --paper: light-dark(#faf9f6, #17181c);\n  --card: light-dark(#ffffff, #202227);\n  --edge: light-dark(#dedbd2, #363a42);\n  --ink: light-dark(#26282e, #e6e4de);\n  --quiet: light-dark(#63666e, #a2a5ad);\n  --accent: light-dark(#2454a0, #8fb4f0);\n  --own: light-dark(#b2222a, #f08a8f);\n  --good: light-dark(#1d6b34, #7fd096);\n  --bad: light-dark(#9c2420, #f59a94);\n  --mark: light-dark(#fff0c2, #4a3d12);\n  font: 15px/1.45 system-ui, sans-serif;\n}\n* { box-sizing: border-box; }\nbody { margin: 0; background: var(--paper); color: var(--ink); }\nh1, h2, p, ol, ul, dl, dd { margin: 0; padding: 0; }\nh1 { font-size: 1.25rem; overflow-wrap: anywhere; }\nh1 small { font-weight: normal; color: var(--quiet); }\nh2 { font-size: 0.8rem; font-weight: 600; color: var(--quiet); margin-bottom: 0.5rem; }\nol, ul { list-style: none; }\nbutton, select, input { font: inherit; color: inherit; }\nbutton, select {\n  border: 1px solid var(--edge); border-radius: 6px; background: var(--card); padding: 0.3rem 0.6rem; cursor: pointer;\n}\nbutton:hover { border-color: var(--accent); }\nbutton:disabled { opacity: 0.5; cursor: default; }\nbutton.main { background: var(--accent); border-color: var(--accent); color: var(--paper); min-width: 5.8rem; }\nbutton.link { border: 0; padding: 0; background: none; color: var(--accent); text-decoration: underline; }\n:focus-visible { outline: 2px solid var(--accent); outline-offset: 1px; }\nsummary { cursor: pointer; color: var(--quiet); font-size: 0.85rem; }\n.panel { background: var(--card); border: 1px solid var(--edge); border-radius: 8px; padding: 0.7rem 0.8rem; min-width: 0; }\n.quiet { color: var(--quiet); }\n.visually-hidden { position: absolute; width: 1px; height: 1px; overflow: hidden; clip-path: inset(50%); }\n.changed { background: var(--mark); border-radius: 3px; }\n\n.stage { position: relative; display: flex; justify-content: center; align-items: center; min-height: 240px; min-width: 0; }\n.sheet { position: relative; line-height: 0; }\n.bubbles { position: absolute; inset: 0; line-height: 1.3; pointer-events: none; }\n.bubble {\n  position: absolute; width: max-content; max-width: min(16rem, 60%); padding: 0.3rem 0.6rem; border-radius: 10px; font-size: 0.9rem;\n  background: #fff; color: #26282e; border: 1.5px solid #2454a0; box-shadow: 0 1px 4px rgb(0 0 0 / 30%);\n}\n.bubble.own { border-color: #b2222a; background: #fff5f4; color: #7d1319; }\n.bubble.above { translate: var(--lean, -50%) calc(-100% - 2px); }\n.bubble.below { translate: var(--lean, -50%) 2px; }\n.bubble.leaning-right { --lean: -1rem; }\n.bubble.leaning-left { --lean: calc(-100% + 1rem); }\n\n.controls { display: flex; flex-wrap: wrap; gap: 0.4rem; align-items: center; }\n.controls input[type="range"] { flex: 1 1 6rem; accent-color: var(--accent); }\n.controls output { font-size: 0.9rem; color: var(--quiet); font-variant-numeric: tabular-nums; }\n\n.sight canvas { display: block; width: 100%; max-width: 224px; margin: auto; border-radius: 4px; }\n.transcript .lines { max-height: 15rem; overflow-y: auto; }\n.transcript li { display: flex; gap: 0.5rem; padding: 0.15rem 0.2rem; }\n.transcript li.now { background: var(--mark); border-radius: 4px; }\n.transcript li.unheard { opacity: 0.6; }\n.transcript .step { padding: 0 0.4rem; min-width: 2.4rem; font-size: 0.8rem; align-self: start; color: var(--quiet); }\nb.own { color: var(--own); }\nb.heard { color: var(--accent); }\n\ntable { border-collapse: collapse; width: 100%; font-size: 0.9rem; }\nth, td { text-align: left; padding: 0.15rem 0.4rem 0.15rem 0; vertical-align: middle; font-weight: normal; overflow-wrap: break-word; }\nthead th { color: var(--quiet); font-size: 0.8rem; }\ntbody th { font-weight: 600; }\ntd canvas { display: block; border-radius: 4px; }\n.cast dl { display: grid; grid-template-columns: auto 1fr; gap: 0.1rem 0.8rem; font-size: 0.85rem; margin-top: 0.3rem; }\n.cast dt { color: var(--quiet); overflow-wrap: anywhere; }\n.cast dd { overflow-wrap: anywhere; }\n\n.why select { margin-bottom: 0.5rem; }\n.rules { max-height: 26rem; overflow-y: auto; }\n.rules li { padding: 0.35rem 0.5rem; border-left: 3px solid var(--edge); margin-bottom: 0.3rem; }\n.rules li.fired { border-color: var(--good); }\n.rules .mark { display: inline-block; min-width: 4.2rem; color: var(--quiet); font-size: 0.85rem; }\n.rules .fired .mark { color: var(--good); font-weight: 600; }\n.rules small { color: var(--quiet); }\n.rules code { display: block; font-size: 0.85rem; overflow-wrap: anywhere; }\n.rules .reason { display: block; color: var(--quiet); font-size: 0.9rem; overflow-wrap: anywhere; }\n\n.mind svg { width: 100%; height: 110px; display: block; border-radius: 4px; background: var(--paper); cursor: pointer; }\n.mind polyline { fill: none; vector-effect: non-scaling-stroke; }\n.mind .halo { stroke: var(--card); stroke-width: 5; }\n.mind .line { stroke: var(--ink); stroke-width: 2; }\n.mind rect.now { fill: none; stroke: var(--ink); stroke-width: 2; vector-effect: non-scaling-stroke; }\n.mind .bars { display: grid; grid-template-columns: repeat(auto-fit, minmax(11rem, 1fr)); gap: 0.8rem; margin-top: 0.6rem; }\n.mind caption { text-align: left; color: var(--quiet); font-size: 0.85rem; }\n.mind td { position: relative; width: 50%; }\n.mind .bar { position: absolute; inset: 0.2rem auto 0.2rem 0; background: var(--accent); opacity: 0.3; border-radius: 3px; }\n.mind tr.chosen { font-weight: 700; }\n.key { display: flex; flex-wrap: wrap; gap: 0.2rem 0.9rem; font-size: 0.85rem; color: var(--quiet); margin-top: 0.3rem; }\n.key i { display: inline-block; width: 0.8rem; height: 0.8rem; border-radius: 3px; margin-right: 0.3rem; vertical-align: -0.1rem; }\n\n.replies li { white-space: pre-wrap; overflow-wrap: anywhere; max-height: 14rem; overflow-y: auto; font-size: 0.9rem; border-left: 3px solid var(--edge); padding-left: 0.6rem; margin-bottom: 0.4rem; }\n\n.verdict { font-size: 0.85rem; font-weight: 600; display: block; overflow-wrap: anywhere; }\n.verdict.good { color: var(--good); }\n.verdict.bad { color: var(--bad); }\n\n.replay {\n  display: grid; gap: 0.9rem; padding: 0.9rem; max-width: 1700px; margin: auto;\n  grid-template: "head head head" auto "list room side" auto / 15rem minmax(0, 1fr) 22rem;\n}\n.replay > header { grid-area: head; }\n.replay > nav { grid-area: list; align-self: start; max-height: 92vh; overflow-y: auto; }\n.replay > main { grid-area: room; display: grid; gap: 0.9rem; align-content: start; min-width: 0; }\n.replay > aside { grid-area: side; display: grid; gap: 0.9rem; align-content: start; min-width: 0; }\n.replay .stage { height: min(60vh, 620px); }\n.episodes button { width: 100%; text-align: left; margin-bottom: 0.3rem; }\n.episodes button[aria-current] { border-color: var(--accent); border-width: 2px; }\n.episodes span { font-size: 0.85rem; color: var(--quiet); }\n.keys { display: grid; grid-template-columns: auto 1fr; gap: 0.1rem 0.8rem; font-size: 0.85rem; margin: 0.4rem 0; }\n@media (max-width: 1200px) {\n  .replay { grid-template: "head head" auto "room side" auto "list side" auto / minmax(0, 1fr) 20rem; }\n}\n@media (max-width: 760px) {\n  .replay { grid-template: "head" auto "room" auto "side" auto "list" auto / minmax(0, 1fr); padding: 0.5rem; }\n  .replay .stage { height: min(50vh, 92vw); }\n  button, select { min-height: 2.6rem; }\n}\n';

// socialai_dsl/study/static/study.css
var study_default = '/* The page of a participant; colours are those of all pages. */\n.study { max-width: 46rem; margin: auto; padding: 0.8rem; display: grid; gap: 0.8rem; }\n.study > main, .study form:not(.say) { display: grid; gap: 0.8rem; }\n.study > header { display: flex; flex-wrap: wrap; gap: 0.2rem 1rem; align-items: baseline; justify-content: space-between; }\n.study .text { font-size: 1.05rem; }\n.study .text > * + * { margin-top: 0.7rem; }\n.study .text :is(h1, h2, h3) { color: var(--ink); font-size: 1.2rem; font-weight: 600; }\n.study .text :is(ul, ol) { padding-left: 1.4rem; }\n.study .text ul { list-style: disc; }\n.study .text ol { list-style: decimal; }\n.study .text img { max-width: 100%; height: auto; border-radius: 6px; }\n.study .text code { background: var(--card); padding: 0.1rem 0.3rem; border-radius: 4px; }\n.study canvas { display: block; width: 100%; max-width: min(28rem, 52vh); margin: auto; border-radius: 4px; }\n.study pre { margin: 0; white-space: pre-wrap; overflow-wrap: anywhere; font: inherit; }\n.study .seen { font-size: 0.9rem; color: var(--quiet); padding: 0 0.2rem; }\n.study :is(.moves, .say)[hidden], .study .seen[hidden], .study canvas[hidden] { display: none; }\n.study h1:focus { outline: none; }\n.study .moves { display: flex; flex-wrap: wrap; gap: 0.4rem; justify-content: center; }\n.study .moves button { min-height: 2.6rem; min-width: 5rem; }\n.study .say { display: flex; flex-wrap: wrap; gap: 0.4rem; align-items: center; }\n.study .say :is(select, input[type="text"]) { flex: 1 1 12rem; min-width: 0; min-height: 2.6rem; border: 1px solid var(--edge); border-radius: 6px; padding: 0.3rem 0.5rem; background: var(--card); }\n.study .say label { display: flex; gap: 0.4rem; align-items: center; font-size: 0.9rem; }\n.study .lines { max-height: 9rem; overflow-y: auto; }\n.study .lines li { padding: 0.1rem 0.2rem; overflow-wrap: anywhere; }\n.study .lines li.now { background: var(--mark); border-radius: 4px; }\n.study .message { min-height: 1.5em; font-weight: 600; }\n.study .message.good { color: var(--good); }\n.study .message.bad { color: var(--bad); }\n.study fieldset { border: 1px solid var(--edge); border-radius: 8px; padding: 0.6rem 0.8rem; margin: 0 0 0.8rem; min-width: 0; background: var(--card); }\n.study legend { font-weight: 600; padding: 0 0.3rem; }\n.study textarea { width: 100%; font: inherit; color: inherit; background: var(--paper); border: 1px solid var(--edge); border-radius: 6px; padding: 0.4rem; }\n.study .scale { display: flex; flex-wrap: wrap; gap: 0.3rem 0.9rem; align-items: center; }\n.study .options { display: grid; gap: 0.3rem; }\n.study fieldset label { display: inline-flex; gap: 0.35rem; align-items: center; min-height: 2rem; }\n.study .wrong { color: var(--bad); font-weight: 600; }\n.study .code { font-size: 1.5rem; font-weight: 700; letter-spacing: 0.05em; user-select: all; }\n.study .buttons { display: flex; flex-wrap: wrap; gap: 0.6rem; }\n.study .buttons button { min-height: 2.6rem; padding: 0.4rem 1rem; }\n.study.offline > :not(header):not(.message) { opacity: 0.45; }\n@media (prefers-reduced-motion: reduce) { * { scroll-behavior: auto !important; transition: none !important; animation: none !important; } }\n';

// socialai_dsl/study/words.json
var en = {
  title: "Study",
  agree: "I agree and take part",
  decline: "I do not take part",
  next: "Continue",
  begin: "Begin",
  page: "Page {number} of {of}",
  practice: "Practice: round {number} of {of}",
  episode: "Round {number} of {of}",
  step: "Step {number}",
  sees: "What you see, 7 by 7 cells; you look up",
  heard: "What was said",
  nothing_heard: "Nothing yet",
  movements: "movements",
  say: "Say",
  say_what: "what to say",
  say_first: "(say nothing)",
  with: "say it with the next movement",
  keys: "Keys: arrows or W A D walk, T toggles, P picks up, O drops, X is done, space stands still, / goes to what can be said.",
  left: "turn left",
  right: "turn right",
  forward: "go forward",
  toggle: "use",
  pickup: "pick up",
  drop: "put down",
  done: "done",
  none: "stand still",
  success: "That was a success.",
  failure: "That was no success.",
  over: "This round is over.",
  waiting: "You have chosen. Others are still choosing.",
  room: "Waiting for another person. If nobody comes it goes on without one.",
  room_left: "At most {number} seconds.",
  ready: "Waiting for the other person.",
  answer: "Please answer this question.",
  choose: "(please choose)",
  thanks: "Thank you, this is the end.",
  declined: "Thank you. You do not take part, and nothing about you was stored.",
  code: "Your code of completion:",
  paid: "You get {sum} {currency}.",
  go: "Go on to the next page",
  full: "Thank you for coming. This study has as many participants as it needs.",
  offline: "The connection was lost. This page goes on by itself when it is there again; nothing is lost.",
  elsewhere: "This study is open in another window. Use that one, or load this page again to go on here.",
  unknown: "This address belongs to no participant. Please use the link that you were given.",
  again: "This study was opened with this id before, and can be taken part in once.",
  disk: "Your last choice could not be stored. Please choose again.",
  fast: "Too many messages came from this page. Load it again to go on.",
  origin: "This study does not admit pages of {origin}. Whoever runs it can: socialai study run ... --embed {origin}",
  consent: "The page did not say who takes part, or not that they have agreed.",
  full_disk: "Nothing can be stored at the moment. Please try again later.",
  forgotten: "The study does not know this participant any more. Load this page again to begin anew; what was stored is kept.",
  silent: "The server of the study has not answered. What was stored is kept.",
  connecting: "Connecting to the study…",
  script: "This page cannot be shown here: it needs a browser from 2023 or later (Chrome, Edge, Firefox or Safari), with scripts allowed. Nothing is lost: load it again, or open the same address in another browser."
};

// web/jspsych-socialai/src/session.js
var HOST = ":host { color-scheme: inherit; display: block; width: min(46rem, 95vw); text-align: left; background: var(--paper); color: var(--ink); }";
var Session = class {
  /** @param {string} server @param {{ id: string | null, simulated: boolean }} hello who takes part */
  constructor(server, hello) {
    this.server = server;
    this.hello = hello;
    this.words = en;
    this.key = `socialai ${server} ${hello.id ?? ""}`;
    this.known = this.remembered();
    this.count = 0;
    this.done = void 0;
    this.now = void 0;
    this.screen = void 0;
    this.connection = void 0;
    this.present = void 0;
    this.timer = void 0;
    this.host = make("div", { class: "jspsych-socialai" });
    this.shadow = this.host.attachShadow({ mode: "open" });
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(pages_default.replace(":root", ":host") + study_default + HOST);
    this.shadow.adoptedStyleSheets = [sheet];
  }
  /** The trial that is shown; one that the experiment has ended by itself is none. */
  get trial() {
    return this.host.isConnected ? this.present : void 0;
  }
  remembered() {
    try {
      return JSON.parse(sessionStorage.getItem(this.key) ?? "");
    } catch {
      return { code: null, episodes: [] };
    }
  }
  remember() {
    try {
      sessionStorage.setItem(this.key, JSON.stringify(this.known));
    } catch {
    }
  }
  /** Let the participant play what comes next. @param {HTMLElement} display @param {Trial} trial */
  begin(display, trial) {
    this.place(display, trial);
    if (this.connection && this.screen?.offline) return this.wait();
    this.screen?.clear();
    if (this.connection) return this.proceed();
    this.shadow.replaceChildren(make("p", { role: "status" }, this.words.connecting));
    this.wait();
    const address = new URL("/embed", this.server);
    address.protocol = address.protocol.replace("http", "ws");
    const greeting = () => ({ do: "join", ...this.hello, code: this.known.code, consented: true });
    try {
      this.connection = new Connection(address.href, (said) => this.hear(said), (why) => this.lose(why), greeting);
    } catch (error) {
      this.fail("server", `${this.server}: ${/** @type {Error} */
      error.message}`);
    }
  }
  /** @param {HTMLElement} display @param {Trial} trial */
  place(display, trial) {
    this.present = trial;
    display.replaceChildren(this.host);
  }
  /** End the trial unless the server answers in time. */
  wait() {
    const tell = () => this.fail("silent", `${this.words.silent} (${this.server})`);
    if (this.trial) this.timer ??= setTimeout(tell, this.trial.patience);
  }
  /** @param {string | undefined} why it is not opened again */
  lose(why) {
    if (why) return this.fail(why, this.words[
      /** @type {"unknown"} */
      why
    ]);
    this.screen?.lose();
    this.wait();
  }
  /** @param {Reply} said */
  hear(said) {
    clearTimeout(this.timer);
    this.timer = void 0;
    if (said.do === "refused") return this.fail(said.why, said.say);
    if (said.do === "consent") return this.fail("full_disk", this.words.full_disk);
    if (said.do !== "joined") {
      this.now = said;
      return this.proceed();
    }
    this.known.code = said.code;
    this.remember();
    this.done ??= said.done;
    this.words = said.words;
    this.host.lang = said.language;
    this.screen ??= new Screen(said.words, (what) => this.connection?.send(what), {}, () => this.onward());
    this.shadow.replaceChildren(this.screen.root);
  }
  /** Show what there is to see, or end the trial where there is nothing to play in it. */
  proceed() {
    const { now, screen, trial } = this, known = this.known.episodes[this.count];
    if (!now || !screen) return;
    if (trial && (known || this.count < (this.done ?? 0))) {
      this.count += 1;
      this.end({ status: "before", ...known ?? { episode: this.count, more: true } });
    } else if (now.record?.episode <= this.count && !now.waiting) {
      if (!trial && now.record.more) return;
      screen.clear();
      screen.send({ do: "go", on: now.on });
    } else if (now.do === "end") {
      this.hangUp();
      this.end({ status: "over" });
    } else {
      screen.show(now);
      trial?.shown?.();
    }
  }
  /** Go on from an episode that has ended. */
  onward() {
    const record = this.now?.record;
    if (!this.trial || !record) return;
    this.count = record.episode;
    this.known.episodes[record.episode - 1] = record;
    this.remember();
    this.end({ status: "played", ...record });
    this.proceed();
  }
  /** End the trial. @param {Reply} data */
  end(data) {
    const { trial } = this;
    clearTimeout(this.timer);
    this.present = this.timer = void 0;
    trial?.finish(data);
  }
  hangUp() {
    clearTimeout(this.timer);
    this.connection?.close();
    this.connection = this.now = this.timer = void 0;
  }
  /** Say why there is nothing to play; the next trial tries again. @param {string} why @param {string} message */
  fail(why, message) {
    this.hangUp();
    if (why === "forgotten") {
      this.known = { code: null, episodes: [] };
      this.remember();
      [this.count, this.done] = [0, void 0];
    }
    if (!this.trial) return;
    console.error(`jspsych-socialai: ${message}`);
    const onclick = () => this.end({ status: "failed", error: why, message });
    const button = make("button", { class: "main", onclick }, this.words.next);
    this.shadow.replaceChildren(make("div", { class: "study" }, make("p", { class: "message bad", role: "alert" }, message), make("div", { class: "buttons" }, button)));
    button.focus();
    this.trial.shown?.();
  }
};

// web/jspsych-socialai/src/index.js
var { BOOL, COMPLEX, FLOAT, INT, STRING } = import_jspsych.ParameterType;
var ACT = {
  /** Step of the episode, from 1. */
  step: { type: INT },
  /** `person`, or who played the step instead. */
  by: { type: STRING },
  /** What was done; empty for standing still. */
  movement: { type: STRING },
  /** What was said. */
  said: { type: STRING },
  /** Lines that the seat heard in the step, one behind another. */
  heard: { type: STRING },
  /** When the picture was shown, milliseconds of the page's clock, which begins with each page. */
  shown_ms: { type: FLOAT },
  /** When the act was chosen, by the same clock. */
  acted_ms: { type: FLOAT },
  /** `acted_ms - shown_ms`. */
  reaction_ms: { type: FLOAT },
  /** Which of the participant's pages it was, from 1. */
  connection: { type: INT },
  /** When the server took the step, UTC. */
  time: { type: STRING }
};
var info = (
  /** @type {const} */
  {
    name: "socialai",
    version,
    parameters: {
      /** Address of the study's server, such as `https://study.example.org`. */
      server: { type: STRING, default: void 0 },
      /** Whether the participant has agreed to take part on this page; nobody plays who has not. */
      consented: { type: BOOL, default: void 0 },
      /** By which the participant is known again; without one only this window knows them again. */
      participant: { type: STRING, default: null },
      /** Milliseconds that the server may be silent, after which the trial ends. */
      connection_timeout: { type: INT, default: 6e4 }
    },
    data: {
      /** `played`; `before` if it was played before this page was loaded; `over` if the study has no episode left; `failed`. */
      status: { type: STRING },
      /** Why it failed, as a word. */
      error: { type: STRING },
      /** The same as the page said it. */
      message: { type: STRING },
      /** Whether nobody sat there. */
      simulated: { type: BOOL },
      /** Id in the tables of the study. */
      participant: { type: STRING },
      /** Likewise; those who play together have the same. */
      game: { type: STRING },
      /** Place of the block in the participant's order, from 1; 0 of practice. */
      position: { type: INT },
      /** Episode in the block or round, from 1. */
      trial: { type: INT },
      /** How many the block or round has. */
      trials: { type: INT },
      /** Episode in the study, with practice, from 1. */
      episode: { type: INT },
      /** Whether the study has another one for the participant. */
      more: { type: BOOL },
      /** Steps of the episode. */
      steps: { type: INT },
      /** Steps that the participant chose. */
      own_steps: { type: INT },
      /** Whether it was a success; null where the study does not tell. */
      success: { type: BOOL },
      /** The scenario's own name of the ending, likewise. */
      outcome: { type: STRING },
      /** Sum of the seat's rewards, likewise. */
      return: { type: FLOAT },
      /** What was done in each step. */
      acts: { type: COMPLEX, array: true, nested: ACT }
    }
  }
);
var OF_JSPSYCH = [
  "type",
  "data",
  "on_start",
  "on_load",
  "on_finish",
  "post_trial_gap",
  "css_classes",
  "extensions",
  "simulation_options",
  "record_data",
  "save_trial_parameters",
  "save_timeline_variables"
];
var sessions = /* @__PURE__ */ new WeakMap();
var JsPsychSocialai = class {
  static info = info;
  /** @param {JsPsych} jsPsych */
  constructor(jsPsych) {
    this.jsPsych = jsPsych;
  }
  /** @param {HTMLElement} display_element @param {Trial} trial */
  trial(display_element, trial) {
    this.play(display_element, trial, (data) => this.jsPsych.finishTrial({ ...data, simulated: false }));
  }
  /** @param {HTMLElement} display @param {Trial} trial @param {(data: Record<string, any>) => void} finish
   * @param {(root: ParentNode) => void} [react] simulates the participant */
  play(display, trial, finish, react) {
    const wrong = problem(trial), session = wrong ? new Session("", { id: null, simulated: false }) : sessionOf(this.jsPsych, trial, Boolean(react));
    const own = { patience: trial.connection_timeout, finish, shown: react && (() => react(session.shadow)) };
    if (!wrong) return session.begin(display, own);
    session.place(display, own);
    session.fail("parameters", wrong);
  }
  /** @param {Trial} trial @param {"data-only" | "visual"} mode @param {Record<string, any>} options @param {() => void} on_load */
  simulate(trial, mode, options, on_load) {
    const finish = (data) => this.jsPsych.finishTrial(this.jsPsych.pluginAPI.mergeSimulationData({ ...data, simulated: true }, options));
    if (mode === "visual") this.play(this.jsPsych.getDisplayElement(), trial, finish, (root) => this.react(root));
    on_load();
    if (mode === "data-only") finish(this.made());
  }
  pause() {
    return this.jsPsych.randomization.sampleExGaussian(500, 50, 1 / 150, true);
  }
  /** Press something that can be pressed. @param {ParentNode} root */
  react(root) {
    const { pluginAPI, randomization } = this.jsPsych;
    const phrase = root.querySelector("form:not([hidden]) select"), says = phrase && randomization.sampleBernoulli(0.2);
    if (says) phrase.selectedIndex = randomization.randomInt(1, phrase.children.length - 1);
    const buttons = says ? ".say button" : ".moves:not([hidden]) button, .buttons button";
    const [button] = randomization.shuffle([...root.querySelectorAll(buttons)]);
    if (button) pluginAPI.clickTarget(button, this.pause());
  }
  /** Data of an episode that was never played: no server is asked. */
  made() {
    const { randomization } = this.jsPsych;
    let now = 0;
    const acts = Array.from({ length: randomization.randomInt(1, 30) }, (_, step) => {
      const movement = randomization.shuffle(["left", "right", "forward", ""])[0], shown_ms = now, acted_ms = now += this.pause();
      return { step: step + 1, by: "person", movement, said: "", heard: "", shown_ms, acted_ms, reaction_ms: acted_ms - shown_ms, connection: 1, time: null };
    });
    const success = randomization.sampleBernoulli(0.5) === 1;
    return {
      status: "played",
      participant: null,
      game: null,
      position: null,
      trial: null,
      trials: null,
      episode: null,
      more: null,
      steps: acts.length,
      own_steps: acts.length,
      success,
      outcome: success ? "success" : "failure",
      return: Number(success),
      acts
    };
  }
};
function sessionOf(jsPsych, { server, participant }, simulated) {
  const ours = sessions.get(jsPsych) ?? /* @__PURE__ */ new Map(), name = JSON.stringify([server, participant]);
  sessions.set(jsPsych, ours);
  if (!ours.has(name)) ours.set(name, new Session(server, { id: participant, simulated }));
  return ours.get(name);
}
function problem(trial) {
  const { server, consented, participant, connection_timeout } = trial, names = Object.keys(info.parameters);
  const unknown = Object.keys(trial).filter((name) => !names.includes(name) && !OF_JSPSYCH.includes(name));
  const got = (name, value, expected) => `${name}: got ${JSON.stringify(value)}, expected ${expected}`;
  if (unknown.length) return `got the parameter ${unknown.join(", ")}, expected ${names.join(", ")}`;
  if (!/^https?:\/\//.test(server) || !URL.canParse(server)) return got("server", server, "an address such as https://study.example.org");
  if (consented !== true) return got("consented", consented, "true: nobody takes part who has not agreed");
  if (participant !== null && !(typeof participant === "string" && participant && participant.length <= 200)) return got("participant", participant, "null, or a text of 1 to 200 characters");
  if (!(connection_timeout > 0)) return got("connection_timeout", connection_timeout, "milliseconds");
}
module.exports = module.exports.default;
