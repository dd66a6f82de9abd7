// @ts-check
/** Reads the trace of an episode (`socialai-trace/1`, socialai_dsl/traces/document.py), which says of each moment what differs. */

/** @typedef {import("./tiles.js").Look} Look */
/** @typedef {import("./tiles.js").Gesture} Gesture */
/** @typedef {import("./tiles.js").Mark} Mark */
/** @typedef {{text: string, name?: string, who?: string | null}} Line */
/** @typedef {{who: string, kind: string, state?: string | null, list?: string | null, name: string, at: string, words: string}} Rule */
/** @typedef {{key: string, name: string, look: Look}} Member */
/** @typedef {{name: string, success: boolean, text: string}} Outcome */
/** @typedef {{probabilities: number[][], value?: number | null}} Thought */
/** @typedef {[number, number, string, ...number[]]} TracedGesture */
/**
 * @typedef {object} Moment
 * @property {number} t
 * @property {string | null} [member]
 * @property {Member[] | null} [cast]
 * @property {[number, number] | null} [room]
 * @property {[number, number][]} [cells]
 * @property {[number, number, number]} agent
 * @property {[number, number][]} [below]
 * @property {TracedGesture[]} [gestures]
 * @property {[number, number][]} [held]
 * @property {number[] | null} [view]
 * @property {TracedGesture[]} [view_gestures]
 * @property {[number, number][]} [view_held]
 * @property {[number, number][]} [marks]
 * @property {[number, number][]} [view_marks]
 * @property {Record<string, any>} [state]
 * @property {[number, number, number, number] | null} [action]
 * @property {string | null} [did]
 * @property {string | null} [said]
 * @property {Line[]} [heard]
 * @property {number} [reward]
 * @property {number[]} [fired]
 * @property {[number, number][]} [others]
 * @property {Thought | null} [thought]
 * @property {{text: string, error?: string}[]} [replies]
 * @property {Outcome | null} [ended]
 */
/**
 * @typedef {object} Trace
 * @property {string} format
 * @property {string} scenario
 * @property {string} [about]
 * @property {string} agent
 * @property {string} episode
 * @property {string[]} actions
 * @property {string[]} templates
 * @property {string[]} nouns
 * @property {Record<string, string[]>} [slots]
 * @property {Look[]} [looks]
 * @property {Mark[][]} [marks]
 * @property {string[]} [texts]
 * @property {Rule[]} [rules]
 * @property {Moment[]} [moments]
 */

/**
 * Cells as they are drawn.
 * @typedef {object} Picture
 * @property {number} width @property {number} height
 * @property {Look[]} cells row by row
 * @property {[number, number, number]} agent x, y, direction
 * @property {Map<number, Look>} below
 * @property {Map<number, Gesture>} gestures
 * @property {Map<number, Look>} held what who stands in a cell carries
 * @property {Map<number, Mark[]>} marks the looks of what is seen in a cell
 * @property {boolean} tinted whether the agent's field of view is marked
 * @property {Set<number>} [seen] the cells that are marked in its place
 */
/**
 * A moment with everything that is so in it.
 * @typedef {object} Scene
 * @property {Moment} moment
 * @property {string | null} member
 * @property {Member[]} cast
 * @property {Picture} room
 * @property {Picture} view
 * @property {Record<string, any>} state values by address
 * @property {Record<string, any>} changed those that differ from the moment before
 * @property {number} reward sum of the rewards so far
 */

const VIEW = 7;
const UP = 3;

/** An episode, from its trace. */
export class Episode {
  /** @param {Trace} trace */
  constructor(trace) {
    if (trace.format !== "socialai-trace/1") {
      throw new Error(`got the trace format ${trace.format}, expected socialai-trace/1`);
    }
    this.trace = trace;
    /** @type {Look[]} */ this.looks = [];
    /** @type {Mark[][]} */ this.marks = [];
    /** @type {string[]} */ this.texts = [];
    /** @type {Rule[]} */ this.rules = [];
    /** @type {Scene[]} */ this.scenes = [];
    this.add(trace);
  }

  /** Number of steps. */
  get length() {
    return this.scenes.length - 1;
  }

  /** How the episode ended; null while it has not. @returns {Outcome | null} */
  get ended() {
    return this.scenes[this.length].moment.ended ?? null;
  }

  /** Go on with what a trace adds. @param {Trace} more */
  add(more) {
    this.looks.push(...(more.looks ?? []));
    this.marks.push(...(more.marks ?? []));
    this.texts.push(...(more.texts ?? []));
    this.rules.push(...(more.rules ?? []));
    for (const moment of more.moments ?? []) this.scenes.push(this.scene(moment));
  }

  /** Take steps back. @param {number} length how many steps are left */
  cut(length) {
    this.scenes.length = length + 1;
  }

  /** The moment, on what was so before it. @param {Moment} moment @returns {Scene} */
  scene(moment) {
    const before = this.scenes[this.scenes.length - 1];
    const [width, height] = moment.room ?? [before.room.width, before.room.height];
    const cells = moment.room ? [] : [...before.room.cells];
    for (const [cell, look] of moment.cells ?? []) cells[cell] = this.looks[look];
    const pairs = (/** @type {TracedGesture[]} */ found) =>
      new Map(found.map(([cell, pointing, act, ...at]) => [cell, { pointing, act, at }]));
    const looks = (/** @type {[number, number][]} */ found) => new Map(found.map(([cell, look]) => [cell, this.looks[look]]));
    const marks = (/** @type {[number, number][]} */ found) => new Map(found.map(([cell, one]) => [cell, this.marks[one]]));
    const changed = moment.state ?? {};
    return {
      moment,
      member: moment.member ?? before?.member ?? null,
      cast: moment.cast ?? before?.cast ?? [],
      room: {
        width,
        height,
        cells,
        agent: moment.agent,
        below: looks(moment.below ?? []),
        gestures: pairs(moment.gestures ?? []),
        held: looks(moment.held ?? []),
        marks: marks(moment.marks ?? []),
        tinted: true,
      },
      view: {
        width: VIEW,
        height: VIEW,
        cells: moment.view ? moment.view.map((look) => this.looks[look]) : before.view.cells,
        agent: [(VIEW - 1) / 2, VIEW - 1, UP],
        below: new Map(),
        gestures: pairs(moment.view_gestures ?? []),
        held: looks(moment.view_held ?? []),
        marks: marks(moment.view_marks ?? []),
        tinted: false,
      },
      state: moment.room ? changed : { ...before.state, ...changed },
      changed: before ? changed : {},
      reward: (before?.reward ?? 0) + (moment.reward ?? 0),
    };
  }

  /** Where somebody is, in cells; null if it has left. @param {Scene} scene @param {string} who */
  place(scene, who) {
    /** @type {[number, number] | null} */
    const at = scene.state[`${who}.at`] ?? null;
    return at;
  }

  /** What the agent heard and said up to a step. @param {number} step */
  transcript(step) {
    return this.scenes.slice(0, step + 1).flatMap(({ moment }) => [
      ...(moment.said ? [{ t: moment.t, who: "agent", name: "Agent", text: moment.said }] : []),
      ...(moment.heard ?? []).map((line) => ({ t: moment.t, who: line.who ?? null, name: line.name ?? "", text: line.text })),
    ]);
  }

  /** How often each rule has fired up to a step. @param {number} step @returns {Map<number, number>} */
  counts(step) {
    /** @type {Map<number, number>} */ const counts = new Map();
    for (const { moment } of this.scenes.slice(0, step + 1)) {
      for (const rule of moment.fired ?? []) counts.set(rule, (counts.get(rule) ?? 0) + 1);
    }
    return counts;
  }
}

/** What stands in templates: the slots by name, each with its words; of most grammars one, the noun.
 * @param {Trace} trace @returns {[string, string[]][]} */
export function slotsOf(trace) {
  const slots = Object.entries(trace.slots ?? {});
  return trace.nouns.length ? [["noun", trace.nouns], ...slots] : slots;
}

/** Whether the agent has a cell in its field of view: 7 by 7, the agent in the middle of the near edge.
 * @param {[number, number, number]} agent @param {number} x @param {number} y */
export function inView([ax, ay, direction], x, y) {
  const [aheadX, aheadY] = [[1, 0], [0, 1], [-1, 0], [0, -1]][direction];
  const dx = x - ax, dy = y - ay;
  const ahead = dx * aheadX + dy * aheadY, aside = -dx * aheadY + dy * aheadX;
  return ahead >= 0 && ahead < VIEW && Math.abs(aside) <= (VIEW - 1) / 2;
}
