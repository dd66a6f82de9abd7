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
 * A moment for a seat behind the agent's.
 * @typedef {object} SeatPart
 * @property {number[] | null} [action]
 * @property {string | null} [did]
 * @property {string | null} [said]
 * @property {Line[]} [heard]
 * @property {number} [reward]
 * @property {boolean | null} [success]
 * @property {number[] | null} [view]
 * @property {TracedGesture[]} [view_gestures]
 * @property {[number, number][]} [view_held]
 * @property {[number, number][]} [view_marks]
 */
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
 * @property {SeatPart[]} [seats]
 * @property {number[]} [fired]
 * @property {[number, number][]} [others]
 * @property {Thought | null} [thought]
 * @property {{text: string, error?: string, seat?: string | null}[]} [replies]
 * @property {Outcome | null} [ended]
 */
/**
 * @typedef {object} Trace
 * @property {string} format
 * @property {string} scenario
 * @property {string} [about]
 * @property {string} agent
 * @property {string[]} [seats]
 * @property {string[]} [names]
 * @property {string} [own]
 * @property {Record<string, string>} [players]
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

/** Something that was said: by whom, and whether it reached the seat whose view is shown.
 * @typedef {{t: number, who: string | null, name: string, text: string, reached: boolean}} Spoken */
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
 * What was done on a seat in a step, and what is seen, heard and earned there.
 * @typedef {object} Part
 * @property {number[] | null} action
 * @property {string | null} did
 * @property {string | null} said
 * @property {Line[]} heard
 * @property {number} reward sum of the rewards so far
 * @property {boolean | null} success null until the episode has ended
 * @property {Picture} view
 */
/**
 * A moment with everything that is so in it.
 * @typedef {object} Scene
 * @property {Moment} moment
 * @property {string | null} member
 * @property {Member[]} cast
 * @property {Picture} room
 * @property {Part[]} parts of the seats of the episode, in their order
 * @property {Record<string, any>} state values by address
 * @property {Record<string, any>} changed those that differ from the moment before
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
    /** The members of the cast with a seat, the agent first. */
    this.seats = trace.seats?.length ? trace.seats : ["agent"];
    /** The seat of the player. */
    this.own = trace.own ?? "agent";
    /** The seat whose view is shown. */
    this.viewer = this.own;
    this.add(trace);
  }

  /** What belongs to a seat in a scene, by default to the player's. @param {Scene} scene @param {string} [seat] */
  part(scene, seat = this.own) {
    return scene.parts[this.seats.indexOf(seat)];
  }

  /** How a seat is called. @param {string} seat */
  called(seat) {
    return this.seats.length > 1 ? (this.trace.names?.[this.seats.indexOf(seat)] || seat) : "Agent";
  }

  /** Where a seat stands and looks, as x, y, direction; null if it has left. @param {Scene} scene @param {string} seat
   * @returns {[number, number, number] | null} */
  pose(scene, seat) {
    if (seat === "agent") return scene.moment.agent[0] < 0 ? null : scene.moment.agent;
    const at = this.place(scene, seat);
    return at && [at[0], at[1], ["right", "down", "left", "up"].indexOf(scene.state[`${seat}.facing`])];
  }

  /** Number of steps. */
  get length() {
    return this.scenes.length - 1;
  }

  /** How the episode ended for the player; null while it has not. @returns {Outcome | null} */
  get ended() {
    const scene = this.scenes[this.length], { ended } = scene.moment;
    return ended ? { ...ended, success: this.part(scene).success ?? false } : null;
  }

  /** Go on with what a trace adds. @param {Trace} more */
  add(more) {
    this.looks.push(...(more.looks ?? []));
    this.marks.push(...(more.marks ?? []));
    this.texts.push(...(more.texts ?? []));
    this.rules.push(...(more.rules ?? []));
    if (more.players) this.trace.players = more.players;
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
      parts: [moment, ...(moment.seats ?? [])].map((part, k) => ({
        action: part.action ?? null,
        did: part.did ?? null,
        said: part.said ?? null,
        heard: part.heard ?? [],
        reward: (before?.parts[k].reward ?? 0) + (part.reward ?? 0),
        success: "success" in part ? (part.success ?? null) : k === 0 ? (moment.ended?.success ?? null) : null,
        view: {
          width: VIEW,
          height: VIEW,
          cells: part.view ? part.view.map((look) => this.looks[look]) : before.parts[k].view.cells,
          agent: [(VIEW - 1) / 2, VIEW - 1, UP],
          below: new Map(),
          gestures: pairs(part.view_gestures ?? []),
          held: looks(part.view_held ?? []),
          marks: marks(part.view_marks ?? []),
          tinted: false,
        },
      })),
      state: moment.room ? changed : { ...before.state, ...changed },
      changed: before ? changed : {},
    };
  }

  /** Where somebody is, in cells; null if it has left. @param {Scene} scene @param {string} who */
  place(scene, who) {
    /** @type {[number, number] | null} */
    const at = scene.state[`${who}.at`] ?? null;
    return at;
  }

  /** What was said in a moment: by those on the seats, then by others as far as a seat heard it.
   * @param {Scene} scene @returns {Spoken[]} */
  said(scene) {
    const { seats } = this, { moment, parts } = scene;
    const heard = parts.map((part) => part.heard.map((line) => JSON.stringify([line.who ?? null, line.name ?? "", line.text])));
    const own = parts.flatMap((part, k) => (part.said === null ? [] : [{ t: moment.t, who: seats[k], name: this.called(seats[k]), text: part.said }]));
    const known = new Set(own.map(({ who, text }) => JSON.stringify([who, text])));
    const others = [...new Set(heard.flat())].map((line) => JSON.parse(line)).filter(([who, , text]) => !known.has(JSON.stringify([who, text])));
    const reaches = (/** @type {string | null} */ who, /** @type {string} */ text) => {
      const k = seats.indexOf(this.viewer);
      return who === this.viewer || parts[k].heard.some((line) => (line.who ?? null) === who && line.text === text);
    };
    return [...own, ...others.map(([who, name, text]) => ({ t: moment.t, who, name, text }))]
      .map((line) => ({ ...line, reached: reaches(line.who, line.text) }));
  }

  /** What was said and heard up to a step. @param {number} step */
  transcript(step) {
    return this.scenes.slice(0, step + 1).flatMap((scene) => this.said(scene));
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
