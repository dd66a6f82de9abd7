// @ts-check
/** A jsPsych plugin: its participant plays an episode of a study, which the study's server stores act by act. */
import { ParameterType } from "jspsych";
import { version } from "../package.json";
import { Session } from "./session.js";

/** @typedef {import("jspsych").JsPsych} JsPsych */
/** @typedef {{ server: string, consented: boolean, participant: string | null, connection_timeout: number }} Trial as jsPsych has
 * it when it begins: with what is given by default */

const { BOOL, COMPLEX, FLOAT, INT, STRING } = ParameterType;
/** Of the seat that the participant has, as the table `steps` of the study has them. */
const ACT = {
  /** Step of the episode, from 1. */ step: { type: INT },
  /** `person`, or who played the step instead. */ by: { type: STRING },
  /** What was done; empty for standing still. */ movement: { type: STRING },
  /** What was said. */ said: { type: STRING },
  /** Lines that the seat heard in the step, one behind another. */ heard: { type: STRING },
  /** When the picture was shown, milliseconds of the page's clock, which begins with each page. */ shown_ms: { type: FLOAT },
  /** When the act was chosen, by the same clock. */ acted_ms: { type: FLOAT },
  /** `acted_ms - shown_ms`. */ reaction_ms: { type: FLOAT },
  /** Which of the participant's pages it was, from 1. */ connection: { type: INT },
  /** When the server took the step, UTC. */ time: { type: STRING },
};

const info = /** @type {const} */ ({
  name: "socialai",
  version,
  parameters: {
    /** Address of the study's server, such as `https://study.example.org`. */
    server: { type: STRING, default: undefined },
    /** Whether the participant has agreed to take part on this page; nobody plays who has not. */
    consented: { type: BOOL, default: undefined },
    /** By which the participant is known again; without one only this window knows them again. */
    participant: { type: STRING, default: null },
    /** Milliseconds that the server may be silent, after which the trial ends. */
    connection_timeout: { type: INT, default: 60_000 },
  },
  data: {
    /** `played`; `before` if it was played before this page was loaded; `over` if the study has no episode left; `failed`. */
    status: { type: STRING },
    /** Why it failed, as a word. */ error: { type: STRING },
    /** The same as the page said it. */ message: { type: STRING },
    /** Whether nobody sat there. */ simulated: { type: BOOL },
    /** Id in the tables of the study. */ participant: { type: STRING },
    /** Likewise; those who play together have the same. */ game: { type: STRING },
    /** Place of the block in the participant's order, from 1; 0 of practice. */ position: { type: INT },
    /** Episode in the block or round, from 1. */ trial: { type: INT },
    /** How many the block or round has. */ trials: { type: INT },
    /** Episode in the study, with practice, from 1. */ episode: { type: INT },
    /** Whether the study has another one for the participant. */ more: { type: BOOL },
    /** Steps of the episode. */ steps: { type: INT },
    /** Steps that the participant chose. */ own_steps: { type: INT },
    /** Whether it was a success; null where the study does not tell. */ success: { type: BOOL },
    /** The scenario's own name of the ending, likewise. */ outcome: { type: STRING },
    /** Sum of the seat's rewards, likewise. */ return: { type: FLOAT },
    /** What was done in each step. */ acts: { type: COMPLEX, array: true, nested: ACT },
  },
});

/** What jsPsych itself reads of a trial. */
const OF_JSPSYCH = ["type", "data", "on_start", "on_load", "on_finish", "post_trial_gap", "css_classes", "extensions",
  "simulation_options", "record_data", "save_trial_parameters", "save_timeline_variables"];
/** Participants by experiment, server and id. @type {WeakMap<JsPsych, Map<string, Session>>} */
const sessions = new WeakMap();

export default class JsPsychSocialai {
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
    const finish = (/** @type {Record<string, any>} */ data) =>
      this.jsPsych.finishTrial(this.jsPsych.pluginAPI.mergeSimulationData({ ...data, simulated: true }, options));
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
    if (says) /** @type {HTMLSelectElement} */ (phrase).selectedIndex = randomization.randomInt(1, phrase.children.length - 1);
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
    return { status: "played", participant: null, game: null, position: null, trial: null, trials: null, episode: null, more: null,
      steps: acts.length, own_steps: acts.length, success, outcome: success ? "success" : "failure", return: Number(success), acts };
  }
}

/** The participant that a trial means, the same for all trials. @param {JsPsych} jsPsych @param {Trial} trial @param {boolean} simulated
 * @returns {Session} */
function sessionOf(jsPsych, { server, participant }, simulated) {
  const ours = sessions.get(jsPsych) ?? new Map(), name = JSON.stringify([server, participant]);
  sessions.set(jsPsych, ours);
  if (!ours.has(name)) ours.set(name, new Session(server, { id: participant, simulated }));
  return ours.get(name);
}

/** What is wrong with the parameters of a trial. @param {Trial} trial */
function problem(trial) {
  const { server, consented, participant, connection_timeout } = trial, names = Object.keys(info.parameters);
  const unknown = Object.keys(trial).filter((name) => !names.includes(name) && !OF_JSPSYCH.includes(name));
  const got = (/** @type {string} */ name, /** @type {any} */ value, /** @type {string} */ expected) => `${name}: got ${JSON.stringify(value)}, expected ${expected}`;
  if (unknown.length) return `got the parameter ${unknown.join(", ")}, expected ${names.join(", ")}`;
  if (!/^https?:\/\//.test(server) || !URL.canParse(server)) return got("server", server, "an address such as https://study.example.org");
  if (consented !== true) return got("consented", consented, "true: nobody takes part who has not agreed");
  if (participant !== null && !(typeof participant === "string" && participant && participant.length <= 200)) return got("participant", participant, "null, or a text of 1 to 200 characters");
  if (!(connection_timeout > 0)) return got("connection_timeout", connection_timeout, "milliseconds");
}
