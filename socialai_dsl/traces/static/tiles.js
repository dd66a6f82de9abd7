// @ts-check
/**
 * Draws one cell of the room: what lies on it, and who stands on it. The same pictures as the PNG ones, which
 * socialai_dsl/render/tiles.py and figures.py draw; a test compares them pixel by pixel.
 */

/** @typedef {[number, number, number]} Rgb */
/** @typedef {[number, number]} Point */
/** @typedef {[number, number, number, number]} Look type, colour, status, orientation */
/** @typedef {{pointing: number, act: string, at?: number[]}} Gesture pointing -1: at nothing; at: how far to the right
 * and down the cell lies that is pointed at, empty if none is shown */
/** @typedef {[Point, Point, number, number]} Ray from the cell of an NPC to the one that it points at, as columns to the
 * right and rows down; the direction of its arm, the number of its colour */
/** @typedef {[string, string, number, number]} Mark look, word, place of the word, row of the look */
/** @typedef {(canvas: Pen, colour: Rgb, status: number, orientation: number) => void} Drawer */

/** @type {Rgb} */ const INK = [38, 40, 46];
/** @type {Rgb} */ const PAPER = [243, 241, 235];
/** @type {Rgb} */ const WHITE = [255, 255, 255];
/** @type {Rgb} */ const LINE = [221, 218, 209];
/** @type {Rgb} */ const LAVA = [240, 118, 34];
/** @type {Rgb} */ const STONE = [92, 97, 107];
/** @type {Rgb} */ const SEEN_TINT = [255, 226, 138];
/** @type {Rgb} */ const SKIN = [252, 206, 160];
/** @type {Rgb} */ const GOLD = [250, 214, 90];
/** @type {Rgb} */ const BROWN = [104, 70, 40];
export const SEEN_LINE = "rgb(214 150 20)";

export const COLOURS = ["red", "green", "blue", "purple", "yellow", "grey"];
/** @type {Rgb[]} */
export const PALETTE = [[214, 64, 58], [62, 160, 82], [58, 110, 205], [142, 84, 178], [232, 182, 44], [136, 140, 148]];
export const NPC = 11;
/** Types that need no letter for their colour: unseen, empty, wall, floor, lava. */
const UNLETTERED = [0, 1, 2, 3, 9];
/** @type {Point[]} */ const FORWARD = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/** @param {Rgb} a @param {Rgb} b @param {number} share @returns {Rgb} the colour `share` of the way from a to b */
function mix(a, b, share) {
  const part = (/** @type {number} */ k) => Math.round(a[k] + (b[k] - a[k]) * share);
  return [part(0), part(1), part(2)];
}
const dark = (/** @type {Rgb} */ colour) => mix(colour, INK, 0.45);
const light = (/** @type {Rgb} */ colour) => mix(colour, WHITE, 0.55);
export const css = (/** @type {Rgb} */ colour) => `rgb(${colour.join(" ")})`;

/** Turn points that were drawn facing right about the centre.
 * @param {Point[]} points @param {number} direction @returns {Point[]} */
function turn(points, direction) {
  const [cos, sin] = FORWARD[direction % 4];
  return points.map(([x, y]) => [0.5 + (x - 0.5) * cos - (y - 0.5) * sin, 0.5 + (x - 0.5) * sin + (y - 0.5) * cos]);
}

/** A square whose corners are (0, 0) and (1, 1), y down. */
class Pen {
  /** @param {CanvasRenderingContext2D} context @param {number} x @param {number} y @param {number} size */
  constructor(context, x, y, size) {
    this.c = context;
    this.x = x;
    this.y = y;
    this.size = size;
  }

  /** A square of this one: its upper left corner and its side. @param {number} x @param {number} y @param {number} size */
  part(x, y, size) {
    return new Pen(this.c, this.x + x * this.size, this.y + y * this.size, size * this.size);
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
    // Edges lie where the PNG pictures have them: on quarters of a pixel, the last one included.
    const snap = (/** @type {number} */ part) => Math.floor(part * last * 4) / 4;
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
    const s = this.size, x = this.x + ((x0 + x1) / 2) * s, y = this.y + ((y0 + y1) / 2) * s;
    this.paint((inset) => {
      const rx = Math.max(0, ((x1 - x0) / 2) * s - inset), ry = Math.max(0, ((y1 - y0) / 2) * s - inset);
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
    this.c.arc(cx, cy, radius * s, (start * Math.PI) / 180, (end * Math.PI) / 180);
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
    this.c.arc(this.x + x * s, this.y + y * s, (radius - width / 2) * s, (start * Math.PI) / 180, (end * Math.PI) / 180);
    this.c.lineCap = "butt";
    this.c.lineWidth = width * s;
    this.c.strokeStyle = css(colour);
    this.c.stroke();
  }
}

/**
 * Draw one cell.
 * @param {CanvasRenderingContext2D} context
 * @param {number} x left edge in pixels @param {number} y upper edge @param {number} size side
 * @param {Look} look
 * @param {{agent?: number, seen?: boolean, below?: Look, gesture?: Gesture, held?: Look, marks?: Mark[], rays?: Ray[],
 *   letter?: boolean}} more
 *   agent: its direction if it stands here; seen: tinted, since it is in the agent's field of view; below: what lies
 *   under an NPC; held: what it carries; marks: the looks of what is here, or of what the agent carries; letter: the
 *   first letter of the colour in a corner (e: grey)
 */
export function drawTile(context, x, y, size, look, more = {}) {
  context.save();
  context.beginPath();
  context.rect(x, y, size, size);
  context.clip();
  const pen = new Pen(context, x, y, size);
  pen.fill(more.seen ? mix(PAPER, SEEN_TINT, 0.55) : PAPER);
  pen.rectangle(0, 0, 1, 1, { outline: more.seen ? mix(LINE, SEEN_TINT, 0.5) : LINE, width: 0.03 });
  const marks = more.marks ?? [], isAgents = more.agent !== undefined;
  if (more.below) drawThing(pen, more.below, []);
  drawThing(pen, look, isAgents ? [] : marks);
  const colour = PALETTE[look[1] % 6];
  if (more.gesture) drawGesture(pen, colour, look[3], more.gesture);
  if (more.agent !== undefined) drawAgent(pen, more.agent);
  if (!isAgents) drawMarks(pen, marks);
  if (more.held) drawHeld(pen, more.held, isAgents ? marks : []);
  drawRays(pen, more.rays ?? []);
  if (more.letter && !UNLETTERED.includes(look[0])) drawLetter(pen, look[1]);
  context.restore();
}

/** A thing or an NPC in its size and with its pattern. @param {Pen} pen @param {Look} look @param {Mark[]} marks */
function drawThing(pen, [type, colour, status, orientation], marks) {
  const side = marks.reduce((part, [, word]) => part * (SIZES[word] ?? 1), 1);
  const part = pen.part((1 - side) / 2, (1 - side) / 2, side);
  (DRAWERS[type] ?? drawUnknown)(part, PALETTE[colour % 6], status, orientation);
  const patterns = marks.map(([, word]) => PATTERNS[word]).filter((draw) => draw);
  for (const draw of patterns) draw(part);
  if (patterns.length && DRAWERS[type] === drawBall && status) {
    part.polygon(star(0.34), WHITE);
    part.polygon(star(0.25), INK);
  }
}

/** A small picture of what is carried, in the lower left corner.
 * @param {Pen} pen @param {Look} held @param {Mark[]} marks */
function drawHeld(pen, held, marks) {
  pen.circle(0.2, 0.8, 0.19, { fill: WHITE, outline: INK, width: 0.03 });
  const part = pen.part(0.05, 0.65, 0.3);
  drawThing(part, held, marks);
  drawMarks(part, marks);
}

/** Words that make a thing smaller. @type {Record<string, number>} */
const SIZES = { tiny: 0.4, small: 0.55, medium: 0.75, large: 0.95 };

/** Words that are drawn over a thing. @type {Record<string, (pen: Pen) => void>} */
const PATTERNS = {
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
  },
};

/** Words that are a face, each with its colour. @type {Record<string, Rgb>} */
const FACES = {
  calm: [255, 236, 160],
  cheerful: [255, 214, 60],
  laughing: [255, 170, 40],
  sad: [150, 190, 240],
  angry: [240, 90, 70],
  afraid: [200, 170, 230],
  surprised: [170, 230, 170],
};

/** Faces, and tags for words without a drawing of their own. @param {Pen} pen @param {Mark[]} marks */
function drawMarks(pen, marks) {
  for (const [, word, place, row] of marks) {
    if (FACES[word]) drawFace(pen, word);
    else if (!SIZES[word] && !PATTERNS[word]) drawTag(pen, place, row);
  }
}

/** @param {Pen} pen @param {string} word */
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

/** @param {Pen} pen @param {number} place @param {number} row */
function drawTag(pen, place, row) {
  const y = 0.94 - 0.09 * row, left = 0.5 - 0.035 * place;
  pen.rectangle(left - 0.05, y - 0.045, left + 0.07 * place + 0.05, y + 0.045, { fill: WHITE, outline: INK, width: 0.015 });
  for (let dot = 0; dot <= place; dot++) pen.circle(left + 0.07 * dot, y, 0.025, { fill: INK });
}

/** @param {Pen} pen @param {number} colour */
function drawLetter(pen, colour) {
  pen.circle(0.84, 0.84, 0.15, { fill: WHITE, outline: INK, width: 0.025 });
  pen.c.font = `bold ${Math.round(pen.size * 0.24)}px system-ui, sans-serif`;
  pen.c.textAlign = "center";
  pen.c.textBaseline = "middle";
  pen.c.fillStyle = css(INK);
  pen.c.fillText("RGBPYE"[colour % 6], pen.x + 0.84 * pen.size, pen.y + 0.85 * pen.size);
}

// -- objects -------------------------------------------------------------------------------------------------------

/** @type {Drawer} */
function drawUnknown(pen, colour, status) {
  pen.rectangle(0.2, 0.2, 0.8, 0.8, { outline: colour, width: 0.06 });
  pen.line([[0.2, 0.2], [0.8, 0.8]], colour, 0.06);
  for (let tick = 0; tick < Math.min(status, 8); tick++) pen.circle(0.12 + 0.11 * tick, 0.91, 0.04, { fill: INK });
}

/** @type {Drawer} */
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

/** @type {Drawer} */
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

/** @param {Pen} pen */
function drawPadlock(pen) {
  pen.arc(0.5, 0.42, 0.15, 180, 360, INK, 0.06);
  pen.line([[0.38, 0.42], [0.38, 0.5]], INK, 0.06);
  pen.line([[0.62, 0.42], [0.62, 0.5]], INK, 0.06);
  pen.rectangle(0.28, 0.47, 0.72, 0.79, { fill: GOLD, outline: INK, width: 0.04, radius: 0.05 });
  pen.circle(0.5, 0.6, 0.05, { fill: INK });
  pen.line([[0.5, 0.6], [0.5, 0.69]], INK, 0.04);
}

/** @type {Drawer} */
function drawRemoteDoor(pen, colour, status) {
  pen.rectangle(0, 0, 1, 1, { outline: dark(colour), width: 0.11 });
  const bottom = status === 0 ? 0.24 : 0.9; // a grating, drawn up when open
  for (const x of [0.28, 0.5, 0.72]) pen.line([[x, 0.1], [x, bottom]], colour, 0.07);
  for (const y of [0.34, 0.66]) if (y < bottom) pen.line([[0.14, y], [0.86, y]], colour, 0.06);
}

/** @type {Drawer} */
function drawBall(pen, colour, status) {
  pen.circle(0.5, 0.5, 0.32, { fill: dark(colour) });
  pen.circle(0.5, 0.5, 0.275, { fill: colour });
  if (!status) {
    pen.circle(0.41, 0.4, 0.07, { fill: light(colour) });
    return;
  }
  pen.polygon(star(0.22), INK);
}

/** The ten corners of a five-pointed star in the middle, one point up. @param {number} radius @returns {Point[]} */
function star(radius) {
  return Array.from({ length: 10 }, (_, corner) => {
    const reach = corner % 2 ? radius * 0.42 : radius, angle = Math.PI * (corner / 5 - 0.5);
    return [0.5 + reach * Math.cos(angle), 0.5 + reach * Math.sin(angle)];
  });
}

/** @type {Drawer} */
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

/** @type {Drawer} */
function drawLava(pen, colour) {
  pen.fill(colour === PALETTE[0] ? LAVA : mix(LAVA, colour, 0.6));
  for (const y of [0.22, 0.5, 0.78]) {
    /** @type {Point[]} */ const wave = [];
    for (let k = 0; k <= 20; k++) wave.push([k / 20, y + 0.06 * Math.sin((k / 20) * 4 * Math.PI)]);
    pen.line(wave, [140, 38, 18], 0.06);
  }
}

/** @type {Drawer} */
function drawSwitch(pen, colour, status) {
  pen.rectangle(0.2, 0.08, 0.8, 0.92, { fill: WHITE, outline: dark(colour), width: 0.05, radius: 0.1 });
  const [top, bottom] = status ? [0.16, 0.5] : [0.5, 0.84];
  pen.rectangle(0.3, 0.16, 0.7, 0.84, { fill: mix(colour, WHITE, 0.7), radius: 0.06 });
  pen.rectangle(0.3, top, 0.7, bottom, { fill: colour, outline: dark(colour), width: 0.03, radius: 0.06 });
  for (let angle = 0; status && angle < 360; angle += 45) {
    const dx = Math.cos((angle * Math.PI) / 180), dy = Math.sin((angle * Math.PI) / 180);
    pen.line([[0.5 + 0.055 * dx, 0.33 + 0.055 * dy], [0.5 + 0.115 * dx, 0.33 + 0.115 * dy]], WHITE, 0.035);
  }
}

/** @type {Drawer} */
function drawApple(pen, colour, status) {
  if (status) { // only the core is left, and a little peel
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

/** @type {Drawer} */
function drawLever(pen, colour, status) {
  if (status < 2) { // down, up
    /** @type {Point} */ const tip = status ? [0.76, 0.24] : [0.24, 0.24];
    pen.line([[0.5, 0.7], tip], INK, 0.08);
    pen.circle(...tip, 0.12, { fill: colour, outline: dark(colour), width: 0.04 });
  } else { // spent: broken off, and lying there
    pen.line([[0.5, 0.7], [0.56, 0.54]], INK, 0.08);
    pen.line([[0.14, 0.93], [0.6, 0.93]], INK, 0.06);
    pen.circle(0.72, 0.9, 0.09, { fill: colour, outline: dark(colour), width: 0.04 });
  }
  pen.rectangle(0.18, 0.66, 0.82, 0.86, { fill: STONE, outline: INK, width: 0.03, radius: 0.05 });
}

/** @type {Drawer} */
function drawGenerator(pen, colour, status) {
  pen.rectangle(0.12, 0.16, 0.88, 0.84, { fill: colour, outline: dark(colour), width: 0.06, radius: 0.1 });
  pen.polygon(
    [[0.56, 0.22], [0.32, 0.54], [0.48, 0.54], [0.42, 0.78], [0.68, 0.44], [0.52, 0.44]],
    status ? [255, 238, 130] : dark(colour),
  );
}

/** @type {Drawer} */
function drawMarble(pen, colour, status, orientation) {
  pen.circle(0.5, 0.5, 0.24, { fill: dark(colour) });
  pen.circle(0.5, 0.5, 0.2, { fill: colour });
  pen.arc(0.44, 0.5, 0.14, 270, 80, WHITE, 0.06);
  pen.circle(0.42, 0.42, 0.045, { fill: light(colour) });
  if (status) { // rolling: two dashes trail it
    for (const y of [0.4, 0.6]) pen.line(turn([[0.06, y], [0.2, y]], orientation), dark(colour), 0.05);
  }
}

/** @type {Drawer} */
function drawPlatform(pen, colour, status) {
  pen.rectangle(0.1, 0.1, 0.9, 0.9, { fill: status ? colour : mix(PAPER, colour, 0.5), outline: dark(colour), width: 0.05 });
  pen.rectangle(0.24, 0.24, 0.76, 0.76, { outline: dark(colour), width: 0.04 });
  pen.line([[0.24, 0.24], [0.76, 0.76]], dark(colour), 0.04);
  pen.line([[0.76, 0.24], [0.24, 0.76]], dark(colour), 0.04);
}

/** @type {Drawer} */
function drawFence(pen, colour) {
  const wood = mix(colour, [150, 110, 70], 0.5);
  for (const y of [0.42, 0.68]) pen.rectangle(0, y, 1, y + 0.09, { fill: dark(wood) });
  for (const x of [0.08, 0.41, 0.74]) {
    pen.polygon([[x, 0.9], [x, 0.26], [x + 0.09, 0.12], [x + 0.18, 0.26], [x + 0.18, 0.9]], wood);
  }
}

// -- figures -------------------------------------------------------------------------------------------------------

/** A red arrow, the only figure without a face. @param {Pen} pen @param {number} direction */
function drawAgent(pen, direction) {
  pen.polygon(turn([[0.97, 0.5], [0.1, 0.93], [0.25, 0.5], [0.1, 0.07]], direction), WHITE);
  pen.polygon(turn([[0.9, 0.5], [0.16, 0.86], [0.3, 0.5], [0.16, 0.14]], direction), [120, 18, 24]);
  pen.polygon(turn([[0.8, 0.5], [0.26, 0.76], [0.37, 0.5], [0.26, 0.24]], direction), [232, 48, 52]);
}

/** A face in its colour, the hat of its kind, eyes and an arrow at the edge in the direction of gaze. @type {Drawer} */
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

/** @param {Pen} pen @param {number} orientation */
function drawGaze(pen, orientation) {
  pen.polygon(turn([[1, 0.5], [0.8, 0.3], [0.8, 0.7]], orientation), WHITE);
  pen.polygon(turn([[0.97, 0.5], [0.83, 0.36], [0.83, 0.64]], orientation), INK);
}

/** Shoulder, hand and finger-tip of an arm to the right, down, left and up. @type {Point[][]} */
const ARMS = [
  [[0.46, 0.85], [0.74, 0.85], [0.93, 0.85]],
  [[0.85, 0.42], [0.85, 0.74], [0.85, 0.93]],
  [[0.54, 0.85], [0.26, 0.85], [0.07, 0.85]],
  [[0.85, 0.62], [0.85, 0.26], [0.85, 0.07]],
];
const RING = 0.42;

/** An arm with a pointing hand, and in the upper left corner a sign for what an NPC did last.
 * @param {Pen} pen @param {Rgb} colour @param {number} orientation @param {Gesture} gesture */
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

/** The parts in a cell of lines from the fingers of NPCs to the cells that they point at, with a ring there.
 * @param {Pen} pen @param {Ray[]} rays */
function drawRays(pen, rays) {
  for (const [[x, y], [toX, toY], direction, number] of rays) {
    const finger = ARMS[direction][2], dark = mix(PALETTE[number % 6], INK, 0.3);
    /** @type {Point} */ const start = [x + finger[0], y + finger[1]];
    /** @type {Point} */ const goal = [toX + 0.5, toY + 0.5];
    const share = Math.max(0, 1 - RING / Math.hypot(goal[0] - start[0], goal[1] - start[1]));
    /** @type {Point} */ const end = [start[0] + (goal[0] - start[0]) * share, start[1] + (goal[1] - start[1]) * share];
    pen.circle(...goal, RING + 0.02, { outline: WHITE, width: 0.11 });
    pen.line([start, end], WHITE, 0.11);
    pen.line([start, end], dark, 0.06);
    pen.circle(...goal, RING, { outline: dark, width: 0.06 });
  }
}

/** An arrow bent to the left (-1) or to the right (1). @param {number} side */
const turnSign = (side) => (/** @type {Pen} */ pen) => {
  pen.line([[0.2 - side * 0.07, 0.3], [0.2 - side * 0.07, 0.17], [0.2 + side * 0.03, 0.17]], WHITE, 0.05);
  pen.polygon([[0.2 + side * 0.14, 0.17], [0.2 + side * 0.02, 0.08], [0.2 + side * 0.02, 0.26]], WHITE);
};

/** @type {Record<string, {fill: Rgb, draw: (pen: Pen) => void}>} */
const SIGNS = {
  forward: {
    fill: [34, 122, 62],
    draw: (pen) => {
      pen.polygon([[0.2, 0.07], [0.31, 0.2], [0.09, 0.2]], WHITE);
      pen.rectangle(0.155, 0.18, 0.245, 0.32, { fill: WHITE });
    },
  },
  left: { fill: [44, 82, 178], draw: turnSign(-1) },
  right: { fill: [44, 82, 178], draw: turnSign(1) },
  toggle: {
    fill: [255, 166, 40],
    draw: (pen) => {
      for (const [dx, dy] of [[0.12, 0], [0.06, 0.104], [0.06, -0.104]]) {
        pen.line([[0.2 - dx, 0.2 - dy], [0.2 + dx, 0.2 + dy]], INK, 0.045);
      }
    },
  },
  point: {
    fill: [252, 220, 90],
    draw: (pen) => {
      pen.rectangle(0.165, 0.08, 0.235, 0.24, { fill: INK });
      pen.circle(0.2, 0.3, 0.04, { fill: INK });
    },
  },
  stop: {
    fill: [150, 40, 44],
    draw: (pen) => {
      for (const side of [-1, 1]) pen.line([[0.12, 0.2 - side * 0.08], [0.28, 0.2 + side * 0.08]], WHITE, 0.055);
    },
  },
};

/** Twelve hats tell the first kinds apart. @type {((pen: Pen) => void)[]} */
const HATS = [
  (pen) => { // pointed hat
    pen.polygon([[0.5, 0], [0.74, 0.33], [0.26, 0.33]], [58, 48, 120]);
    pen.rectangle(0.14, 0.31, 0.86, 0.39, { fill: [58, 48, 120], radius: 0.03 });
    pen.circle(0.51, 0.22, 0.05, { fill: GOLD });
  },
  (pen) => { // flat cap
    pen.rectangle(0.23, 0.14, 0.77, 0.36, { fill: [52, 112, 100], radius: 0.1 });
    pen.rectangle(0.23, 0.31, 0.95, 0.39, { fill: [30, 66, 60], radius: 0.03 });
  },
  (pen) => { // crown
    const outer = [[0.23, 0.38], [0.2, 0.1], [0.37, 0.23], [0.5, 0.03], [0.63, 0.23], [0.8, 0.1], [0.77, 0.38]];
    const inner = [[0.27, 0.34], [0.26, 0.19], [0.38, 0.29], [0.5, 0.12], [0.62, 0.29], [0.74, 0.19], [0.73, 0.34]];
    pen.polygon(/** @type {Point[]} */ (outer), [140, 96, 8]);
    pen.polygon(/** @type {Point[]} */ (inner), [250, 206, 62]);
  },
  (pen) => { // top hat
    pen.rectangle(0.31, 0.02, 0.69, 0.34, { fill: INK, radius: 0.02 });
    pen.rectangle(0.31, 0.22, 0.69, 0.29, { fill: [200, 56, 56] });
    pen.rectangle(0.15, 0.31, 0.85, 0.38, { fill: INK, radius: 0.03 });
  },
  (pen) => { // bow
    pen.polygon([[0.5, 0.22], [0.2, 0.05], [0.2, 0.39]], [230, 76, 146]);
    pen.polygon([[0.5, 0.22], [0.8, 0.05], [0.8, 0.39]], [230, 76, 146]);
    pen.circle(0.5, 0.22, 0.08, { fill: [150, 30, 86] });
  },
  (pen) => { // feather
    pen.polygon([[0.62, 0.33], [0.64, 0], [0.8, 0.1], [0.74, 0.3]], [226, 110, 36]);
    pen.line([[0.66, 0.32], [0.72, 0.08]], [126, 52, 12], 0.03);
    pen.rectangle(0.17, 0.29, 0.83, 0.39, { fill: WHITE, outline: INK, width: 0.025, radius: 0.02 });
  },
  (pen) => { // cook's hat
    for (const [x, y] of [[0.33, 0.17], [0.67, 0.17], [0.5, 0.14]]) {
      pen.circle(x, y, 0.14, { fill: WHITE, outline: INK, width: 0.025 });
    }
    pen.rectangle(0.3, 0.15, 0.7, 0.3, { fill: WHITE });
    pen.rectangle(0.28, 0.27, 0.72, 0.39, { fill: WHITE, outline: INK, width: 0.025 });
  },
  (pen) => { // mortarboard
    pen.rectangle(0.3, 0.22, 0.7, 0.38, { fill: INK, radius: 0.03 });
    pen.polygon([[0.5, 0.04], [0.94, 0.18], [0.5, 0.31], [0.06, 0.18]], INK);
    pen.line([[0.5, 0.18], [0.84, 0.22], [0.84, 0.4]], [250, 206, 62], 0.035);
    pen.circle(0.84, 0.41, 0.05, { fill: [250, 206, 62] });
  },
  (pen) => { // halo
    pen.ellipse(0.22, 0.03, 0.78, 0.24, { outline: [150, 104, 8], width: 0.085 });
    pen.ellipse(0.24, 0.045, 0.76, 0.225, { outline: [255, 214, 64], width: 0.05 });
  },
  (pen) => { // broad hat
    pen.ellipse(0.27, 0.06, 0.73, 0.48, { fill: [190, 142, 78] });
    pen.rectangle(0.27, 0.24, 0.73, 0.32, { fill: [110, 66, 28] });
    pen.ellipse(0.03, 0.29, 0.97, 0.41, { fill: [190, 142, 78], outline: [110, 66, 28], width: 0.025 });
  },
  (pen) => { // horned helmet
    const horns = [[0.16, 0.26], [0.2, 0.4], [0.43, 0.33], [0.46, 0], [0.33, 0.19]];
    const bone = [[0.19, 0.29], [0.22, 0.36], [0.39, 0.3], [0.43, 0.08], [0.34, 0.23]];
    for (const side of [-1, 1]) {
      pen.polygon(horns.map(([x, y]) => [0.5 + side * x, y]), INK);
      pen.polygon(bone.map(([x, y]) => [0.5 + side * x, y]), [246, 236, 210]);
    }
    pen.pie(0.5, 0.38, 0.28, 180, 360, [150, 156, 166]);
    pen.rectangle(0.21, 0.33, 0.79, 0.4, { fill: INK, radius: 0.02 });
  },
  (pen) => { // propeller
    pen.pie(0.5, 0.39, 0.25, 180, 360, [66, 190, 200]);
    pen.pie(0.5, 0.39, 0.25, 240, 300, [240, 120, 60]);
    pen.line([[0.5, 0.15], [0.5, 0.07]], INK, 0.04);
    pen.ellipse(0.2, 0.02, 0.5, 0.11, { fill: [220, 60, 60], outline: INK, width: 0.02 });
    pen.ellipse(0.5, 0.02, 0.8, 0.11, { fill: [220, 60, 60], outline: INK, width: 0.02 });
  },
];

/** By type code of the observation. @type {Record<number, Drawer>} */
const DRAWERS = {
  0: (pen) => pen.fill(mix(STONE, INK, 0.7)), // not seen
  1: () => {},
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
  19: drawRemoteDoor,
};
